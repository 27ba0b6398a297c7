//! What may be asked of the legs' motors: cut before it is written in the numbers of the wire.
//!
//! The last of several limits: the controller keeps tighter ones by itself. Position, velocity, torque and gains are
//! cut one by one, so a command that is cut is never one that points the other way.

use serde::Deserialize;

use super::{LowCommand, MotorCommand, command::MOTORS};
use crate::plant::JointCommand;

/// `[limits]` of `go1.toml`; hip, thigh, calf.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Least positions, rad.
    pub lower_rad: [f64; 3],
    /// Greatest positions, rad.
    pub upper_rad: [f64; 3],
    /// Greatest speeds, rad/s.
    pub speed_rad_s: [f64; 3],
    /// Greatest feed-forward torques, N m.
    pub torque_nm: [f64; 3],
    /// Greatest position gain, N m/rad.
    pub kp: f64,
    /// Greatest velocity gain, N m s/rad.
    pub kd: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            lower_rad: [-0.863, -0.663, -2.818],
            upper_rad: [0.863, 2.966, -0.888],
            speed_rad_s: [30.1, 30.1, 20.06],
            torque_nm: [23.7, 23.7, 35.55],
            kp: 250.0,
            kd: 10.0,
        }
    }
}

impl Limits {
    /// The legs' part of a command, within the limits. A motor whose command holds a number that is none is damped.
    pub fn apply(&self, joints: &JointCommand) -> LowCommand {
        let mut command = LowCommand::default();
        for (motor, slot) in command.motors[..MOTORS].iter_mut().enumerate() {
            let joint = motor % 3;
            let symmetric = |value: f64, most: f64| value.clamp(-most, most) as f32;
            *slot = MotorCommand::servo(
                joints.position[motor].clamp(self.lower_rad[joint], self.upper_rad[joint]) as f32,
                symmetric(joints.velocity[motor], self.speed_rad_s[joint]),
                symmetric(joints.torque[motor], self.torque_nm[joint]),
                joints.kp[motor].clamp(0.0, self.kp) as f32,
                joints.kd[motor].clamp(0.0, self.kd) as f32,
            );
        }
        command
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_beyond_the_limits_is_cut_and_what_is_within_passes() {
        let mut wish = JointCommand::damping();
        wish.position[2] = -9.0;
        wish.velocity[0] = 99.0;
        wish.torque[5] = -200.0;
        wish.kp[1] = 5000.0;
        wish.kd[1] = -1.0;
        let sent = Limits::default().apply(&wish);
        assert_eq!(sent.motors[2].q_rad, -2.818);
        assert_eq!(sent.motors[0].dq_rad_s, 30.1);
        assert_eq!(sent.motors[5].torque_n_m(), -f64::from((35.55_f64 * 256.0) as i16) / 256.0);
        assert_eq!(sent.motors[1].gains(), [250.0, 0.0]);
        assert_eq!(sent.motors[7].gains(), [0.0, 3.0]);
    }

    #[test]
    fn a_number_that_is_none_damps_its_motor_alone() {
        let mut wish = JointCommand::damping();
        wish.kp.fill(60.0);
        wish.position[4] = f64::NAN;
        let sent = Limits::default().apply(&wish);
        assert_eq!(sent.motors[4], MotorCommand::damping(2.0));
        assert_eq!(sent.motors[3].gains()[0], 60.0);
    }
}
