//! The joint law and what the motors can really do.
//!
//! `tau = tau_ff + kp (q_des - q) + kd (dq_des - dq)`, then limited by the drive's torque and by its speed:
//! near the no-load speed no torque is left in the direction of motion, braking stays possible. The arms'
//! servos have a law of their own ([`super::servo`]).

use locoman_robot::joints::JOINTS;
use locoman_robot::plant::JointCommand;

use super::profile::Profile;
use super::scene::{ArmServo, Gripper, LegDrive, Scene};
use super::servo::Servos;
use super::world::{MOTORS, World};

/// Torque limits of one motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motor {
    /// Torque at low speed, N m.
    pub torque_nm: f64,
    /// Speed at which nothing is left, rad/s.
    pub no_load_speed_rad_s: f64,
    /// Share of that speed up to which the full torque is there; 0 is a direct-current motor's straight line.
    pub full_torque_speed_share: f64,
}

impl Motor {
    /// The torque that comes out of the wish `torque_nm` at this speed.
    ///
    /// Forward limit: `T` below the share `s` of the no-load speed `w0`, then `T (w0 - w) / (w0 - s w0)`,
    /// never below 0: a motor faster than `w0` does not brake by itself here.
    pub fn limited(&self, torque_nm: f64, speed_rad_s: f64) -> f64 {
        let knee = self.full_torque_speed_share * self.no_load_speed_rad_s;
        let ahead = |speed: f64| {
            let left = (self.no_load_speed_rad_s - speed) / (self.no_load_speed_rad_s - knee);
            self.torque_nm * left.clamp(0.0, 1.0)
        };
        torque_nm.clamp(-ahead(-speed_rad_s), ahead(speed_rad_s))
    }
}

/// All motors and the laws that drive them.
#[derive(Debug, Clone)]
pub struct Drives {
    leg: [Motor; 3],
    arm: Motor,
    servos: Servos,
    gripper: Gripper,
    jaw: Motor,
}

impl Drives {
    /// From the scene; `seed` is that of the servos' encoder noise.
    pub fn new(scene: &Scene, profile: &Profile, seed: u64) -> Self {
        let LegDrive { torque_limit_nm, no_load_speed_rad_s, full_torque_speed_share, .. } = &scene.leg;
        let leg = std::array::from_fn(|joint| Motor {
            torque_nm: torque_limit_nm[joint],
            no_load_speed_rad_s: no_load_speed_rad_s[joint],
            full_torque_speed_share: *full_torque_speed_share,
        });
        let ArmServo { torque_limit_nm, no_load_speed_rad_s, .. } = &scene.arm;
        let servo = |torque_nm, no_load_speed_rad_s| Motor {
            torque_nm,
            no_load_speed_rad_s,
            full_torque_speed_share: 0.0,
        };
        Self {
            leg,
            arm: servo(*torque_limit_nm, *no_load_speed_rad_s),
            servos: Servos::new(&scene.arm, &profile.servos, scene.physics.timestep_s, seed),
            jaw: servo(scene.gripper.torque_limit_nm, scene.gripper.no_load_speed_rad_s),
            gripper: scene.gripper.clone(),
        }
    }

    /// Motor torques for the present state under a command; to be called once a step.
    pub fn torques(&mut self, command: &JointCommand, world: &World) -> [f64; MOTORS] {
        self.servos.exchange(command, world);
        std::array::from_fn(|motor| {
            let (angle, speed) = (world.angle(motor), world.motor_speed(motor));
            match motor {
                0..12 => self.leg[motor % 3].limited(joint_law(command, motor, angle, speed), speed),
                // A servo follows positions with its own gains unless the command brings some: damping.
                12..JOINTS if command.kp[motor] > 0.0 || command.kd[motor] > 0.0 => {
                    self.arm.limited(joint_law(command, motor, angle, speed), speed)
                }
                12..JOINTS => self.servos.torque(motor - 12, speed),
                _ => self.jaw.limited(self.jaw_law(command.opening[motor - JOINTS], angle, speed), speed),
            }
        })
    }

    /// The arms' servos.
    pub fn servos_mut(&mut self) -> &mut Servos {
        &mut self.servos
    }

    fn jaw_law(&self, opening: f64, angle: f64, speed: f64) -> f64 {
        let goal =
            self.jaw_angle(opening).clamp(angle - self.gripper.lead_rad, angle + self.gripper.lead_rad);
        self.gripper.kp * (goal - angle) - self.gripper.kd * speed
    }

    /// Jaw angle of an opening.
    pub fn jaw_angle(&self, opening: f64) -> f64 {
        self.gripper.closed_rad + opening.clamp(0.0, 1.0) * (self.gripper.open_rad - self.gripper.closed_rad)
    }

    /// Opening of a jaw angle.
    pub fn opening(&self, angle: f64) -> f64 {
        ((angle - self.gripper.closed_rad) / (self.gripper.open_rad - self.gripper.closed_rad))
            .clamp(0.0, 1.0)
    }
}

fn joint_law(command: &JointCommand, joint: usize, angle: f64, speed: f64) -> f64 {
    command.torque[joint]
        + command.kp[joint] * (command.position[joint] - angle)
        + command.kd[joint] * (command.velocity[joint] - speed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn torque_is_limited_by_the_drive_and_by_its_speed() {
        let calf = Motor { torque_nm: 35.55, no_load_speed_rad_s: 20.06, full_torque_speed_share: 0.5 };
        assert_eq!(calf.limited(100.0, 0.0), 35.55);
        assert_eq!(calf.limited(-100.0, 0.0), -35.55);
        assert_eq!(calf.limited(100.0, 20.06), 0.0);
        // Braking at full speed still has the whole torque.
        assert_eq!(calf.limited(-100.0, 20.06), -35.55);
        assert_eq!(calf.limited(5.0, 3.0), 5.0);
    }

    #[test]
    fn a_servo_has_a_straight_torque_speed_line() {
        let servo = Motor { torque_nm: 0.92, no_load_speed_rad_s: 6.8, full_torque_speed_share: 0.0 };
        assert!((servo.limited(2.0, 3.4) - 0.46).abs() < 1e-12);
        assert_eq!(servo.limited(-2.0, 3.4), -0.92);
    }
}
