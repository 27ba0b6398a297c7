//! What stops: joints at the ends of their ranges and at their greatest speeds, limbs at the ground, links
//! before they touch.
//!
//! [`super::barrier`] says how far, how fast and how hard each quantity may go. Where the hierarchy's solution
//! goes further, it is replaced by the nearest one that does not; the other joints take over what they can.
//! Cutting would leave the error to nobody, freezing would leave it for good.
//!
//! * Joints of a **standing leg** move with the torso, because its foot rests: with J_t and J_l the foot's Jacobian
//!   of the torso and of the leg's joints, a change of the torso's motion by d ∈ R⁶ changes theirs by
//!   -J_l⁻¹ J_t d. The torso goes to the nearest motion that the limits of all standing legs permit, and the
//!   other objectives follow it.
//! * A **free limb** (a leg in the air with its arm, or the arm of a standing leg) moves nothing else: its joints
//!   alone are changed, to the nearest motion that all its limits permit, near in what the limb's objectives see.
//!   Torso, stance feet and the other limb do not notice.
//!
//! Both are projections onto polyhedra ([`crate::polyhedron`]), first the one, then the other, so that the command
//! has no jump where a limit begins or ceases to act.

use nalgebra::{Matrix6, SMatrix, Vector6};

use super::{
    ContactSet, Objective, ObjectiveKind, Tracked, WbcSettings,
    barrier::{Interval, Window},
    objective::Robot,
};
use crate::{
    collision::{Altitude, Clearance, Clearances, Ground, Link, MOST_NEAR, Part, height_under},
    dynamics::{DOF, Dynamics, Motion, State},
    joints::{JOINTS, Leg, Side},
    kinematics::inverse_of_leg,
    model::{Frame, Model},
    polyhedron::Polyhedron,
};

/// Quantities other than joints: heights of capsules' ends, distances of pairs of links.
const MOST_ROWS: usize = 24 + MOST_NEAR;

/// Shorter gradients of a distance are taken as this long, m/rad: there joints cannot change it.
const SHORTEST_GRADIENT: f64 = 0.01;

/// What is nearer than this to its limit is looked at, m: at the greatest speed of a target (0.5 m/s) the barrier begins
/// to act at 0.033 m.
const INFLUENCE_M: f64 = 0.06;

/// Share of the room between two links that a step may use up: the gradient turns on the way.
const STEP_SHARE: f64 = 0.5;

/// An error of a radian counts like this many metres where a free limb's objectives compete for what limits
/// leave. Small: position goes before orientation.
const METRES_PER_RADIAN: f64 = 0.05;

/// Motion of joints that no objective sees counts like so many metres for each radian: joints do not run about for the
/// last millimetre.
const METRES_PER_JOINT: f64 = 0.02;

/// Where standing legs limit the torso, a radian of its orientation counts like so many metres of its position: half its
/// length.
const TORSO_METRES_PER_RADIAN: f64 = 0.2;

/// Joints of the legs; they come first.
const LEG_JOINTS: usize = 12;

/// What a row belongs to.
#[derive(Debug, Clone, Copy, PartialEq)]
enum What {
    /// A link above the ground.
    Ground,
    /// Two links.
    Pair([Link; 2]),
}

/// A quantity's direction in joint space, of length 1, and what is permitted along it.
#[derive(Debug, Clone, Copy)]
struct Row {
    what: What,
    /// Whose joints are changed.
    leg: Leg,
    direction: [f64; DOF],
    /// J̇ q̇ along it.
    bias: f64,
    window: Window,
    acts: bool,
}

/// All limits of a control step, and which of them act.
#[derive(Debug, Clone)]
pub(super) struct Stops {
    joints: [Window; JOINTS],
    /// Those that a solution took beyond their windows, a bit for each.
    stopped: u32,
    /// Legs in the air, by index.
    lifted: [bool; 4],
    rows: [Row; MOST_ROWS],
    count: usize,
    clearances: Clearances,
    polyhedron: Polyhedron,
}

/// What stops depend on, besides the solution.
pub(super) struct Surroundings<'a> {
    pub(super) model: &'a Model,
    pub(super) state: &'a State,
    pub(super) dynamics: &'a Dynamics,
    pub(super) contacts: &'a ContactSet,
    pub(super) objectives: &'a [Objective],
    pub(super) settings: &'a WbcSettings,
}

impl Stops {
    /// Takes all memory that it will need.
    pub(super) fn new() -> Self {
        let row = Row {
            what: What::Ground,
            leg: Leg::FrontRight,
            direction: [0.0; DOF],
            bias: 0.0,
            window: Window::free(),
            acts: false,
        };
        Self {
            joints: [Window::free(); JOINTS],
            stopped: 0,
            lifted: [false; 4],
            rows: [row; MOST_ROWS],
            count: 0,
            clearances: Clearances::new(),
            polyhedron: Polyhedron::new(),
        }
    }

