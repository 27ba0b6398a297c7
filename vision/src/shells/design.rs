//! The standard shells, as `configs/shells/standard.toml` describes them: drawn here, printed from there.
//!
//! Every facet holds one tag with a white margin of one cell (an eighth of the black square) all round,
//! which the detector needs to find the black border.
//!
//! * **Palm**, a dome over the back of the hand: half a rhombicuboctahedron, its axis z. Frame: origin at
//!   the dome's centre, x towards the fingers, y left, z out of the back of the hand (up when the palm
//!   faces down). The facet towards the wrist stays bare: straps and forearm pass there.
//! * **Thumb**, a cap over the thumb's end: the same solid, smaller, its axis x towards the thumb's tip.
//! * **Torso**, a plate on the chest, bent twice: x out of the chest, y left, z up; origin at the centre of
//!   its middle part.
//!
//! Left shells mirror the right ones in y; the solids are symmetric, so only the order of ids differs.

use std::f64::consts::{FRAC_PI_4, SQRT_2};
use std::fmt::Write;

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::{Shell, ShellSet, ShellTag};

/// What the shells are drawn from: metres and radians. The default is the standard shells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dimensions {
    /// Black square of a palm tag.
    pub palm_tag_m: f64,
    /// Distance of the palm's facets from its origin.
    pub palm_inradius_m: f64,
    /// Black square of a thumb tag.
    pub thumb_tag_m: f64,
    /// Distance of the thumb's facets from its origin.
    pub thumb_inradius_m: f64,
    /// Black square of a torso tag.
    pub torso_tag_m: f64,
    /// Side of the square that a torso tag with its margin gets on the plate.
    pub torso_facet_m: f64,
    /// How far the torso's side columns are bent back.
    pub torso_bend_rad: f64,
}

impl Default for Dimensions {
    fn default() -> Self {
        Self {
            palm_tag_m: 0.025,
            palm_inradius_m: 0.045,
            thumb_tag_m: 0.014,
            thumb_inradius_m: 0.0215,
            torso_tag_m: 0.055,
            torso_facet_m: 0.072,
            // 35 degrees.
            torso_bend_rad: 0.610_865,
        }
    }
}

/// Side of a tag with its white margin of one cell, per side of its black square of eight cells.
pub const MARGIN_FACTOR: f64 = 10.0 / 8.0;

/// Edge of a rhombicuboctahedron per distance of its square facets from the centre.
pub const EDGE_PER_INRADIUS: f64 = 2.0 / (1.0 + SQRT_2);

/// The standard shells.
pub fn standard() -> ShellSet {
    draw(&Dimensions::default())
}

/// Shells of these dimensions, numbered from 0: torso, palms, thumbs; the right one first.
pub fn draw(dimensions: &Dimensions) -> ShellSet {
    let Dimensions { palm_tag_m, thumb_tag_m, torso_tag_m, .. } = *dimensions;
    let mut next_id = 0..;
    let mut shell = |name: &str, size_m: f64, facets: Vec<Isometry3<f64>>| Shell {
        name: name.to_owned(),
        tags: facets
            .into_iter()
            .zip(&mut next_id)
            .map(|(shell_from_tag, id)| ShellTag { id, size_m, shell_from_tag })
            .collect(),
    };
    let shells = vec![
        shell("torso", torso_tag_m, torso(dimensions)),
        shell("right_palm", palm_tag_m, palm(dimensions.palm_inradius_m, 1.0)),
        shell("left_palm", palm_tag_m, palm(dimensions.palm_inradius_m, -1.0)),
        shell("right_thumb", thumb_tag_m, thumb(dimensions.thumb_inradius_m, 1.0)),
        shell("left_thumb", thumb_tag_m, thumb(dimensions.thumb_inradius_m, -1.0)),
    ];
    ShellSet { family: "tag36h11".to_owned(), shells }
}

/// Dome round z without the belt's facet towards the wrist (-x), the fifth of the belt.
fn palm(inradius_m: f64, side: f64) -> Vec<Isometry3<f64>> {
    const WRIST: usize = 4;
    let mut facets = dome(inradius_m, side, &Matrix3::identity());
    facets.remove(WRIST);
    facets
}

/// Dome round x; the belt starts at the nail (z).
fn thumb(inradius_m: f64, side: f64) -> Vec<Isometry3<f64>> {
    dome(inradius_m, side, &thumb_from_dome())
}

