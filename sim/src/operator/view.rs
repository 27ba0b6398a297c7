//! What stands before one camera during one exposure, made ready for many rays.
//!
//! A facet is hit by a ray d = (x, y, 1) where its plane is: with `facet_from_camera` = (R, t) and rows
//! r1, r2, r3 of R, the hit is at (u, v) = ((t_z r1 - t_x r3) . d, (t_z r2 - t_y r3) . d) / -(r3 . d) in the
//! facet's plane, at depth z = -t_z / (r3 . d). The exposure is cut into slices of time; each facet has these
//! nine numbers for each of them.

use locoman_vision::camera::Camera;
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use super::body::{Limb, Shape};
use super::ink::CELLS;
use super::lens::Ray;
use super::motion::Posture;
use super::scene::Light;
use super::solid::{Facet, Solid};

/// Reflectance of the paper and of the ink on it.
const WHITE: f32 = 0.86;
const BLACK: f32 = 0.055;
/// Stripes of a knitted sweater, radians a metre.
const STRIPES_PER_M: f32 = 180.0;

/// The nearest thing on a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// 1 / depth along the camera's z axis; larger is nearer.
    pub nearness: f32,
    /// Reflected light; 1 is a white surface in full light.
    pub light: f32,
    /// Equal for rays that hit the same surface of the same ink.
    pub key: u32,
}

/// A pixel rectangle: columns from `left` to `right`, rows from `top` to `bottom`, both inclusive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Leftmost column.
    pub left: f64,
    /// Topmost row.
    pub top: f64,
    /// Rightmost column.
    pub right: f64,
    /// Lowest row.
    pub bottom: f64,
}

/// Things by number, and where in the image they are.
pub type Placed = Vec<(u16, Bounds)>;

/// Facets that face the camera, and limbs, in the camera's frame.
#[derive(Debug)]
pub struct View {
    facets: Vec<SeenFacet>,
    limbs: Vec<SeenLimb>,
}

#[derive(Debug)]
struct SeenFacet {
    /// Index of the solid and of the facet in it.
    place: (usize, usize),
    /// One for each slice of the exposure.
    slices: Vec<Slice>,
    /// Inside where a u + b v + c >= 0 for all edges.
    edges: Vec<[f32; 3]>,
    tags: Vec<SeenTag>,
    /// Light on it: constant, per metre of u, per metre of v.
    light: [f32; 3],
    bounds: Option<Bounds>,
}

#[derive(Debug, Clone, Copy)]
struct Slice {
    u: [f32; 3],
    v: [f32; 3],
    w: [f32; 3],
    /// nearness = w . d * this.
    nearness: f32,
}

#[derive(Debug)]
struct SeenTag {
    center: [f32; 2],
    x_axis: [f32; 2],
    half_m: f32,
    cells_per_m: f32,
    white: [[bool; CELLS]; CELLS],
}

#[derive(Debug)]
struct SeenLimb {
    form: Form,
    albedo: f32,
    stripes: f32,
    bounds: Option<Bounds>,
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

/// A lamp as one camera sees it.
#[derive(Debug, Clone, Copy)]
pub struct Lamp {
    towards: Vector3<f32>,
    lamp: f32,
    ambient: f32,
    gradient: Vector3<f32>,
    chest: Vector3<f32>,
}

impl Lamp {
    /// Moves the scene's light into a camera's frame; `chest` is where the gradient is zero.
    pub fn new(light: &Light, camera_from_world: &Isometry3<f64>, chest: &Point3<f64>) -> Self {
        let towards = Vector3::from(light.towards_lamp).normalize();
        Self {
            towards: (camera_from_world.rotation * towards).cast(),
            lamp: light.lamp as f32,
            ambient: light.ambient as f32,
            gradient: (camera_from_world.rotation * Vector3::from(light.gradient_per_m)).cast(),
            chest: (camera_from_world * chest).coords.cast(),
        }
    }

    /// Light on a surface with a normal (matte), before the gradient.
    fn on(&self, normal: &Vector3<f32>) -> f32 {
        // Half of the ambient light comes from above all else: soft shading of what the lamp misses.
        let soft = 0.5 + 0.5 * normal.dot(&self.towards);
        self.ambient * (0.6 + 0.4 * soft) + self.lamp * normal.dot(&self.towards).max(0.0)
    }

