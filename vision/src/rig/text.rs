//! A rig as the text of its file.

use std::fmt::Write;

use toml::Spanned;

use super::calibration::numbers_hash;
use super::{Rig, RigFile};
use crate::camera::{Camera, Distortion};

impl Rig {
    /// The file's text; reading it gives this rig again, to nine digits. Its calibration gets the hash of the numbers
    /// as they stand in the text. Live sources are left to the person.
    pub fn to_toml(&self) -> String {
        let cameras = self.cameras.iter().zip(&self.serials);
        let cameras: String =
            cameras.map(|(camera, serial)| camera_text(camera, serial.as_deref())).collect();
        let Some(calibration) = &self.calibration else { return cameras };
        let mut text = String::from("[calibration]\n");
        if let Some(date) = &calibration.date {
            let _ = writeln!(text, "date = \"{date}\"");
        }
        if let Some(days) = calibration.max_age_days {
            let _ = writeln!(text, "max_age_days = {days}");
        }
        if let Some(rms_px) = calibration.rms_px {
            let _ = writeln!(text, "rms_px = {rms_px}");
        }
        // A rig whose text cannot be read again (a camera without a sensible id) is refused when it is; no hash then.
        if let Ok(file) = toml::from_str::<RigFile>(&cameras) {
            let _ = writeln!(text, "hash = \"{}\"", numbers_hash(file.camera.iter().map(Spanned::get_ref)));
        }
        format!("{text}\n{cameras}")
    }
}

fn camera_text(camera: &Camera, serial: Option<&str>) -> String {
    let (model, coefficients): (&str, &[f64]) = match &camera.distortion {
        Distortion::Pinhole => ("pinhole", &[]),
        Distortion::RadTan(k) if k[5..].iter().all(|number| *number == 0.0) => ("radtan", &k[..5]),
        Distortion::RadTan(k) => ("radtan", k),
        Distortion::Fisheye(k) => ("fisheye", k),
    };
    let list = |numbers: &[f64]| numbers.iter().map(|n| clean(*n).to_string()).collect::<Vec<_>>().join(", ");
    let serial = serial.map(|serial| format!("serial = \"{serial}\"\n")).unwrap_or_default();
    let q = camera.world_from_camera.rotation.quaternion();
    let q = if q.w < 0.0 { -q } else { *q };
    let line_time = if camera.line_time_s > 0.0 {
        format!("line_time_us = {}\n", clean(1e6 * camera.line_time_s))
    } else {
        String::new()
    };
    format!(
        "[[camera]]\nid = \"{}\"\n{serial}width = {}\nheight = {}\nmodel = \"{model}\"\nfx = {}\nfy = {}\ncx = {}\ncy = {}\n\
         distortion = [{}]\n{line_time}world_from_camera = {{ xyz = [{}], quat = [{}] }}\n\n",
        camera.id,
        camera.width,
        camera.height,
        clean(camera.focal_px.x),
        clean(camera.focal_px.y),
        clean(camera.center_px.x),
        clean(camera.center_px.y),
        list(coefficients),
        list(camera.world_from_camera.translation.vector.as_slice()),
        list(&[q.w, q.i, q.j, q.k]),
    )
}

/// Nine digits after the point, and no negative zero.
fn clean(number: f64) -> f64 {
    (number * 1e9).round() / 1e9 + 0.0
}
