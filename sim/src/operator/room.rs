//! The room behind the operator: a wall with shelves, a window and a poster, floor and ceiling. Procedural,
//! so that it needs no file; static, so that it is drawn once for each camera.

use locoman_vision::camera::Camera;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::lens::RayTable;
use super::sensor::mix;

/// The back wall stands here along x, the side walls along y, metres.
const BACK_M: f64 = -1.3;
const SIDE_M: f64 = 2.1;
const CEILING_M: f64 = 2.6;
/// Samples along each side of a pixel.
const GRID: usize = 2;

/// Light from the room on each pixel of a camera, by rows.
pub fn background(camera: &Camera, rays: &RayTable, seed: u64) -> Vec<f32> {
    let width = camera.width as usize;
    let eye = Point3::from(camera.world_from_camera.translation.vector);
    let mut light = vec![0.0; width * camera.height as usize];
    light.par_chunks_mut(width).enumerate().for_each(|(row, line)| {
        for (column, pixel) in line.iter_mut().enumerate() {
            let rays = rays.pixel(column, row);
            let mut sum = 0.0;
            for cell in 0..GRID * GRID {
                let place = |i: usize| (i as f32 + 0.5) / GRID as f32;
                let [x, y] = rays.at(place(cell % GRID), place(cell / GRID));
                let ray = Vector3::new(f64::from(x), f64::from(y), 1.0);
                sum += radiance(&eye, &(camera.world_from_camera.rotation * ray), seed);
            }
            *pixel = (sum / (GRID * GRID) as f64) as f32;
        }
    });
    light
}

/// Reflectance at a point of a surface, given the seed.
type Paint = fn(&Point3<f64>, u64) -> f64;

/// What is seen from a point in the room along a direction.
fn radiance(eye: &Point3<f64>, direction: &Vector3<f64>, seed: u64) -> f64 {
    let to = |plane: f64, axis: usize| {
        let distance = (plane - eye[axis]) / direction[axis];
        if distance > 0.0 { distance } else { f64::INFINITY }
    };
    let side = SIDE_M.copysign(direction.y);
    let surfaces: [(f64, Paint); 4] = [
        (to(BACK_M, 0), back_wall),
        (to(side, 1), side_wall),
        (to(0.0, 2), floor),
        (to(CEILING_M, 2), |_, _| 0.55),
    ];
    let (distance, paint) =
        surfaces.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::INFINITY, |_, _| 0.0));
    /// Walls are lit as brightly as the operator.
    const BRIGHTNESS: f64 = 1.35;
    if distance.is_finite() { BRIGHTNESS * paint(&(eye + direction * distance), seed) } else { 0.3 }
}

fn back_wall(p: &Point3<f64>, seed: u64) -> f64 {
    let plaster =
        0.40 + 0.05 * cloud(p.y * 3.0, p.z * 3.0, seed) + 0.015 * cloud(p.y * 90.0, p.z * 90.0, seed);
    let lit = 1.0 + 0.10 * p.y;
    if inside(p.y, 0.62, 1.75) && inside(p.z, 0.1, 1.95) {
        return shelf(p.y, p.z, seed) * lit;
    }
    if inside(p.y, -1.75, -0.75) && inside(p.z, 0.95, 2.0) {
        return window(p.y, p.z, seed);
    }
    if inside(p.y, -0.38, 0.30) && inside(p.z, 0.72, 1.62) {
        return poster(p.y, p.z, seed) * lit;
    }
    if p.z < 0.09 { 0.62 * lit } else { plaster * lit }
}

