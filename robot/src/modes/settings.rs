//! Postures, durations and gains of the modes: part of `configs/robot/control.toml`.

use nalgebra::{Vector2, Vector3};
use serde::Deserialize;

use super::mode::Effector;
use crate::joints::{JointVector, Leg, Side};

/// Named postures.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoseSettings {
    /// Hip, thigh, calf of every leg when standing, rad.
    pub stand_rad: Vector3<f64>,
    /// Hip, thigh, calf of every leg when lying, rad: the feet stay below the hips on the way.
    pub fold_rad: Vector3<f64>,
    /// The left arm folded up along its calf, rad; the right one has joint 2 mirrored.
    pub left_stow_rad: Vector3<f64>,
    /// The left arm ready for use, rad; the right one has joint 2 mirrored.
    pub left_ready_rad: Vector3<f64>,
    /// The left arm as it is carried while walking, rad; the right one has joint 2 mirrored.
    pub left_carry_rad: Vector3<f64>,
    /// Hip, thigh, calf of the left front leg of a robot that sits upright, rad; the right one has the hip mirrored.
    pub left_upright_leg_rad: Vector3<f64>,
    /// Its arm, rad; the right one has joint 2 mirrored.
    pub left_upright_arm_rad: Vector3<f64>,
    /// Torso's origin above the feet's centres in stance, m.
    pub stand_height_m: f64,
    /// How far the torso rises before a foot lifts, m.
    pub rise_m: f64,
    /// How far inside the other three feet the torso's shift brings the lifted robot's centre of mass, m.
    pub shift_margin_m: f64,
    /// How far a foot is lifted for its gripper, m.
    pub lift_m: f64,
    /// How far a foot is lifted for its own sake, m.
    pub foot_lift_m: f64,
    /// Height from which a foot is lowered, m.
    pub hover_m: f64,
}

impl Default for PoseSettings {
    fn default() -> Self {
        Self {
            stand_rad: Vector3::new(0.0, 0.9, -1.8),
            fold_rad: Vector3::new(0.0, 1.39, -2.78),
            left_stow_rad: Vector3::new(-std::f64::consts::PI, 0.05, 0.0),
            left_ready_rad: Vector3::new(-0.1, 0.0, 0.0),
            left_carry_rad: Vector3::new(-2.24, 0.3, 0.0),
            left_upright_leg_rad: Vector3::new(0.15, 1.15, -1.5),
            left_upright_arm_rad: Vector3::new(0.35, 0.0, 0.0),
            stand_height_m: 0.265,
            rise_m: 0.04,
            shift_margin_m: 0.07,
            lift_m: 0.12,
            foot_lift_m: 0.08,
            hover_m: 0.04,
        }
    }
}

impl PoseSettings {
    /// The folded posture of an arm.
    pub fn stow(&self, side: Side) -> Vector3<f64> {
        mirrored(&self.left_stow_rad, side)
    }

    /// The posture of an arm ready for use.
    pub fn ready(&self, side: Side) -> Vector3<f64> {
        mirrored(&self.left_ready_rad, side)
    }

    /// The posture of an arm that is carried while walking.
    pub fn carry(&self, side: Side) -> Vector3<f64> {
        mirrored(&self.left_carry_rad, side)
    }

    /// The front leg of a robot that sits upright, and its arm.
    pub fn upright(&self, side: Side) -> [Vector3<f64>; 2] {
        let leg = self.left_upright_leg_rad;
        let leg = match side {
            Side::Left => leg,
            Side::Right => Vector3::new(-leg.x, leg.y, leg.z),
        };
        [leg, mirrored(&self.left_upright_arm_rad, side)]
    }

    /// The posture of the lifted leg's arm in which a mode begins.
    pub fn arm(&self, effector: Effector) -> Vector3<f64> {
        match effector {
            Effector::Foot(side) => self.stow(side),
            Effector::Gripper(side) => self.ready(side),
        }
    }

    /// How far above its landing point a foot is when a mode begins, m.
    pub fn lift(&self, effector: Effector) -> f64 {
        match effector {
            Effector::Foot(_) => self.foot_lift_m,
            Effector::Gripper(_) => self.lift_m,
        }
    }

    /// All joints: the same for each leg, arms folded.
    pub fn posture(&self, leg_rad: &Vector3<f64>) -> JointVector {
        let mut posture = JointVector::zeros();
        for leg in Leg::ALL {
            posture.fixed_rows_mut::<3>(leg.first_joint()).copy_from(leg_rad);
        }
        for side in Side::ALL {
            posture.fixed_rows_mut::<3>(side.first_arm_joint()).copy_from(&self.stow(side));
        }
        posture
    }
}

/// Angles of a left arm, for either side.
fn mirrored(left: &Vector3<f64>, side: Side) -> Vector3<f64> {
    match side {
        Side::Left => *left,
        Side::Right => Vector3::new(left.x, -left.y, left.z),
    }
}

