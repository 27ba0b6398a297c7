//! The shells as closed solids for 3D printers.
//!
//! ```text
//!      facet with recess        the printed face of a glued tag is flush with the facet: it lies where the shells
//!     ┌───┐ ▁▁▁▁▁▁▁ ┌───┐       file says. In the recess' floor the tag's number is engraved, upright as the tag is.
//!     │   └─┐▁▁▁▁▁┌─┘   │
//!     │     number      │       slots in the skirt (palm, thumb) or the flanges (torso) take straps
//!     └─────────────────┘
//! ```
//! Domes stand on their rim and need no support but the short bridge of their top; the torso stands on an end.

use locoman_vision::shells::design::MARGIN_FACTOR;
use locoman_vision::shells::{Shell, ShellTag};
use nalgebra::{Matrix3, Point3, Vector3};

use super::PrintError;
use super::facets::{BELT, Facet, Kind, belt_corner, dome, plate_section};
use super::mesh::{Mesh, newell_normal};
use super::numerals::rectangles;
use super::spec::{Spec, Sticker, Torso};

/// Least wall that is left anywhere: three lines of a 0.4 mm nozzle.
const LEAST_WALL_MM: f64 = 1.2;
/// The belt's facets with strap slots: to the left and to the right.
const SLOTTED: [usize; 2] = [2, 6];
/// The belt's facet whose skirt carries the letter of the side.
const LETTERED: usize = 0;

type Outline = Vec<Point3<f64>>;

/// The solid of a shell, millimetres in the shell's frame.
pub fn solid(shell: &Shell, spec: &Spec) -> Result<Mesh, PrintError> {
    match Kind::of(shell) {
        Some(Kind::Torso) => plate(shell, spec),
        Some(kind) => domed(shell, kind, spec),
        None => Err(PrintError::UnknownShell { name: shell.name.clone() }),
    }
}

/// What of a dome is not its outer facets.
struct Hollow {
    /// Distance of the inner belt from the axis.
    inradius_mm: f64,
    /// Inner facets above the belt, seen from inside.
    ceiling: Vec<Outline>,
    /// Where the inner belt ends.
    top_mm: f64,
    rim_mm: f64,
    /// Height of the walls below the tags' facets.
    skirt_mm: f64,
    slot_mm: [f64; 2],
}

fn domed(shell: &Shell, kind: Kind, spec: &Spec) -> Result<Mesh, PrintError> {
    let outer_mm = if kind == Kind::Palm { spec.palm.inradius_mm } else { spec.thumb.inradius_mm };
    let half_edge_mm = -dome(outer_mm)[0][0].z;
    let hollow = if kind == Kind::Palm {
        let inradius_mm = spec.palm.inradius_mm - spec.palm.wall_mm;
        let ceiling: Vec<Outline> = dome(inradius_mm).split_off(BELT);
        Hollow {
            inradius_mm,
            top_mm: ceiling[0][0].z,
            ceiling,
            rim_mm: -half_edge_mm - spec.palm.skirt_mm,
            skirt_mm: spec.palm.skirt_mm,
            slot_mm: spec.palm.slot_mm,
        }
    } else {
        let thumb = &spec.thumb;
        let lid = (0..BELT).map(|k| belt_corner(thumb.bore_mm, k, thumb.bore_end_mm)).collect();
        Hollow {
            inradius_mm: thumb.bore_mm,
            ceiling: vec![lid],
            top_mm: thumb.bore_end_mm,
            rim_mm: -half_edge_mm - thumb.skirt_mm,
            skirt_mm: thumb.skirt_mm,
            slot_mm: thumb.slot_mm,
        }
    };
    let facets = kind.facets(spec);
    check_walls(shell, &facets, kind, &hollow, &spec.sticker)?;
    let shell_from_solid = kind.shell_from_solid();
    let place = |outline: Outline| -> Outline { outline.iter().map(|p| shell_from_solid * p).collect() };
    let ring = |inradius_mm: f64, z_mm: f64| -> Outline {
        (0..BELT).map(|k| belt_corner(inradius_mm, k, z_mm)).collect()
    };
    let mut mesh = Mesh::default();
    for facet in &facets[BELT..] {
        let recesses = facet.tags(shell).into_iter().map(|tag| recess(tag, &spec.sticker)).collect();
        faced(&mut mesh, &facet.corners, recesses, &[]);
    }
    for (k, facet) in facets.iter().take(BELT).enumerate() {
        let mut recesses: Vec<Recess> =
            facet.tags(shell).into_iter().map(|tag| recess(tag, &spec.sticker)).collect();
        // The facet goes on below its tag, down to the rim.
        let wall = |inradius_mm: f64, top_mm: f64| {
            let corner = |k: usize, z: f64| belt_corner(inradius_mm, k, z);
            let rim = hollow.rim_mm;
            place(vec![corner(k, rim), corner(k + 1, rim), corner(k + 1, top_mm), corner(k, top_mm)])
        };
        let skirt_middle_mm = (hollow.rim_mm - half_edge_mm) / 2.0;
        if k == LETTERED
            && let Some(letter) = side_letter(shell)
        {
            let height_mm = 0.45 * hollow.skirt_mm;
            let center = shell_from_solid * Point3::new(outer_mm, 0.0, skirt_middle_mm + 0.2 * height_mm);
            recesses.extend(engraving(
                letter,
                height_mm,
                &center,
                &(shell_from_solid * Matrix3::from_columns(&[Vector3::y(), Vector3::z(), Vector3::x()])),
                spec.sticker.engraving_mm,
            ));
        }
        let slots: Vec<(Outline, Outline)> = if SLOTTED.contains(&k) {
            let side = if k == SLOTTED[0] { 1.0 } else { -1.0 };
            let [half_width, half_height] = hollow.slot_mm.map(|length| length / 2.0);
            let at = |y_mm: f64| {
                let corner = |x: f64, z: f64| Point3::new(-side * x, side * y_mm, skirt_middle_mm + z);
                let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
                place(corners.map(|(x, z)| corner(x * half_width, z * half_height)).to_vec())
            };
            vec![(at(outer_mm), at(hollow.inradius_mm))]
        } else {
            Vec::new()
        };
        let (mouths, ends): (Vec<_>, Vec<_>) = slots.into_iter().unzip();
        for (mouth, end) in mouths.iter().zip(&ends) {
            mesh.walls(mouth, end);
        }
        faced(&mut mesh, &wall(outer_mm, half_edge_mm), recesses, &mouths);
        mesh.face(&reversed(wall(hollow.inradius_mm, hollow.top_mm)), &ends);
    }
    for outline in &hollow.ceiling {
        mesh.face(&reversed(place(outline.clone())), &[]);
    }
    let rim = reversed(place(ring(outer_mm, hollow.rim_mm)));
    mesh.face(&rim, &[place(ring(hollow.inradius_mm, hollow.rim_mm))]);
    Ok(mesh)
}

