//! What the Go1's own protocol leaves of numbers: 32-bit floats, and fixed point for torques and gains.

use locoman_robot::plant::JointCommand;

/// Joints that hang on it: the legs'.
const LEGS: usize = 12;
/// Steps of a torque, a position gain and a velocity gain a unit (N m, N m/rad, N m s/rad).
const TORQUE: f64 = 256.0;
const KP: f64 = 32.0;
const KD: f64 = 16.0;

/// A leg command as a low-level datagram carries it; the arms' part stays.
pub fn command(command: &JointCommand) -> JointCommand {
    let mut carried = *command;
    for joint in 0..LEGS {
        carried.position[joint] = float32(command.position[joint]);
        carried.velocity[joint] = float32(command.velocity[joint]);
        carried.torque[joint] = fixed(command.torque[joint], TORQUE);
        carried.kp[joint] = fixed(command.kp[joint], KP);
        carried.kd[joint] = fixed(command.kd[joint], KD);
    }
    carried
}

/// A leg's torque as a state datagram carries it.
pub fn torque(value: f64) -> f64 {
    fixed(value, TORQUE)
}

/// The nearest 32-bit float.
pub fn float32(value: f64) -> f64 {
    f64::from(value as f32)
}

/// Fixed point, cut towards zero.
fn fixed(value: f64, steps: f64) -> f64 {
    (value * steps).trunc() / steps
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
