//! Shells as solid polyhedra: the facets that carry the tags, and what closes the gaps between them.
//!
//! A shells file says where the tags are, not what they are glued to. The solid is taken to be the
//! intersection of the half-spaces behind the tags and of a box around them; where a shell is not convex a
//! facet is cut only by planes that leave its own tags whole.

use locoman_vision::shells::{Shell, ShellSet, ShellTag};
use nalgebra::{Isometry3, Point2, Point3, UnitQuaternion, Vector3};

use super::ink::{self, Bitmap, InkError, MARGIN_RATIO};
use super::motion::Body;

/// The box stands this far out of the tags' margins.
const BOX_CLEARANCE_M: f64 = 0.002;
/// Tags this close to one plane lie on one facet; a cut this deep into a margin is tolerated.
const COPLANAR_M: f64 = 5e-5;
/// Larger than any shell: the size of a facet before it is cut.
const UNCUT_M: f64 = 1.0;

/// A shell that cannot be rendered.
#[derive(Debug, thiserror::Error)]
pub enum SolidError {
    /// The script moves five bodies only.
    #[error("shell `{0}` is none of torso, right_palm, left_palm, right_thumb, left_thumb")]
    Name(String),
    /// A tag of it cannot be printed.
    #[error("shell `{shell}` cannot be printed")]
    Ink {
        /// The shell.
        shell: String,
        /// What is wrong with the tag.
        source: InkError,
    },
    /// A tag of a poster cannot be printed.
    #[error("a poster of the scene cannot be printed")]
    Poster(#[source] InkError),
    /// A visitor of the scene would need more tags than the family has.
    #[error(
        "a visitor with other tags needs {needed}, but the shells leave {free} of the family: use tags = \"same\""
    )]
    Visitor {
        /// As many as the operator wears.
        needed: usize,
        /// As many as he does not wear.
        free: usize,
    },
}

/// A tag on a facet.
#[derive(Debug, Clone)]
pub struct PrintedTag {
    /// Its number.
    pub id: u32,
    /// Side of the black square, metres.
    pub size_m: f64,
    /// Centre of the tag in the facet's plane.
    pub center: Point2<f64>,
    /// Direction of the tag's x axis in the facet's plane.
    pub x_axis: [f64; 2],
    /// Its cells.
    pub bitmap: Bitmap,
}

/// A flat convex face. Its frame: z out of the solid; the polygon runs counter-clockwise about z.
#[derive(Debug, Clone)]
pub struct Facet {
    /// Pose of the facet on the shell.
    pub shell_from_facet: Isometry3<f64>,
    /// Outline in the facet's plane.
    pub polygon: Vec<Point2<f64>>,
    /// What is printed on it.
    pub tags: Vec<PrintedTag>,
}

/// A shell with a surface.
#[derive(Debug, Clone)]
pub struct Solid {
    /// Which body wears it.
    pub body: Body,
    /// Its faces.
    pub facets: Vec<Facet>,
}

/// A half-space: points p with `normal . p <= offset_m` are inside.
#[derive(Debug, Clone, Copy)]
struct Plane {
    normal: Vector3<f64>,
    offset_m: f64,
}

impl Plane {
    fn height(&self, p: &Point3<f64>) -> f64 {
        self.normal.dot(&p.coords) - self.offset_m
    }
}

/// The solids of a set of shells, in its order.
pub fn solids(set: &ShellSet) -> Result<Vec<Solid>, SolidError> {
    set.shells.iter().map(|shell| solid(&set.family, shell)).collect()
}

/// A sheet with tags in a row, as a facet on its own; its frame is the poster's.
pub fn sheet(ids: &[u32], size_m: f64) -> Result<Facet, SolidError> {
    /// From centre to centre, in tag sides: room for a margin of a cell on each and of paper between.
    const PITCH: f64 = 1.5;
    let (middle, count) = (0.5 * (ids.len() as f64 - 1.0), ids.len() as f64);
    let tags = ids
        .iter()
        .enumerate()
        .map(|(i, &id)| {
            Ok(PrintedTag {
                id,
                size_m,
                center: Point2::new((i as f64 - middle) * PITCH * size_m, 0.0),
                x_axis: [1.0, 0.0],
                bitmap: ink::bitmap("tag36h11", id).map_err(SolidError::Poster)?,
            })
        })
        .collect::<Result<Vec<_>, SolidError>>()?;
    let (w, h) = (0.5 * count * PITCH * size_m, 0.5 * PITCH * size_m);
    Ok(Facet { shell_from_facet: Isometry3::identity(), polygon: rectangle(w, h), tags })
}

