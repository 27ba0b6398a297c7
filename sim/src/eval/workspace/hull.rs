//! Convex hull of points in space, by quickhull (Barber, Dobkin and Huhdanpaa, "The quickhull algorithm for convex
//! hulls", ACM Transactions on Mathematical Software 22, 1996).

use std::collections::HashMap;

use nalgebra::Vector3;

/// A convex polyhedron.
#[derive(Debug, Clone, Default)]
pub struct Hull {
    /// Corners.
    pub corners: Vec<Vector3<f64>>,
    /// Triangles, counter-clockwise seen from outside.
    pub faces: Vec<[usize; 3]>,
}

/// A face while the hull grows.
struct Face {
    corners: [usize; 3],
    normal: Vector3<f64>,
    offset: f64,
    /// Points that see it from outside.
    outside: Vec<usize>,
    alive: bool,
}

impl Face {
    fn new(points: &[Vector3<f64>], corners: [usize; 3]) -> Self {
        let [a, b, c] = corners.map(|corner| points[corner]);
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_else(Vector3::zeros);
        Self { corners, normal, offset: normal.dot(&a), outside: Vec::new(), alive: true }
    }

    fn height(&self, point: &Vector3<f64>) -> f64 {
        self.normal.dot(point) - self.offset
    }

    fn edges(&self) -> [(usize, usize); 3] {
        let [a, b, c] = self.corners;
        [(a, b), (b, c), (c, a)]
    }
}

struct Growth<'a> {
    points: &'a [Vector3<f64>],
    faces: Vec<Face>,
    /// The face on the left of each directed edge.
    left_of: HashMap<(usize, usize), usize>,
    /// Heights below this are none.
    tolerance: f64,
}

impl Hull {
    /// Of points that do not lie in a plane; empty if they do.
    pub fn of(points: &[Vector3<f64>]) -> Self {
        let size = points.iter().map(Vector3::amax).fold(0.0, f64::max);
        let Some(first) = tetrahedron(points, 1e-9 * size) else { return Self::default() };
        let mut growth =
            Growth { points, faces: Vec::new(), left_of: HashMap::new(), tolerance: 1e-10 * size };
        growth.begin(first);
        let mut next = 0;
        while next < growth.faces.len() {
            growth.grow(next);
            next += 1;
        }
        growth.finish()
    }

    /// Volume, m³: the sum of the tetrahedra between the faces and the origin.
    pub fn volume(&self) -> f64 {
        let of_face = |face: &[usize; 3]| {
            let [a, b, c] = face.map(|corner| self.corners[corner]);
            a.dot(&b.cross(&c)) / 6.0
        };
        self.faces.iter().map(of_face).sum()
    }
}

/// Four points with a volume, the last on the inner side of the first three.
fn tetrahedron(points: &[Vector3<f64>], tolerance: f64) -> Option<[usize; 4]> {
    let farthest = |measure: &dyn Fn(&Vector3<f64>) -> f64| {
        let best = points.iter().enumerate().max_by(|(_, p), (_, q)| measure(p).total_cmp(&measure(q)));
        best.filter(|(_, point)| measure(point) > tolerance).map(|(index, _)| index)
    };
    let a = (0..points.len()).min_by(|p, q| points[*p].x.total_cmp(&points[*q].x))?;
    let b = farthest(&|p| (p - points[a]).norm())?;
    let along = (points[b] - points[a]).normalize();
    let c = farthest(&|p| (p - points[a]).cross(&along).norm())?;
    let normal = (points[b] - points[a]).cross(&(points[c] - points[a])).normalize();
    let d = farthest(&|p| (p - points[a]).dot(&normal).abs())?;
    let inside_out = (points[d] - points[a]).dot(&normal) > 0.0;
    Some(if inside_out { [a, c, b, d] } else { [a, b, c, d] })
}