    fn gradient_at(&self, p: &Vector3<f32>) -> f32 {
        1.0 + self.gradient.dot(&(p - self.chest))
    }
}

impl View {
    /// Gets ready; `postures` holds one posture for each slice of the exposure, `limbs` those of its middle.
    pub fn new(camera: &Camera, solids: &[Solid], postures: &[Posture], limbs: &[Limb], lamp: &Lamp) -> Self {
        let camera_from_world = camera.world_from_camera.inverse();
        let mut facets = Vec::new();
        for (index, solid) in solids.iter().enumerate() {
            let camera_from_shell: Vec<Isometry3<f64>> =
                postures.iter().map(|posture| camera_from_world * posture.of(solid.body)).collect();
            for (place, facet) in solid.facets.iter().enumerate() {
                facets.extend(SeenFacet::new(camera, (index, place), facet, &camera_from_shell, lamp));
            }
        }
        let limbs = limbs.iter().map(|limb| SeenLimb::new(camera, limb, &camera_from_world)).collect();
        Self { facets, limbs }
    }

    /// Where facets and limbs appear, by the numbers that [`View::trace`] knows them by; those behind the
    /// camera are left out.
    pub fn bounds(&self) -> (Placed, Placed) {
        let facets = self.facets.iter().map(|facet| facet.bounds);
        let limbs = self.limbs.iter().map(|limb| limb.bounds);
        (numbered(facets), numbered(limbs))
    }

    /// The numbers of everything in front of the camera.
    pub fn all(&self) -> (Vec<u16>, Vec<u16>) {
        let (facets, limbs) = self.bounds();
        (facets.iter().map(|(n, _)| *n).collect(), limbs.iter().map(|(n, _)| *n).collect())
    }

    /// The number of a facet, if it faces the camera.
    pub fn number_of(&self, place: (usize, usize)) -> Option<u16> {
        self.facets.iter().position(|facet| facet.place == place).map(|n| n as u16)
    }

    /// The nearest hit of a ray among the named facets and limbs.
    #[inline]
    pub fn trace(&self, facets: &[u16], limbs: &[u16], ray: Ray, slice: usize, lamp: &Lamp) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        for &number in facets {
            if let Some(hit) = self.facets[usize::from(number)].hit(number, ray, slice)
                && nearest.is_none_or(|old| hit.nearness > old.nearness)
            {
                nearest = Some(hit);
            }
        }
        for &number in limbs {
            let behind = nearest.map_or(0.0, |hit| hit.nearness);
            if let Some(hit) = self.limbs[usize::from(number)].hit(number, ray, behind, lamp) {
                nearest = Some(hit);
            }
        }
        nearest
    }

    /// Whether a key came from the facet of this number.
    pub fn is_facet(key: u32, number: u16) -> bool {
        key & LIMB == 0 && key >> 1 == u32::from(number)
    }
}

const LIMB: u32 = 1 << 31;

fn numbered(bounds: impl Iterator<Item = Option<Bounds>>) -> Placed {
    bounds.enumerate().filter_map(|(n, bounds)| Some((n as u16, bounds?))).collect()
}

impl SeenFacet {
    /// `None` if it faces away at some time of the exposure.
    fn new(
        camera: &Camera,
        place: (usize, usize),
        facet: &Facet,
        camera_from_shell: &[Isometry3<f64>],
        lamp: &Lamp,
    ) -> Option<Self> {
        let camera_from_facet: Vec<Isometry3<f64>> =
            camera_from_shell.iter().map(|pose| pose * facet.shell_from_facet).collect();
        let slices = camera_from_facet.iter().map(Slice::new).collect::<Option<Vec<_>>>()?;
        let n = facet.polygon.len();
        let edges = (0..n)
            .map(|i| {
                let (a, b) = (facet.polygon[i], facet.polygon[(i + 1) % n]);
                let inward = nalgebra::Vector2::new(a.y - b.y, b.x - a.x).normalize();
                [inward.x as f32, inward.y as f32, -inward.dot(&a.coords) as f32]
            })
            .collect();
        let middle = &camera_from_facet[camera_from_facet.len() / 2];
        let axis = |v: Vector3<f64>| -> Vector3<f32> { (middle.rotation * v).cast() };
        let on = lamp.on(&axis(Vector3::z()));
        let light = [
            on * lamp.gradient_at(&middle.translation.vector.cast()),
            on * lamp.gradient.dot(&axis(Vector3::x())),
            on * lamp.gradient.dot(&axis(Vector3::y())),
        ];
        let ends = [camera_from_facet.first(), camera_from_facet.last()].into_iter().flatten();
        let outline =
            ends.flat_map(|pose| facet.polygon.iter().map(move |p| pose * Point3::new(p.x, p.y, 0.0)));
        Some(Self {
            place,
            slices,
            edges,
            tags: facet.tags.iter().map(SeenTag::new).collect(),
            light,
            bounds: Bounds::of(camera, outline, 0.0),
        })
    }

