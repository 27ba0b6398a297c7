//! What the Go1's own protocol leaves of numbers: 32-bit floats, and fixed point for torques and gains.

use locoman_robot::go1::MotorCommand;
use locoman_robot::plant::JointCommand;

/// Joints that hang on it: the legs'.
const LEGS: usize = 12;

/// A leg command as a low-level datagram carries it; the arms' part stays.
pub fn command(command: &JointCommand) -> JointCommand {
    let mut carried = *command;
    for joint in 0..LEGS {
        let JointCommand { position, velocity, torque, kp, kd, .. } = command;
        let [q, dq, tau, kp, kd] = [position, velocity, torque, kp, kd].map(|of| of[joint] as f32);
        let motor = MotorCommand::servo(q, dq, tau, kp, kd);
        carried.position[joint] = motor.q_rad.into();
        carried.velocity[joint] = motor.dq_rad_s.into();
        carried.torque[joint] = motor.torque_n_m();
        [carried.kp[joint], carried.kd[joint]] = motor.gains();
    }
    carried
}

/// A leg's torque as a state datagram carries it, in the steps of a command's.
pub fn torque(value: f64) -> f64 {
    MotorCommand::servo(0.0, 0.0, value as f32, 0.0, 0.0).torque_n_m()
}

/// The nearest 32-bit float.
pub fn float32(value: f64) -> f64 {
    f64::from(value as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_gains_vanish_and_torques_are_cut_towards_zero() {
        let mut wish = JointCommand::damping();
        wish.kp[0] = 0.03;
        wish.kd[0] = 0.06;
        wish.torque[0] = -0.65;
        wish.torque[12] = -0.65;
        let carried = command(&wish);
        assert_eq!((carried.kp[0], carried.kd[0]), (0.0, 0.0));
        assert_eq!(carried.torque[0], -166.0 / 256.0);
        assert_eq!(carried.torque[12], -0.65);
    }
}
