//! Ways of a foot off the ground and back onto it.

use nalgebra::Vector3;

use crate::{commander::PointMotion, wbc::PointReference};

/// Share of the rise after which the foot also moves sideways: clear of what it stood on.
const SIDEWAYS_AFTER: f64 = 0.4;

/// Straight up, then, still rising, to its place; velocity and acceleration without a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lift {
    up: PointMotion,
    sideways: PointMotion,
    rise_s: f64,
}

impl Lift {
    /// Stays where it is.
    pub fn hold(place: Vector3<f64>) -> Self {
        Self { up: PointMotion::hold(place), sideways: PointMotion::hold(Vector3::zeros()), rise_s: 1.0 }
    }

    /// From a foot's reference to a place above.
    pub fn new(start: &PointReference, place: &Vector3<f64>, rise_s: f64) -> Self {
        let level = Vector3::new(start.position.x, start.position.y, place.z);
        let rest = PointReference::hold(Vector3::zeros());
        Self {
            up: PointMotion::new(start, &level, rise_s),
            sideways: PointMotion::new(&rest, &(place - level), rise_s),
            rise_s,
        }
    }

    /// How long it takes, s.
    pub fn duration_s(&self) -> f64 {
        (1.0 + SIDEWAYS_AFTER) * self.rise_s
    }

    /// Where the foot should be.
    pub fn sample(&self, elapsed_s: f64) -> PointReference {
        let (up, sideways) =
            (self.up.sample(elapsed_s), self.sideways.sample(elapsed_s - SIDEWAYS_AFTER * self.rise_s));
        sum(&up, &sideways)
    }
}

/// Down at a steady speed, until the ground stops it or it is too deep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Descent {
    start: Vector3<f64>,
    depth_m: f64,
    speed_m_s: f64,
    ramp_s: f64,
    /// From how the foot moves and where it is to straight above its landing point.
    over: PointMotion,
}

impl Descent {
    /// Stays where it is.
    pub fn hold(place: Vector3<f64>) -> Self {
        Self {
            start: place,
            depth_m: 0.0,
            speed_m_s: 1.0,
            ramp_s: 0.1,
            over: PointMotion::hold(Vector3::zeros()),
        }
    }

    /// From a foot's reference down to `deepest`. The speed is reached and given up in `ramp_s`; within
    /// `over_s` the foot is above `deepest`.
    pub fn new(
        start: &PointReference,
        deepest: &Vector3<f64>,
        speed_m_s: f64,
        ramp_s: f64,
        over_s: f64,
    ) -> Self {
        let above = Vector3::new(deepest.x, deepest.y, start.position.z);
        let off = PointReference { position: start.position - above, ..*start };
        Self {
            start: above,
            depth_m: (above.z - deepest.z).max(0.0),
            speed_m_s,
            ramp_s,
            over: PointMotion::new(&off, &Vector3::zeros(), over_s),
        }
    }

    /// How long it takes if nothing stops it, s.
    pub fn duration_s(&self) -> f64 {
        (self.depth_m / self.speed_m_s + self.ramp_s).max(2.0 * self.ramp_s)
    }

    /// Where the foot should be.
    pub fn sample(&self, elapsed_s: f64) -> PointReference {
        // A way shorter than the two ramps is gone at less than full speed.
        let full_m = self.speed_m_s * (self.duration_s() - self.ramp_s);
        let scale = self.depth_m / full_m;
        let (began, ends) = (self.ramp(elapsed_s), self.ramp(elapsed_s - (self.duration_s() - self.ramp_s)));
        let down = |index: usize| (began[index] - ends[index]) * scale * -Vector3::z();
        let way = PointReference { position: self.start + down(0), velocity: down(1), acceleration: down(2) };
        sum(&way, &self.over.sample(elapsed_s))
    }

    /// Distance, speed and acceleration of a motion that goes from rest to full speed in the ramp's time:
    /// v (3 s² - 2 s³).
    fn ramp(&self, elapsed_s: f64) -> [f64; 3] {
        let (v, t) = (self.speed_m_s, self.ramp_s);
        if elapsed_s >= t {
            return [v * (elapsed_s - t / 2.0), v, 0.0];
        }
        let s = (elapsed_s / t).max(0.0);
        [v * t * s.powi(3) * (1.0 - s / 2.0), v * s * s * (3.0 - 2.0 * s), v * 6.0 * s * (1.0 - s) / t]
    }
}

fn sum(a: &PointReference, b: &PointReference) -> PointReference {
    PointReference {
        position: a.position + b.position,
        velocity: a.velocity + b.velocity,
        acceleration: a.acceleration + b.acceleration,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const DT_S: f64 = 1e-4;

    /// Velocity and acceleration are those of the position, all the way.
    fn assert_consistent(duration_s: f64, sample: impl Fn(f64) -> PointReference) {
        for step in 1..(duration_s / DT_S) as usize {
            let at_s = step as f64 * DT_S;
            let (before, now, after) = (sample(at_s - DT_S), sample(at_s), sample(at_s + DT_S));
            let velocity = (after.position - before.position) / (2.0 * DT_S);
            assert!((velocity - now.velocity).norm() < 1e-4, "at {at_s}");
            // The change over a step is bounded: no step in the acceleration either.
            assert!((after.acceleration - now.acceleration).norm() < 0.03, "at {at_s}");
        }
    }

    fn vector(range: f64) -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-range..range).prop_map(Vector3::from)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]
        #[test]
        fn lifting_goes_up_first_and_without_steps(at in vector(0.3), to in vector(0.05), rise in 0.02..0.15f64) {
            let place = at + Vector3::new(to.x, to.y, rise);
            let sut = Lift::new(&PointReference::hold(at), &place, 1.0);
            assert_consistent(sut.duration_s(), |at_s| sut.sample(at_s));
            let early = sut.sample(SIDEWAYS_AFTER);
            prop_assert!((early.position - at).xy().norm() < 1e-12 && early.position.z > at.z + 0.2 * rise);
            prop_assert!((sut.sample(sut.duration_s()).position - place).norm() < 1e-9);
        }

        #[test]
        fn a_descent_starts_as_the_foot_moves_and_never_goes_faster_than_it_may(
            at in vector(0.3), velocity in vector(0.1), depth in 0.001..0.1f64, aside in vector(0.02),
        ) {
            let start = PointReference { velocity, ..PointReference::hold(at) };
            let deepest = at + Vector3::new(aside.x, aside.y, -depth);
            let sut = Descent::new(&start, &deepest, 0.05, 0.1, 0.4);
            prop_assert!((sut.sample(0.0).position - at).norm() < 1e-12);
            prop_assert!((sut.sample(0.0).velocity - velocity).norm() < 1e-9);
            assert_consistent(sut.duration_s(), |at_s| sut.sample(at_s));
            let end_s = sut.duration_s().max(0.4);
            prop_assert!((sut.sample(end_s).position - deepest).norm() < 1e-9);
            let calm = Descent::new(&PointReference::hold(at), &deepest, 0.05, 0.1, 0.4);
            for step in 0..200 {
                prop_assert!(calm.sample(f64::from(step) * 0.01).velocity.z.abs() < 0.05 + 1e-9);
            }
        }
    }
}
