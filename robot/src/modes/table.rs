//! The paper's table of operation modes: what each mode controls, the most important first, and which feet
//! stand. It is data: a mode is a row here, and the way to it a few phases.
//!
//! The paper's table ends with the gripper's orientation. What it leaves free, the joints of stowed arms, is
//! held by posture objectives after all of it, where they disturb nothing.

use super::mode::{Arms, Mode};
use crate::{
    joints::{Leg, Side},
    wbc::{
        ContactPoint::{self, Foot, Knee},
        ContactSet,
        ObjectiveKind::{
            self, ArmPosture, FootPosition, GripperOrientation, GripperPosition, LegPosture,
            TorsoOrientation, TorsoPosition,
        },
    },
};

/// What the whole-body controller does in a mode.
#[derive(Debug, PartialEq, Eq)]
pub struct Row {
    /// The mode; on the way from one to another, the one whose objectives are in force.
    pub mode: Mode,
    /// What is tracked, the most important first.
    pub objectives: &'static [ObjectiveKind],
    /// What stands on the ground.
    pub stance: &'static [ContactPoint],
}

impl Row {
    /// What stands, in full contact.
    pub fn contacts(&self) -> ContactSet {
        ContactSet::of(self.stance)
    }

    /// Whether something is tracked.
    pub fn controls(&self, kind: ObjectiveKind) -> bool {
        self.objectives.contains(&kind)
    }
}

const FEET: &[ContactPoint] =
    &[Foot(Leg::FrontRight), Foot(Leg::FrontLeft), Foot(Leg::RearRight), Foot(Leg::RearLeft)];
const ALL_BUT_FRONT_RIGHT: &[ContactPoint] =
    &[Foot(Leg::FrontLeft), Foot(Leg::RearRight), Foot(Leg::RearLeft)];
const ALL_BUT_FRONT_LEFT: &[ContactPoint] =
    &[Foot(Leg::FrontRight), Foot(Leg::RearRight), Foot(Leg::RearLeft)];
/// The paper has the rear feet alone; what really carries a robot that sits is feet and knees.
const SHANKS: &[ContactPoint] =
    &[Foot(Leg::RearRight), Foot(Leg::RearLeft), Knee(Side::Right), Knee(Side::Left)];

/// Standing on four feet.
pub static STANCE: Row = Row {
    mode: Mode::Stance,
    objectives: &[TorsoPosition, TorsoOrientation, ArmPosture(Side::Right), ArmPosture(Side::Left)],
    stance: FEET,
};

/// Single-foot manipulation, right and left.
pub static SINGLE_FOOT: [Row; 2] = [
    Row {
        mode: Mode::Foot(Side::Right),
        objectives: &[
            TorsoPosition,
            TorsoOrientation,
            FootPosition(Leg::FrontRight),
            ArmPosture(Side::Right),
            ArmPosture(Side::Left),
        ],
        stance: ALL_BUT_FRONT_RIGHT,
    },
    Row {
        mode: Mode::Foot(Side::Left),
        objectives: &[
            TorsoPosition,
            TorsoOrientation,
            FootPosition(Leg::FrontLeft),
            ArmPosture(Side::Right),
            ArmPosture(Side::Left),
        ],
        stance: ALL_BUT_FRONT_LEFT,
    },
];

/// Single-gripper manipulation, right and left.
pub static SINGLE_GRIPPER: [Row; 2] = [
    Row {
        mode: Mode::Gripper(Side::Right),
        objectives: &[
            TorsoPosition,
            TorsoOrientation,
            GripperPosition(Side::Right),
            GripperOrientation(Side::Right),
            ArmPosture(Side::Left),
        ],
        stance: ALL_BUT_FRONT_RIGHT,
    },
    Row {
        mode: Mode::Gripper(Side::Left),
        objectives: &[
            TorsoPosition,
            TorsoOrientation,
            GripperPosition(Side::Left),
            GripperOrientation(Side::Left),
            ArmPosture(Side::Right),
        ],
        stance: ALL_BUT_FRONT_LEFT,
    },
];

