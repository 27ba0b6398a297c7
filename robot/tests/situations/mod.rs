//! Random robots in every mode, the same from the same seed.

use std::path::Path;

use locoman_robot::{
    dynamics::{Dynamics, State},
    joints::{JointVector, Leg, Side},
    model::{Frame, Model},
    modes::{
        Arms, Mode,
        table::{Row, STANCE, TABLE},
    },
    wbc::{ContactSet, Objective, ObjectiveKind, PointReference, RotationReference},
};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3, Vector6};

pub fn model() -> Model {
    Model::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/robot")).unwrap()
}

/// What stands and what is tracked.
pub struct Case {
    pub name: String,
    pub stance: Vec<Leg>,
    pub objectives: Vec<ObjectiveKind>,
}

const PAIRS: [[Leg; 2]; 2] = [[Leg::FrontRight, Leg::RearLeft], [Leg::FrontLeft, Leg::RearRight]];

/// The rows of the table of modes that stand, and both pairs of feet of a trot with the objectives of a stance.
pub fn standing() -> Vec<Case> {
    let rows = TABLE
        .iter()
        .filter(|row| !matches!(row.mode, Mode::Locomotion | Mode::LocoManipulation(_) | Mode::Bimanual));
    let of = |name: String, stance: &[Leg], objectives: &[ObjectiveKind]| Case {
        name,
        stance: stance.to_vec(),
        objectives: objectives.to_vec(),
    };
    let rows = rows.map(|row| {
        let stance: Vec<Leg> = row.contacts().legs().collect();
        of(format!("{:?}", row.mode), &stance, row.objectives)
    });
    let trots = PAIRS.iter().map(|pair| of(format!("trot on {pair:?}"), pair, STANCE.objectives));
    rows.chain(trots).collect()
}

/// Those, and the rows that walk on one pair of feet of a trot, locomotion on both.
pub fn cases() -> Vec<Case> {
    let mut cases = standing();
    for row in TABLE {
        match row.mode {
            Mode::Locomotion => cases.extend(PAIRS.map(|pair| trot(row, pair))),
            Mode::LocoManipulation(arms) => {
                // The leg that swings carries the arm that works.
                let pair = if arms == Arms::One(Side::Left) { PAIRS[0] } else { PAIRS[1] };
                cases.push(trot(row, pair));
            }
            _ => {}
        }
    }
    cases
}

/// Of the feet those in the air are tracked.
fn trot(row: &Row, stance: [Leg; 2]) -> Case {
    let stands =
        |kind: &&ObjectiveKind| matches!(kind, ObjectiveKind::FootPosition(leg) if stance.contains(leg));
    Case {
        name: format!("{:?} on {stance:?}", row.mode),
        stance: stance.to_vec(),
        objectives: row.objectives.iter().filter(|kind| !stands(kind)).copied().collect(),
    }
}

/// SplitMix64 (Steele, Lea and Flood 2014).
pub struct Random(pub u64);

