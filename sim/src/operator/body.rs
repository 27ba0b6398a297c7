//! The operator's body: capsules and ellipsoids that move with the shells and stand in the way.

use nalgebra::{Isometry3, Point3, Unit, Vector3};

use super::motion::{Body, Posture};

/// A shape, in the world or in a camera's frame.
#[derive(Debug, Clone, Copy)]
pub enum Shape {
    /// All points within a radius of a line segment.
    Capsule {
        /// One end of the segment.
        a: Point3<f64>,
        /// The other end.
        b: Point3<f64>,
        /// Metres.
        radius_m: f64,
    },
    /// A stretched ball.
    Ellipsoid {
        /// Its centre and axes.
        pose: Isometry3<f64>,
        /// Half lengths along its axes, metres.
        radii_m: Vector3<f64>,
    },
}

/// A part of the body.
#[derive(Debug, Clone, Copy)]
pub struct Limb {
    /// Where it is.
    pub shape: Shape,
    /// Reflectance, 0 to 1.
    pub albedo: f32,
    /// Contrast of the stripes across it, 0 for none.
    pub stripes: f32,
}

impl Limb {
    /// Carried to another place.
    pub fn moved(&self, by: &Isometry3<f64>) -> Self {
        let shape = match self.shape {
            Shape::Capsule { a, b, radius_m } => Shape::Capsule { a: by * a, b: by * b, radius_m },
            Shape::Ellipsoid { pose, radii_m } => Shape::Ellipsoid { pose: by * pose, radii_m },
        };
        Self { shape, ..*self }
    }
}

const SKIN: (f32, f32) = (0.60, 0.0);
const SWEATER: (f32, f32) = (0.33, 0.22);
const TROUSERS: (f32, f32) = (0.17, 0.0);
const HAIR: (f32, f32) = (0.08, 0.0);

/// The body that fits a posture; `home` is the posture at rest, for which the proportions are given.
pub fn limbs(posture: &Posture, home: &Posture) -> Vec<Limb> {
    let world_from_home = posture.of(Body::Torso) * home.of(Body::Torso).inverse();
    let trunk = |x: f64, y: f64, z: f64| world_from_home * Point3::new(x, y, z);
    let ellipsoid = |center: (f64, f64, f64), radii: (f64, f64, f64), (albedo, stripes)| Limb {
        shape: Shape::Ellipsoid {
            pose: world_from_home * Isometry3::translation(center.0, center.1, center.2),
            radii_m: Vector3::new(radii.0, radii.1, radii.2),
        },
        albedo,
        stripes,
    };
    let mut limbs = vec![
        ellipsoid((-0.03, 0.0, 1.25), (0.12, 0.19, 0.28), SWEATER),
        ellipsoid((-0.03, 0.0, 1.02), (0.12, 0.17, 0.20), SWEATER),
        ellipsoid((0.01, 0.0, 1.66), (0.10, 0.078, 0.13), SKIN),
        ellipsoid((-0.025, 0.0, 1.70), (0.10, 0.088, 0.12), HAIR),
        capsule(trunk(-0.02, 0.0, 1.45), trunk(-0.01, 0.0, 1.58), 0.055, SKIN),
        capsule(trunk(-0.03, -0.16, 1.43), trunk(-0.03, 0.16, 1.43), 0.065, SWEATER),
        capsule(Point3::new(-0.02, -0.1, 0.1), trunk(-0.02, -0.09, 0.88), 0.085, TROUSERS),
        capsule(Point3::new(-0.02, 0.1, 0.1), trunk(-0.02, 0.09, 0.88), 0.085, TROUSERS),
    ];
    for (palm, thumb, side) in
        [(Body::RightPalm, Body::RightThumb, -1.0), (Body::LeftPalm, Body::LeftThumb, 1.0)]
    {
        let shoulder = trunk(-0.03, side * 0.2, 1.42);
        arm(&mut limbs, shoulder, posture.of(palm), posture.of(thumb), side);
    }
    limbs
}

