//! Sits up and comes down again along a [`Path`], from node to node; at each node feet and knees take over or give up
//! their load. It may turn round at any instant.

mod path;

use nalgebra::Vector3;
pub use path::{Node, Path};

use super::{
    scene::Scene,
    setpoint::Setpoint,
    settings::{MotionSettings, UprightSettings},
};
use crate::{
    commander::{PointMotion, PoseMotion, PoseReference},
    joints::{JointVector, Side},
    kinematics::torso_from_frame,
    model::Frame,
    wbc::{ContactPoint, ContactSet, PointReference, RotationReference},
};

/// Half the interval of the central differences that give velocities and accelerations, s.
const STEP_S: f64 = 1e-3;
/// The path goes with the feet in this time, s: their noise is not followed.
const FOLLOW_S: f64 = 0.3;

/// A robot on its way up or down, or upright.
#[derive(Debug, Clone)]
pub struct Upright {
    settings: UprightSettings,
    path: Path,
    /// The node that was reached last.
    at: Node,
    /// The one that it moves to.
    towards: Option<Node>,
    time_s: f64,
    began_s: f64,
    /// Place on the path between nodes from [`Node::Touch`] on, in its first coordinate.
    along: PointMotion,
    /// Between [`Node::Stand`] and [`Node::Touch`].
    torso: PoseMotion,
    /// What front legs and arms right, left are off the path, rad: it fades out.
    offsets: [PointMotion; 4],
    offsets_began_s: f64,
}

impl Upright {
    /// Begins on four feet.
    pub fn begin(path: Path, settings: UprightSettings, setpoint: &Setpoint) -> Self {
        let nothing = PointMotion::hold(Vector3::zeros());
        Self {
            settings,
            path,
            at: Node::Stand,
            towards: None,
            time_s: 0.0,
            began_s: 0.0,
            along: PointMotion::hold(Vector3::x() * place(Node::Touch)),
            torso: PoseMotion::new(&setpoint.torso, &setpoint.torso.pose(), 1.0),
            offsets: [nothing; 4],
            offsets_began_s: 0.0,
        }
    }

    /// Takes up the front limbs as the joints hold them, wherever the operator has led them.
    pub fn take_up_limbs(&mut self, motions: &MotionSettings, scene: &Scene<'_>) {
        let at = self.along.sample(self.time_s - self.began_s).position.x;
        let mut longest: f64 = 0.0;
        let mut offset = |held: Vector3<f64>, planned: Vector3<f64>| {
            let offset = held - planned;
            longest = longest.max(offset.amax());
            offset
        };
        let [right, left] = Side::ALL.map(|side| {
            let [leg, arm] = self.path.limb(side, at);
            let held = crate::kinematics::of_leg(scene.desired, side.leg());
            [offset(held, leg), offset(scene.desired_arm(side), arm)]
        });
        let duration_s = (longest / motions.leg_rad_s).max(motions.torso_s);
        self.offsets = [right[0], left[0], right[1], left[1]]
            .map(|offset| PointMotion::new(&PointReference::hold(offset), &Vector3::zeros(), duration_s));
        self.offsets_began_s = self.time_s;
    }

    /// One step towards a node. Returns whether it is there, on what should carry it.
    pub fn step(
        &mut self,
        goal: Node,
        motions: &MotionSettings,
        scene: &Scene<'_>,
        setpoint: &mut Setpoint,
    ) -> bool {
        self.time_s += scene.dt_s;
        if let Some(to) = self.towards {
            let elapsed_s = self.time_s - self.began_s;
            let back = if to > self.at { goal <= self.at } else { goal >= self.at };
            if back && goal != to {
                self.towards = Some(self.at);
                self.at = to;
                self.head(setpoint);
            } else if elapsed_s >= self.duration_s() {
                (self.at, self.towards) = (to, None);
            }
        }
        let next = match self.towards {
            None if goal > self.at => after(self.at),
            None if goal < self.at => before(self.at),
            _ => None,
        };
        let mut settled = true;
        if self.towards.is_none() {
            let wanted = next.map_or_else(|| resting(self.at), |next| Some(between(self.at, next)));
            if let Some(wanted) = wanted {
                settled = load(setpoint, &wanted, scene.dt_s / motions.load_s);
            }
        }
        let waits =
            self.time_s - self.offsets_began_s < self.offsets[0].duration_s() && self.at == Node::Upright;
        if let Some(next) = next
            && settled
            && !waits
        {
            self.towards = Some(next);
            self.head(setpoint);
        }
        self.refer(scene, setpoint);
        setpoint.kneel();
        self.towards.is_none() && self.at == goal && settled && !waits
    }

    /// The torso of a robot that is upright, for one step.
    pub fn hold(&mut self, scene: &Scene<'_>, setpoint: &mut Setpoint) {
        self.time_s += scene.dt_s;
        self.refer(scene, setpoint);
    }

    fn duration_s(&self) -> f64 {
        if self.is_on_four_feet() { self.torso_duration_s() } else { self.along.duration_s() }
    }

    fn torso_duration_s(&self) -> f64 {
        self.settings.touch_s
    }