/// Locomotion. Which feet stand changes all the time; those that do not are tracked.
pub static LOCOMOTION: Row = Row {
    mode: Mode::Locomotion,
    objectives: &walking(ArmPosture(Side::Right), ArmPosture(Side::Left)),
    stance: FEET,
};

/// Loco-manipulation with the right arm, the left arm, both.
pub static LOCO_MANIPULATION: [Row; 3] = [
    Row {
        mode: Mode::LocoManipulation(Arms::One(Side::Right)),
        objectives: &walking(GripperOrientation(Side::Right), ArmPosture(Side::Left)),
        stance: FEET,
    },
    Row {
        mode: Mode::LocoManipulation(Arms::One(Side::Left)),
        objectives: &walking(GripperOrientation(Side::Left), ArmPosture(Side::Right)),
        stance: FEET,
    },
    Row {
        mode: Mode::LocoManipulation(Arms::Both),
        objectives: &walking(GripperOrientation(Side::Right), GripperOrientation(Side::Left)),
        stance: FEET,
    },
];

/// On the shanks of the rear legs, on the way to sitting upright and back. The joints of these legs are held, and with them
/// the torso: it has no other freedom there, and where it is does not hang on where the robot believes to be.
pub static KNEELING: Row = Row {
    mode: Mode::Bimanual,
    objectives: &kneeling([
        LegPosture(Leg::FrontRight),
        LegPosture(Leg::FrontLeft),
        ArmPosture(Side::Right),
        ArmPosture(Side::Left),
    ]),
    stance: SHANKS,
};

/// Bimanual manipulation; then with the right limb led by foot and arm, the left, both.
pub static BIMANUAL: [Row; 4] = [
    Row {
        mode: Mode::Bimanual,
        objectives: &kneeling([
            GripperPosition(Side::Right),
            GripperPosition(Side::Left),
            GripperOrientation(Side::Right),
            GripperOrientation(Side::Left),
        ]),
        stance: SHANKS,
    },
    Row {
        mode: Mode::Bimanual,
        objectives: &kneeling([
            FootPosition(Leg::FrontRight),
            GripperPosition(Side::Left),
            GripperOrientation(Side::Left),
            ArmPosture(Side::Right),
        ]),
        stance: SHANKS,
    },
    Row {
        mode: Mode::Bimanual,
        objectives: &kneeling([
            FootPosition(Leg::FrontLeft),
            GripperPosition(Side::Right),
            GripperOrientation(Side::Right),
            ArmPosture(Side::Left),
        ]),
        stance: SHANKS,
    },
    Row {
        mode: Mode::Bimanual,
        objectives: &kneeling([
            FootPosition(Leg::FrontRight),
            FootPosition(Leg::FrontLeft),
            ArmPosture(Side::Right),
            ArmPosture(Side::Left),
        ]),
        stance: SHANKS,
    },
];

/// The legs on which the robot kneels, and then the front limbs.
const fn kneeling([first, second, third, fourth]: [ObjectiveKind; 4]) -> [ObjectiveKind; 6] {
    [LegPosture(Leg::RearRight), LegPosture(Leg::RearLeft), first, second, third, fourth]
}

/// Torso, feet, and then the arms.
const fn walking(first: ObjectiveKind, second: ObjectiveKind) -> [ObjectiveKind; MAX_OBJECTIVES] {
    [
        TorsoPosition,
        TorsoOrientation,
        FootPosition(Leg::FrontRight),
        FootPosition(Leg::FrontLeft),
        FootPosition(Leg::RearRight),
        FootPosition(Leg::RearLeft),
        first,
        second,
    ]
}

/// The row of loco-manipulation with these arms.
pub fn loco_manipulation(arms: Arms) -> &'static Row {
    let [right, left, both] = &LOCO_MANIPULATION;
    match arms {
        Arms::One(Side::Right) => right,
        Arms::One(Side::Left) => left,
        Arms::Both => both,
    }
}

