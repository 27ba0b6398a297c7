//! The motion of a hand, made up.
//!
//! It reaches from place to place as hands do, with least jerk (Flash and Hogan, "The coordination of arm
//! movements", 1985), each reach begun before the last has quite ended, with rests between some, and it trembles.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::testing::Noise;

/// A reach from here to there: begins, lasts, shifts and turns.
struct Reach {
    begin_s: f64,
    duration_s: f64,
    shift_m: Vector3<f64>,
    turn_rad: Vector3<f64>,
}

/// A minute of a hand.
pub struct Hand(Vec<Reach>);

impl Hand {
    /// From a seed.
    pub fn new(noise: &mut Noise) -> Self {
        let mut begin_s = 0.0;
        let mut reaches = Vec::new();
        let (mut place, mut facing) = (Vector3::zeros(), Vector3::zeros());
        while begin_s < 60.0 {
            let mut within = |reach: f64| Vector3::from_fn(|_, _| reach * (2.0 * noise.uniform() - 1.0));
            let (to, face) = (within(0.25), within(0.6));
            let shift_m: Vector3<f64> = to - place;
            // 0.45 s and 1.5 s for each metre: peak speeds about 1 m/s.
            let duration_s = 0.45 + 1.5 * shift_m.norm() * (0.7 + 0.6 * noise.uniform());
            reaches.push(Reach { begin_s, duration_s, shift_m, turn_rad: face - facing });
            (place, facing) = (to, face);
            let rest_s = if noise.uniform() < 0.3 { 0.6 } else { -0.1 * duration_s };
            begin_s += duration_s + rest_s;
        }
        Self(reaches)
    }

    /// Where it is, about where it rests.
    pub fn at(&self, t_s: f64) -> Isometry3<f64> {
        let (mut place, mut facing) = (Vector3::zeros(), Vector3::zeros());
        for reach in &self.0 {
            let x = ((t_s - reach.begin_s) / reach.duration_s).clamp(0.0, 1.0);
            let share = x * x * x * (10.0 + x * (6.0 * x - 15.0));
            place += reach.shift_m * share;
            facing += reach.turn_rad * share;
        }
        // Physiological tremor: 9 Hz, a tenth of a millimetre.
        let tremor = 1e-4 * (std::f64::consts::TAU * 9.0 * t_s).sin();
        place += Vector3::new(tremor, 0.5 * tremor, -0.7 * tremor);
        Isometry3::from_parts(place.into(), UnitQuaternion::from_scaled_axis(facing))
    }
}
