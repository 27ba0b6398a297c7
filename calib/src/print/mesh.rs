//! A closed surface of triangles, and the STL file that slicers read.
//!
//! Convention: millimetres in the shell's frame; triangles are seen counter-clockwise from outside. Faces of a solid
//! share whole edges, so that the surface closes without cracks; a vertex that two faces compute is kept once.

use nalgebra::{Point3, Vector3};

use super::triangulate::triangulate;

/// Vertices nearer than this are the same one; far below what any printer resolves.
const SAME_MM: f64 = 1e-5;

/// A surface of triangles.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    /// Corners, each once.
    pub vertices: Vec<Point3<f64>>,
    /// Indices into the vertices, counter-clockwise from outside.
    pub triangles: Vec<[usize; 3]>,
}

impl Mesh {
    /// Adds a plane face: its outline counter-clockwise from outside, and holes in it (either sense).
    pub fn face(&mut self, outline: &[Point3<f64>], holes: &[Vec<Point3<f64>>]) {
        let normal = newell_normal(outline);
        let Some(origin) = outline.first() else { return };
        let right = normal.cross(&any_across(&normal)).normalize();
        let up = normal.cross(&right);
        let flat = |points: &[Point3<f64>]| -> Vec<[f64; 2]> {
            points.iter().map(|p| [(p - origin).dot(&right), (p - origin).dot(&up)]).collect()
        };
        let flat_holes: Vec<Vec<[f64; 2]>> = holes.iter().map(|hole| flat(hole)).collect();
        let corners: Vec<usize> =
            outline.iter().chain(holes.iter().flatten()).map(|point| self.vertex(point)).collect();
        let triangles = triangulate(&flat(outline), &flat_holes);
        self.triangles.extend(triangles.into_iter().map(|triangle| triangle.map(|k| corners[k])));
    }

    /// The walls of a hole from one outline to the other, point by point; counter-clockwise from outside.
    pub fn walls(&mut self, mouth: &[Point3<f64>], end: &[Point3<f64>]) {
        for k in 0..mouth.len().min(end.len()) {
            let next = (k + 1) % mouth.len();
            self.face(&[mouth[k], mouth[next], end[next], end[k]], &[]);
        }
    }

    fn vertex(&mut self, point: &Point3<f64>) -> usize {
        let known = self.vertices.iter().position(|other| (other - point).norm() < SAME_MM);
        known.unwrap_or_else(|| {
            self.vertices.push(*point);
            self.vertices.len() - 1
        })
    }

    /// The binary STL file.
    pub fn to_stl(&self) -> Vec<u8> {
        /// Free text of the format, padded with spaces; must not begin with `solid`.
        const HEAD: [u8; 80] =
            *b"LocoMan Teleop shell, millimetres, in the shell's frame                         ";
        let mut bytes = Vec::with_capacity(84 + 50 * self.triangles.len());
        bytes.extend_from_slice(&HEAD);
        bytes.extend_from_slice(&u32::try_from(self.triangles.len()).unwrap_or(u32::MAX).to_le_bytes());
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|k| self.vertices[k]);
            let normal = (b - a).cross(&(c - a)).normalize();
            for vector in [normal, a.coords, b.coords, c.coords] {
                for number in vector.iter() {
                    bytes.extend_from_slice(&(*number as f32).to_le_bytes());
                }
            }
            bytes.extend_from_slice(&[0, 0]);
        }
        bytes
    }
}

/// The unit normal of a plane outline that is seen counter-clockwise from where it points.
pub fn newell_normal(outline: &[Point3<f64>]) -> Vector3<f64> {
    let next = outline.iter().cycle().skip(1);
    outline.iter().zip(next).map(|(a, b)| a.coords.cross(&b.coords)).sum::<Vector3<f64>>().normalize()
}

/// The axis that is farthest from a direction.
fn any_across(direction: &Vector3<f64>) -> Vector3<f64> {
    let axis = direction.iamin();
    Vector3::from_fn(|row, _| f64::from(u8::from(row == axis)))
}