impl Random {
    /// From -1 to 1.
    pub fn number(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        bits ^= bits >> 31;
        (bits >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// From 0 to 1.
    pub fn share(&mut self) -> f64 {
        0.5 + 0.5 * self.number()
    }

    pub fn vector(&mut self, size: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| size * self.number())
    }
}

/// A moving robot: half of them near standing, half anywhere within the joints' ranges; legs in the air drawn up.
pub fn state(random: &mut Random, model: &Model, stance: &[Leg]) -> State {
    let near = random.number() < 0.0;
    let mut position = JointVector::from_fn(|joint, _| {
        let (lower, upper) = (model.lower[joint], model.upper[joint]);
        if near {
            (stand()[joint] + 0.35 * random.number()).clamp(lower, upper)
        } else {
            lower + random.share() * (upper - lower)
        }
    });
    draw_up(&mut position, stance, model);
    let tilt = random.vector(0.3);
    State {
        world_from_torso: Isometry3::from_parts(
            Translation3::from(random.vector(0.3)),
            UnitQuaternion::from_euler_angles(tilt.x, tilt.y, 10.0 * tilt.z),
        ),
        torso_twist: Vector6::from_fn(|_, _| 0.3 * random.number()),
        position,
        velocity: JointVector::from_fn(|_, _| random.number()),
    }
}

/// Draws up the legs that do not stand: one in the air that is as low as the others touches the ground.
fn draw_up(position: &mut JointVector, stance: &[Leg], model: &Model) {
    const BY_RAD: f64 = 0.3;
    for leg in Leg::ALL.into_iter().filter(|leg| !stance.contains(leg)) {
        let calf = leg.first_joint() + 2;
        position[calf] = (position[calf] - BY_RAD).max(model.lower[calf]);
    }
}

fn stand() -> JointVector {
    let mut position = JointVector::zeros();
    for leg in Leg::ALL {
        position.fixed_rows_mut::<3>(leg.first_joint()).copy_from_slice(&[0.0, 0.9, -1.8]);
    }
    for side in Side::ALL {
        position.fixed_rows_mut::<3>(side.first_arm_joint()).copy_from_slice(&[-0.6, 0.1, 0.2]);
    }
    position
}

/// References near where everything is, from a hundredth of a usual demand to three times as much.
pub fn objectives(
    random: &mut Random,
    kinds: &[ObjectiveKind],
    state: &State,
    dynamics: &Dynamics,
) -> Vec<Objective> {
    let size = 10_f64.powf(-2.0 + 2.5 * random.share());
    let point = |random: &mut Random, at: Vector3<f64>| PointReference {
        position: at + random.vector(0.03 * size),
        velocity: random.vector(0.1 * size),
        acceleration: random.vector(2.0 * size),
    };
    let rotation = |random: &mut Random, frame| RotationReference {
        orientation: UnitQuaternion::from_scaled_axis(random.vector(0.2 * size))
            * dynamics.frame(frame).world_from_frame.rotation,
        angular_velocity: random.vector(0.3 * size),
        angular_acceleration: random.vector(5.0 * size),
    };
    let origin = |frame| dynamics.frame(frame).world_from_frame.translation.vector;
    kinds
        .iter()
        .map(|kind| match *kind {
            ObjectiveKind::TorsoPosition => Objective::TorsoPosition(point(random, origin(Frame::Torso))),
            ObjectiveKind::TorsoOrientation => Objective::TorsoOrientation(rotation(random, Frame::Torso)),
            ObjectiveKind::FootPosition(leg) => {
                Objective::FootPosition(leg, point(random, origin(Frame::Foot(leg))))
            }
            ObjectiveKind::GripperPosition(side) => {
                Objective::GripperPosition(side, point(random, origin(Frame::Gripper(side))))
            }
            ObjectiveKind::GripperOrientation(side) => {
                Objective::GripperOrientation(side, rotation(random, Frame::Gripper(side)))
            }
            ObjectiveKind::LegPosture(leg) => {
                let joints = state.position.fixed_rows::<3>(leg.first_joint()).into_owned();
                Objective::LegPosture(leg, point(random, joints))
            }
            ObjectiveKind::ArmPosture(side) => {
                let arm = state.position.fixed_rows::<3>(side.first_arm_joint()).into_owned();
                Objective::ArmPosture(side, point(random, arm))
            }
        })
        .collect()
}

/// The feet in full contact, or now and then one of them half loaded.
pub fn contacts(random: &mut Random, stance: &[Leg]) -> ContactSet {
    let contacts = stance.iter().fold(ContactSet::NOTHING, |contacts, leg| contacts.with_share(*leg, 1.0));
    let first = stance[0];
    if random.number() < 0.8 { contacts } else { contacts.with_share(first, 0.05 + 0.95 * random.share()) }
}