    /// Between [`Node::Stand`] and [`Node::Touch`].
    fn is_on_four_feet(&self) -> bool {
        self.at == Node::Stand || self.towards == Some(Node::Stand)
    }

    /// Begins to move to the next node, from how the references move.
    fn head(&mut self, setpoint: &Setpoint) {
        let Some(to) = self.towards else { return };
        if self.is_on_four_feet() {
            let goal =
                if to == Node::Stand { self.path.stand() } else { self.path.torso(place(Node::Touch)) };
            self.torso = PoseMotion::new(&setpoint.torso, &goal, self.settings.touch_s);
        } else {
            let start = self.along.sample(self.time_s - self.began_s);
            let whole_s =
                if self.at.max(to) == Node::Upright { self.settings.rise_s } else { self.settings.kneel_s };
            let goal = Vector3::x() * place(to);
            let duration_s = (whole_s * (goal - start.position).norm()).max(0.5 * whole_s);
            self.along = PointMotion::new(&start, &goal, duration_s);
        }
        self.began_s = self.time_s;
    }

    /// Writes the references.
    fn refer(&mut self, scene: &Scene<'_>, setpoint: &mut Setpoint) {
        let elapsed_s = self.time_s - self.began_s;
        if self.is_on_four_feet() {
            if self.towards.is_some() {
                setpoint.torso = self.torso.sample(elapsed_s);
            }
            return;
        }
        self.path.follow(scene, scene.dt_s / FOLLOW_S);
        let times = [elapsed_s - STEP_S, elapsed_s, elapsed_s + STEP_S];
        let at = times.map(|time_s| self.along.sample(time_s.max(0.0)).position.x);
        let torso = at.map(|at| self.path.torso(at));
        let point = differences(torso.map(|torso| torso.translation.vector));
        let rates = [0, 1].map(|first| {
            (torso[first + 1].rotation * torso[first].rotation.inverse()).scaled_axis() / STEP_S
        });
        setpoint.torso = PoseReference {
            point,
            rotation: RotationReference {
                orientation: torso[1].rotation,
                angular_velocity: (rates[0] + rates[1]) / 2.0,
                angular_acceleration: (rates[1] - rates[0]) / STEP_S,
            },
        };
        for side in Side::ALL {
            let limb = [0, 1, 2].map(|index| {
                let faded_s = self.time_s - self.offsets_began_s + times[index] - elapsed_s;
                let [leg, arm] = self.path.limb(side, at[index]);
                let place = side.index();
                [
                    leg + self.offsets[place].sample(faded_s.max(0.0)).position,
                    arm + self.offsets[2 + place].sample(faded_s.max(0.0)).position,
                ]
            });
            let feet = [0, 1, 2].map(|index| {
                let mut joints: JointVector = *scene.desired;
                joints.fixed_rows_mut::<3>(side.leg().first_joint()).copy_from(&limb[index][0]);
                (torso[index] * torso_from_frame(scene.model, &joints, Frame::Foot(side.leg())))
                    .translation
                    .vector
            });
            setpoint.lead_foot(side.leg(), differences(feet));
            setpoint.hold_arm(side, differences(limb.map(|[_, arm]| arm)));
        }
    }
}

/// Position, velocity and acceleration in the middle of three places, [`STEP_S`] apart.
fn differences([before, now, after]: [Vector3<f64>; 3]) -> PointReference {
    PointReference {
        position: now,
        velocity: (after - before) / (2.0 * STEP_S),
        acceleration: (after - 2.0 * now + before) / (STEP_S * STEP_S),
    }
}

/// Place of a node on the path.
const fn place(node: Node) -> f64 {
    match node {
        Node::Stand | Node::Touch => 1.0,
        Node::Kneel => 2.0,
        Node::Upright => 3.0,
    }
}

const fn after(node: Node) -> Option<Node> {
    match node {
        Node::Stand => Some(Node::Touch),
        Node::Touch => Some(Node::Kneel),
        Node::Kneel => Some(Node::Upright),
        Node::Upright => None,
    }
}

const fn before(node: Node) -> Option<Node> {
    match node {
        Node::Stand => None,
        Node::Touch => Some(Node::Stand),
        Node::Kneel => Some(Node::Touch),
        Node::Upright => Some(Node::Kneel),
    }
}

/// What carries between two neighbours.
fn between(one: Node, other: Node) -> ContactSet {
    match one.max(other) {
        Node::Stand | Node::Touch => ContactSet::STANCE,
        Node::Kneel => ContactSet::EVERYTHING,
        Node::Upright => ContactSet::KNEELING,
    }
}

/// What carries a robot that rests at a node; nothing is changed where both its sides have the same.
fn resting(node: Node) -> Option<ContactSet> {
    match node {
        Node::Stand => Some(ContactSet::STANCE),
        Node::Touch => None,
        Node::Kneel => Some(ContactSet::EVERYTHING),
        Node::Upright => Some(ContactSet::KNEELING),
    }
}

/// Moves all shares of the load towards those that are wanted; returns whether they are there.
fn load(setpoint: &mut Setpoint, wanted: &ContactSet, step: f64) -> bool {
    for point in ContactPoint::ALL {
        setpoint.load_point(point, wanted.share_of(point), step);
    }
    setpoint.contacts == *wanted
}
