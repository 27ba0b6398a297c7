//! All joints on their way to one posture, and from there to another.

use crate::{commander::PointMotion, joints::JointVector, wbc::PointReference};

/// Two motions of all joints, one after the other.
#[derive(Debug, Clone, Copy)]
pub struct PostureMotion {
    /// Legs, then arms.
    first: [PointMotion; 6],
    second: [PointMotion; 6],
}

impl PostureMotion {
    /// From rest to rest at `via`, then to rest at `to`.
    pub fn new(from: &JointVector, via: &JointVector, to: &JointVector, first_s: f64, second_s: f64) -> Self {
        let stage = |from: &JointVector, to: &JointVector, duration_s: f64| {
            std::array::from_fn(|limb| {
                let start = PointReference::hold(from.fixed_rows::<3>(3 * limb).into_owned());
                PointMotion::new(&start, &to.fixed_rows::<3>(3 * limb).into_owned(), duration_s)
            })
        };
        Self { first: stage(from, via, first_s), second: stage(via, to, second_s) }
    }

    /// How long both take, s.
    pub fn duration_s(&self) -> f64 {
        self.first[0].duration_s() + self.second[0].duration_s()
    }

    /// Positions and velocities after some time.
    pub fn sample(&self, elapsed_s: f64) -> (JointVector, JointVector) {
        let first_s = self.first[0].duration_s();
        let (stage, at_s) =
            if elapsed_s < first_s { (&self.first, elapsed_s) } else { (&self.second, elapsed_s - first_s) };
        let (mut position, mut velocity) = (JointVector::zeros(), JointVector::zeros());
        for (limb, motion) in stage.iter().enumerate() {
            let sample = motion.sample(at_s);
            position.fixed_rows_mut::<3>(3 * limb).copy_from(&sample.position);
            velocity.fixed_rows_mut::<3>(3 * limb).copy_from(&sample.velocity);
        }
        (position, velocity)
    }
}