impl Growth<'_> {
    fn begin(&mut self, [a, b, c, d]: [usize; 4]) {
        let everything: Vec<usize> = (0..self.points.len()).collect();
        let faces = [[a, b, c], [a, d, b], [b, d, c], [c, d, a]];
        self.add(&faces, &everything);
    }

    /// Adds faces, and shares points among those that they see.
    fn add(&mut self, faces: &[[usize; 3]], points: &[usize]) {
        let first = self.faces.len();
        for corners in faces {
            let face = Face::new(self.points, *corners);
            for edge in face.edges() {
                self.left_of.insert(edge, self.faces.len());
            }
            self.faces.push(face);
        }
        for &point in points {
            let seen =
                self.faces[first..].iter_mut().find(|f| f.height(&self.points[point]) > self.tolerance);
            if let Some(face) = seen {
                face.outside.push(point);
            }
        }
    }

    /// Replaces all faces that the farthest point outside of one sees by a cone to that point.
    fn grow(&mut self, face: usize) {
        if !self.faces[face].alive {
            return;
        }
        let height = |point: &usize| self.faces[face].height(&self.points[*point]);
        let Some(apex) =
            self.faces[face].outside.iter().copied().max_by(|p, q| height(p).total_cmp(&height(q)))
        else {
            return;
        };
        let (mut seen, mut horizon, mut orphans) = (vec![face], Vec::new(), Vec::new());
        self.faces[face].alive = false;
        while let Some(face) = seen.pop() {
            orphans.append(&mut self.faces[face].outside);
            for (from, to) in self.faces[face].edges() {
                let Some(&beyond) = self.left_of.get(&(to, from)) else { continue };
                if !self.faces[beyond].alive {
                    continue;
                }
                if self.faces[beyond].height(&self.points[apex]) > self.tolerance {
                    self.faces[beyond].alive = false;
                    seen.push(beyond);
                } else {
                    horizon.push((from, to));
                }
            }
        }
        let cone: Vec<[usize; 3]> = horizon.iter().map(|(from, to)| [*from, *to, apex]).collect();
        self.add(&cone, &orphans);
    }

    fn finish(self) -> Hull {
        let mut places = HashMap::new();
        let mut hull = Hull::default();
        for face in self.faces.iter().filter(|face| face.alive) {
            let corners = face.corners.map(|corner| {
                *places.entry(corner).or_insert_with(|| {
                    hull.corners.push(self.points[corner]);
                    hull.corners.len() - 1
                })
            });
            hull.faces.push(corners);
        }
        hull
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn all_points_are_inside_and_the_surface_is_closed() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        for count in [5, 8, 20, 100, 1000] {
            let mut point = || Vector3::from_fn(|_, _| random.random_range(-1.0..=1.0));
            let points: Vec<_> = (0..count).map(|_| point()).collect();
            let sut = Hull::of(&points);
            for face in &sut.faces {
                let [a, b, c] = face.map(|corner| sut.corners[corner]);
                let normal = (b - a).cross(&(c - a)).normalize();
                assert!(points.iter().all(|point| normal.dot(&(point - a)) < 1e-7));
            }
            // Euler: V - E + F = 2 with E = 3F/2.
            assert_eq!(2 * sut.corners.len(), sut.faces.len() + 4);
            assert!(sut.volume() > 0.0 && sut.volume() < 8.0);
        }
    }

    #[test]
    fn a_box_with_points_inside_has_the_volume_of_the_box() {
        let mut points = vec![Vector3::new(0.1, 0.2, 0.3)];
        for corner in 0..8 {
            let side = |bit: usize, size: f64| if corner >> bit & 1 == 1 { size } else { 0.0 };
            points.push(Vector3::new(side(0, 1.0), side(1, 2.0), side(2, 3.0)));
        }
        let sut = Hull::of(&points);
        assert!((sut.volume() - 6.0).abs() < 1e-12);
        assert_eq!(sut.corners.len(), 8);
    }

    #[test]
    fn the_hull_of_many_points_of_a_sphere_has_nearly_its_volume() {
        // Fibonacci's spiral.
        let points: Vec<_> = (0..20_000)
            .map(|i| {
                let z = 1.0 - (2.0 * f64::from(i) + 1.0) / 20_000.0;
                let angle = f64::from(i) * 2.399_963_229_728_653;
                let radius = (1.0 - z * z).sqrt();
                Vector3::new(radius * angle.cos(), radius * angle.sin(), z)
            })
            .collect();
        let sphere = 4.0 / 3.0 * std::f64::consts::PI;
        assert!((Hull::of(&points).volume() / sphere - 1.0).abs() < 1e-3);
    }

    #[test]
    fn points_in_a_plane_have_no_hull() {
        let points: Vec<_> = (0..10).map(|i| Vector3::new(f64::from(i), f64::from(i * i), 0.0)).collect();
        assert_eq!(Hull::of(&points).volume(), 0.0);
    }
}