/// Rotation from the frame of a dome (its axis z) to that of a thumb; a palm's frame is the dome's own.
pub fn thumb_from_dome() -> Matrix3<f64> {
    Matrix3::from_columns(&[Vector3::z(), Vector3::y() * -1.0, Vector3::x()])
}

/// Upper half of a rhombicuboctahedron: a belt of eight facets, four slanted by 45 degrees, one on top.
///
/// `side` is 1 or -1 and sets the sense in which the belt is numbered.
fn dome(inradius_m: f64, side: f64, shell_from_dome: &Matrix3<f64>) -> Vec<Isometry3<f64>> {
    let direction = |azimuth_rad: f64, elevation_rad: f64| {
        let (sin_azimuth, cos_azimuth) = (side * azimuth_rad).sin_cos();
        let (sin_elevation, cos_elevation) = elevation_rad.sin_cos();
        Vector3::new(cos_elevation * cos_azimuth, cos_elevation * sin_azimuth, sin_elevation)
    };
    let belt = (0..8).map(|k| (direction(f64::from(k) * FRAC_PI_4, 0.0), Vector3::z()));
    let slanted = (0..4).map(|k| (direction(f64::from(k) * 2.0 * FRAC_PI_4, FRAC_PI_4), Vector3::z()));
    let top = (Vector3::z(), Vector3::x());
    belt.chain(slanted)
        .chain([top])
        .map(|(normal, up)| {
            let normal = shell_from_dome * normal;
            facet(normal * inradius_m, normal, shell_from_dome * up)
        })
        .collect()
}

/// Columns from the wearer's right to left, in each the lower row first.
fn torso(dimensions: &Dimensions) -> Vec<Isometry3<f64>> {
    let half = dimensions.torso_facet_m / 2.0;
    let mut facets = Vec::new();
    for column in [-1.0, 0.0, 1.0] {
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), column * dimensions.torso_bend_rad);
        // From the middle of the plate to the bend, then half a facet along the bent part.
        let center = column * (Vector3::y() * half + turn * Vector3::y() * half);
        for row in [-1.0, 1.0] {
            let origin = center + Vector3::z() * (row * half);
            facets.push(facet(origin, turn * Vector3::x(), Vector3::z()));
        }
    }
    facets
}

/// Pose of a tag whose face looks along `normal`; its upper edge points as near to `up` as it can.
fn facet(center: Vector3<f64>, normal: Vector3<f64>, up: Vector3<f64>) -> Isometry3<f64> {
    let z = normal.normalize();
    let y = (up - z * z.dot(&up)).normalize();
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[y.cross(&z), y, z]));
    Isometry3::from_parts(Translation3::from(center), UnitQuaternion::from_rotation_matrix(&rotation))
}

/// The file that describes the shells.
pub fn to_toml(set: &ShellSet) -> String {
    let mut text = String::from(HEAD);
    let _ = writeln!(text, "family = \"{}\"", set.family);
    for shell in &set.shells {
        let _ = writeln!(text, "\n[[shell]]\nname = \"{}\"", shell.name);
        for tag in &shell.tags {
            let p = tag.shell_from_tag.translation.vector.map(clean);
            // The scalar part is kept positive: q and -q are the same rotation.
            let q = tag.shell_from_tag.rotation.quaternion();
            let q = (if q.w < 0.0 { -q } else { *q }).coords.map(clean);
            let _ = writeln!(
                text,
                "  [[shell.tag]]\n  id = {}\n  size = {}\n  shell_from_tag = {{ xyz = [{}, {}, {}], \
                 quat = [{}, {}, {}, {}] }}",
                tag.id, tag.size_m, p.x, p.y, p.z, q.w, q.x, q.y, q.z
            );
        }
    }
    text
}

/// Rounds to nine digits (a nanometre) and loses the sign of zero, so that the text is the same everywhere.
fn clean(number: f64) -> f64 {
    (number * 1e9).round() / 1e9 + 0.0
}

