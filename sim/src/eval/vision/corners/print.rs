//! Pictures of single tags, as exact as corners are to be measured: each pixel is the mean of 64 samples of the print,
//! after the lens's blur and the motion's on the same fine grid.

use locoman_vision::camera::{Camera, Distortion};
use nalgebra::{Isometry3, Matrix3, Point2, Point3, Rotation3, UnitQuaternion, Vector2, Vector3};

use super::{Case, unit};
use crate::operator::ink::{self, Bitmap, CELLS};
use crate::operator::sensor::{gaussian, mix};
use crate::operator::studio::Picture;

/// Standard deviation of the noise, grey levels.
pub const NOISE: f64 = 2.0;
/// Grey levels of black and white ink, and of what is behind the tag.
const BLACK: f32 = 40.0;
const WHITE: f32 = 200.0;
const BEHIND: f32 = 120.0;
/// Standard deviation of the lens's blur, pixels.
const BLUR_PX: f64 = 0.7;
/// Samples along each side of a pixel.
const FINE: usize = 8;
/// Side of the tag, metres: any would do.
const SIZE_M: f64 = 0.03;

/// A camera for one tag of this side, without distortion; its image leaves room for the tag however it is turned.
pub fn camera(side_px: f64) -> Camera {
    let size = (1.9 * side_px + 40.0).ceil();
    Camera {
        id: "print".to_owned(),
        width: size as u32,
        height: size as u32,
        focal_px: Vector2::new(1000.0, 1000.0),
        center_px: Vector2::new(0.5 * (size - 1.0), 0.5 * (size - 1.0)),
        distortion: Distortion::Pinhole,
        world_from_camera: Isometry3::identity(),
        line_time_s: 0.0,
    }
}

/// A tag before the camera.
#[derive(Debug)]
pub struct Print {
    bitmap: Bitmap,
    camera_from_tag: Isometry3<f64>,
    motion_px: f64,
}

impl Print {
    /// The tag of a case, turned, and off the middle by some pixels; it moves along the rows.
    pub fn draw(camera: &Camera, id: u32, case: &Case, random: u64) -> Self {
        let depth_m = camera.focal_px.x * SIZE_M / case.side_px;
        let pixel = camera.center_px + Vector2::new(6.0 * unit(random, 3) - 3.0, 6.0 * unit(random, 4) - 3.0);
        let place = camera.unproject(&pixel.into()) * depth_m;
        let axis_angle = std::f64::consts::TAU * unit(random, 5);
        let axis = nalgebra::Unit::new_normalize(Vector3::new(axis_angle.cos(), axis_angle.sin(), 0.0));
        let tilt = Rotation3::from_axis_angle(&axis, case.tilt_deg.to_radians());
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), std::f64::consts::TAU * unit(random, 6));
        let facing = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let rotation = UnitQuaternion::from_rotation_matrix(&(tilt * turn * facing));
        // An id beyond the family's end is printed white: nobody will find it.
        let bitmap = ink::bitmap("tag36h11", id).unwrap_or([[true; CELLS]; CELLS]);
        Self {
            bitmap,
            camera_from_tag: Isometry3::from_parts(place.into(), rotation),
            motion_px: case.motion_px,
        }
    }

    /// Where the corners are in the middle of the exposure: bottom left, bottom right, top right, top left.
    pub fn corners_px(&self, camera: &Camera) -> [Point2<f64>; 4] {
        let half = 0.5 * SIZE_M;
        [(-half, -half), (half, -half), (half, half), (-half, half)].map(|(x, y)| {
            let p = self.camera_from_tag * Point3::new(x, y, 0.0);
            camera.pixel_of_ideal(Vector2::new(p.x / p.z, p.y / p.z))
        })
    }

    /// How the tag moves, if its way is that of an exposure of 10 ms: see [`Expectation::ideal_rate`].
    ///
    /// [`Expectation::ideal_rate`]: locoman_vision::detect::expected::Expectation::ideal_rate
    pub fn ideal_rate(&self, camera: &Camera) -> Matrix3<f64> {
        const EXPOSURE_S: f64 = 0.01;
        let mut rate = Matrix3::zeros();
        rate[(0, 2)] = self.motion_px / camera.focal_px.x / EXPOSURE_S;
        rate
    }

    /// The light on each pixel, by rows.
    pub fn light(&self, camera: &Camera) -> Vec<f32> {
        let (width, height) = (camera.width as usize * FINE, camera.height as usize * FINE);
        let cells_from_ideal = self.cells_from_ideal();
        // Beside the tag nothing differs from what is behind it.
        let mut fine = vec![0.0_f32; width * height];
        for (row, line) in fine.chunks_mut(width).enumerate() {
            for (column, sample) in line.iter_mut().enumerate() {
                let place = |at: usize| (at as f64 + 0.5) / FINE as f64 - 0.5;
                let ideal = (Vector2::new(place(column), place(row)) - camera.center_px)
                    .component_div(&camera.focal_px);
                let cell = cells_from_ideal * Vector3::new(ideal.x, ideal.y, 1.0);
                let (u, v) = ((cell.x / cell.z).floor(), (cell.y / cell.z).floor());
                let inside = 0.0..CELLS as f64;
                if inside.contains(&u) && inside.contains(&v) {
                    let ink = if self.bitmap[v as usize][u as usize] { WHITE } else { BLACK };
                    *sample = ink - BEHIND;
                }
            }
        }
        let kernel = lens();
        let mut along = kernel.clone();
        if self.motion_px > 0.0 {
            along = convolved(&kernel, &path(self.motion_px));
        }
        let both = blurred(&blurred(&fine, 1, &along), width, &kernel);
        let columns = camera.width as usize;
        let mut light = vec![BEHIND; columns * camera.height as usize];
        for (row, line) in both.chunks(width).enumerate() {
            for (column, sample) in line.iter().enumerate() {
                light[row / FINE * columns + column / FINE] += sample / (FINE * FINE) as f32;
            }
        }
        light
    }

    /// Cells of the printed tag, its margin included: u to the right, v down, from 0 to 10.
    fn cells_from_ideal(&self) -> Matrix3<f64> {
        let cell_m = SIZE_M / (CELLS as f64 - 2.0);
        let middle = 0.5 * CELLS as f64;
        let rotation = self.camera_from_tag.rotation.to_rotation_matrix();
        let (x, y) = (rotation.matrix().column(0) * cell_m, rotation.matrix().column(1) * -cell_m);
        let origin = self.camera_from_tag.translation.vector - (x + y) * middle;
        Matrix3::from_columns(&[x, y, origin]).try_inverse().unwrap_or_else(Matrix3::zeros)
    }
}

