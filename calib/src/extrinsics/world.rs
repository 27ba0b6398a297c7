//! Where the world is: nobody sees it, so somebody says what lies at its origin.

use locoman_vision::rig::Rig;
use nalgebra::Isometry3;

use super::solve::Solved;
use crate::bundle::Motion;

/// What sets the world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum World {
    /// The first camera stays where its rig file has it.
    FirstCamera,
    /// The body at a moment (seconds after the recording's begin): a board on the floor has z up; `world_from_body` is
    /// where it then is.
    Body {
        /// When.
        at_s: f64,
        /// Where it is then.
        world_from_body: Isometry3<f64>,
    },
}

impl World {
    /// The rig in this world; `None` if the body has no pose at that moment.
    pub fn place(&self, solved: &Solved) -> Option<Rig> {
        let mut rig = solved.rig.clone();
        let Self::Body { at_s, world_from_body } = self else { return Some(rig) };
        let before = match &solved.problem.motion {
            Motion::Path(path) => path.pose_at(*at_s)?,
            Motion::Instants(poses) => {
                let sightings = solved.problem.sightings.iter();
                let near = sightings
                    .min_by(|a, b| (a.capture_s - at_s).abs().total_cmp(&(b.capture_s - at_s).abs()))?;
                *poses.get(near.instant)?
            }
        };
        let world_from_old = world_from_body * before.inverse();
        for camera in &mut rig.cameras {
            camera.world_from_camera = world_from_old * camera.world_from_camera;
        }
        Some(rig)
    }
}
