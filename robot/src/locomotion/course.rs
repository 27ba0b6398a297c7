//! Where the torso should be on its way: the commanded velocity, at a bounded acceleration, summed up.
//!
//! A reference that moves on by itself has no steady error of velocity, which feedback of velocity alone has. It is on
//! a leash: a robot that was pushed away, or that is held, is not pulled back to where it would have been.

use nalgebra::{UnitQuaternion, Vector2, Vector3};

use super::settings::CourseSettings;

/// How the robot should move along the ground, seen from itself.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Velocity {
    /// Forward and left, m/s.
    pub linear: Vector2<f64>,
    /// Counter-clockwise seen from above, rad/s.
    pub turn: f64,
}

impl Velocity {
    /// At most as fast as the settings permit; nothing where it is no number.
    #[must_use]
    pub fn limited(&self, settings: &CourseSettings) -> Self {
        let limit = |value: f64, most: f64| if value.is_finite() { value.clamp(-most, most) } else { 0.0 };
        Self {
            linear: Vector2::new(
                limit(self.linear.x, settings.speed_m_s.x),
                limit(self.linear.y, settings.speed_m_s.y),
            ),
            turn: limit(self.turn, settings.turn_rad_s),
        }
    }
}

/// The course.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Course {
    /// In the world, seen from above, m.
    pub position: Vector2<f64>,
    /// In the world, rad.
    pub heading: f64,
    /// Seen from the robot.
    pub velocity: Velocity,
    /// Its change, m/s² and rad/s².
    acceleration: Velocity,
}

impl Course {
    /// At rest.
    pub fn at(position: Vector2<f64>, heading: f64) -> Self {
        Self { position, heading, velocity: Velocity::default(), acceleration: Velocity::default() }
    }

    /// One step towards a velocity, for a torso that really is somewhere and faces somewhere.
    pub fn step(
        &mut self,
        wanted: &Velocity,
        position: &Vector2<f64>,
        heading: f64,
        settings: &CourseSettings,
        dt_s: f64,
    ) {
        let wanted = wanted.limited(settings);
        let before = self.velocity;
        let change = (wanted.linear - before.linear).cap_magnitude(settings.acceleration_m_s2 * dt_s);
        self.velocity.linear += change;
        let most = settings.turn_acceleration_rad_s2 * dt_s;
        self.velocity.turn += (wanted.turn - before.turn).clamp(-most, most);
        self.acceleration =
            Velocity { linear: change / dt_s, turn: (self.velocity.turn - before.turn) / dt_s };
        self.heading += self.velocity.turn * dt_s;
        self.position += self.in_world(&self.velocity.linear) * dt_s;
        self.position = position + (self.position - position).cap_magnitude(settings.leash_m);
        let ahead = wrapped(self.heading - heading);
        self.heading = heading + ahead.clamp(-settings.leash_rad, settings.leash_rad);
    }

    /// Its velocity in the world.
    pub fn linear_velocity(&self) -> Vector3<f64> {
        let velocity = self.in_world(&self.velocity.linear);
        Vector3::new(velocity.x, velocity.y, 0.0)
    }

    /// Its acceleration in the world, with that of turning.
    pub fn linear_acceleration(&self) -> Vector3<f64> {
        let acceleration = self.in_world(&self.acceleration.linear);
        let turning = self.velocity.turn * Vector3::z();
        Vector3::new(acceleration.x, acceleration.y, 0.0) + turning.cross(&self.linear_velocity())
    }

    /// Its angular acceleration.
    pub fn turn_acceleration(&self) -> f64 {
        self.acceleration.turn
    }

    /// Its heading as a rotation.
    pub fn rotation(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.heading)
    }

    fn in_world(&self, of_robot: &Vector2<f64>) -> Vector2<f64> {
        nalgebra::Rotation2::new(self.heading) * of_robot
    }
}

/// An angle between -π and π.
fn wrapped(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    (angle + PI).rem_euclid(TAU) - PI
}
