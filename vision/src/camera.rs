//! Camera models: from a point in the camera frame to a pixel, and back to a ray.
//!
//! Convention: camera frame x right, y down, z forward; pixel centres at integers, as OpenCV has it.
//! The distortion models and the order of their coefficients are OpenCV's (`calib3d` documentation), so
//! that its calibrations can be used as they are.

use nalgebra::{Isometry3, Matrix2, Matrix2x3, Point2, Point3, Vector2, Vector3};

/// How a lens departs from the ideal pinhole, acting on normalized image coordinates (x/z, y/z).
#[derive(Debug, Clone, PartialEq)]
pub enum Distortion {
    /// None.
    Pinhole,
    /// Radial and tangential: k1, k2, p1, p2, k3, k4, k5, k6 (rational; trailing ones may be zero).
    RadTan([f64; 8]),
    /// Equidistant fisheye (Kannala-Brandt): k1, k2, k3, k4.
    Fisheye([f64; 4]),
}

/// A calibrated camera and where it stands.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Its name in the rig file, in recordings and in reports.
    pub id: String,
    /// Image width in pixels.
    pub width: u32,
    /// Image height in pixels.
    pub height: u32,
    /// Focal lengths fx, fy in pixels.
    pub focal_px: Vector2<f64>,
    /// Principal point cx, cy in pixels.
    pub center_px: Vector2<f64>,
    /// The lens.
    pub distortion: Distortion,
    /// Pose of the camera in the world.
    pub world_from_camera: Isometry3<f64>,
    /// Time from the exposure of one row to that of the next; 0 for a global shutter.
    pub line_time_s: f64,
}

/// Points nearer to the image plane than this (metres along z) are not projected.
const NEAR_M: f64 = 0.02;

impl Camera {
    /// The pixel of a point given in the camera frame; `None` behind or almost beside the camera.
    ///
    /// Does not ask whether the pixel is inside the image: see [`Camera::contains`].
    pub fn project(&self, point_in_camera: &Point3<f64>) -> Option<Point2<f64>> {
        self.project_with_jacobian(point_in_camera).map(|(pixel, _)| pixel)
    }

    /// [`Camera::project`] and the derivative of the pixel by the point (2x3).
    pub fn project_with_jacobian(&self, p: &Point3<f64>) -> Option<(Point2<f64>, Matrix2x3<f64>)> {
        if p.z < NEAR_M {
            return None;
        }
        let inv_z = 1.0 / p.z;
        let ideal = Vector2::new(p.x * inv_z, p.y * inv_z);
        let d_ideal = Matrix2x3::new(inv_z, 0.0, -ideal.x * inv_z, 0.0, inv_z, -ideal.y * inv_z);
        let (pixel, by_ideal) = self.pixel_of_ideal_with_jacobian(ideal);
        Some((pixel, by_ideal * d_ideal))
    }

    /// The pixel of ideal image coordinates (x/z, y/z).
    pub fn pixel_of_ideal(&self, ideal: Vector2<f64>) -> Point2<f64> {
        self.pixel_of_ideal_with_jacobian(ideal).0
    }

    /// [`Camera::pixel_of_ideal`] and its derivative (2x2).
    pub fn pixel_of_ideal_with_jacobian(&self, ideal: Vector2<f64>) -> (Point2<f64>, Matrix2<f64>) {
        let (distorted, derivative) = self.distortion.distort(ideal);
        let pixel = Point2::from(self.focal_px.component_mul(&distorted) + self.center_px);
        (pixel, Matrix2::from_diagonal(&self.focal_px) * derivative)
    }

    /// The ray (x, y, 1) in the camera frame that a pixel sees.
    pub fn unproject(&self, pixel: &Point2<f64>) -> Vector3<f64> {
        let distorted = (pixel.coords - self.center_px).component_div(&self.focal_px);
        let ideal = self.distortion.undistort(distorted);
        Vector3::new(ideal.x, ideal.y, 1.0)
    }

    /// When a row was exposed, seconds after the capture time: that is when the middle row was, halfway through
    /// its exposure.
    pub fn row_delay_s(&self, y_px: f64) -> f64 {
        (y_px - 0.5 * f64::from(self.height.saturating_sub(1))) * self.line_time_s
    }

    /// Whether a pixel lies inside the image.
    pub fn contains(&self, pixel: &Point2<f64>) -> bool {
        pixel.x >= -0.5
            && pixel.y >= -0.5
            && pixel.x <= f64::from(self.width) - 0.5
            && pixel.y <= f64::from(self.height) - 0.5
    }
}

impl Distortion {
    /// Distorts normalized image coordinates; also the derivative (2x2).
    pub fn distort(&self, ideal: Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
        match self {
            Self::Pinhole => (ideal, Matrix2::identity()),
            Self::RadTan(k) => radtan(k, ideal),
            Self::Fisheye(k) => fisheye(k, ideal),
        }
    }

    /// Inverts [`Distortion::distort`] by Newton's method.
    ///
    /// Where the model folds over (far outside the calibrated field) the nearest iterate is returned.
    pub fn undistort(&self, distorted: Vector2<f64>) -> Vector2<f64> {
        /// Newton converges quadratically inside the calibrated field: 3 to 5 steps.
        const MAX_STEPS: usize = 20;
        const CONVERGED: f64 = 1e-14;
        let mut ideal = distorted;
        if *self == Self::Pinhole {
            return ideal;
        }
        for _ in 0..MAX_STEPS {
            let (value, derivative) = self.distort(ideal);
            let Some(inverse) = derivative.try_inverse() else { break };
            let step = inverse * (distorted - value);
            ideal += step;
            if step.norm_squared() < CONVERGED * CONVERGED {
                break;
            }
        }
        ideal
    }
}

/// OpenCV's rational radial and tangential model.
fn radtan(k: &[f64; 8], p: Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
    let [k1, k2, p1, p2, k3, k4, k5, k6] = *k;
    let (x, y) = (p.x, p.y);
    let r2 = x * x + y * y;
    let num = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
    let den = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6));
    let radial = num / den;
    let d_num = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3);
    let d_den = k4 + r2 * (2.0 * k5 + r2 * 3.0 * k6);
    let d_radial = (d_num * den - num * d_den) / (den * den);
    let value = Vector2::new(
        x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
        y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
    );
    let cross = 2.0 * x * y * d_radial + 2.0 * p1 * x + 2.0 * p2 * y;
    let derivative = Matrix2::new(
        radial + 2.0 * x * x * d_radial + 2.0 * p1 * y + 6.0 * p2 * x,
        cross,
        cross,
        radial + 2.0 * y * y * d_radial + 6.0 * p1 * y + 2.0 * p2 * x,
    );
    (value, derivative)
}

/// OpenCV's `fisheye` model.
fn fisheye(k: &[f64; 4], p: Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
    let r = p.norm();
    if r < 1e-9 {
        return (p, Matrix2::identity());
    }
    let theta = r.atan();
    let t2 = theta * theta;
    let theta_d = theta * (1.0 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))));
    let d_theta_d = 1.0 + t2 * (3.0 * k[0] + t2 * (5.0 * k[1] + t2 * (7.0 * k[2] + t2 * 9.0 * k[3])));
    let scale = theta_d / r;
    // d(theta_d / r) / dr, with d theta / dr = 1 / (1 + r^2).
    let d_scale = (d_theta_d / (1.0 + r * r) - scale) / r;
    let unit = p / r;
    (p * scale, Matrix2::identity() * scale + p * unit.transpose() * d_scale)
}

#[cfg(test)]
mod tests;