/// A tag of a facet that hangs on its upper edge: its print, and the back of its paper.
pub fn hanging(facet: &Facet, tag: &PrintedTag) -> [Facet; 2] {
    const TURN_RAD: f64 = -50.0 * std::f64::consts::PI / 180.0;
    /// So far before the facet, that the two do not cross at the edge.
    const LIFT_M: f64 = 0.0005;
    let half_m = 0.5 * tag.size_m * MARGIN_RATIO;
    let facet_from_tag = Isometry3::from_parts(
        Vector3::new(tag.center.x, tag.center.y, 0.0).into(),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), tag.x_axis[1].atan2(tag.x_axis[0])),
    );
    let tag_from_hanging = Isometry3::translation(0.0, half_m, LIFT_M)
        * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), TURN_RAD)
        * Isometry3::translation(0.0, -half_m, 0.0);
    let shell_from_front = facet.shell_from_facet * facet_from_tag * tag_from_hanging;
    let about = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let upright = PrintedTag { center: Point2::origin(), x_axis: [1.0, 0.0], ..tag.clone() };
    let polygon = rectangle(half_m, half_m);
    [
        Facet { shell_from_facet: shell_from_front, polygon: polygon.clone(), tags: vec![upright] },
        Facet { shell_from_facet: shell_from_front * about, polygon, tags: Vec::new() },
    ]
}

/// Half width, half height; counter-clockwise.
fn rectangle(w: f64, h: f64) -> Vec<Point2<f64>> {
    [(-w, -h), (w, -h), (w, h), (-w, h)].map(|(x, y)| Point2::new(x, y)).to_vec()
}

fn solid(family: &str, shell: &Shell) -> Result<Solid, SolidError> {
    let body = Body::from_name(&shell.name).ok_or_else(|| SolidError::Name(shell.name.clone()))?;
    let bitmaps = shell
        .tags
        .iter()
        .map(|tag| ink::bitmap(family, tag.id))
        .collect::<Result<Vec<_>, _>>()
        .map_err(|source| SolidError::Ink { shell: shell.name.clone(), source })?;

    let mut faces: Vec<(Isometry3<f64>, Vec<usize>)> = Vec::new();
    for (index, tag) in shell.tags.iter().enumerate() {
        match faces.iter_mut().find(|(facet, _)| lies_on(facet, tag)) {
            Some((_, tags)) => tags.push(index),
            None => faces.push((tag.shell_from_tag, vec![index])),
        }
    }
    faces.extend(closing_box(shell).map(|facet| (facet, Vec::new())));

    let planes: Vec<Plane> = faces.iter().map(|(facet, _)| plane_of(facet)).collect();
    let facets = faces
        .iter()
        .enumerate()
        .filter_map(|(own, (shell_from_facet, tags))| {
            let margins: Vec<Point3<f64>> = tags.iter().flat_map(|&tag| margin(&shell.tags[tag])).collect();
            let cutters = planes.iter().enumerate().filter(|(other, plane)| {
                *other != own && margins.iter().all(|corner| plane.height(corner) < COPLANAR_M)
            });
            let polygon = cut(shell_from_facet, cutters.map(|(_, plane)| plane));
            let tags =
                tags.iter().map(|&tag| printed(shell_from_facet, &shell.tags[tag], bitmaps[tag])).collect();
            (polygon.len() >= 3).then_some(Facet { shell_from_facet: *shell_from_facet, polygon, tags })
        })
        .collect();
    Ok(Solid { body, facets })
}

fn lies_on(shell_from_facet: &Isometry3<f64>, tag: &ShellTag) -> bool {
    margin(tag).iter().all(|corner| shell_from_facet.inverse_transform_point(corner).z.abs() < COPLANAR_M)
        && (shell_from_facet.rotation * Vector3::z()).dot(&(tag.shell_from_tag.rotation * Vector3::z())) > 0.0
}