    /// Finds what is permitted in a state. Nothing is stopped yet.
    pub(super) fn begin(&mut self, around: &Surroundings) {
        self.lifted = Leg::ALL.map(|leg| !around.contacts.contains(leg));
        (self.stopped, self.count) = (0, 0);
        self.limit_joints(around);
        self.limit_heights(around);
        self.limit_distances(around);
    }

    fn limit_joints(&mut self, around: &Surroundings) {
        let Surroundings { model, state, settings, .. } = around;
        for (joint, window) in self.joints.iter_mut().enumerate() {
            let (angle, speed) = (state.position[joint], state.velocity[joint]);
            let below = angle - model.lower[joint] - settings.joint_margin;
            let over = model.upper[joint] - settings.joint_margin - angle;
            let speed_limit = settings.stops.speed_share * model.max_velocity[joint];
            *window = Window::joint(below, over, speed, speed_limit, &settings.stops);
        }
    }

    /// Links of a limb in the air stay above the ground: what touches it unplanned lifts the torso off its course. Not
    /// the calf of a foot that has a target of its own: who leads it keeps it up, or puts it down.
    fn limit_heights(&mut self, around: &Surroundings) {
        let Surroundings { model, state, dynamics, contacts, .. } = around;
        let height = |leg| dynamics.frame(Frame::Foot(leg)).world_from_frame.translation.z;
        let Some(ground_m) = height_under(contacts.legs().map(height)) else { return };
        let ground = Ground::at(ground_m, &state.world_from_torso);
        for leg in Leg::ALL.into_iter().filter(|leg| !contacts.contains(*leg)) {
            let leads = |objective: &Objective| objective.kind() == ObjectiveKind::FootPosition(leg);
            let is_led = around.objectives.iter().any(leads);
            for end in ground.altitudes(leg, &model.collision, *dynamics) {
                if !(is_led && end.link.part == Part::Calf) {
                    self.limit_height(around, &ground, leg, &end);
                }
            }
        }
    }

    fn limit_height(&mut self, around: &Surroundings, ground: &Ground, leg: Leg, end: &Altitude) {
        let Surroundings { state, dynamics, settings, .. } = around;
        let room = end.height - settings.stops.ground_clearance;
        if room > INFLUENCE_M {
            return;
        }
        let gradient = end.gradient(ground, *dynamics);
        let scale = 1.0 / gradient.norm().max(SHORTEST_GRADIENT);
        let mut direction = [0.0; DOF];
        direction[..3].copy_from_slice((ground.up * scale).as_slice());
        direction[3..6].copy_from_slice((end.center.cross(&ground.up) * scale).as_slice());
        direction[6..].copy_from_slice((gradient * scale).as_slice());
        let speed: f64 = direction.iter().zip(state.motion().iter()).map(|(a, b)| a * b).sum();
        let bias = ground.up.dot(&dynamics.bias_acceleration_at(end.joint, &end.center));
        self.push(Row {
            what: What::Ground,
            leg,
            direction,
            bias: bias * scale,
            window: Window::above(room * scale, speed, 1.0, &settings.stops),
            acts: false,
        });
    }

    /// Links of free limbs keep their distance from each other and from the rest of the robot. How the gradient
    /// itself turns is left to the margin: at 2 rad/s and 0.2 m it comes to 0.8 m/s², which the barrier balances
    /// 4 mm nearer.
    fn limit_distances(&mut self, around: &Surroundings) {
        let Surroundings { model, state, dynamics, settings, .. } = around;
        let margin = settings.stops.collision_margin;
        let pairs = model.collision.pairs();
        self.clearances.update(&model.collision, pairs, *dynamics, margin + INFLUENCE_M);
        for index in 0..self.clearances.near().len() {
            let clearance = self.clearances.near()[index];
            let Some(leg) = self.mover(&clearance) else { continue };
            let gradient = clearance.gradient(*dynamics);
            let scale = 1.0 / gradient.norm().max(SHORTEST_GRADIENT);
            let mut direction = [0.0; DOF];
            direction[6..].copy_from_slice((gradient * scale).as_slice());
            let (room, speed) = (clearance.distance - margin, gradient.dot(&state.velocity));
            self.push(Row {
                what: What::Pair(clearance.links),
                leg,
                direction,
                bias: 0.0,
                window: Window::above(room * scale, speed * scale, STEP_SHARE, &settings.stops),
                acts: false,
            });
        }
    }

