//! A part of the body, ready to be hit.

use locoman_vision::camera::Camera;
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use super::{Bounds, Hit, LIMB, Lamp, Window};
use crate::operator::body::{Limb, Shape};
use crate::operator::lens::Ray;

/// Stripes of a knitted sweater, radians a metre.
const STRIPES_PER_M: f32 = 180.0;

#[derive(Debug)]
pub(super) struct SeenLimb {
    form: Form,
    albedo: f32,
    stripes: f32,
    pub(super) bounds: Option<Bounds>,
    pub(super) window: Window,
}

#[derive(Debug)]
enum Form {
    Capsule {
        a: Vector3<f32>,
        ab: Vector3<f32>,
        radius: f32,
    },
    /// `unit_from_camera` maps the ellipsoid to the unit ball.
    Ellipsoid {
        unit_from_camera: Matrix3<f32>,
        origin: Vector3<f32>,
        tallness: f32,
    },
}

impl SeenLimb {
    pub(super) fn new(camera: &Camera, limb: &Limb, camera_from_world: &Isometry3<f64>) -> Self {
        let (form, bounds, window) = match limb.shape {
            Shape::Capsule { a, b, radius_m } => {
                let (a, b) = (camera_from_world * a, camera_from_world * b);
                let form = Form::Capsule { a: a.coords.cast(), ab: (b - a).cast(), radius: radius_m as f32 };
                let ends = [a, b].into_iter();
                (form, Bounds::of(camera, ends.clone(), radius_m), Window::of_balls(ends, radius_m))
            }
            Shape::Ellipsoid { pose, radii_m } => {
                let pose = camera_from_world * pose;
                let unit_from_camera = Matrix3::from_diagonal(&radii_m.map(|r| 1.0 / r))
                    * pose.rotation.inverse().to_rotation_matrix().matrix();
                let center = pose.translation.vector;
                let form = Form::Ellipsoid {
                    unit_from_camera: unit_from_camera.cast(),
                    origin: (-unit_from_camera * center).cast(),
                    tallness: radii_m.z as f32,
                };
                let (center, reach_m) = (std::iter::once(Point3::from(center)), radii_m.max());
                (form, Bounds::of(camera, center.clone(), reach_m), Window::of_balls(center, reach_m))
            }
        };
        Self { form, albedo: limb.albedo, stripes: limb.stripes, bounds, window }
    }

    #[inline]
    pub(super) fn hit(&self, number: u16, ray: Ray, behind: f32, lamp: &Lamp) -> Option<Hit> {
        let direction = Vector3::new(ray[0], ray[1], 1.0);
        let depth = self.form.depth(&direction)?;
        let nearness = 1.0 / depth;
        if depth <= 0.0 || nearness <= behind {
            return None;
        }
        let point = direction * depth;
        let (normal, height) = self.form.normal_and_height(&point);
        let stripes = 1.0 + self.stripes * (STRIPES_PER_M * height).sin();
        Some(Hit {
            nearness,
            light: self.albedo * stripes * lamp.on(&normal) * lamp.gradient_at(&point),
            key: LIMB | u32::from(number),
        })
    }
}

impl Form {
    /// Depth of the first hit of a ray from the camera's centre.
    #[inline]
    fn depth(&self, d: &Vector3<f32>) -> Option<f32> {
        match self {
            Self::Capsule { a, ab, radius } => {
                let (dd, abab, abd) = (d.dot(d), ab.dot(ab), ab.dot(d));
                let (aba, da, aa) = (-ab.dot(a), -d.dot(a), a.dot(a));
                let qa = abab * dd - abd * abd;
                let qb = abab * da - aba * abd;
                let qc = abab * aa - aba * aba - radius * radius * abab;
                let discriminant = qb * qb - qa * qc;
                if discriminant < 0.0 {
                    return None;
                }
                let t = (-qb - discriminant.sqrt()) / qa;
                let along = aba + t * abd;
                if along > 0.0 && along < abab {
                    return Some(t);
                }
                let end = if along <= 0.0 { *a } else { a + ab };
                let b = -d.dot(&end);
                let discriminant = b * b - dd * (end.dot(&end) - radius * radius);
                (discriminant >= 0.0).then(|| (-b - discriminant.sqrt()) / dd)
            }
            Self::Ellipsoid { unit_from_camera, origin, .. } => {
                let d = unit_from_camera * d;
                let (a, b, c) = (d.dot(&d), d.dot(origin), origin.dot(origin) - 1.0);
                let discriminant = b * b - a * c;
                (discriminant >= 0.0).then(|| (-b - discriminant.sqrt()) / a)
            }
        }
    }

    /// Outward normal at a point of the surface, and how far along the form's length it is, metres.
    #[inline]
    fn normal_and_height(&self, point: &Vector3<f32>) -> (Vector3<f32>, f32) {
        match self {
            Self::Capsule { a, ab, radius } => {
                let along = ((point - a).dot(ab) / ab.dot(ab)).clamp(0.0, 1.0);
                ((point - a - ab * along) / *radius, along * ab.norm())
            }
            Self::Ellipsoid { unit_from_camera, origin, tallness } => {
                let on_ball = unit_from_camera * point + origin;
                (unit_from_camera.tr_mul(&on_ball).normalize(), on_ball.z * tallness)
            }
        }
    }
}