const HEAD: &str = "\
# The standard shells. Drawn by `vision/src/shells/design.rs`; to change them, change that and run
#   cargo run -p locoman-vision --example standard_shells > configs/shells/standard.toml
#
# family          tag family of all tags
# shell.name      torso, right_palm, left_palm, right_thumb, left_thumb
# tag.id          number within the family, used once in the whole file
# tag.size        metres, side of the black square (8 cells); one white cell more all round
# shell_from_tag  pose of the tag on the shell: xyz in metres, quat = [w, x, y, z]; tag frame: origin at
#                 its centre, x right, y up, z out of the printed face
#
# Frames. palm: x to the fingers, y left, z out of the back of the hand. thumb: x to the tip, z out of the
# nail. torso: x out of the chest, y left, z up.
";

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn directions() -> impl Iterator<Item = Vector3<f64>> {
        // Fibonacci's sphere: even coverage.
        const COUNT: u32 = 4000;
        (0..COUNT).map(|k| {
            let z = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(COUNT);
            let azimuth = f64::from(k) * 2.399_963;
            let r = (1.0 - z * z).sqrt();
            Vector3::new(r * azimuth.cos(), r * azimuth.sin(), z)
        })
    }

    /// Where cameras may stand, seen from a shell that is worn and used as intended.
    fn may_face_a_camera(shell: &str, direction: &Vector3<f64>) -> bool {
        match shell {
            // In front, up to 60 degrees to either side, 45 up or down.
            "torso" => {
                direction.x > 0.0
                    && direction.y.atan2(direction.x).abs() < 60_f64.to_radians()
                    && direction.z.abs() < 45_f64.to_radians().sin()
            }
            // All but 30 degrees and more below the horizon, and but for the forearm's side.
            "right_palm" | "left_palm" => direction.z > -0.5 && direction.x > -0.5,
            // All but a cone (60 degrees) round the thumb's root.
            _ => direction.x > -0.5,
        }
    }

    #[test]
    fn at_least_two_tags_are_seen_from_any_side_that_faces_a_camera() {
        /// Beyond it a tag is too oblique to be read reliably.
        const FACING_COS: f64 = 0.5;
        for shell in standard().shells {
            let seen_from = |direction: Vector3<f64>| {
                shell.tags.iter().filter(|tag| tag.normal().dot(&direction) > FACING_COS).count()
            };
            let counts: Vec<usize> = directions()
                .filter(|direction| may_face_a_camera(&shell.name, direction))
                .map(seen_from)
                .collect();
            assert!(counts.len() > 400, "{}: {} directions", shell.name, counts.len());
            let least = counts.into_iter().min();
            assert!(least >= Some(2), "{}: {least:?}", shell.name);
        }
    }

    #[test]
    fn palms_and_thumbs_have_at_least_eight_facets() {
        for shell in standard().shells.iter().skip(1) {
            assert!(shell.tags.len() >= 8, "{}: {}", shell.name, shell.tags.len());
        }
    }

    #[test]
    fn tags_with_their_margin_fit_their_facets() {
        let sut = Dimensions::default();
        assert!(sut.palm_tag_m * MARGIN_FACTOR < sut.palm_inradius_m * EDGE_PER_INRADIUS);
        assert!(sut.thumb_tag_m * MARGIN_FACTOR < sut.thumb_inradius_m * EDGE_PER_INRADIUS);
        assert!(sut.torso_tag_m * MARGIN_FACTOR < sut.torso_facet_m);
    }

    #[test]
    fn every_tag_looks_outwards() {
        for shell in standard().shells {
            for tag in shell.tags {
                let outwards = match shell.name.as_str() {
                    "torso" => tag.normal().x,
                    _ => tag.normal().dot(&tag.center().coords.normalize()),
                };
                assert!(outwards > 0.8, "{} {}", shell.name, tag.id);
            }
        }
    }

    #[test]
    fn the_file_is_what_the_design_gives() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/shells/standard.toml");
        let text = std::fs::read_to_string(&path).expect("standard.toml");
        assert_eq!(text, to_toml(&standard()), "run the command in the file's head");
        let read = ShellSet::load(&path).expect("valid");
        for (from_file, designed) in read.shells.iter().zip(&standard().shells) {
            for (a, b) in from_file.tags.iter().zip(&designed.tags) {
                assert_eq!(a.id, b.id);
                let error = a.shell_from_tag.inverse() * b.shell_from_tag;
                assert!(error.translation.vector.norm() < 1e-8 && error.rotation.angle() < 1e-7);
            }
        }
    }
}