    fn push(&mut self, row: Row) {
        if let Some(place) = self.rows.get_mut(self.count) {
            *place = row;
            self.count += 1;
        }
    }

    /// The limb that makes way when two links come near: one in the air, or else one whose arm it is. Two standing
    /// legs do not come near unless the torso leans further than it may.
    fn mover(&self, clearance: &Clearance) -> Option<Leg> {
        let free = |link: &Link| link.leg.filter(|leg| self.lifted[leg.index()] || link.part.is_of_arm());
        let [first, second] = &clearance.links;
        let lifted = |leg: &Leg| self.lifted[leg.index()];
        let (first, second) = (free(first), free(second));
        second.filter(lifted).or(first.filter(lifted)).or(second).or(first)
    }

    /// The joints that a leg's limb can move without moving anything else; the first are those of the leg itself.
    fn free_joints(&self, leg: Leg) -> impl Iterator<Item = usize> {
        let of_leg = leg.first_joint()..leg.first_joint() + if self.lifted[leg.index()] { 3 } else { 0 };
        let arm = leg.side().map(Side::first_arm_joint);
        of_leg.chain(arm.into_iter().flat_map(|first| first..first + 3))
    }

    /// The least changes of the torso's step, velocity and acceleration with which no joint of a standing leg exceeds
    /// its limits; nothing where a solution already keeps to them.
    pub(super) fn restrain(
        &mut self,
        around: &Surroundings,
        solution: &Tracked,
    ) -> Option<[Vector6<f64>; 3]> {
        let stopped = Chain::ALL.map(|chain| self.exceeded(chain, solution));
        if stopped == [0; 3] {
            return None;
        }
        self.stopped |= stopped[0] | stopped[1] | stopped[2];
        let from_torso = legs_from_torso(around);
        let mut metric = from_torso.tr_mul(&from_torso) * METRES_PER_JOINT.powi(2);
        for axis in 0..6 {
            metric[(axis, axis)] += if axis < 3 { 1.0 } else { TORSO_METRES_PER_RADIAN.powi(2) };
        }
        Some(Chain::ALL.map(|chain| {
            self.polyhedron.clear();
            for joint in self.standing_joints() {
                let value = solution.chain(chain)[6 + joint];
                let row = from_torso.row(joint).transpose();
                self.polyhedron.enclose(row, chain.of(&self.joints[joint]), value);
            }
            self.polyhedron.nearest(&Vector6::zeros(), &metric).unwrap_or_default()
        }))
    }

    /// The joints of standing legs that one chain takes beyond their limits, a bit for each.
    fn exceeded(&self, chain: Chain, solution: &Tracked) -> u32 {
        let exceeds = |joint: &usize| {
            // Rounding is no excess.
            chain.of(&self.joints[*joint]).excess(solution.chain(chain)[6 + joint]) > 1e-9
        };
        self.standing_joints().filter(exceeds).fold(0, |joints, joint| joints | 1 << joint)
    }

    fn standing_joints(&self) -> impl Iterator<Item = usize> + use<> {
        let standing = Leg::ALL.map(|leg| (leg, !self.lifted[leg.index()]));
        let legs = standing.into_iter().filter_map(|(leg, stands)| stands.then_some(leg));
        legs.flat_map(|leg| leg.first_joint()..leg.first_joint() + 3)
    }

    /// Brings the joints of each free limb to the nearest motion that all its limits permit.
    pub(super) fn restrict(&mut self, around: &Surroundings, solution: &mut Tracked) {
        for leg in Leg::ALL {
            let mut joints = [None; 6];
            for (place, joint) in joints.iter_mut().zip(self.free_joints(leg)) {
                *place = Some(joint);
            }
            let mut metric = None;
            for chain in Chain::ALL {
                self.enclose(leg, &joints, chain, solution);
                if self.polyhedron.contains(&Vector6::zeros()) {
                    continue;
                }
                let metric = metric.get_or_insert_with(|| metric_of(around, &joints));
                let Some(change) = self.polyhedron.nearest(&Vector6::zeros(), metric) else { continue };
                let motion = solution.chain_mut(chain);
                for (joint, change) in joints.iter().zip(change.iter()) {
                    if let Some(joint) = joint {
                        motion[6 + joint] += change;
                    }
                }
            }
        }
    }

