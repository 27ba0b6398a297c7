//! The way of a foot through the air, with its velocity and acceleration.
//!
//! Horizontally one fifth-order polynomial from where it lifted to where it is to land; vertically one up and one down.
//! Both join at rest, so that a landing point that is planned anew on the way changes the reference without a jump.

use nalgebra::Vector3;

use super::settings::SwingSettings;
use crate::wbc::PointReference;

/// Share of the swing after which the foot goes down.
const APEX: f64 = 0.5;

/// One foot's swing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Swing {
    from: Vector3<f64>,
    to: Vector3<f64>,
    duration_s: f64,
}

/// A polynomial from 0 at rest to 1 at rest: its value, slope and curvature.
fn minimum_jerk(s: f64) -> [f64; 3] {
    let s = s.clamp(0.0, 1.0);
    [
        s * s * s * (10.0 + s * (6.0 * s - 15.0)),
        30.0 * s * s * (1.0 - s) * (1.0 - s),
        60.0 * s * (1.0 - s) * (1.0 - 2.0 * s),
    ]
}

impl Swing {
    /// Lifts from a place; it lands there too until it is told where.
    pub fn new(from: Vector3<f64>, duration_s: f64) -> Self {
        Self { from, to: from, duration_s }
    }

    /// Where it is to land.
    pub fn aim(&mut self, to: Vector3<f64>) {
        self.to = to;
    }

    /// Where the foot should be after a share of the swing; after its end it goes on down.
    pub fn sample(&self, progress: f64, settings: &SwingSettings) -> PointReference {
        let [x, dx, ddx] = minimum_jerk(progress);
        let way = self.to - self.from;
        let rate = 1.0 / self.duration_s;
        let mut reference = PointReference {
            position: self.from + way * x,
            velocity: way * dx * rate,
            acceleration: way * ddx * rate * rate,
        };
        let apex = self.from.z.max(self.to.z) + settings.height_m;
        let (start, end, share, begin) = if progress < APEX {
            (self.from.z, apex, APEX, 0.0)
        } else {
            (apex, self.to.z, 1.0 - APEX, APEX)
        };
        let rate = rate / share;
        let [z, dz, ddz] = minimum_jerk((progress - begin) / share);
        reference.position.z = start + (end - start) * z;
        reference.velocity.z = (end - start) * dz * rate;
        reference.acceleration.z = (end - start) * ddz * rate * rate;
        if progress > 1.0 {
            let late_s = (progress - 1.0) * self.duration_s;
            let depth = (settings.landing_m_s * late_s).min(settings.search_m);
            reference.position.z -= depth;
            reference.velocity.z = if depth < settings.search_m { -settings.landing_m_s } else { 0.0 };
        }
        reference
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::locomotion::LocomotionSettings;

    const DURATION_S: f64 = 0.225;

    fn place() -> impl Strategy<Value = Vector3<f64>> {
        (-0.2..0.2f64, -0.2..0.2f64, -0.05..0.05f64).prop_map(|(x, y, z)| Vector3::new(x, y, z))
    }

    proptest! {
        #[test]
        fn it_leaves_and_lands_at_rest_and_clears_both_ends(from in place(), to in place()) {
            let settings = LocomotionSettings::default().swing;
            let mut sut = Swing::new(from, DURATION_S);
            sut.aim(to);
            let (first, last) = (sut.sample(0.0, &settings), sut.sample(1.0, &settings));
            prop_assert!((first.position - from).norm() < 1e-12 && first.velocity.norm() < 1e-9);
            prop_assert!((last.position - to).norm() < 1e-12 && last.velocity.norm() < 1e-9);
            let middle = sut.sample(0.5, &settings).position.z;
            prop_assert!((middle - from.z.max(to.z) - settings.height_m).abs() < 1e-9);
        }

        #[test]
        fn velocity_and_acceleration_are_those_of_the_way(from in place(), to in place(), s in 0.02..0.98f64) {
            prop_assume!((s - 0.5).abs() > 0.01);
            const H: f64 = 1e-5;
            let settings = LocomotionSettings::default().swing;
            let mut sut = Swing::new(from, DURATION_S);
            sut.aim(to);
            let at = |s: f64| sut.sample(s, &settings);
            let slope = (at(s + H).position - at(s - H).position) / (2.0 * H * DURATION_S);
            prop_assert!((slope - at(s).velocity).norm() < 1e-5);
            let bend = (at(s + H).velocity - at(s - H).velocity) / (2.0 * H * DURATION_S);
            prop_assert!((bend - at(s).acceleration).norm() < 1e-3);
        }
    }
}
