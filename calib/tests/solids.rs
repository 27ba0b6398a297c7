//! The shells' STL files, judged by an independent reader of STL and by rays.

#![expect(clippy::expect_used, reason = "helpers of tests: a panic there is the report")]

use std::collections::HashMap;
use std::io::Cursor;
use std::path::Path;

use locoman_calib::print::solid::solid;
use locoman_calib::print::spec::Spec;
use locoman_vision::shells::{Shell, ShellTag, design};
use nalgebra::{Point3, Vector3};
use stl_io::IndexedMesh;

/// The issue's own number.
const MOST_ERROR_MM: f64 = 0.01;

fn shells() -> (Spec, Vec<(Shell, IndexedMesh)>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/calib/print.toml");
    let spec = Spec::load(&path).expect("valid");
    let shells = design::draw(&spec.dimensions()).shells.into_iter().map(|shell| {
        let bytes = solid(&shell, &spec).expect("drawn").to_stl();
        let mesh = stl_io::read_stl(&mut Cursor::new(bytes)).expect("an STL file");
        (shell, mesh)
    });
    let shells = shells.collect();
    (spec, shells)
}

fn corners(mesh: &IndexedMesh) -> Vec<[Point3<f64>; 3]> {
    let point = |k: usize| Point3::from(mesh.vertices[k].0.map(f64::from));
    mesh.faces.iter().map(|face| face.vertices.map(point)).collect()
}

/// Distance along a ray to the first triangle that it meets (Möller and Trumbore, 1997).
fn first_hit(triangles: &[[Point3<f64>; 3]], from: &Point3<f64>, along: &Vector3<f64>) -> Option<f64> {
    let hits = triangles.iter().filter_map(|[a, b, c]| {
        let (u, v) = (b - a, c - a);
        let p = along.cross(&v);
        let determinant = u.dot(&p);
        let offset = from - a;
        let x = offset.dot(&p) / determinant;
        let q = offset.cross(&u);
        let y = along.dot(&q) / determinant;
        let t = v.dot(&q) / determinant;
        (determinant.abs() > 1e-12 && x >= 0.0 && y >= 0.0 && x + y <= 1.0 && t > 0.0).then_some(t)
    });
    hits.min_by(f64::total_cmp)
}

#[test]
fn every_shell_is_watertight_and_turned_outwards() {
    for (shell, mesh) in shells().1 {
        let mut edges: HashMap<(usize, usize), usize> = HashMap::new();
        for face in &mesh.faces {
            for k in 0..3 {
                *edges.entry((face.vertices[k], face.vertices[(k + 1) % 3])).or_default() += 1;
            }
        }
        for ((a, b), count) in &edges {
            assert_eq!(*count, 1, "{}: an edge is used twice in one sense", shell.name);
            assert_eq!(edges.get(&(*b, *a)), Some(&1), "{}: an edge has one side only", shell.name);
        }
        let volume_mm3: f64 =
            corners(&mesh).iter().map(|[a, b, c]| a.coords.dot(&b.coords.cross(&c.coords)) / 6.0).sum();
        assert!((20_000.0..150_000.0).contains(&volume_mm3), "{}: {volume_mm3} mm3", shell.name);
        let least_mm2 =
            corners(&mesh).iter().map(|[a, b, c]| (b - a).cross(&(c - a)).norm() / 2.0).fold(1.0, f64::min);
        assert!(least_mm2 > 1e-6, "{}: a triangle without area", shell.name);
    }
}

#[test]
fn dimensions_are_those_of_the_file() {
    let (spec, shells) = shells();
    for (shell, mesh) in shells {
        let triangles = corners(&mesh);
        let extent = |axis: usize| {
            let along = triangles.iter().flatten().map(|p| p[axis]);
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
        };
        let edge_mm = |inradius_mm: f64| inradius_mm * design::EDGE_PER_INRADIUS;
        // Axis, low end, high end.
        let expected = match shell.name.as_str() {
            "torso" => vec![(2, -spec.torso.facet_mm, spec.torso.facet_mm)],
            name if name.ends_with("palm") => {
                let r = spec.palm.inradius_mm;
                vec![(0, -r, r), (1, -r, r), (2, -edge_mm(r) / 2.0 - spec.palm.skirt_mm, r)]
            }
            _ => {
                let r = spec.thumb.inradius_mm;
                vec![(2, -r, r), (1, -r, r), (0, -edge_mm(r) / 2.0 - spec.thumb.skirt_mm, r)]
            }
        };
        for (axis, low, high) in expected {
            let (seen_low, seen_high) = extent(axis);
            let error_mm = (seen_low - low).abs().max((seen_high - high).abs());
            assert!(error_mm < MOST_ERROR_MM, "{}: axis {axis} from {seen_low} to {seen_high}", shell.name);
        }
    }
}

#[test]
fn a_glued_tag_lies_where_the_shells_file_says() {
    /// Rays start so far outside.
    const AWAY_MM: f64 = 5.0;
    let (spec, shells) = shells();
    for (shell, mesh) in shells {
        let triangles = corners(&mesh);
        for tag in &shell.tags {
            let depth_at = |x: f64, y: f64| depth_mm(&triangles, tag, x, y, AWAY_MM);
            let half_mm = 1e3 * tag.size_m * design::MARGIN_FACTOR / 2.0;
            // Round the number: the floor of the recess lies a sticker's thickness below the printed face.
            for (x, y) in [(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9), (0.0, 0.9), (-0.95, 0.0)] {
                let error_mm = depth_at(x * half_mm, y * half_mm) - spec.sticker.thickness_mm;
                assert!(error_mm.abs() < MOST_ERROR_MM, "{} tag {}: {error_mm} mm", shell.name, tag.id);
            }
            // Just outside the recess: flush.
            let outside_mm = half_mm + spec.sticker.clearance_mm + 0.02;
            let error_mm = depth_at(outside_mm, 0.0);
            assert!(error_mm.abs() < MOST_ERROR_MM, "{} tag {}: {error_mm} mm", shell.name, tag.id);
        }
    }
}

/// How far below the printed face the solid begins, at a point of the tag's frame.
fn depth_mm(triangles: &[[Point3<f64>; 3]], tag: &ShellTag, x_mm: f64, y_mm: f64, away_mm: f64) -> f64 {
    let inwards = -tag.normal();
    let at_m = tag.shell_from_tag * Point3::new(x_mm / 1e3, y_mm / 1e3, 0.0);
    let from = Point3::from(1e3 * at_m.coords - inwards * away_mm);
    first_hit(triangles, &from, &inwards).expect("a hit") - away_mm
}
