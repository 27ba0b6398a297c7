//! Distance between two capsules, smooth enough to steer by.

use nalgebra::Vector3;

/// All points within a radius of a segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Capsule {
    /// One end of the axis, m.
    pub a: Vector3<f64>,
    /// The other, m.
    pub b: Vector3<f64>,
    /// m.
    pub radius: f64,
}

/// How far two capsules are apart, and where they are nearest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Separation {
    /// Between the surfaces, m; negative when they overlap.
    pub distance: f64,
    /// On the first axis.
    pub first: Vector3<f64>,
    /// On the second axis.
    pub second: Vector3<f64>,
    /// From the second point to the first; of length 1 or a little less. The distance grows by the relative
    /// velocity of these two points along it.
    pub direction: Vector3<f64>,
}

/// Share of an axis's squared length that is added for each unit of the squared place on it, see
/// [`separation`].
const ROUNDING: f64 = 0.1;
/// Longer axes are rounded as one of this length, m.
const LONGEST_ROUNDED_M: f64 = 0.05;
/// Shortest distance of two axes that a direction is made of, m.
const LEAST_M: f64 = 1e-6;

/// Distance between two capsules.
///
/// ```text
/// d = √ min |p(s) - q(t)|² + w_a (s - ½)² + w_b (t - ½)²  -  r_a - r_b          over s, t in [0, 1]
/// ```
/// Without w, the nearest points of two nearly parallel axes jump from end to end at the slightest turn, and
/// whatever is steered by their direction shakes. With w = 0.1 min(length, 5 cm)² the minimum is unique and
/// moves continuously; d is too long by less than a millimetre for axes 7 cm apart or more, and less than two
/// wherever links of this robot touch. The direction is the exact gradient of this d, by the envelope theorem.
pub fn separation(first: &Capsule, second: &Capsule) -> Separation {
    let (u, v) = (first.b - first.a, second.b - second.a);
    let between = first.a - second.a;
    let (along_first, along_second) = (u.norm_squared(), v.norm_squared());
    let rounding = |squared: f64| ROUNDING * squared.min(LONGEST_ROUNDED_M * LONGEST_ROUNDED_M) + 1e-12;
    let (wa, wb) = (rounding(along_first), rounding(along_second));
    let problem = Problem {
        hessian: [along_first + wa, -u.dot(&v), along_second + wb],
        gradient: [u.dot(&between) - 0.5 * wa, -v.dot(&between) - 0.5 * wb],
    };
    let [s, t] = problem.solve();
    let (p, q) = (first.a + u * s, second.a + v * t);
    let gap = p - q;
    let squared = gap.norm_squared() + wa * (s - 0.5).powi(2) + wb * (t - 0.5).powi(2);
    let length = squared.sqrt().max(LEAST_M);
    Separation {
        distance: length - first.radius - second.radius,
        first: p,
        second: q,
        direction: gap / length,
    }
}

/// ½ xᵀ H x + gᵀ x over the unit square, H positive definite.
struct Problem {
    /// H₀₀, H₀₁, H₁₁
    hessian: [f64; 3],
    gradient: [f64; 2],
}

impl Problem {
    fn solve(&self) -> [f64; 2] {
        let ([a, c, b], [g, h]) = (self.hessian, self.gradient);
        let determinant = a * b - c * c;
        let free = [(c * h - b * g) / determinant, (c * g - a * h) / determinant];
        if free.iter().all(|x| (0.0..=1.0).contains(x)) {
            return free;
        }
        // The minimum is on an edge.
        let given_first = |s: f64| [s, (-(h + c * s) / b).clamp(0.0, 1.0)];
        let given_second = |t: f64| [(-(g + c * t) / a).clamp(0.0, 1.0), t];
        let mut best = given_first(0.0);
        let mut least = self.value(&best);
        for candidate in [given_first(1.0), given_second(0.0), given_second(1.0)] {
            let value = self.value(&candidate);
            if value < least {
                (best, least) = (candidate, value);
            }
        }
        best
    }

