//! Cuts a plane polygon with holes into triangles, by clipping ears.
//!
//! Each hole is first joined to the outline by the shortest bridge that crosses nothing; of the ears that may then be
//! cut off, the one with the widest smallest angle goes first, which keeps slivers out. The polygons have some tens of
//! corners: that it takes time with the cube of them does not matter.

/// A point in the plane.
type Point = [f64; 2];

/// Below it an area (mm²) counts as none.
const NO_AREA: f64 = 1e-9;

/// Triangles, counter-clockwise, as indices into the corners of the outline followed by those of the holes in turn.
///
/// The outline is counter-clockwise; holes lie inside, do not touch, and may have either sense.
pub fn triangulate(outline: &[Point], holes: &[Vec<Point>]) -> Vec<[usize; 3]> {
    let points: Vec<Point> = outline.iter().chain(holes.iter().flatten()).copied().collect();
    let mut ring: Vec<usize> = (0..outline.len()).collect();
    let mut first = outline.len();
    let mut waiting: Vec<Vec<usize>> = holes
        .iter()
        .map(|hole| {
            let indices = first..first + hole.len();
            first += hole.len();
            if signed_area(hole) > 0.0 { indices.rev().collect() } else { indices.collect() }
        })
        .collect();
    while let Some((hole, join)) = shortest_bridge(&points, &ring, &waiting) {
        let hole = waiting.swap_remove(hole);
        let (at, from) = join;
        let around = hole[from..].iter().chain(&hole[..=from]).copied();
        // There, round the hole, and back to the same corner.
        let detour: Vec<usize> = around.chain([ring[at]]).collect();
        ring.splice(at + 1..at + 1, detour);
    }
    clip_ears(&points, ring)
}

/// The hole, and the places in ring and hole, that the shortest bridge which crosses nothing joins.
fn shortest_bridge(
    points: &[Point],
    ring: &[usize],
    holes: &[Vec<usize>],
) -> Option<(usize, (usize, usize))> {
    let mut best: Option<(f64, usize, (usize, usize))> = None;
    for (number, hole) in holes.iter().enumerate() {
        for (from, &h) in hole.iter().enumerate() {
            for (at, &p) in ring.iter().enumerate() {
                let length = distance(points[h], points[p]);
                if best.is_none_or(|(least, ..)| length < least)
                    && looks_inwards(points, ring, at, points[h])
                    && !crosses_anything(points, ring, holes, (h, p))
                {
                    best = Some((length, number, (at, from)));
                }
            }
        }
    }
    best.map(|(_, number, join)| (number, join))
}

/// Whether the direction from a corner of the ring to a target runs inside the polygon at first.
fn looks_inwards(points: &[Point], ring: &[usize], at: usize, target: Point) -> bool {
    let count = ring.len();
    let (before, corner, after) =
        (points[ring[(at + count - 1) % count]], points[ring[at]], points[ring[(at + 1) % count]]);
    let left_of = |a: Point, b: Point| cross(a, b, target) > NO_AREA;
    if cross(before, corner, after) > 0.0 {
        left_of(before, corner) && left_of(corner, after)
    } else {
        left_of(before, corner) || left_of(corner, after)
    }
}

fn crosses_anything(points: &[Point], ring: &[usize], holes: &[Vec<usize>], (h, p): (usize, usize)) -> bool {
    let edges = |closed: &[usize]| -> Vec<(usize, usize)> {
        closed.iter().zip(closed.iter().cycle().skip(1)).map(|(a, b)| (*a, *b)).collect()
    };
    let (from, to) = (points[h], points[p]);
    holes.iter().map(Vec::as_slice).chain([ring]).flat_map(edges).any(|(a, b)| {
        let touches = |k: usize| k != h && k != p && lies_on(points[k], from, to);
        if touches(a) || touches(b) {
            return true;
        }
        if [a, b].iter().any(|k| *k == h || *k == p) {
            return false;
        }
        let (a, b) = (points[a], points[b]);
        cross(a, b, from) * cross(a, b, to) < 0.0 && cross(from, to, a) * cross(from, to, b) < 0.0
    })
}

