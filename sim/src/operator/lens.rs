//! Rays of a camera, tabulated: the lens is inverted once, not at every sample.

use locoman_vision::camera::Camera;
use nalgebra::Point2;
use rayon::prelude::*;

/// A ray (x, y, 1) of the camera frame, without its last coordinate.
pub type Ray = [f32; 2];

/// The rays through all pixel corners, by rows: (width + 1) x (height + 1).
#[derive(Debug, Clone)]
pub struct RayTable {
    columns: usize,
    corners: Vec<Ray>,
}

/// The rays through one pixel, by bilinear interpolation of its corners.
///
/// Over one pixel the lens bends by less than 1e-6 px, so that this is as good as the camera model.
#[derive(Debug, Clone, Copy)]
pub struct PixelRays {
    origin: Ray,
    along_x: Ray,
    along_y: Ray,
}

impl RayTable {
    /// Tabulates a camera.
    pub fn new(camera: &Camera) -> Self {
        let columns = camera.width as usize + 1;
        let rows = camera.height as usize + 1;
        let mut corners = vec![[0.0; 2]; columns * rows];
        corners.par_chunks_mut(columns).enumerate().for_each(|(row, line)| {
            for (column, ray) in line.iter_mut().enumerate() {
                // Pixel centres are at integers, so corners lie half a pixel before them.
                let corner = Point2::new(column as f64 - 0.5, row as f64 - 0.5);
                let exact = camera.unproject(&corner);
                *ray = [exact.x as f32, exact.y as f32];
            }
        });
        Self { columns, corners }
    }

    /// The ray through the top left corner of pixel (column, row).
    pub fn corner(&self, column: usize, row: usize) -> Ray {
        self.corners[row * self.columns + column]
    }

    /// The rays through pixel (column, row).
    pub fn pixel(&self, column: usize, row: usize) -> PixelRays {
        let origin = self.corner(column, row);
        let right = self.corner(column + 1, row);
        let below = self.corner(column, row + 1);
        PixelRays {
            origin,
            along_x: [right[0] - origin[0], right[1] - origin[1]],
            along_y: [below[0] - origin[0], below[1] - origin[1]],
        }
    }
}

impl PixelRays {
    /// The ray at a place in the pixel, from (0, 0) at the top left to (1, 1) at the bottom right.
    pub fn at(&self, x: f32, y: f32) -> Ray {
        [
            self.origin[0] + x * self.along_x[0] + y * self.along_y[0],
            self.origin[1] + x * self.along_x[1] + y * self.along_y[1],
        ]
    }

    /// The rays through the pixel's four corners.
    pub fn corners(&self) -> [Ray; 4] {
        [self.at(0.0, 0.0), self.at(1.0, 0.0), self.at(0.0, 1.0), self.at(1.0, 1.0)]
    }
}