/// The row of bimanual manipulation; `led` are the limbs right, left that foot and arm lead.
pub fn bimanual(led: [bool; 2]) -> &'static Row {
    &BIMANUAL[usize::from(led[0]) + 2 * usize::from(led[1])]
}

/// All rows.
pub static TABLE: [&Row; 10] = [
    &STANCE,
    &SINGLE_FOOT[0],
    &SINGLE_FOOT[1],
    &SINGLE_GRIPPER[0],
    &SINGLE_GRIPPER[1],
    &LOCOMOTION,
    &LOCO_MANIPULATION[0],
    &LOCO_MANIPULATION[1],
    &LOCO_MANIPULATION[2],
    &BIMANUAL[0],
];

/// The most objectives in a row.
pub const MAX_OBJECTIVES: usize = 8;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modes::Effector;

    /// One objective in the paper's words; nothing for what its table leaves out.
    fn words(kind: &ObjectiveKind) -> Option<&'static str> {
        match kind {
            TorsoPosition => Some("Torso Position"),
            TorsoOrientation => Some("Torso Orientation"),
            FootPosition(_) => Some("Foot Position"),
            GripperPosition(_) => Some("Gripper Position"),
            GripperOrientation(_) => Some("Gripper Orientation"),
            LegPosture(_) | ArmPosture(_) => None,
        }
    }

    #[test]
    fn the_rows_are_those_of_the_papers_table_of_operation_modes() {
        for row in TABLE {
            let mut line: Vec<_> = row.objectives.iter().filter_map(words).collect();
            // The paper names all swinging feet together, and both grippers.
            line.dedup();
            let line = line.join(" | ");
            println!("{:?}: {line}; {} feet", row.mode, row.stance.len());
            let (paper, feet) = match row.mode {
                Mode::Foot(_) => ("Torso Position | Torso Orientation | Foot Position", 3),
                Mode::Gripper(_) => {
                    ("Torso Position | Torso Orientation | Gripper Position | Gripper Orientation", 3)
                }
                // All four may stand; the gait takes away those that swing.
                Mode::Locomotion => ("Torso Position | Torso Orientation | Foot Position", 4),
                Mode::LocoManipulation(_) => {
                    ("Torso Position | Torso Orientation | Foot Position | Gripper Orientation", 4)
                }
                // Feet and knees carry; the paper has the rear feet.
                Mode::Bimanual => ("Gripper Position | Gripper Orientation", 4),
                // Not in the paper's table: where its switchers begin and end.
                _ => ("Torso Position | Torso Orientation", 4),
            };
            assert_eq!((line.as_str(), row.stance.len()), (paper, feet));
        }
    }

    #[test]
    fn postures_come_last_and_nothing_that_stands_or_is_held_otherwise_is_moved() {
        for row in TABLE {
            assert!(row.objectives.len() <= MAX_OBJECTIVES);
            let postures = |kind: &&ObjectiveKind| matches!(kind, ArmPosture(_));
            let last = row.objectives.iter().rev().take_while(postures).count();
            assert_eq!(last, row.objectives.iter().filter(postures).count(), "{:?}", row.mode);
            for side in Side::ALL {
                let turned = row.controls(GripperOrientation(side));
                assert_ne!(turned, row.controls(ArmPosture(side)), "{:?}", row.mode);
                let walks = matches!(row.mode, Mode::Locomotion | Mode::LocoManipulation(_));
                let gripper = row.controls(GripperPosition(side));
                assert_eq!(gripper, turned && !walks);
                if walks {
                    continue;
                }
                let foot = row.controls(FootPosition(side.leg()));
                assert_ne!(row.stance.contains(&Foot(side.leg())), gripper || foot, "{:?}", row.mode);
            }
        }
    }

    #[test]
    fn both_sides_have_the_same_row() {
        for rows in [&SINGLE_FOOT, &SINGLE_GRIPPER] {
            let [right, left] = rows.each_ref().map(|row| row.objectives.iter().filter_map(words));
            assert!(right.eq(left));
            assert_eq!(
                rows.each_ref().map(|row| row.mode.effector().map(Effector::side)),
                Side::ALL.map(Some)
            );
        }
    }
}