    /// Makes the polyhedron of one limb, around one chain of the solution, and notes what acts.
    fn enclose(&mut self, leg: Leg, joints: &[Option<usize>; 6], chain: Chain, solution: &Tracked) {
        let motion = solution.chain(chain);
        self.polyhedron.clear();
        for (place, joint) in joints.iter().enumerate() {
            let Some(joint) = *joint else { continue };
            let interval = chain.of(&self.joints[joint]);
            let value = motion[6 + joint];
            let unit = Vector6::ith(place, 1.0);
            self.polyhedron.enclose(unit, interval, value);
            if interval.excess(value) > 1e-9 {
                self.stopped |= 1 << joint;
            }
        }
        for row in self.rows[..self.count].iter_mut().filter(|row| row.leg == leg) {
            let along: f64 = row.direction.iter().zip(motion.iter()).map(|(a, b)| a * b).sum();
            let value = if chain == Chain::Acceleration { along + row.bias } else { along };
            let of_joints =
                Vector6::from_fn(|place, _| joints[place].map_or(0.0, |joint| row.direction[6 + joint]));
            let interval = chain.of(&row.window);
            self.polyhedron.push(of_joints, interval.lower() - value);
            row.acts |= interval.excess(value) > 1e-9;
        }
    }

    /// The joints that are limited, a bit for each.
    pub(super) const fn joints(&self) -> u32 {
        self.stopped
    }

    /// Whether a link is kept above the ground.
    pub(super) fn grounded(&self) -> bool {
        self.acting().any(|row| row.what == What::Ground)
    }

    /// One of the pairs of links that are kept apart.
    pub(super) fn pair(&self) -> Option<[Link; 2]> {
        self.acting().find_map(|row| match row.what {
            What::Ground => None,
            What::Pair(links) => Some(links),
        })
    }

    fn acting(&self) -> impl Iterator<Item = &Row> {
        self.rows[..self.count].iter().filter(|row| row.acts)
    }
}

/// One of the three chains of the hierarchy.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Chain {
    Step,
    Velocity,
    Acceleration,
}

impl Chain {
    const ALL: [Self; 3] = [Self::Step, Self::Velocity, Self::Acceleration];

    const fn of(self, window: &Window) -> &Interval {
        match self {
            Self::Step => &window.step,
            Self::Velocity => &window.velocity,
            Self::Acceleration => &window.acceleration,
        }
    }
}

impl Polyhedron {
    /// Keeps a joint, of this value before a change, in an interval.
    fn enclose(&mut self, row: Vector6<f64>, interval: &Interval, value: f64) {
        self.push(row, interval.lower() - value);
        self.push(-row, value - interval.upper());
    }
}

impl Tracked {
    const fn chain(&self, chain: Chain) -> &Motion {
        match chain {
            Chain::Step => &self.step,
            Chain::Velocity => &self.velocity,
            Chain::Acceleration => &self.acceleration,
        }
    }

    const fn chain_mut(&mut self, chain: Chain) -> &mut Motion {
        match chain {
            Chain::Step => &mut self.step,
            Chain::Velocity => &mut self.velocity,
            Chain::Acceleration => &mut self.acceleration,
        }
    }
}

/// How the joints of standing legs follow a change of the torso's motion: -J_l⁻¹ J_t, three rows for each leg; zero for
/// legs in the air.
fn legs_from_torso(around: &Surroundings) -> SMatrix<f64, LEG_JOINTS, 6> {
    let mut legs = SMatrix::<f64, LEG_JOINTS, 6>::zeros();
    for leg in around.contacts.legs() {
        let jacobian = &around.dynamics.frame(Frame::Foot(leg)).jacobian;
        let of_torso = jacobian.fixed_view::<3, 6>(0, 0);
        let of_joints = jacobian.fixed_view::<3, 3>(0, 6 + leg.first_joint()).into_owned();
        let mut rows = legs.fixed_rows_mut::<3>(leg.first_joint());
        rows.copy_from(&(-inverse_of_leg(&of_joints) * of_torso));
    }
    legs
}

/// M: how far a change of a free limb's joints moves what its objectives control.
fn metric_of(around: &Surroundings, joints: &[Option<usize>; 6]) -> Matrix6<f64> {
    let mut metric = Matrix6::identity() * METRES_PER_JOINT.powi(2);
    let robot = Robot { state: around.state, dynamics: around.dynamics };
    for objective in around.objectives.iter().filter(|objective| !objective.kind().is_of_torso()) {
        let weight = match objective.kind() {
            ObjectiveKind::FootPosition(_) | ObjectiveKind::GripperPosition(_) => 1.0,
            _ => METRES_PER_RADIAN.powi(2),
        };
        let Some(task) = objective.task(&robot, around.settings.objectives.of(objective.kind())) else {
            continue;
        };
        for row in &task.rows {
            let of_joints = Vector6::from_fn(|place, _| joints[place].map_or(0.0, |joint| row[6 + joint]));
            metric.ger(weight, &of_joints, &of_joints, 1.0);
        }
    }
    metric
}