/// Corners of the printed tag with its white margin, in the shell frame.
fn margin(tag: &ShellTag) -> [Point3<f64>; 4] {
    ShellTag { size_m: tag.size_m * MARGIN_RATIO, ..tag.clone() }.corners()
}

/// Six faces around all tags, for shells that are open on some side.
fn closing_box(shell: &Shell) -> impl Iterator<Item = Isometry3<f64>> + use<> {
    let corners: Vec<Point3<f64>> = shell.tags.iter().flat_map(margin).collect();
    let extent = |sign: f64, axis: usize| {
        corners.iter().map(|corner| sign * corner[axis]).fold(f64::NEG_INFINITY, f64::max) + BOX_CLEARANCE_M
    };
    let faces: Vec<_> = [1.0, -1.0]
        .into_iter()
        .flat_map(|sign| (0..3).map(move |axis| (sign, axis)))
        .map(|(sign, axis)| {
            let mut normal = Vector3::zeros();
            normal[axis] = sign;
            let rotation = UnitQuaternion::rotation_between(&Vector3::z(), &normal)
                .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
            Isometry3::from_parts((normal * extent(sign, axis)).into(), rotation)
        })
        .collect();
    faces.into_iter()
}

fn plane_of(shell_from_facet: &Isometry3<f64>) -> Plane {
    let normal = shell_from_facet.rotation * Vector3::z();
    Plane { normal, offset_m: normal.dot(&shell_from_facet.translation.vector) }
}

/// What is left of a facet's plane inside all the half-spaces (Sutherland and Hodgman's clipping).
fn cut<'a>(shell_from_facet: &Isometry3<f64>, planes: impl Iterator<Item = &'a Plane>) -> Vec<Point2<f64>> {
    let mut polygon = rectangle(UNCUT_M, UNCUT_M);
    for plane in planes {
        let height = |p: &Point2<f64>| plane.height(&(shell_from_facet * Point3::new(p.x, p.y, 0.0)));
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (i, a) in polygon.iter().enumerate() {
            let b = &polygon[(i + 1) % polygon.len()];
            let (ha, hb) = (height(a), height(b));
            if ha <= 0.0 {
                kept.push(*a);
            }
            if (ha <= 0.0) != (hb <= 0.0) {
                kept.push(a + (b - a) * (ha / (ha - hb)));
            }
        }
        polygon = kept;
    }
    polygon
}

fn printed(shell_from_facet: &Isometry3<f64>, tag: &ShellTag, bitmap: Bitmap) -> PrintedTag {
    let facet_from_tag = shell_from_facet.inv_mul(&tag.shell_from_tag);
    let center = facet_from_tag.translation.vector;
    let x_axis = facet_from_tag.rotation * Vector3::x();
    PrintedTag {
        id: tag.id,
        size_m: tag.size_m,
        center: Point2::new(center.x, center.y),
        x_axis: [x_axis.x, x_axis.y],
        bitmap,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube() -> ShellSet {
        let tags = closing_box(&Shell {
            name: "torso".into(),
            tags: vec![ShellTag { id: 0, size_m: 0.08, shell_from_tag: Isometry3::identity() }],
        })
        .enumerate()
        .map(|(id, face)| {
            let normal = face.rotation * Vector3::z();
            ShellTag {
                id: id as u32,
                size_m: 0.08,
                shell_from_tag: Isometry3::from_parts((normal * 0.06).into(), face.rotation),
            }
        })
        .collect();
        ShellSet { family: "tag36h11".into(), shells: vec![Shell { name: "torso".into(), tags }] }
    }

    #[test]
    fn six_tags_on_a_cube_make_six_square_facets() {
        let solids = solids(&cube()).unwrap();
        assert_eq!(solids[0].facets.len(), 6);
        for facet in &solids[0].facets {
            assert_eq!(facet.tags.len(), 1);
            for corner in &facet.polygon {
                assert!((corner.x.abs() - 0.06).abs() < 1e-12 && (corner.y.abs() - 0.06).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_foreign_family_is_refused_by_name() {
        let set = ShellSet { family: "tag25h9".into(), ..cube() };
        let error = format!("{:#}", anyhow::Error::from(solids(&set).unwrap_err()));
        assert!(error.contains("tag25h9"), "{error}");
    }
}