/// Durations and speeds of scripted motions.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotionSettings {
    /// From anywhere to the fold, s.
    pub fold_s: f64,
    /// From the fold to the stand, s.
    pub stand_s: f64,
    /// Rest at the end of standing up, s.
    pub settle_s: f64,
    /// Least duration of a torso's motion, s.
    pub torso_s: f64,
    /// Greatest mean speed of a scripted torso motion, m/s.
    pub torso_m_s: f64,
    /// Greatest mean angular speed of a scripted torso motion, rad/s.
    pub torso_rad_s: f64,
    /// Time in which a foot is unloaded or loaded, s.
    pub load_s: f64,
    /// Duration of lifting, s.
    pub lift_s: f64,
    /// Duration of folding and unfolding an arm by half a turn, s; shorter ways take less.
    pub arm_s: f64,
    /// Greatest mean speed of the joints of a leg that goes back to above its landing point, rad/s.
    pub leg_rad_s: f64,
    /// Speed of a foot towards the ground, m/s.
    pub lower_m_s: f64,
    /// Vertical force that tells that a foot has landed, N.
    pub touch_n: f64,
    /// How far below the expected ground a foot may search, m.
    pub search_m: f64,
    /// From standing to the fold when lying down, s.
    pub lie_down_s: f64,
    /// Least distance of the centre of mass to the edge of three feet before a foot lifts, m.
    pub lift_margin_m: f64,
}

impl Default for MotionSettings {
    fn default() -> Self {
        Self {
            fold_s: 1.2,
            stand_s: 1.8,
            settle_s: 0.3,
            torso_s: 0.8,
            torso_m_s: 0.1,
            torso_rad_s: 0.3,
            load_s: 0.4,
            lift_s: 0.7,
            arm_s: 1.6,
            leg_rad_s: 1.0,
            lower_m_s: 0.05,
            touch_n: 8.0,
            search_m: 0.04,
            lie_down_s: 2.5,
            lift_margin_m: 0.02,
        }
    }
}

/// How the robot sits up. Places of the centre of mass are in front of the rear feet, m.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UprightSettings {
    /// Where the feet stand about the middle of the robot before it kneels, forward and aside, m: under its hips.
    pub stance_m: Vector2<f64>,
    /// Feet farther from there than this step into place first, m.
    pub astray_m: f64,
    /// When the knees come to the ground.
    pub touch_com_m: f64,
    /// When the front feet are unloaded.
    pub kneel_com_m: f64,
    /// When the torso is upright.
    pub upright_com_m: f64,
    /// Pitch of the upright torso, nose up, rad.
    pub pitch_rad: f64,
    /// From four feet until the knees touch the ground, s.
    pub touch_s: f64,
    /// From there until the front feet are unloaded, s.
    pub kneel_s: f64,
    /// From there to the upright torso, s.
    pub rise_s: f64,
}

impl Default for UprightSettings {
    fn default() -> Self {
        Self {
            stance_m: Vector2::new(0.188, 0.127),
            astray_m: 0.02,
            touch_com_m: 0.04,
            kneel_com_m: -0.055,
            upright_com_m: -0.105,
            pitch_rad: std::f64::consts::FRAC_PI_2,
            touch_s: 2.0,
            kneel_s: 2.0,
            rise_s: 4.0,
        }
    }
}

/// Joint-level gains.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointGains {
    /// Legs under the whole-body controller, N m/rad.
    pub balance_kp: f64,
    /// N m s/rad.
    pub balance_kd: f64,
    /// Legs on which the robot kneels, N m/rad.
    pub kneeling_kp: f64,
    /// N m s/rad.
    pub kneeling_kd: f64,
    /// Legs of a robot that walks, N m/rad.
    pub walking_kp: f64,
    /// N m s/rad.
    pub walking_kd: f64,
    /// Legs that follow plain joint set-points, N m/rad.
    pub scripted_kp: f64,
    /// N m s/rad.
    pub scripted_kd: f64,
}

impl Default for JointGains {
    fn default() -> Self {
        Self {
            balance_kp: 60.0,
            balance_kd: 2.0,
            kneeling_kp: 100.0,
            kneeling_kd: 6.0,
            walking_kp: 60.0,
            walking_kd: 2.0,
            scripted_kp: 200.0,
            scripted_kd: 2.0,
        }
    }
}

impl JointGains {
    /// The same with those of kneeling for the rear legs.
    pub fn kneeling(&self) -> (JointVector, JointVector) {
        let (mut kp, mut kd) = Self::vectors(self.balance_kp, self.balance_kd);
        for side in Side::ALL {
            let first = side.rear_leg().first_joint();
            kp.fixed_rows_mut::<3>(first).fill(self.kneeling_kp);
            kd.fixed_rows_mut::<3>(first).fill(self.kneeling_kd);
        }
        (kp, kd)
    }

    /// kp and kd of all joints. Those of the arms are 0: their servos follow positions with their own gains.
    pub fn vectors(leg_kp: f64, leg_kd: f64) -> (JointVector, JointVector) {
        let (mut kp, mut kd) = (JointVector::zeros(), JointVector::zeros());
        for leg in Leg::ALL {
            kp.fixed_rows_mut::<3>(leg.first_joint()).fill(leg_kp);
            kd.fixed_rows_mut::<3>(leg.first_joint()).fill(leg_kd);
        }
        (kp, kd)
    }
}