fn plate(shell: &Shell, spec: &Spec) -> Result<Mesh, PrintError> {
    let Torso { wall_mm, flange_mm, facet_mm, slot_mm: [slot_length_mm, slot_width_mm], .. } = spec.torso;
    let depth_mm = spec.sticker.thickness_mm + spec.sticker.engraving_mm;
    if wall_mm < depth_mm + LEAST_WALL_MM {
        return Err(PrintError::Wall {
            name: shell.name.clone(),
            left_mm: wall_mm - depth_mm,
            least_mm: LEAST_WALL_MM,
        });
    }
    if slot_width_mm > flange_mm - 2.0 * LEAST_WALL_MM || slot_length_mm > facet_mm - 2.0 * LEAST_WALL_MM {
        return Err(PrintError::Slot {
            name: shell.name.clone(),
            slot_mm: spec.torso.slot_mm,
            room_mm: [facet_mm - 2.0 * LEAST_WALL_MM, flange_mm - 2.0 * LEAST_WALL_MM],
        });
    }
    let front = plate_section(&spec.torso, flange_mm);
    let normals: Vec<Vector3<f64>> =
        (0..3).map(|k| (front[k + 1] - front[k]).cross(&Vector3::z()).normalize()).collect();
    // Parallel to the front; at the bends along the line that halves the angle.
    let back: Vec<Vector3<f64>> = (0..4_usize)
        .map(|k| {
            let (before, after) = (normals[k.saturating_sub(1)], normals[k.min(2)]);
            front[k] - (before + after) * (wall_mm / (1.0 + before.dot(&after)))
        })
        .collect();
    let at = |section: &[Vector3<f64>], k: usize, z_mm: f64| Point3::from(section[k] + z_mm * Vector3::z());
    let column = |section: &[Vector3<f64>], k: usize| {
        let corners = [(k, -facet_mm), (k + 1, -facet_mm), (k + 1, facet_mm), (k, facet_mm)];
        corners.map(|(k, z_mm)| at(section, k, z_mm)).to_vec()
    };
    let mut mesh = Mesh::default();
    for (k, normal) in normals.iter().enumerate() {
        let facet = Facet { corners: column(&front, k) };
        let recesses = facet.tags(shell).into_iter().map(|tag| recess(tag, &spec.sticker)).collect();
        let outwards = front[k + 1] - front[k];
        // The middle of the flange, from the outer end inwards.
        let end = match k {
            0 => Some(front[0] + outwards.normalize() * (flange_mm / 2.0)),
            2 => Some(front[3] - outwards.normalize() * (flange_mm / 2.0)),
            _ => None,
        };
        let slots: Vec<Outline> = end
            .iter()
            .flat_map(|middle| [-0.5, 0.5].map(|row| middle + row * facet_mm * Vector3::z()))
            .map(|center| {
                let (across, along) = (outwards.normalize() * slot_width_mm, Vector3::z() * slot_length_mm);
                [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
                    .map(|(x, z)| Point3::from(center + x * across + z * along))
                    .to_vec()
            })
            .collect();
        let ends: Vec<Outline> =
            slots.iter().map(|slot| slot.iter().map(|p| p - normal * wall_mm).collect()).collect();
        for (mouth, end) in slots.iter().zip(&ends) {
            mesh.walls(mouth, end);
        }
        faced(&mut mesh, &facet.corners, recesses, &slots);
        mesh.face(&reversed(column(&back, k)), &ends);
    }
    for (z_mm, above) in [(facet_mm, true), (-facet_mm, false)] {
        let section: Outline =
            (0..4).map(|k| at(&front, k, z_mm)).chain((0..4).rev().map(|k| at(&back, k, z_mm))).collect();
        mesh.face(&if above { section } else { reversed(section) }, &[]);
    }
    for (k, right) in [(0, true), (3, false)] {
        let side = vec![
            at(&back, k, -facet_mm),
            at(&front, k, -facet_mm),
            at(&front, k, facet_mm),
            at(&back, k, facet_mm),
        ];
        mesh.face(&if right { side } else { reversed(side) }, &[]);
    }
    Ok(mesh)
}

/// A hole with a floor, and holes with floors in that.
struct Recess {
    mouth: Outline,
    depth_mm: f64,
    within: Vec<Recess>,
}

/// The place of a sticker, with its number in the floor.
fn recess(tag: &ShellTag, sticker: &Sticker) -> Recess {
    let side_mm = 1e3 * tag.size_m * MARGIN_FACTOR + 2.0 * sticker.clearance_mm;
    let center = Point3::from(1e3 * tag.shell_from_tag.translation.vector);
    let axes = tag.shell_from_tag.rotation.to_rotation_matrix().into_inner();
    let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
    let mouth = corners.map(|(x, y)| center + axes * Vector3::new(x, y, 0.0) * side_mm).to_vec();
    let floor = center - axes.column(2) * sticker.thickness_mm;
    let within = engraving(&tag.id.to_string(), 0.4 * side_mm, &floor, &axes, sticker.engraving_mm);
    Recess { mouth, depth_mm: sticker.thickness_mm, within }
}

/// Text in a plane: `axes` are its right, its up, and the outward normal.
fn engraving(
    text: &str,
    height_mm: f64,
    center: &Point3<f64>,
    axes: &Matrix3<f64>,
    depth_mm: f64,
) -> Vec<Recess> {
    rectangles(text, height_mm)
        .into_iter()
        .map(|([left, low], [right, high])| {
            let corners = [(left, low), (right, low), (right, high), (left, high)];
            let mouth = corners.map(|(x, y)| center + axes * Vector3::new(x, y, 0.0)).to_vec();
            Recess { mouth, depth_mm, within: Vec::new() }
        })
        .collect()
}

/// A face with recesses, and with holes whose walls stand elsewhere.
fn faced(mesh: &mut Mesh, outline: &[Point3<f64>], recesses: Vec<Recess>, holes: &[Outline]) {
    let mouths: Vec<Outline> =
        recesses.iter().map(|recess| recess.mouth.clone()).chain(holes.iter().cloned()).collect();
    mesh.face(outline, &mouths);
    let normal = newell_normal(outline);
    for recess in recesses {
        let floor: Outline = recess.mouth.iter().map(|p| p - normal * recess.depth_mm).collect();
        mesh.walls(&recess.mouth, &floor);
        faced(mesh, &floor, recess.within, &[]);
    }
}

/// Refuses a hollow that leaves too little wall, or slots wider than the skirt.
fn check_walls(
    shell: &Shell,
    facets: &[Facet],
    kind: Kind,
    hollow: &Hollow,
    sticker: &Sticker,
) -> Result<(), PrintError> {
    let name = || shell.name.clone();
    let shell_from_solid = kind.shell_from_solid();
    let belt = (0..BELT).map(|k| belt_corner(hollow.inradius_mm, k, hollow.top_mm));
    let inner = belt.chain(hollow.ceiling.iter().flatten().copied()).map(|p| shell_from_solid * p);
    let depth_of = |p: Point3<f64>| {
        facets.iter().map(|facet| (facet.corners[0] - p).dot(&facet.normal())).fold(f64::INFINITY, f64::min)
    };
    let wall_mm = inner.map(depth_of).fold(f64::INFINITY, f64::min);
    let left_mm = wall_mm - sticker.thickness_mm - sticker.engraving_mm;
    if left_mm < LEAST_WALL_MM {
        return Err(PrintError::Wall { name: name(), left_mm, least_mm: LEAST_WALL_MM });
    }
    let [a, b] = [0, 1].map(|k| belt_corner(hollow.inradius_mm, k, 0.0));
    // Half a least wall on each side: a slot is not a wall's only support.
    let room_mm = [(b - a).norm(), hollow.skirt_mm].map(|length| length - LEAST_WALL_MM);
    if hollow.slot_mm[0] > room_mm[0] || hollow.slot_mm[1] > room_mm[1] {
        return Err(PrintError::Slot { name: name(), slot_mm: hollow.slot_mm, room_mm });
    }
    Ok(())
}

fn side_letter(shell: &Shell) -> Option<&'static str> {
    match shell.name.split_once('_') {
        Some(("left", _)) => Some("L"),
        Some(("right", _)) => Some("r"),
        _ => None,
    }
}

fn reversed(mut outline: Outline) -> Outline {
    outline.reverse();
    outline
}
