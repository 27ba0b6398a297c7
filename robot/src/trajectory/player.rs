//! Plays a trajectory at its own pace, or lets it come to a stand along its way and go on.

use super::path::{Sample, Trajectory};
use crate::commander::PoseReference;

/// Time in which the pace goes from full to none, s. [E] At half the usual accelerations' limits.
const STOP_S: f64 = 0.25;

/// A trajectory that is being played.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Player {
    trajectory: Trajectory,
    time_s: f64,
    /// Seconds of trajectory in a second, 0 to 1.
    pace: f64,
    /// Change of the pace, 1/s.
    quickening: f64,
}

impl Player {
    /// At its beginning, at full pace: a trajectory starts from rest.
    pub fn new(trajectory: &Trajectory) -> Self {
        Self { trajectory: *trajectory, time_s: 0.0, pace: 1.0, quickening: 0.0 }
    }

    /// One step. Unless it runs, the pace goes down to a stand; the way stays the same.
    pub fn advance(&mut self, running: bool, dt_s: f64) {
        let step = dt_s / STOP_S;
        let before = self.pace;
        self.pace = if running { (before + step).min(1.0) } else { (before - step).max(0.0) };
        self.quickening = (self.pace - before) / dt_s;
        self.time_s += 0.5 * (before + self.pace) * dt_s;
    }

    /// Where the bodies should be now.
    pub fn sample(&self) -> Sample {
        let Sample { torso, limbs, opening } = self.trajectory.at(self.time_s);
        let paced = |body: &PoseReference| body.paced(self.pace, self.quickening);
        Sample { torso: paced(&torso), limbs: limbs.each_ref().map(paced), opening }
    }

    /// Time along the trajectory, s.
    pub fn time_s(&self) -> f64 {
        self.time_s
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::*;
    use crate::trajectory::Waypoint;

    const DT_S: f64 = 0.0025;

    fn sut() -> Player {
        let end = Waypoint { torso: Isometry3::translation(0.1, 0.0, 0.0), ..Waypoint::still(2.0) };
        Player::new(&Trajectory::new([end]).unwrap())
    }

    #[test]
    fn at_full_pace_its_time_is_the_robots() {
        let mut sut = sut();
        for _ in 0..400 {
            sut.advance(true, DT_S);
        }
        assert!((sut.time_s() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn interrupted_it_comes_to_a_stand_without_a_step_in_velocity_and_goes_on() {
        let mut sut = sut();
        let mut before = sut.sample().torso.point;
        let mut stood = false;
        for tick in 0..2000 {
            sut.advance(!(300..600).contains(&tick), DT_S);
            let now = sut.sample().torso.point;
            // Its own greatest acceleration is 0.15 m/s²; braking from 0.075 m/s in 0.25 s adds 0.3.
            assert!((now.velocity - before.velocity).norm() <= 0.5 * DT_S, "{tick}");
            assert!((now.position - before.position).norm() <= 0.08 * DT_S, "{tick}");
            stood |= tick == 500 && now.velocity.norm() == 0.0;
            before = now;
        }
        assert!(stood && (before.position.x - 0.1).abs() < 1e-12);
    }
}