    fn value(&self, [s, t]: &[f64; 2]) -> f64 {
        let ([a, c, b], [g, h]) = (self.hessian, self.gradient);
        0.5 * (a * s * s + b * t * t) + c * s * t + g * s + h * t
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn capsule() -> impl Strategy<Value = Capsule> {
        let point = || prop::array::uniform3(-0.2..0.2f64).prop_map(Vector3::from);
        (point(), point(), 0.01..0.06f64).prop_map(|(a, b, radius)| Capsule { a, b, radius })
    }

    /// Distance of a point from a segment.
    fn to_segment(point: &Vector3<f64>, a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
        let along = b - a;
        let share = ((point - a).dot(&along) / along.norm_squared().max(1e-12)).clamp(0.0, 1.0);
        (point - a - along * share).norm()
    }

    /// By trying many points of the first axis.
    fn searched(first: &Capsule, second: &Capsule) -> f64 {
        const POINTS: i32 = 4000;
        let nearest = (0..=POINTS)
            .map(|i| first.a.lerp(&second_free(first), f64::from(i) / f64::from(POINTS)))
            .map(|point| to_segment(&point, &second.a, &second.b))
            .fold(f64::INFINITY, f64::min);
        nearest - first.radius - second.radius
    }

    fn second_free(capsule: &Capsule) -> Vector3<f64> {
        capsule.b
    }

    proptest! {
        #[test]
        fn the_distance_is_the_geometric_one_up_to_its_rounding(first in capsule(), second in capsule()) {
            let exact = searched(&first, &second);
            let found = separation(&first, &second).distance;
            // √(x² + w/2) - x with w of two axes of 5 cm or more.
            let x = exact + first.radius + second.radius;
            let most = (x * x + 0.5 * ROUNDING * LONGEST_ROUNDED_M.powi(2)).sqrt() - x;
            prop_assert!(found > exact - 1e-4, "{found} {exact}");
            prop_assert!(found < exact + most + 1e-6, "{found} {exact}");
        }

        #[test]
        fn it_does_not_matter_which_is_first(first in capsule(), second in capsule()) {
            let (ab, ba) = (separation(&first, &second), separation(&second, &first));
            prop_assert!((ab.distance - ba.distance).abs() < 1e-12);
            prop_assert!((ab.direction + ba.direction).norm() < 1e-6);
        }

        #[test]
        fn the_direction_is_the_gradient(
            first in capsule(), second in capsule(), way in prop::array::uniform3(-1.0..1.0f64),
        ) {
            const STEP_M: f64 = 1e-6;
            let way = Vector3::from(way);
            let moved = |by: f64| {
                let shift = way * by;
                separation(&Capsule { a: first.a + shift, b: first.b + shift, ..first }, &second).distance
            };
            let now = separation(&first, &second);
            prop_assume!(now.distance + first.radius + second.radius > 0.005);
            let slope = (moved(STEP_M) - moved(-STEP_M)) / (2.0 * STEP_M);
            prop_assert!((slope - now.direction.dot(&way)).abs() < 1e-4);
        }

        #[test]
        fn the_direction_turns_continuously(
            first in capsule(), second in capsule(), turn in prop::array::uniform3(-1.0..1.0f64),
        ) {
            // Parallel axes, one of them turned through.
            let axis = second.b - second.a;
            prop_assume!(axis.norm() > 0.05);
            let gap = axis.cross(&Vector3::new(0.3, 0.5, 0.8)).normalize() * (0.06 + 2.0 * first.radius);
            let at = |angle: f64| {
                let tilt = nalgebra::Rotation3::from_scaled_axis(Vector3::from(turn) * angle);
                let (centre, half) = ((second.a + second.b) / 2.0 + gap, tilt * axis / 2.0);
                separation(&Capsule { a: centre - half, b: centre + half, radius: first.radius }, &second)
            };
            let mut last = at(-0.1).direction;
            for step in -999..=1000 {
                let now = at(f64::from(step) * 1e-4).direction;
                prop_assert!((now - last).norm() < 0.02, "{last} {now}");
                last = now;
            }
        }
    }
}
