//! Keeps the centre of mass over the feet that stand.

use nalgebra::{Vector2, Vector3};

/// In a corner of 34 degrees, the sharpest of three feet, a round leaves 0.7 of what lacks: 1 % in the end.
const ROUNDS: usize = 16;

/// The edges of the polygon of the feet, seen from above: a corner, and the direction inwards, of length 1. With fewer
/// than three feet there is no polygon.
pub fn edges(feet: &[Vector2<f64>]) -> impl Iterator<Item = (Vector2<f64>, Vector2<f64>)> + '_ {
    let centre = feet.iter().sum::<Vector2<f64>>() / feet.len().max(1) as f64;
    let pairs = feet.iter().enumerate().flat_map(|(i, a)| feet[i + 1..].iter().map(move |b| (a, b)));
    pairs.filter(|_| feet.len() >= 3).filter_map(move |(a, b)| {
        let along = b - a;
        let normal = Vector2::new(-along.y, along.x).normalize();
        let inwards = if normal.dot(&(centre - a)) < 0.0 { -normal } else { normal };
        // A diagonal of the polygon has feet on both sides: it is no edge.
        feet.iter().all(|foot| inwards.dot(&(foot - a)) >= -1e-9).then_some((*a, inwards))
    })
}

/// The smallest push that brings a point at least `margin_m` inside the polygon of the feet, seen from above.
///
/// Each edge that is too near pushes the point away from itself, round by round until a corner is settled. With fewer
/// than three feet there is no polygon, and no push.
pub fn push_inside(point: &Vector2<f64>, feet: &[Vector2<f64>], margin_m: f64) -> Vector2<f64> {
    let mut inside = *point;
    for _ in 0..ROUNDS {
        for (corner, inwards) in edges(feet) {
            inside += (margin_m - inwards.dot(&(inside - corner))).max(0.0) * inwards;
        }
    }
    inside - point
}

/// The greatest margin that a point can have inside the triangle of three feet: the radius of its incircle,
/// twice its area by its circumference. Nothing with fewer feet; of four, the best of their triangles.
pub fn deepest_margin(feet: &[Vector2<f64>]) -> f64 {
    let mut deepest: f64 = 0.0;
    for (i, a) in feet.iter().enumerate() {
        for (j, b) in feet.iter().enumerate().skip(i + 1) {
            for c in &feet[j + 1..] {
                let circumference = (b - a).norm() + (c - b).norm() + (a - c).norm();
                deepest = deepest.max((b - a).perp(&(c - a)).abs() / circumference.max(1e-9));
            }
        }
    }
    deepest
}

/// The point seen from above.
pub fn from_above(point: &Vector3<f64>) -> Vector2<f64> {
    point.xy()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn tripod() -> [Vector2<f64>; 3] {
        [Vector2::new(0.19, 0.13), Vector2::new(-0.19, -0.13), Vector2::new(-0.19, 0.13)]
    }

    #[test]
    fn a_point_well_inside_is_left_alone() {
        assert_eq!(push_inside(&Vector2::new(-0.1, 0.05), &tripod(), 0.02), Vector2::zeros());
    }

    #[test]
    fn the_deepest_margin_is_the_incircles_radius() {
        let [a, b, c] = tripod();
        let hypotenuse = (a - b).norm();
        let expected = ((a - c).norm() + (b - c).norm() - hypotenuse) / 2.0;
        assert!((deepest_margin(&tripod()) - expected).abs() < 1e-12);
        assert_eq!(deepest_margin(&tripod()[..2]), 0.0);
    }

    proptest! {
        #[test]
        fn any_point_comes_inside_the_margin(x in -0.3..0.3f64, y in -0.3..0.3f64) {
            let point = Vector2::new(x, y);
            let inside = point + push_inside(&point, &tripod(), 0.02);
            let again = push_inside(&inside, &tripod(), 0.02);
            prop_assert!(again.norm() < 0.003, "{}", again);
        }

        #[test]
        fn on_four_feet_the_diagonals_do_not_push(x in -0.15..0.15f64, y in -0.1..0.1f64) {
            let feet = [tripod()[0], tripod()[1], tripod()[2], Vector2::new(0.19, -0.13)];
            prop_assert_eq!(push_inside(&Vector2::new(x, y), &feet, 0.02), Vector2::zeros());
        }
    }
}
