//! What the tests of this crate share: a rig, poses as they are worn, and a plain renderer.

mod hand;
mod sightings;

use nalgebra::{Isometry3, Matrix3, Point2, Point3, Rotation3, UnitQuaternion, Vector2, Vector3};

use crate::camera::{Camera, Distortion};
use crate::detect::tag_bitmap;
use crate::image::GrayImage;
use crate::rig::Rig;
use crate::shells::{ShellSet, design};
pub use hand::Hand;
pub use sightings::observe;

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

/// Deterministic random numbers: a linear congruence, twelve uniforms a normal number.
pub struct Noise(pub u64);

impl Noise {
    /// From 0 to 1.
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Zero mean, unit variance.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// One tag before one camera, exactly: the lens, the pixel's area, a Gaussian blur, noise.
pub struct TagPicture {
    /// Who looks.
    pub camera: Camera,
    /// Where the tag is.
    pub camera_from_tag: Isometry3<f64>,
    /// Side of the black square.
    pub size_m: f64,
    /// Its number.
    pub id: u32,
    /// Standard deviation of the blur.
    pub blur_px: f64,
    /// How far the tag moves to the right while it is exposed.
    pub motion_px: f64,
    /// Standard deviation of the noise; white is 160 above black.
    pub noise_levels: f64,
}

impl TagPicture {
    /// Where its corners are.
    pub fn corners_px(&self) -> [Point2<f64>; 4] {
        let h = self.size_m / 2.0;
        [(-h, -h), (h, -h), (h, h), (-h, h)].map(|(x, y)| {
            self.camera.project(&(self.camera_from_tag * Point3::new(x, y, 0.0))).expect("before the camera")
        })
    }

    /// The image: the tag on white paper that fills its surroundings.
    pub fn render(&self, seed: u64) -> GrayImage {
        /// Samples along a pixel's side, and along the blur, in standard deviations.
        const FINE: usize = 9;
        const REACH_SIGMAS: f64 = 3.5;
        const BLACK: f64 = 40.0;
        const CONTRAST: f64 = 160.0;
        let bitmap = tag_bitmap(self.id).expect("known id");
        let corners = self.corners_px();
        let low = |axis: usize| corners.iter().map(|c| c[axis]).fold(f64::INFINITY, f64::min);
        let high = |axis: usize| corners.iter().map(|c| c[axis]).fold(0.0, f64::max);
        let margin = 0.25 * (high(0) - low(0)).max(high(1) - low(1)) + 6.0;
        let (width, height) = (self.camera.width as usize, self.camera.height as usize);
        let span = |axis: usize, size: usize| {
            ((low(axis) - margin).max(0.0) as usize)..((high(axis) + margin).max(0.0) as usize).min(size)
        };
        let (columns, rows) = (span(0, width), span(1, height));
        let (across, down) = (columns.len() * FINE, rows.len() * FINE);
        let tag_from_camera = self.camera_from_tag.inverse();
        let eye = tag_from_camera * Point3::origin();
        let cell = self.size_m / 8.0;
        let mut fine = vec![0.0f64; across * down];
        for (at, light) in fine.iter_mut().enumerate() {
            let place = |k: usize, start: usize| start as f64 + (k as f64 + 0.5) / FINE as f64 - 0.5;
            let pixel = Point2::new(place(at % across, columns.start), place(at / across, rows.start));
            let ray = tag_from_camera.rotation * self.camera.unproject(&pixel);
            let hit = eye - ray * (eye.z / ray.z);
            let (column, row) = ((hit.x / cell + 5.0).floor(), (5.0 - hit.y / cell).floor());
            let inside = (0.0..10.0).contains(&column) && (0.0..10.0).contains(&row);
            let white = !inside || bitmap.row(row as u32)[column as usize] != 0;
            *light = f64::from(u8::from(white));
        }
        let sigma = self.blur_px * FINE as f64;
        let reach = (REACH_SIGMAS * sigma).ceil() as isize;
        let kernel: Vec<f64> = (-reach..=reach).map(|k| (-0.5 * (k as f64 / sigma).powi(2)).exp()).collect();
        let moves = (0.5 * self.motion_px * FINE as f64).round() as isize;
        let streak = vec![1.0; (2 * moves + 1) as usize];
        let blurred =
            |lights: &[f64], weights: &[f64], stride: usize, count: usize, at: usize, k: usize| -> f64 {
                let reach = (weights.len() / 2) as isize;
                let total: f64 = weights.iter().sum();
                let sum: f64 = weights
                    .iter()
                    .zip(-reach..=reach)
                    .map(|(w, offset)| {
                        let other = k.saturating_add_signed(offset).min(count - 1);
                        w * lights[at - k * stride + other * stride]
                    })
                    .sum();
                sum / total
            };
        let along = |lights: &[f64], weights: &[f64]| -> Vec<f64> {
            (0..lights.len()).map(|at| blurred(lights, weights, 1, across, at, at % across)).collect()
        };
        let rowwise = along(&along(&fine, &streak), &kernel);
        let fine: Vec<f64> =
            (0..fine.len()).map(|at| blurred(&rowwise, &kernel, across, down, at, at / across)).collect();
        let mut noise = Noise(seed);
        let mut pixels = vec![(BLACK + CONTRAST) as u8; width * height];
        for (j, y) in rows.enumerate() {
            for (i, x) in columns.clone().enumerate() {
                let line = |k: usize| &fine[(j * FINE + k) * across + i * FINE..][..FINE];
                let mean = (0..FINE).flat_map(line).sum::<f64>() / (FINE * FINE) as f64;
                let grey = BLACK + CONTRAST * mean + self.noise_levels * noise.normal();
                pixels[y * width + x] = grey.round().clamp(0.0, 255.0) as u8;
            }
        }
        GrayImage::new(self.camera.width, self.camera.height, pixels).expect("size")
    }
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
