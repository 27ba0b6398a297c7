//! What each link collides with: primitives in the link's own frame.
//!
//! Fitted to the meshes of the authors' model (capsules), the trunk after the public MuJoCo model of the
//! Go1; feet are spheres of 20 mm as in the URDF. The lower shank is thinner than its mesh so that the foot
//! alone touches the ground in any standing posture: that is what the controller assumes.
//! Left parts are the mirror image in y of the right ones.

use locoman_robot::joints::Side;
use locoman_robot::model::FOOT_RADIUS_M;

/// A primitive in its link's frame, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// Ball.
    Sphere {
        /// Centre.
        center: [f64; 3],
        /// Radius.
        radius: f64,
    },
    /// Two half balls and what is between.
    Capsule {
        /// One end of the axis.
        from: [f64; 3],
        /// The other end.
        to: [f64; 3],
        /// Radius.
        radius: f64,
    },
    /// Box along the link's axes.
    Box {
        /// Centre.
        center: [f64; 3],
        /// Half of the edges.
        half: [f64; 3],
    },
}

const fn sphere(center: [f64; 3], radius: f64) -> Shape {
    Shape::Sphere { center, radius }
}

const fn capsule(from: [f64; 3], to: [f64; 3], radius: f64) -> Shape {
    Shape::Capsule { from, to, radius }
}

const TRUNK: [Shape; 5] = [
    Shape::Box { center: [0.0, 0.0, 0.0], half: [0.1881, 0.04675, 0.057] },
    capsule([-0.125, -0.04, 0.0], [0.125, -0.04, 0.0], 0.058),
    capsule([-0.125, 0.04, 0.0], [0.125, 0.04, 0.0], 0.058),
    capsule([0.255, -0.052, 0.0355], [0.255, 0.052, 0.0355], 0.021),
    capsule([0.25, -0.06, -0.05], [0.25, 0.06, -0.05], 0.01),
];
const HIP: [Shape; 1] = [sphere([0.0, 0.0, 0.0], 0.046)];
const THIGH: [Shape; 3] = [
    capsule([-0.00385, 0.02132, -0.02338], [0.00074, 0.0384, 0.00129], 0.046),
    capsule([-0.00873, 0.02883, -0.03732], [-0.01263, 0.00179, -0.15378], 0.03),
    capsule([0.00116, 0.00194, -0.20798], [-0.01393, 0.00124, -0.19172], 0.02316),
];
const CALF: [Shape; 2] = [
    capsule([0.01028, 0.0004, -0.08893], [-0.00131, 0.0, 0.01], 0.0183),
    capsule([0.0155, 0.0005, -0.11037], [0.0048, 0.0, -0.195], 0.016),
];
const FOOT: [Shape; 1] = [sphere([0.0, 0.0, 0.0], FOOT_RADIUS_M)];
const ARM_MOUNT: [Shape; 1] = [capsule([-0.00219, 0.00262, 0.00792], [0.0, 0.03455, 0.0011], 0.02)];
const ARM_LINK_2: [Shape; 1] = [capsule([0.0, 0.0, -0.05421], [0.0, 0.0, 0.00111], 0.0168)];
const ARM_LINK_3: [Shape; 1] = [capsule([0.00754, 0.0, -0.0283], [0.00065, 0.0, -0.00546], 0.018)];
const END_EFFECTOR: [Shape; 1] = [capsule([0.0, 0.0, 0.018], [0.0, 0.0, 0.0311], 0.018)];

/// A part of the robot with a shape of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Trunk with head.
    Trunk,
    /// Hip-roll body.
    Hip,
    /// Thigh with its motor and the knee.
    Thigh,
    /// Shank.
    Calf,
    /// Foot, in the frame of its centre.
    Foot,
    /// What holds an arm to the calf, in the frame of the arm's first joint.
    ArmMount,
    /// Two servos, in the frame of the first joint.
    ArmLink2,
    /// Third servo, in the frame of the second joint.
    ArmLink3,
    /// Fourth servo; the jaws are bodies of their own.
    EndEffector,
}

/// The primitives of a part on the right or, mirrored in y, on the left.
pub fn shapes(part: Part, side: Side) -> Vec<Shape> {
    let right: &[Shape] = match part {
        Part::Trunk => &TRUNK,
        Part::Hip => &HIP,
        Part::Thigh => &THIGH,
        Part::Calf => &CALF,
        Part::Foot => &FOOT,
        Part::ArmMount => &ARM_MOUNT,
        Part::ArmLink2 => &ARM_LINK_2,
        Part::ArmLink3 => &ARM_LINK_3,
        Part::EndEffector => &END_EFFECTOR,
    };
    right.iter().map(|&shape| if side == Side::Left { mirrored(shape) } else { shape }).collect()
}

fn mirrored(shape: Shape) -> Shape {
    let flip = |[x, y, z]: [f64; 3]| [x, -y, z];
    match shape {
        Shape::Sphere { center, radius } => Shape::Sphere { center: flip(center), radius },
        Shape::Capsule { from, to, radius } => Shape::Capsule { from: flip(from), to: flip(to), radius },
        Shape::Box { center, half } => Shape::Box { center: flip(center), half },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_left_part_mirrors_the_right_one() {
        let (right, left) = (shapes(Part::Thigh, Side::Right), shapes(Part::Thigh, Side::Left));
        assert_eq!(right.len(), left.len());
        assert_eq!(right[0], mirrored(left[0]));
        assert_ne!(right[0], left[0]);
    }
}
