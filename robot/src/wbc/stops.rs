//! What stops: joints at the ends of their ranges and at their greatest speeds, limbs at the ground, links
//! before they touch.
//!
//! [`super::barrier`] says how far, how fast and how hard each quantity may go. Where the hierarchy's solution
//! goes further, it is replaced by the nearest one that does not; the other joints take over what they can.
//! Cutting would leave the error to nobody, freezing would leave it for good.
//!
//! * Joints of a **standing leg** move with the torso. One that would go too far is held, with priority over all
//!   objectives, and the hierarchy is solved again (Flacco, De Luca and Khatib, "Control of redundant robots under
//!   hard joint constraints: saturation in the null space", IEEE Transactions on Robotics 31, 2015).
//! * A **free limb** (a leg in the air with its arm, or the arm of a standing leg) moves nothing else: its joints
//!   alone are changed, to the nearest motion that all its limits permit ([`crate::polyhedron`]), near in what the
//!   limb's objectives see. Torso, stance feet and the other limb do not notice.

use nalgebra::{Matrix6, Vector6};

use super::{
    ContactSet, Objective, ObjectiveKind, Tracked, WbcSettings,
    barrier::{Interval, Window},
    objective::Robot,
    task::Task,
};
use crate::{
    collision::{Altitude, Clearance, Clearances, Ground, Link, MOST_NEAR, Part},
    dynamics::{DOF, Dynamics, Motion, State},
    joints::{JOINTS, Leg, Side},
    model::{FOOT_RADIUS_M, Frame, Model},
    polyhedron::Polyhedron,
};

/// What is held at once in the standing legs.
pub(super) const MOST_HELD: usize = 6;

/// Directions of a held joint that what stands before it has nearly used up fade out below this.
const DAMPING_START: f64 = 0.1;

/// Quantities other than joints: heights of capsules' ends, distances of pairs of links.
const MOST_ROWS: usize = 24 + MOST_NEAR;

/// Shorter gradients of a distance are taken as this long, m/rad: there joints cannot change it.
const SHORTEST_GRADIENT: f64 = 0.01;

/// What is nearer than this to its limit is looked at, m: at the greatest speed of a
/// target (0.5 m/s) the barrier begins to act at 0.033 m.
const INFLUENCE_M: f64 = 0.06;

/// Share of the room between two links that a step may use up: the gradient turns on the way.
const STEP_SHARE: f64 = 0.5;

/// An error of a radian counts like this many metres where a free limb's objectives compete for what limits
/// leave. Small: position goes before orientation.
const METRES_PER_RADIAN: f64 = 0.05;

/// Motion of a free limb's joints that its objectives do not see counts like so many metres for each radian: joints
/// do not run about for the last millimetre.
const METRES_PER_JOINT: f64 = 0.02;

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
    /// Of standing legs.
    held: [Option<[f64; 3]>; JOINTS],
    /// Of free limbs, a bit for each.
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
            held: [None; JOINTS],
            stopped: 0,
            lifted: [false; 4],
            rows: [row; MOST_ROWS],
            count: 0,
            clearances: Clearances::new(),
            polyhedron: Polyhedron::new(),
        }
    }

    /// Finds what is permitted in a state. Nothing is held yet.
    pub(super) fn begin(&mut self, around: &Surroundings) {
        self.lifted = Leg::ALL.map(|leg| !around.contacts.contains(leg));
        self.held = [None; JOINTS];
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

    /// Links of a limb in the air stay above the ground, but for a calf whose foot is being put down: what touches
    /// it unplanned lifts the torso off its course.
    fn limit_heights(&mut self, around: &Surroundings) {
        let Surroundings { model, state, dynamics, contacts, .. } = around;
        let Some(height) = ground_height(around) else { return };
        let ground = Ground::at(height, &state.world_from_torso);
        for leg in Leg::ALL.into_iter().filter(|leg| !contacts.contains(*leg)) {
            let lands = |objective: &Objective| objective.kind() == ObjectiveKind::FootPosition(leg);
            let lands = around.objectives.iter().any(lands);
            for end in ground.altitudes(leg, &model.collision, *dynamics) {
                if !(lands && end.link.part == Part::Calf) {
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

    /// Hands over each joint of a standing leg that is held.
    pub(super) fn for_each_held(&self, mut add: impl FnMut(Task, f64)) {
        for (joint, held) in self.held.iter().enumerate() {
            if let Some([step, velocity, acceleration]) = *held {
                let mut direction = [0.0; DOF];
                direction[6 + joint] = 1.0;
                add(Task::held(direction, step, velocity, acceleration), DAMPING_START);
            }
        }
    }

    /// Holds, in each standing leg, the joint that a solution takes furthest beyond what is permitted. Whether there
    /// was any.
    pub(super) fn hold(&mut self, solution: &Tracked, settings: &WbcSettings) -> bool {
        let mut found = false;
        for leg in Leg::ALL.into_iter().filter(|leg| !self.lifted[leg.index()]) {
            // Rounding is no excess.
            let mut worst = (1e-9, None);
            for joint in leg.first_joint()..leg.first_joint() + 3 {
                let excess = solution.excess(6 + joint, &self.joints[joint], settings.stops.rate);
                if self.held[joint].is_none() && excess > worst.0 {
                    worst = (excess, Some(joint));
                }
            }
            if let Some(joint) = worst.1 {
                self.held[joint] = Some(solution.within(6 + joint, &self.joints[joint]));
                found = true;
            }
        }
        found
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
                if self.polyhedron.contains_zero() {
                    continue;
                }
                let metric = metric.get_or_insert_with(|| metric_of(around, &joints));
                let Some(change) = self.polyhedron.nearest(metric) else { continue };
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
            self.polyhedron.push(unit, interval.lower() - value);
            self.polyhedron.push(-unit, value - interval.upper());
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
    pub(super) fn joints(&self) -> u32 {
        let held = self.held.iter().enumerate().filter(|(_, held)| held.is_some());
        held.fold(self.stopped, |joints, (joint, _)| joints | 1 << joint)
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

    /// How far one entry is beyond what is permitted, in the unit of a step: what the barrier would make of an
    /// excess of velocity or acceleration.
    fn excess(&self, index: usize, window: &Window, rate: f64) -> f64 {
        let of_velocity = window.velocity.excess(self.velocity[index]) / rate;
        let of_acceleration = window.acceleration.excess(self.acceleration[index]) / (rate * rate);
        window.step.excess(self.step[index]).max(of_velocity).max(of_acceleration)
    }

    /// The nearest values of one entry that are permitted.
    fn within(&self, index: usize, window: &Window) -> [f64; 3] {
        Chain::ALL.map(|chain| chain.of(window).nearest(self.chain(chain)[index]))
    }
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

/// Height of the ground under the feet that stand, in their mean; nothing without any.
fn ground_height(around: &Surroundings) -> Option<f64> {
    let height = |leg| around.dynamics.frame(Frame::Foot(leg)).world_from_frame.translation.z;
    let (sum, count) =
        around.contacts.legs().fold((0.0, 0.0), |(sum, count), leg| (sum + height(leg), count + 1.0));
    (count > 0.0).then(|| sum / count - FOOT_RADIUS_M)
}