fn clip_ears(points: &[Point], mut ring: Vec<usize>) -> Vec<[usize; 3]> {
    let mut triangles = Vec::with_capacity(ring.len());
    while ring.len() >= 3 {
        let count = ring.len();
        let ear = |at: usize| [ring[(at + count - 1) % count], ring[at], ring[(at + 1) % count]];
        let best = (0..count)
            .filter(|&at| is_ear(points, &ring, ear(at)))
            .map(|at| (smallest_sine(ear(at).map(|k| points[k])), at))
            .max_by(|a, b| a.0.total_cmp(&b.0));
        // A polygon without an ear has no area left.
        let Some((_, at)) = best else { break };
        triangles.push(ear(at));
        ring.remove(at);
    }
    triangles
}

/// Convex, and no other corner inside or on its border.
fn is_ear(points: &[Point], ring: &[usize], ear: [usize; 3]) -> bool {
    let [a, b, c] = ear.map(|k| points[k]);
    let inside =
        |p: Point| cross(a, b, p) > -NO_AREA && cross(b, c, p) > -NO_AREA && cross(c, a, p) > -NO_AREA;
    cross(a, b, c) > NO_AREA && ring.iter().filter(|k| !ear.contains(k)).all(|k| !inside(points[*k]))
}

/// Sine of the smallest angle, to compare triangles by.
fn smallest_sine([a, b, c]: [Point; 3]) -> f64 {
    let mut sides = [distance(a, b), distance(b, c), distance(c, a)];
    sides.sort_by(f64::total_cmp);
    cross(a, b, c) / (sides[1] * sides[2])
}

fn lies_on(p: Point, a: Point, b: Point) -> bool {
    let between = |k: usize| p[k] >= a[k].min(b[k]) - 1e-9 && p[k] <= a[k].max(b[k]) + 1e-9;
    cross(a, b, p).abs() < NO_AREA && between(0) && between(1)
}

/// Twice the area of a triangle, positive if counter-clockwise.
fn cross(a: Point, b: Point, c: Point) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

fn distance(a: Point, b: Point) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

fn signed_area(polygon: &[Point]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    0.5 * polygon.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn rectangle(x: f64, y: f64, width: f64, height: f64) -> Vec<Point> {
        vec![[x, y], [x + width, y], [x + width, y + height], [x, y + height]]
    }

    fn area_of(outline: &[Point], holes: &[Vec<Point>]) -> f64 {
        let points: Vec<Point> = outline.iter().chain(holes.iter().flatten()).copied().collect();
        triangulate(outline, holes)
            .iter()
            .map(|triangle| {
                let [a, b, c] = triangle.map(|k| points[k]);
                assert!(cross(a, b, c) > 0.0, "{triangle:?} is clockwise");
                0.5 * cross(a, b, c)
            })
            .sum()
    }

    #[test]
    fn a_square_is_two_triangles() {
        assert_eq!(triangulate(&rectangle(0.0, 0.0, 1.0, 1.0), &[]).len(), 2);
    }

    proptest! {
        #[test]
        fn triangles_cover_what_holes_leave(
            columns in 1_usize..5,
            rows in 1_usize..4,
            fill in 0.2_f64..0.9,
            turned in any::<bool>(),
        ) {
            // Rows of holes whose sides lie in line: the hardest case for bridges.
            let outline = rectangle(-0.1, -0.1, columns as f64 + 0.2, rows as f64 + 0.2);
            let mut holes: Vec<Vec<Point>> = (0..columns * rows)
                .map(|k| rectangle((k % columns) as f64, (k / columns) as f64, fill, fill))
                .collect();
            if turned {
                holes.iter_mut().for_each(|hole| hole.reverse());
            }
            let expected = (columns as f64 + 0.2) * (rows as f64 + 0.2) - (columns * rows) as f64 * fill * fill;
            prop_assert!((area_of(&outline, &holes) - expected).abs() < 1e-9);
            let corners = 4 + 4 * holes.len();
            prop_assert_eq!(triangulate(&outline, &holes).len(), corners + 2 * holes.len() - 2);
        }
    }
}
