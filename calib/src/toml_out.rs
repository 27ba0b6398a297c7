//! Rig and shells files as the tracker reads them, written with what was found.

use std::fmt::Write;

use locoman_vision::camera::{Camera, Distortion};
use locoman_vision::rig::{CameraSource, Half, Rig};
use locoman_vision::shells::ShellSet;
use nalgebra::Isometry3;

/// The text of a rig file; `comment` goes before it, line by line.
pub fn rig_text(rig: &Rig, comment: &str) -> String {
    let mut text = commented(comment);
    for (k, camera) in rig.cameras.iter().enumerate() {
        text.push_str(&camera_text(camera));
        if let Some(group) =
            rig.sync_groups.get(k).filter(|_| rig.sync_groups.iter().any(|group| *group != 0))
        {
            let _ = writeln!(text, "sync = \"group_{group}\"");
        }
        if let Some(source) = rig.sources.get(k).and_then(source_text) {
            let _ = writeln!(text, "source = {source}");
        }
        text.push('\n');
    }
    text
}

/// One `[[camera]]`.
fn camera_text(camera: &Camera) -> String {
    let (model, coefficients): (&str, &[f64]) = match &camera.distortion {
        Distortion::Pinhole => ("pinhole", &[]),
        Distortion::RadTan(k) if k[5..].iter().any(|k| *k != 0.0) => ("radtan", k),
        Distortion::RadTan(k) if k[4] != 0.0 => ("radtan", &k[..5]),
        Distortion::RadTan(k) => ("radtan", &k[..4]),
        Distortion::Fisheye(k) => ("fisheye", k),
    };
    let mut text = format!(
        "[[camera]]\nid = \"{}\"\nwidth = {}\nheight = {}\nmodel = \"{model}\"\nfx = {:.4}\nfy = {:.4}\ncx = {:.4}\ncy = {:.4}\n",
        camera.id,
        camera.width,
        camera.height,
        camera.focal_px.x,
        camera.focal_px.y,
        camera.center_px.x,
        camera.center_px.y
    );
    if !coefficients.is_empty() {
        let list: Vec<String> = coefficients.iter().map(|k| format!("{k:.8}")).collect();
        let _ = writeln!(text, "distortion = [{}]", list.join(", "));
    }
    if camera.line_time_s > 0.0 {
        let _ = writeln!(text, "line_time_us = {:.4}", 1e6 * camera.line_time_s);
    }
    let _ = writeln!(text, "world_from_camera = {}", pose_text(&camera.world_from_camera));
    text
}

/// The text of a shells file.
pub fn shells_text(set: &ShellSet, comment: &str) -> String {
    let mut text = commented(comment);
    let _ = writeln!(text, "family = \"{}\"", set.family);
    for shell in &set.shells {
        let _ = writeln!(text, "\n[[shell]]\nname = \"{}\"", shell.name);
        for tag in &shell.tags {
            let pose = pose_text(&tag.shell_from_tag);
            let _ = writeln!(
                text,
                "  [[shell.tag]]\n  id = {}\n  size = {:.6}\n  shell_from_tag = {pose}",
                tag.id, tag.size_m
            );
        }
    }
    text
}

fn commented(comment: &str) -> String {
    comment.lines().map(|line| format!("# {line}\n")).collect::<String>() + "\n"
}

/// Nine digits: a nanometre, and a rotation to a billionth.
fn pose_text(pose: &Isometry3<f64>) -> String {
    let (t, q) = (pose.translation.vector, pose.rotation.quaternion());
    format!(
        "{{ xyz = [{:.9}, {:.9}, {:.9}], quat = [{:.9}, {:.9}, {:.9}, {:.9}] }}",
        t.x, t.y, t.z, q.w, q.i, q.j, q.k
    )
}

/// `None` of a camera without a source.
fn source_text(source: &CameraSource) -> Option<String> {
    let mut parts = Vec::new();
    let quoted = |path: &std::path::Path| toml::Value::String(path.display().to_string()).to_string();
    if let Some(device) = &source.device {
        parts.push(format!("device = {}", quoted(device)));
    }
    if let Some(file) = &source.file {
        parts.push(format!("file = {}", quoted(file)));
    }
    if let Some(url) = &source.url {
        parts.push(format!("url = {}", toml::Value::String(url.clone())));
    }
    if let Some(half) = source.half {
        parts.push(format!("half = \"{}\"", if half == Half::Left { "left" } else { "right" }));
    }
    if source.remote {
        parts.push("remote = true".to_owned());
    }
    (!parts.is_empty()).then(|| format!("{{ {} }}", parts.join(", ")))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use locoman_vision::shells::ShellSet;

    use super::*;

    #[test]
    fn what_is_written_is_read_again_as_it_was() {
        let folder = tempfile::tempdir().expect("a folder");
        let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs");
        let mut rig = Rig::load(&configs.join("rigs/two_zed_pairs_rolling_720p.toml")).expect("valid");
        rig.sources[0].device = Some("/dev/video0".into());
        rig.sources[0].half = Some(Half::Right);
        let path = folder.path().join("rig.toml");
        crate::file::write_whole(&path, &rig_text(&rig, "two\nlines")).expect("written");
        let again = Rig::load(&path).expect("valid");
        assert_eq!((again.sources, again.sync_groups), (rig.sources.clone(), rig.sync_groups.clone()));
        for (a, b) in again.cameras.iter().zip(&rig.cameras) {
            assert!((a.world_from_camera.inverse() * b.world_from_camera).translation.vector.norm() < 1e-8);
            assert!(
                (a.line_time_s - b.line_time_s).abs() < 1e-9 && a.distortion == b.distortion && a.id == b.id
            );
        }
        let set = ShellSet::load(&configs.join("shells/standard.toml")).expect("valid");
        let path = folder.path().join("shells.toml");
        crate::file::write_whole(&path, &shells_text(&set, "")).expect("written");
        let again = ShellSet::load(&path).expect("valid");
        for (a, b) in again.shells.iter().flat_map(|s| &s.tags).zip(set.shells.iter().flat_map(|s| &s.tags)) {
            let error = a.shell_from_tag.inverse() * b.shell_from_tag;
            assert!(a.id == b.id && error.translation.vector.norm() < 2e-9 && error.rotation.angle() < 1e-8);
        }
        let left: Vec<_> = std::fs::read_dir(folder.path()).expect("listed").collect();
        assert_eq!(left.len(), 2, "nothing half-written is left");
    }
}
