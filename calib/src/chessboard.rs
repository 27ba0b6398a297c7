//! Chessboards: the target of other people's pictures, found by OpenCV; whole views only.

use locoman_vision::image::{GrayImage, ImageError};
use nalgebra::{Isometry3, Point2, Point3, SMatrix};
use opencv::calib3d;
use opencv::core::{Mat, Point2f, Size, TermCriteria, Vector};
use opencv::imgproc;

use crate::bundle::{FIXED, POINTS, Part};
use crate::intrinsics::{PartView, View};

/// A chessboard: its inner corners, row by row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chessboard {
    /// Inner corners in a row.
    pub columns: u32,
    /// Rows of them.
    pub rows: u32,
    /// Side of a square, metres.
    pub square_m: f64,
}

/// Standard deviation of a corner, pixels: what saddle points have in fair pictures; only its ratio to others matters.
const SIGMA_PX: f64 = 0.1;

impl Chessboard {
    /// One part a corner: z towards the viewer, y up.
    pub fn parts(&self) -> Vec<Part> {
        let corner = |k: u32| Part {
            points: vec![Point3::origin()],
            object_from_part: Isometry3::translation(
                f64::from(k % self.columns) * self.square_m,
                -f64::from(k / self.columns) * self.square_m,
                0.0,
            ),
            scale: 1.0,
            loose: [FIXED; 3],
        };
        (0..self.rows * self.columns).map(corner).collect()
    }

    /// The board in an image; `None` if it is not there as a whole.
    pub fn find(&self, name: &str, image: &GrayImage) -> Result<Option<View>, ImageError> {
        let failed = |error: opencv::Error| ImageError::Undecodable {
            bytes: image.data().len(),
            reason: error.message,
        };
        let corners = self.corners(image).map_err(failed)?;
        let mut whitening = SMatrix::<f64, 8, 8>::zeros();
        whitening[(0, 0)] = 1.0 / SIGMA_PX;
        whitening[(1, 1)] = 1.0 / SIGMA_PX;
        let part = |(part, pixel): (usize, Point2f)| {
            let mut points_px = [Point2::origin(); POINTS];
            points_px[0] = Point2::new(f64::from(pixel.x), f64::from(pixel.y));
            PartView { part, points_px, whitening }
        };
        Ok(corners.map(|corners| View {
            name: name.to_owned(),
            parts: corners.iter().enumerate().map(part).collect(),
            blur_px: None,
        }))
    }

    fn corners(&self, image: &GrayImage) -> opencv::Result<Option<Vector<Point2f>>> {
        let side = |count: u32| i32::try_from(count).unwrap_or(i32::MAX);
        let mat = Mat::new_rows_cols_with_data(side(image.height()), side(image.width()), image.data())?;
        let mut corners = Vector::<Point2f>::new();
        if !calib3d::find_chessboard_corners_def(
            &mat,
            Size::new(side(self.columns), side(self.rows)),
            &mut corners,
        )? {
            return Ok(None);
        }
        // Half the side of a small square: a larger window sees the neighbours of far boards.
        let stop = TermCriteria { typ: 3, max_count: 30, epsilon: 0.01 };
        imgproc::corner_sub_pix(&mat, &mut corners, Size::new(5, 5), Size::new(-1, -1), stop)?;
        Ok(Some(corners))
    }
}
