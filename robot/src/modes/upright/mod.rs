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
    joints::{JointVector, Leg, Side},
    wbc::{ContactPoint, ContactSet, PointReference},
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
    /// What the joints are off the path, rad, of which a share remains, in the first coordinate of `fades`.
    offset: JointVector,
    fades: PointMotion,
    fades_from_s: f64,
}

impl Upright {
    /// Begins on four feet.
    pub fn begin(path: Path, settings: UprightSettings, setpoint: &Setpoint) -> Self {
        Self {
            settings,
            path,
            at: Node::Stand,
            towards: None,
            time_s: 0.0,
            began_s: 0.0,
            along: PointMotion::hold(Vector3::x() * place(Node::Touch)),
            torso: PoseMotion::new(&setpoint.torso, &setpoint.torso.pose(), 1.0),
            offset: JointVector::zeros(),
            fades: PointMotion::hold(Vector3::zeros()),
            fades_from_s: 0.0,
        }
    }

    /// Takes up the joints as they are, wherever an operator has led them. (What is asked of them includes what was learned
    /// of their loads.)
    pub fn take_up(&mut self, motions: &MotionSettings, scene: &Scene<'_>) {
        self.offset = scene.state.position - self.path.joints(self.place(self.time_s));
        let duration_s = (self.offset.amax() / motions.leg_rad_s).max(motions.torso_s);
        let whole = PointReference::hold(Vector3::x());
        self.fades = PointMotion::new(&whole, &Vector3::zeros(), duration_s);
        self.fades_from_s = self.time_s;
    }

    /// Where it is on the path at some time.
    fn place(&self, time_s: f64) -> f64 {
        self.along.sample((time_s - self.began_s).max(0.0)).position.x
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
                if self.at == Node::Touch {
                    self.take_up(motions, scene);
                }
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
        let waits = self.time_s - self.fades_from_s < self.fades.duration_s() && self.at == Node::Upright;
        if let Some(next) = next
            && settled
            && !waits
        {
            if next == Node::Upright {
                self.path.stand_here(scene);
            }
            self.towards = Some(next);
            self.head(setpoint);
        }
        self.refer(scene, setpoint);
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
            setpoint.stand();
            if self.towards.is_some() {
                setpoint.torso = self.torso.sample(elapsed_s);
            }
            return;
        }
        setpoint.kneel();
        self.path.follow(scene, scene.dt_s / FOLLOW_S);
        setpoint.torso = PoseReference::hold(&self.path.torso(self.place(self.time_s)));
        let joints = [-STEP_S, 0.0, STEP_S].map(|later_s| {
            let time_s = self.time_s + later_s;
            let left = self.fades.sample((time_s - self.fades_from_s).max(0.0)).position.x;
            self.path.joints(self.place(time_s)) + self.offset * left
        });
        let of = |first: usize| differences(joints.map(|joints| joints.fixed_rows::<3>(first).into_owned()));
        for leg in Leg::ALL {
            setpoint.hold_leg(leg, of(leg.first_joint()));
        }
        for side in Side::ALL {
            setpoint.hold_arm(side, of(side.first_arm_joint()));
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
