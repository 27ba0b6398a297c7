//! The tracker's outcome as a message.

use locoman_protocol::geometry;
use locoman_protocol::messages::{self, ShellPose, Verdict};
use locoman_vision::shells::ShellSet;
use locoman_vision::track::{self, TrackUpdate};
use nalgebra::Vector3;

/// Poses and durations of one instant; header, age and cameras are the caller's.
pub fn report(shells: &ShellSet, update: &TrackUpdate) -> messages::Tracking {
    let shells = shells.shells.iter().zip(&update.shells).map(|(shell, seen)| ShellPose {
        shell: shell.name.clone(),
        verdict: match seen.verdict {
            track::Verdict::Tracked => Verdict::Tracked,
            track::Verdict::Predicted => Verdict::Predicted,
            track::Verdict::Lost => Verdict::Lost,
        }
        .into(),
        pose: seen.world_from_shell.as_ref().map(geometry::pose),
        // Symmetric, so the order of storage does not matter.
        covariance: seen.covariance.iter().copied().collect(),
        rms_px: seen.rms_px,
        tags: u32::try_from(seen.tags).unwrap_or(u32::MAX),
        cameras: u32::try_from(seen.cameras).unwrap_or(u32::MAX),
        velocity_m_s: Some(vector(&seen.velocity_m_s)),
        rate_rad_s: Some(vector(&seen.rate_rad_s)),
    });
    messages::Tracking {
        shells: shells.collect(),
        decode_ns: update.decode_ns,
        detect_ns: update.detect_ns,
        solve_ns: update.solve_ns,
        ..messages::Tracking::default()
    }
}

fn vector(v: &Vector3<f64>) -> messages::Vector3 {
    messages::Vector3 { x: v.x, y: v.y, z: v.z }
}
