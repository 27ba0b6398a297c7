//! Where things are while one picture is taken.
//!
//! With a global shutter that is one pose for each slice of the exposure. Where rows are exposed one after another
//! there would be eight poses for each of a thousand rows: they are taken from knots instead.

use nalgebra::Isometry3;

use super::shutter::{SLICES, Shutter};

/// The poses of something that moves, over one picture, in the camera's frame.
#[derive(Debug, Clone)]
pub enum Course {
    /// One for each slice of the exposure, for all rows alike.
    Slices(Vec<Isometry3<f64>>),
    /// At equal steps of time; in between it moves straight on.
    Knots {
        /// Time of the first.
        begin_s: f64,
        /// From one to the next.
        step_s: f64,
        /// At least two.
        poses: Vec<Isometry3<f64>>,
    },
}

/// Knots are no farther apart than this: at 10 m/s^2 the straight way between them is wrong by at most 0.3 um,
/// and at a full turn a second by 3e-7 of a shell's size.
const MOST_STEP_S: f64 = 5e-4;

impl Course {
    /// The courses of several things over a picture; `world_from_things(t_s)` are their poses at a time.
    ///
    /// What stands still while rows are exposed one after another is seen as by a global shutter.
    pub fn of_all(
        shutter: &Shutter<'_>,
        world_from_things: impl Fn(f64) -> Vec<Isometry3<f64>>,
    ) -> Vec<Self> {
        let (begin_s, end_s) = shutter.span_s();
        let steps = ((end_s - begin_s) / MOST_STEP_S).ceil().max(1.0);
        let step_s = (end_s - begin_s) / steps;
        let times: Vec<f64> = if shutter.is_global() {
            (0..SLICES).map(|slice| shutter.slice_s(0.0, slice)).collect()
        } else {
            (0..=steps as usize).map(|knot| begin_s + step_s * knot as f64).collect()
        };
        let at_times: Vec<Vec<Isometry3<f64>>> = times.iter().map(|t_s| world_from_things(*t_s)).collect();
        let things = at_times.first().map_or(0, Vec::len);
        let camera_from_world = shutter.camera.world_from_camera.inverse();
        (0..things)
            .map(|thing| {
                let world_from_thing = at_times.iter().filter_map(|poses| poses.get(thing));
                let still = world_from_thing.clone().all(|pose| Some(pose) == at_times[0].get(thing));
                let poses = world_from_thing.map(|pose| camera_from_world * pose);
                match (shutter.is_global(), still) {
                    (true, _) => Self::Slices(poses.collect()),
                    (false, true) => Self::Slices(poses.cycle().take(SLICES).collect()),
                    (false, false) => Self::Knots { begin_s, step_s, poses: poses.collect() },
                }
            })
            .collect()
    }

    /// All poses that it passes through.
    pub fn poses(&self) -> &[Isometry3<f64>] {
        match self {
            Self::Slices(poses) | Self::Knots { poses, .. } => poses,
        }
    }
}
