//! A trajectory: up to 32 poses of torso and limbs, each with the time at which to be there.

use locoman_protocol::{
    geometry::isometry,
    messages::{self, Pose},
    validate::MAX_WAYPOINTS,
};
use nalgebra::Isometry3;

use super::bezier::Segment;
use crate::commander::PoseReference;

/// Where the bodies are to be at some time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Waypoint {
    /// Since engagement, s.
    pub time_s: f64,
    /// Displacement of the torso since engagement.
    pub torso: Isometry3<f64>,
    /// Displacements of the grippers or feet right, left since engagement.
    pub limbs: [Isometry3<f64>; 2],
    /// Openings of the grippers right, left; none: as they are.
    pub opening: [Option<f64>; 2],
}

impl Waypoint {
    /// Nothing is displaced.
    pub fn still(time_s: f64) -> Self {
        Self { time_s, torso: Isometry3::identity(), limbs: [Isometry3::identity(); 2], opening: [None; 2] }
    }
}

/// Where the bodies are and how they move, as displacements since engagement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Torso.
    pub torso: PoseReference,
    /// Grippers or feet right, left.
    pub limbs: [PoseReference; 2],
    /// Openings to go to right, left.
    pub opening: [Option<f64>; 2],
}

/// Poses to go through, at rest in each; before the first, nothing is displaced. Of fixed size: it is part of
/// a command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trajectory {
    waypoints: [Waypoint; MAX_WAYPOINTS],
    count: usize,
}

impl Trajectory {
    /// From 1 to [`MAX_WAYPOINTS`] poses at times that grow from above 0; none if they are not so.
    pub fn new(waypoints: impl IntoIterator<Item = Waypoint>) -> Option<Self> {
        let mut sut = Self { waypoints: [Waypoint::still(0.0); MAX_WAYPOINTS], count: 0 };
        let mut last_s = 0.0;
        for waypoint in waypoints {
            // A time that is no number is after none.
            if !waypoint.time_s.is_finite() || waypoint.time_s <= last_s {
                return None;
            }
            last_s = waypoint.time_s;
            *sut.waypoints.get_mut(sut.count)? = waypoint;
            sut.count += 1;
        }
        (sut.count > 0).then_some(sut)
    }

    /// From a message; a body that a waypoint leaves out stays where the one before has it. None if the message
    /// is not one that [`locoman_protocol::validate::validate_trajectory`] accepts.
    pub fn from_message(message: &messages::Trajectory) -> Option<Self> {
        let mut last = Waypoint::still(0.0);
        let there = |pose: &Option<Pose>, before: Isometry3<f64>| {
            pose.as_ref().and_then(|pose| isometry(pose).ok()).unwrap_or(before)
        };
        Self::new(message.waypoints.iter().map(|waypoint| {
            last = Waypoint {
                time_s: waypoint.time_s,
                torso: there(&waypoint.torso, last.torso),
                limbs: [
                    there(&waypoint.right_limb, last.limbs[0]),
                    there(&waypoint.left_limb, last.limbs[1]),
                ],
                opening: [waypoint.right_opening, waypoint.left_opening],
            };
            last
        }))
    }

    /// The poses.
    pub fn waypoints(&self) -> &[Waypoint] {
        &self.waypoints[..self.count]
    }

    /// When the last pose is reached, s.
    pub fn duration_s(&self) -> f64 {
        self.waypoints().last().map_or(0.0, |waypoint| waypoint.time_s)
    }

    /// Where the bodies are after some time.
    pub fn at(&self, time_s: f64) -> Sample {
        let waypoints = self.waypoints();
        let next = waypoints.partition_point(|waypoint| waypoint.time_s <= time_s).min(self.count - 1);
        let start = match next.checked_sub(1) {
            Some(previous) => waypoints[previous],
            None => Waypoint::still(0.0),
        };
        let end = &waypoints[next];
        let elapsed_s = time_s - start.time_s;
        let between = |from: &Isometry3<f64>, to: &Isometry3<f64>| {
            Segment::new(from, to, end.time_s - start.time_s).sample(elapsed_s)
        };
        Sample {
            torso: between(&start.torso, &end.torso),
            limbs: [0, 1].map(|side| between(&start.limbs[side], &end.limbs[side])),
            opening: end.opening,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn there(time_s: f64, x_m: f64) -> Waypoint {
        Waypoint { torso: Isometry3::translation(x_m, 0.0, 0.0), ..Waypoint::still(time_s) }
    }

    #[test]
    fn it_passes_through_its_poses_and_stays_at_the_last() {
        let sut = Trajectory::new([there(1.0, 0.1), there(3.0, -0.1)]).unwrap();
        let x = |time_s| sut.at(time_s).torso.point.position.x;
        let expected =
            [(-1.0, 0.0), (0.0, 0.0), (0.5, 0.05), (1.0, 0.1), (2.0, 0.0), (3.0, -0.1), (9.0, -0.1)];
        for (time_s, position) in expected {
            assert!((x(time_s) - position).abs() < 1e-12, "{time_s}");
        }
        assert_eq!(sut.duration_s(), 3.0);
    }

    #[test]
    fn times_that_do_not_grow_and_counts_out_of_range_are_refused() {
        assert!(Trajectory::new([]).is_none());
        assert!(Trajectory::new([there(0.0, 0.1)]).is_none());
        assert!(Trajectory::new([there(f64::NAN, 0.1)]).is_none());
        assert!(Trajectory::new([there(1.0, 0.1), there(1.0, 0.2)]).is_none());
        let many = |count: u32| (1..=count).map(|i| there(f64::from(i), 0.0));
        assert!(Trajectory::new(many(32)).is_some());
        assert!(Trajectory::new(many(33)).is_none());
    }
}