    #[inline]
    fn hit(&self, number: u16, [x, y]: Ray, slice: usize) -> Option<Hit> {
        let slice = &self.slices[slice];
        let along = |row: &[f32; 3]| row[0] * x + row[1] * y + row[2];
        let w = along(&slice.w);
        if w <= 0.0 {
            return None;
        }
        let (u, v) = (along(&slice.u) / w, along(&slice.v) / w);
        if self.edges.iter().any(|[a, b, c]| a * u + b * v + c < 0.0) {
            return None;
        }
        let white = self.tags.iter().all(|tag| tag.is_white_at(u, v));
        let reflectance = if white { WHITE } else { BLACK };
        Some(Hit {
            nearness: w * slice.nearness,
            light: reflectance * (self.light[0] + self.light[1] * u + self.light[2] * v),
            key: u32::from(number) << 1 | u32::from(white),
        })
    }
}

impl Slice {
    fn new(camera_from_facet: &Isometry3<f64>) -> Option<Self> {
        let facet_from_camera = camera_from_facet.inverse();
        let rotation = facet_from_camera.rotation.to_rotation_matrix();
        let t = facet_from_camera.translation.vector;
        if t.z <= 0.0 {
            return None;
        }
        let row = |i: usize| rotation.matrix().row(i).transpose();
        let u = row(0) * t.z - row(2) * t.x;
        let v = row(1) * t.z - row(2) * t.y;
        let w = -row(2);
        let as_f32 = |r: Vector3<f64>| [r.x as f32, r.y as f32, r.z as f32];
        Some(Self { u: as_f32(u), v: as_f32(v), w: as_f32(w), nearness: (1.0 / t.z) as f32 })
    }
}

impl SeenTag {
    fn new(tag: &super::solid::PrintedTag) -> Self {
        let half_m = tag.size_m * super::ink::MARGIN_RATIO / 2.0;
        Self {
            center: [tag.center.x as f32, tag.center.y as f32],
            x_axis: tag.x_axis.map(|v| v as f32),
            half_m: half_m as f32,
            cells_per_m: (CELLS as f64 / (2.0 * half_m)) as f32,
            white: tag.bitmap,
        }
    }

    /// Paper is white outside the tag.
    #[inline]
    fn is_white_at(&self, u: f32, v: f32) -> bool {
        let (du, dv) = (u - self.center[0], v - self.center[1]);
        let x = du * self.x_axis[0] + dv * self.x_axis[1];
        let y = dv * self.x_axis[0] - du * self.x_axis[1];
        let column = (x + self.half_m) * self.cells_per_m;
        let row = (self.half_m - y) * self.cells_per_m;
        if column < 0.0 || row < 0.0 {
            return true;
        }
        self.white.get(row as usize).and_then(|cells| cells.get(column as usize)).copied().unwrap_or(true)
    }
}

impl SeenLimb {
    fn new(camera: &Camera, limb: &Limb, camera_from_world: &Isometry3<f64>) -> Self {
        let (form, bounds) = match limb.shape {
            Shape::Capsule { a, b, radius_m } => {
                let (a, b) = (camera_from_world * a, camera_from_world * b);
                let form = Form::Capsule { a: a.coords.cast(), ab: (b - a).cast(), radius: radius_m as f32 };
                (form, Bounds::of(camera, [a, b].into_iter(), radius_m))
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
                (form, Bounds::of(camera, [Point3::from(center)].into_iter(), radii_m.max()))
            }
        };
        Self { form, albedo: limb.albedo, stripes: limb.stripes, bounds }
    }

    #[inline]
    fn hit(&self, number: u16, ray: Ray, behind: f32, lamp: &Lamp) -> Option<Hit> {
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

impl Bounds {
    /// The pixels that balls of one radius around some points may cover; `None` if one is too near.
    fn of(camera: &Camera, points: impl Iterator<Item = Point3<f64>>, radius_m: f64) -> Option<Self> {
        /// Lens distortion and blur may carry an outline this far out of the projected points.
        const SLACK_PX: f64 = 4.0;
        let mut bounds = Self {
            left: f64::INFINITY,
            top: f64::INFINITY,
            right: f64::NEG_INFINITY,
            bottom: f64::NEG_INFINITY,
        };
        for point in points {
            let center = camera.project(&point)?;
            let near = point.z - radius_m;
            if near <= 0.05 {
                return None;
            }
            // A ball off the axis projects to an ellipse that is longer by its distance from the axis.
            let stretch = point.coords.norm() / point.z;
            let reach = 1.1 * camera.focal_px.max() * radius_m / near * stretch * stretch + SLACK_PX;
            bounds.left = bounds.left.min(center.x - reach);
            bounds.right = bounds.right.max(center.x + reach);
            bounds.top = bounds.top.min(center.y - reach);
            bounds.bottom = bounds.bottom.max(center.y + reach);
        }
        Some(bounds)
    }
}