/// Grey levels of light, with noise of a standard deviation.
pub fn developed(light: &[f32], noise: f64, random: u64) -> Vec<u8> {
    let develop = |(at, light): (usize, &f32)| {
        let noisy = light + noise as f32 * gaussian(mix(random ^ mix(at as u64 + 100)));
        // A cast saturates at 0 and 255.
        (noisy + 0.5) as u8
    };
    light.iter().enumerate().map(develop).collect()
}

/// As a picture.
pub fn picture(camera: &Camera, grey: Vec<u8>) -> Picture {
    Picture { width: camera.width, height: camera.height, grey, jpeg_quality: 92 }
}

/// The lens on the fine grid; an odd number of weights whose sum is 1.
fn lens() -> Vec<f32> {
    let sigma = BLUR_PX * FINE as f64;
    let radius = (4.0 * sigma).ceil() as i32;
    normal((-radius..=radius).map(|i| (-0.5 * (f64::from(i) / sigma).powi(2)).exp()).collect())
}

/// A straight motion at a steady speed: half weights at both ends, so that it is symmetric.
fn path(motion_px: f64) -> Vec<f32> {
    let half = (0.5 * motion_px * FINE as f64).round() as usize;
    let weight = |i: usize| if i == 0 || i == 2 * half { 0.5 } else { 1.0 };
    normal((0..=2 * half).map(weight).collect())
}

fn normal(weights: Vec<f64>) -> Vec<f32> {
    let sum: f64 = weights.iter().sum();
    weights.into_iter().map(|weight| (weight / sum) as f32).collect()
}

fn convolved(a: &[f32], b: &[f32]) -> Vec<f32> {
    let mut out = vec![0.0; a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            out[i + j] += x * y;
        }
    }
    out
}

/// Convolution along one direction, `step` from a sample to the next. Nothing lies at the border: what is beyond it, and
/// what a row takes from the end of another, is zero.
fn blurred(fine: &[f32], step: usize, kernel: &[f32]) -> Vec<f32> {
    let radius = kernel.len() / 2;
    let mut out = vec![0.0_f32; fine.len()];
    for (k, weight) in kernel.iter().enumerate() {
        let (from, to) = (k.saturating_sub(radius) * step, radius.saturating_sub(k) * step);
        for (out, sample) in out.iter_mut().skip(to).zip(fine.iter().skip(from)) {
            *out += weight * sample;
        }
    }
    out
}