/// A forearm with its hand upright, in a frame with x to the right, y down and its origin in the palm's middle.
pub fn raised_hand() -> Vec<Limb> {
    let mut limbs = vec![
        Limb {
            shape: Shape::Ellipsoid {
                pose: Isometry3::identity(),
                radii_m: Vector3::new(0.045, 0.055, 0.018),
            },
            albedo: SKIN.0,
            stripes: SKIN.1,
        },
        capsule(Point3::new(0.0, 0.05, 0.0), Point3::new(0.02, 0.10, 0.005), 0.028, SKIN),
        capsule(Point3::new(0.02, 0.10, 0.005), Point3::new(0.10, 0.40, 0.03), 0.038, SWEATER),
        capsule(Point3::new(0.03, 0.03, 0.0), Point3::new(0.075, -0.035, -0.01), 0.012, SKIN),
    ];
    for finger in [-1.5, -0.5, 0.5, 1.5] {
        let (x, tip) = (0.021 * finger, -0.135 + 0.006 * f64::abs(finger + 0.3));
        limbs.push(capsule(Point3::new(x, -0.03, 0.0), Point3::new(1.3 * x, tip, -0.01), 0.0095, SKIN));
    }
    limbs
}

/// Upper arm, forearm, hand and fingers. Palm frame: x along the fingers, y left, z out of the back.
fn arm(
    limbs: &mut Vec<Limb>,
    shoulder: Point3<f64>,
    palm: &Isometry3<f64>,
    thumb: &Isometry3<f64>,
    side: f64,
) {
    let on_hand = |x: f64, y: f64, z: f64| palm * Point3::new(x, y, z);
    let wrist = on_hand(-0.085, 0.0, -0.035);
    let elbow = elbow(&shoulder, &wrist, side);
    limbs.push(capsule(shoulder, elbow, 0.05, SWEATER));
    limbs.push(capsule(elbow, wrist, 0.036, SWEATER));
    limbs.push(capsule(wrist, on_hand(-0.05, 0.0, -0.04), 0.028, SKIN));
    for finger in [-1.5, -0.5, 0.5, 1.5] {
        let y = finger * 0.021;
        let reach = 0.012 * (1.0 - f64::abs(finger - 0.5 * side) / 2.0);
        let knuckle = on_hand(0.02, y, -0.042);
        let middle = on_hand(0.072 + reach, y * 1.05, -0.052);
        let tip = on_hand(0.105 + 1.6 * reach, y * 1.05, -0.075);
        limbs.push(capsule(on_hand(-0.05, 0.6 * y, -0.042), knuckle, 0.015, SKIN));
        limbs.push(capsule(knuckle, middle, 0.0095, SKIN));
        limbs.push(capsule(middle, tip, 0.0085, SKIN));
    }
    // The thumb runs from the wrist's inner side through its shell.
    let root = on_hand(-0.04, -side * 0.02, -0.045);
    let joint = thumb * Point3::new(-0.032, 0.0, 0.0);
    let tip = thumb * Point3::new(0.0, 0.0, 0.0);
    limbs.push(capsule(root, joint, 0.014, SKIN));
    limbs.push(capsule(joint, tip, 0.010, SKIN));
}

/// Where the elbow hangs, for an upper arm and forearm of given lengths.
fn elbow(shoulder: &Point3<f64>, wrist: &Point3<f64>, side: f64) -> Point3<f64> {
    const UPPER_ARM_M: f64 = 0.30;
    const FOREARM_M: f64 = 0.27;
    let reach = wrist - shoulder;
    let distance = reach.norm().clamp(0.1, UPPER_ARM_M + FOREARM_M - 1e-3);
    let along = (UPPER_ARM_M.powi(2) - FOREARM_M.powi(2) + distance.powi(2)) / (2.0 * distance);
    let across = (UPPER_ARM_M.powi(2) - along.powi(2)).max(0.0).sqrt();
    let direction = Unit::new_normalize(reach);
    let down_and_out = Vector3::new(-0.2, 0.35 * side, -1.0);
    let hang = down_and_out - direction.into_inner() * direction.dot(&down_and_out);
    shoulder + direction.into_inner() * along + hang.normalize() * across
}

fn capsule(a: Point3<f64>, b: Point3<f64>, radius_m: f64, (albedo, stripes): (f32, f32)) -> Limb {
    Limb { shape: Shape::Capsule { a, b, radius_m }, albedo, stripes }
}
