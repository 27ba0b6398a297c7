//! What the tests of this crate share: a rig, poses as they are worn, and a plain renderer.

mod noise;

use nalgebra::{Isometry3, Matrix3, Point2, Point3, Rotation3, UnitQuaternion, Vector2, Vector3};

use crate::camera::{Camera, Distortion};
use crate::detect::tag_bitmap;
use crate::image::GrayImage;
use crate::rig::Rig;
use crate::shells::{ShellSet, design};
pub use noise::{Noise, observe};

/// Two stereo pairs of 1280x720 pixels in front of the operator, with barrel distortion.
pub fn rig() -> Rig {
    let camera = |id: &str, y: f64| Camera {
        id: id.to_owned(),
        width: 1280,
        height: 720,
        focal_px: Vector2::new(880.0, 882.0),
        center_px: Vector2::new(641.5, 357.0),
        distortion: Distortion::RadTan([-0.09, 0.03, 3e-4, -2e-4, 0.0, 0.0, 0.0, 0.0]),
        world_from_camera: looking(Point3::new(1.15, y, 1.4), Point3::new(0.3, y * 0.15, 1.12)),
        line_time_s: 0.0,
    };
    Rig::new(vec![
        camera("right_a", -0.56),
        camera("right_b", -0.44),
        camera("left_a", 0.44),
        camera("left_b", 0.56),
    ])
}

/// A camera at a point that looks at another, upright.
fn looking(eye: Point3<f64>, target: Point3<f64>) -> Isometry3<f64> {
    let z = (target - eye).normalize();
    let x = z.cross(&Vector3::z()).normalize();
    let axes = Matrix3::from_columns(&[x, z.cross(&x), z]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    Isometry3::from_parts(eye.coords.into(), rotation)
}

/// Where the shells are while the operator holds still, in the order of the standard shells.
pub fn worn() -> Vec<Isometry3<f64>> {
    let pose = |x: f64, y: f64, z: f64, axis_angle: [f64; 3]| {
        Isometry3::new(Vector3::new(x, y, z), Vector3::from(axis_angle))
    };
    vec![
        pose(0.12, 0.0, 1.27, [0.0, 0.05, 0.0]),
        pose(0.45, -0.22, 1.08, [0.1, -0.2, 0.1]),
        pose(0.45, 0.22, 1.08, [-0.1, -0.2, -0.1]),
        pose(0.51, -0.155, 1.055, [0.0, -0.1, 0.5]),
        pose(0.51, 0.155, 1.055, [0.0, -0.1, -0.5]),
    ]
}

/// The standard shells.
pub fn shells() -> ShellSet {
    design::standard()
}

/// What a camera sees of the shells: nearer tags cover farther ones; nothing else is drawn.
pub fn render(camera: &Camera, shells: &ShellSet, poses: &[Isometry3<f64>]) -> GrayImage {
    const BACKGROUND: u8 = 110;
    let (width, height) = (camera.width as usize, camera.height as usize);
    let mut pixels = vec![BACKGROUND; width * height];
    let mut tags: Vec<(Isometry3<f64>, f64, u32)> = Vec::new();
    for (shell, pose) in shells.shells.iter().zip(poses) {
        for tag in &shell.tags {
            let camera_from_tag = camera.world_from_camera.inverse() * pose * tag.shell_from_tag;
            let center = camera_from_tag.translation.vector;
            if (camera_from_tag.rotation * Vector3::z()).dot(&center) < -0.1 * center.norm() {
                tags.push((camera_from_tag, tag.size_m, tag.id));
            }
        }
    }
    tags.sort_by(|a, b| b.0.translation.z.total_cmp(&a.0.translation.z));
    for (camera_from_tag, size_m, id) in tags {
        draw(camera, &camera_from_tag, size_m, id, &mut pixels);
    }
    GrayImage::new(camera.width, camera.height, pixels).expect("size")
}

fn draw(camera: &Camera, camera_from_tag: &Isometry3<f64>, size_m: f64, id: u32, pixels: &mut [u8]) {
    const SAMPLES: usize = 5;
    const INK: f64 = 40.0;
    const PAPER: f64 = 200.0;
    let bitmap = tag_bitmap(id).expect("known id");
    let half = size_m * design::MARGIN_FACTOR / 2.0;
    let corners = [(-half, -half), (half, -half), (half, half), (-half, half)]
        .map(|(x, y)| camera.project(&(camera_from_tag * Point3::new(x, y, 0.0))));
    let corners: Vec<Point2<f64>> = corners.into_iter().flatten().collect();
    if corners.len() < 4 {
        return;
    }
    let bound = |axis: usize, size: u32| {
        let min = corners.iter().map(|c| c[axis]).fold(f64::INFINITY, f64::min).floor();
        let max = corners.iter().map(|c| c[axis]).fold(0.0, f64::max).ceil() + 1.0;
        min.max(0.0) as u32..max.min(f64::from(size)) as u32
    };
    let tag_from_camera = camera_from_tag.inverse();
    let eye = tag_from_camera * Point3::origin();
    for y in bound(1, camera.height) {
        for x in bound(0, camera.width) {
            let (mut sum, mut hits) = (0.0, 0.0);
            for k in 0..SAMPLES * SAMPLES {
                let offset = |i: usize| (i as f64 + 0.5) / SAMPLES as f64 - 0.5;
                let pixel =
                    Point2::new(f64::from(x) + offset(k % SAMPLES), f64::from(y) + offset(k / SAMPLES));
                let ray = tag_from_camera.rotation * camera.unproject(&pixel);
                let hit = eye - ray * (eye.z / ray.z);
                let cell = size_m / 8.0;
                let (column, row) = ((hit.x / cell + 5.0).floor(), (5.0 - hit.y / cell).floor());
                if (0.0..10.0).contains(&column) && (0.0..10.0).contains(&row) {
                    sum += if bitmap.row(row as u32)[column as usize] == 0 { INK } else { PAPER };
                    hits += 1.0;
                }
            }
            let pixel = &mut pixels[(y * camera.width + x) as usize];
            let rest = (SAMPLES * SAMPLES) as f64 - hits;
            *pixel = ((sum + rest * f64::from(*pixel)) / (SAMPLES * SAMPLES) as f64).round() as u8;
        }
    }
}
