//! The outer facets of the shells, as `vision/src/shells/design.rs` describes their tags.
//!
//! Convention: millimetres in the shell's frame; corners counter-clockwise from outside. Tags are found on facets by
//! where they lie, so numbering and mirroring stay in one place.

use locoman_vision::shells::design::{EDGE_PER_INRADIUS, thumb_from_dome};
use locoman_vision::shells::{Shell, ShellTag};
use nalgebra::{Matrix3, Point3, Rotation3, Vector3};

use super::mesh::newell_normal;
use super::spec::{Spec, Torso};

/// Half an edge of a dome per distance of its square facets from the centre.
const HALF_EDGE: f64 = EDGE_PER_INRADIUS / 2.0;
/// Facets of a dome's belt.
pub const BELT: usize = 8;

/// A plane facet.
#[derive(Debug, Clone)]
pub struct Facet {
    /// Counter-clockwise from outside.
    pub corners: Vec<Point3<f64>>,
}

impl Facet {
    /// The unit normal, outwards.
    pub fn normal(&self) -> Vector3<f64> {
        newell_normal(&self.corners)
    }

    /// The tags that lie on it.
    pub fn tags<'a>(&self, shell: &'a Shell) -> Vec<&'a ShellTag> {
        /// The shells file is written in nanometres.
        const ON_PLANE_MM: f64 = 1e-4;
        let normal = self.normal();
        let holds = |p: Point3<f64>| {
            let next = self.corners.iter().cycle().skip(1);
            let inside = |(a, b): (&Point3<f64>, &Point3<f64>)| (b - a).cross(&(p - a)).dot(&normal) > 0.0;
            (p - self.corners[0]).dot(&normal).abs() < ON_PLANE_MM
                && self.corners.iter().zip(next).all(inside)
        };
        shell.tags.iter().filter(|tag| holds(tag.center() * 1e3)).collect()
    }
}

/// What kind of solid a shell is, by its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A dome round z.
    Palm,
    /// A dome round x.
    Thumb,
    /// A bent plate.
    Torso,
}

impl Kind {
    /// By the shell's name.
    pub fn of(shell: &Shell) -> Option<Self> {
        match shell.name.as_str() {
            "right_palm" | "left_palm" => Some(Self::Palm),
            "right_thumb" | "left_thumb" => Some(Self::Thumb),
            "torso" => Some(Self::Torso),
            _ => None,
        }
    }

    /// Rotation from the solid's own frame (a dome's axis is z) to the shell's.
    pub fn shell_from_solid(self) -> Matrix3<f64> {
        if self == Self::Thumb { thumb_from_dome() } else { Matrix3::identity() }
    }

    /// The facets, in the shell's frame. Domes: the belt, the slanted squares, the triangles, the top. Torso: the
    /// three columns, then a brace above and one below.
    pub fn facets(self, spec: &Spec) -> Vec<Facet> {
        let shell_from_solid = self.shell_from_solid();
        let solids = match self {
            Self::Palm => dome(spec.palm.inradius_mm),
            Self::Thumb => dome(spec.thumb.inradius_mm),
            Self::Torso => plate(&spec.torso),
        };
        let moved = |corners: Vec<Point3<f64>>| corners.into_iter().map(|p| shell_from_solid * p).collect();
        solids.into_iter().map(|corners| Facet { corners: moved(corners) }).collect()
    }
}

/// Corner `k` of a belt of eight facets at a distance from the axis: before facet `k`, counter-clockwise from above.
pub fn belt_corner(inradius_mm: f64, k: usize, z_mm: f64) -> Point3<f64> {
    let (r, h) = (inradius_mm, inradius_mm * HALF_EDGE);
    let corners = [(r, -h), (r, h), (h, r), (-h, r), (-r, h), (-r, -h), (-h, -r), (h, -r)];
    let (x, y) = corners[k % BELT];
    Point3::new(x, y, z_mm)
}

/// Upper half of a rhombicuboctahedron round z.
pub fn dome(inradius_mm: f64) -> Vec<Vec<Point3<f64>>> {
    let (r, h) = (inradius_mm, inradius_mm * HALF_EDGE);
    let corner = |k: usize, z: f64| belt_corner(r, k, z);
    let belt = (0..BELT).map(|k| vec![corner(k, -h), corner(k + 1, -h), corner(k + 1, h), corner(k, h)]);
    // The top's corner above each triangle, which stands over every other facet of the belt.
    let top = [(h, h), (-h, h), (-h, -h), (h, -h)].map(|(x, y)| Point3::new(x, y, r));
    let slanted = (0..4).map(|k| vec![corner(2 * k, h), corner(2 * k + 1, h), top[k], top[(k + 3) % 4]]);
    let triangles = (0..4).map(|k| vec![corner(2 * k + 1, h), corner(2 * k + 2, h), top[k]]);
    belt.chain(slanted).chain(triangles).chain([top.to_vec()]).collect()
}

/// Where the plate's columns begin and end, seen from above, from the wearer's right to left; `flange_mm` more at
/// both ends.
pub fn plate_section(torso: &Torso, flange_mm: f64) -> [Vector3<f64>; 4] {
    let half = torso.facet_mm / 2.0;
    let along = |side: f64| {
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), side * torso.bend_rad);
        side * (Vector3::y() * half + turn * Vector3::y() * (torso.facet_mm + flange_mm))
    };
    [along(-1.0), -half * Vector3::y(), half * Vector3::y(), along(1.0)]
}

fn plate(torso: &Torso) -> Vec<Vec<Point3<f64>>> {
    let section = plate_section(torso, 0.0);
    let at = |k: usize, z: f64| Point3::from(section[k] + z * Vector3::z());
    let height = torso.facet_mm;
    let column = |k: usize| vec![at(k, -height), at(k + 1, -height), at(k + 1, height), at(k, height)];
    let above = (0..4).map(|k| at(k, height)).collect();
    let below = (0..4).rev().map(|k| at(k, -height)).collect();
    vec![column(0), column(1), column(2), above, below]
}
