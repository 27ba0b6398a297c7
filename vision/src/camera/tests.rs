//! Against finite differences, against itself, and against OpenCV.

use opencv::calib3d;
use opencv::core::{Mat, Point2d, Point3d, Vector};
use proptest::prelude::*;

use super::*;

fn camera(distortion: Distortion) -> Camera {
    Camera {
        id: "camera".to_owned(),
        width: 1280,
        height: 720,
        focal_px: Vector2::new(700.0, 705.0),
        center_px: Vector2::new(642.3, 355.1),
        distortion,
        world_from_camera: Isometry3::identity(),
        line_time_s: 0.0,
    }
}

const RATIONAL: [f64; 8] = [-0.31, 0.12, 1.1e-3, -0.7e-3, 0.05, 0.02, 0.01, -0.004];
const KANNALA_BRANDT: [f64; 4] = [-0.021, 0.011, -0.006, 0.0012];

fn lenses() -> [Camera; 3] {
    [Distortion::Pinhole, Distortion::RadTan(RATIONAL), Distortion::Fisheye(KANNALA_BRANDT)].map(camera)
}

proptest! {
    #[test]
    fn the_jacobian_is_the_derivative(
        x in -0.6_f64..0.6, y in -0.4_f64..0.4, z in 0.4_f64..3.0,
    ) {
        const STEP_M: f64 = 1e-6;
        /// Central differences: rounding of a pixel's last digits over the step.
        const TOLERANCE: f64 = 1e-4;
        for camera in lenses() {
            let point = Point3::new(x * z, y * z, z);
            let (_, jacobian) = camera.project_with_jacobian(&point).expect("in front");
            for axis in 0..3 {
                let mut step = Vector3::zeros();
                step[axis] = STEP_M;
                let ahead = camera.project(&(point + step)).expect("in front");
                let behind = camera.project(&(point - step)).expect("in front");
                let numeric = (ahead - behind) / (2.0 * STEP_M);
                prop_assert!((numeric - jacobian.column(axis)).norm() < TOLERANCE * (1.0 + numeric.norm()));
            }
        }
    }

    #[test]
    fn a_pixels_ray_leads_back_to_the_pixel(u in 0.0_f64..1280.0, v in 0.0_f64..720.0) {
        for camera in lenses() {
            let pixel = Point2::new(u, v);
            let ray = camera.unproject(&pixel);
            let back = camera.project(&Point3::from(ray * 2.0)).expect("in front");
            prop_assert!((back - pixel).norm() < 1e-8, "{back}");
        }
    }

    #[test]
    fn pixels_are_where_opencv_has_them(
        x in -0.6_f64..0.6, y in -0.4_f64..0.4, z in 0.4_f64..3.0,
    ) {
        for camera in lenses() {
            let point = Point3::new(x * z, y * z, z);
            let ours = camera.project(&point).expect("in front");
            let theirs = by_opencv(&camera, &point).expect("opencv");
            prop_assert!((ours - theirs).norm() < 1e-9, "{ours} {theirs}");
        }
    }
}

fn by_opencv(camera: &Camera, point: &Point3<f64>) -> opencv::Result<Point2<f64>> {
    let matrix = Mat::from_slice_2d(&[
        [camera.focal_px.x, 0.0, camera.center_px.x],
        [0.0, camera.focal_px.y, camera.center_px.y],
        [0.0, 0.0, 1.0],
    ])?;
    let object: Vector<Point3d> = [Point3d::new(point.x, point.y, point.z)].into_iter().collect();
    let still = Vector::<f64>::from_slice(&[0.0; 3]);
    let mut image = Vector::<Point2d>::new();
    if let Distortion::Fisheye(k) = &camera.distortion {
        let k = Vector::<f64>::from_slice(k);
        calib3d::fisheye_project_points_vec_def(&object, &mut image, &still, &still, &matrix, &k)?;
    } else {
        let k = match &camera.distortion {
            Distortion::RadTan(k) => Vector::<f64>::from_slice(k),
            _ => Vector::<f64>::from_slice(&[0.0; 4]),
        };
        calib3d::project_points_def(&object, &still, &still, &matrix, &k, &mut image)?;
    }
    let pixel = image.get(0)?;
    Ok(Point2::new(pixel.x, pixel.y))
}

#[test]
fn what_is_behind_the_camera_has_no_pixel() {
    for camera in lenses() {
        assert_eq!(camera.project(&Point3::new(0.0, 0.0, -1.0)), None);
        assert_eq!(camera.project(&Point3::new(0.0, 0.0, 0.0)), None);
    }
}

#[test]
fn the_image_ends_half_a_pixel_beyond_the_outer_centres() {
    let camera = camera(Distortion::Pinhole);
    assert!(camera.contains(&Point2::new(-0.4, 719.4)));
    assert!(!camera.contains(&Point2::new(-0.6, 0.0)));
    assert!(!camera.contains(&Point2::new(0.0, 719.6)));
}
