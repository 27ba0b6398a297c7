//! Reads rig and shells files as the tracker does, and says in words what they describe.

use std::fmt::Write;

use locoman_vision::rig::Rig;
use locoman_vision::shells::ShellSet;

/// One line a camera: name, size, field of view, place.
pub fn describe_rig(rig: &Rig) -> String {
    let mut text = String::new();
    for camera in &rig.cameras {
        let ray = |x: f64| camera.unproject(&[x, camera.center_px.y].into());
        let right_px = f64::from(camera.width) - 1.0;
        let view_deg = ray(0.0).angle(&ray(right_px)).to_degrees();
        let place = camera.world_from_camera.translation.vector;
        let _ = writeln!(
            text,
            "{}: {}x{} px, {view_deg:.0} deg wide, at ({:.3}, {:.3}, {:.3}) m",
            camera.id, camera.width, camera.height, place.x, place.y, place.z
        );
    }
    text
}

/// One line a shell: name, number and size of tags, radius.
pub fn describe_shells(set: &ShellSet) -> String {
    let mut text = String::new();
    for shell in &set.shells {
        let size = |pick: fn(f64, f64) -> f64, start: f64| {
            1e3 * shell.tags.iter().map(|tag| tag.size_m).fold(start, pick)
        };
        let _ = writeln!(
            text,
            "{}: {} tags of {:.1} to {:.1} mm, radius {:.0} mm",
            shell.name,
            shell.tags.len(),
            size(f64::min, f64::INFINITY),
            size(f64::max, 0.0),
            1e3 * shell.radius_m()
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn the_standard_shells_are_described() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/shells/standard.toml");
        let text = describe_shells(&ShellSet::load(&path).expect("valid"));
        assert!(text.contains("right_thumb: 13 tags of 14.0 to 14.0 mm"), "{text}");
        assert_eq!(text.lines().count(), 5);
    }
}