/// Rows of books of random widths, heights and greys.
fn shelf(y: f64, z: f64, seed: u64) -> f64 {
    const ROW_M: f64 = 0.31;
    const BOARD_M: f64 = 0.022;
    let row = (z / ROW_M).floor();
    let above_board = z - row * ROW_M - BOARD_M;
    if above_board < 0.0 || inside(y, 0.62, 0.645) || inside(y, 1.725, 1.75) {
        return 0.33 + 0.03 * cloud(y * 8.0, z * 70.0, seed);
    }
    // Books have widths of 18 to 48 mm; walking along the row finds the one at y.
    let mut left = 0.645;
    for book in 0..64 {
        let dice = mix(seed ^ mix(book << 16 | row as u64 & 0xffff));
        let width = 0.018 + 0.030 * unit(dice);
        if y < left + width {
            let height = 0.18 + 0.08 * unit(mix(dice));
            if above_board > height {
                return 0.05;
            }
            let round = 1.0 - 0.35 * (2.0 * (y - left) / width - 1.0).powi(2);
            let label = inside(above_board, 0.04, 0.06) || inside(above_board, height - 0.05, height - 0.044);
            let cover = 0.08 + 0.40 * unit(mix(dice ^ 7));
            return round * if label { 0.5 - cover * 0.5 } else { cover };
        }
        left += width;
    }
    0.05
}

fn window(y: f64, z: f64, seed: u64) -> f64 {
    let frame = [(-1.75, -1.71), (-1.27, -1.23), (-0.79, -0.75)].iter().any(|&(a, b)| inside(y, a, b))
        || [(0.95, 0.99), (1.46, 1.50), (1.96, 2.0)].iter().any(|&(a, b)| inside(z, a, b));
    if frame { 0.66 } else { 0.80 + 0.10 * (z - 1.5) + 0.08 * cloud(y * 4.0, z * 4.0, seed ^ 3) }
}

/// Hills under a sky, in a dark frame.
fn poster(y: f64, z: f64, seed: u64) -> f64 {
    if !(inside(y, -0.35, 0.27) && inside(z, 0.75, 1.59)) {
        return 0.12;
    }
    let mut grey = 0.62 - 0.12 * (z - 0.75);
    for (layer, (height, tone)) in [(1.25, 0.46), (1.12, 0.34), (0.98, 0.22)].into_iter().enumerate() {
        let skyline = height + 0.10 * cloud(y * (5.0 + 4.0 * layer as f64), 0.5, seed ^ layer as u64);
        if z < skyline {
            grey = tone + 0.03 * cloud(y * 40.0, z * 40.0, seed);
        }
    }
    grey
}

fn side_wall(p: &Point3<f64>, seed: u64) -> f64 {
    0.42 + 0.05 * cloud(p.x * 3.0, p.z * 3.0, seed ^ 11)
}

/// Boards of 14 cm along x.
fn floor(p: &Point3<f64>, seed: u64) -> f64 {
    let board = (p.y / 0.14).floor();
    let gap = inside(p.y - board * 0.14, 0.0, 0.004);
    let tone = 0.24 + 0.08 * unit(mix(seed ^ board as i64 as u64));
    if gap { 0.07 } else { tone + 0.04 * cloud(p.x * 6.0 + board * 3.7, p.y * 60.0, seed) }
}

fn inside(value: f64, low: f64, high: f64) -> bool {
    (low..high).contains(&value)
}

/// A number from 0 to 1 from random bits.
fn unit(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1u64 << 53) as f64
}

/// Smooth noise between -1 and 1 in three octaves (value noise on a square lattice).
fn cloud(x: f64, y: f64, seed: u64) -> f64 {
    let octave = |scale: f64, salt: u64| {
        let (x, y) = (x * scale, y * scale);
        let (i, j) = (x.floor(), y.floor());
        let ease = |t: f64| t * t * (3.0 - 2.0 * t);
        let (u, v) = (ease(x - i), ease(y - j));
        let lattice = |di: f64, dj: f64| {
            let (i, j) = ((i + di) as i64 as u64, (j + dj) as i64 as u64);
            2.0 * unit(mix(mix(i ^ salt) ^ mix(j).rotate_left(17) ^ seed)) - 1.0
        };
        (lattice(0.0, 0.0) * (1.0 - u) + lattice(1.0, 0.0) * u) * (1.0 - v)
            + (lattice(0.0, 1.0) * (1.0 - u) + lattice(1.0, 1.0) * u) * v
    };
    0.57 * octave(1.0, 1) + 0.29 * octave(2.1, 2) + 0.14 * octave(4.3, 3)
}
