//! Reads a URDF into the fixed tree: by the names of joints and links, never by their order.

use std::{collections::HashMap, path::Path};

use nalgebra::{Isometry3, Matrix3, Translation3, Unit, UnitQuaternion, Vector3};
use urdf_rs::{JointType, Robot};

use super::{
    JOINT_NAMES, Joint, Model, ModelError, PARENT, RigidBody,
    tree::{FOOT_LINKS, GRIPPER_LINKS, TORSO_LINK},
};
use crate::{
    collision::CollisionModel,
    joints::{JOINTS, JointVector},
};

/// Reads the file, merges links on fixed joints into their parents, and checks what it holds.
pub(super) fn read(path: &Path) -> Result<Model, ModelError> {
    let text =
        std::fs::read_to_string(path).map_err(|source| ModelError::Read { file: path.to_owned(), source })?;
    let robot = urdf_rs::read_from_string(&text)
        .map_err(|source| ModelError::Urdf { file: path.to_owned(), source: Box::new(source) })?;
    Reader::new(path, &robot)?.model()
}

/// Which body a link moves with, and where it sits on it.
#[derive(Clone, Copy)]
struct Mount {
    /// The joint that carries the body, or nothing for the torso.
    joint: Option<usize>,
    body_from_link: Isometry3<f64>,
}

struct Reader<'a> {
    path: &'a Path,
    robot: &'a Robot,
    /// The joint above each link.
    above: HashMap<&'a str, &'a urdf_rs::Joint>,
}

impl<'a> Reader<'a> {
    fn new(path: &'a Path, robot: &'a Robot) -> Result<Self, ModelError> {
        let above = robot.joints.iter().map(|joint| (joint.child.link.as_str(), joint)).collect();
        let reader = Self { path, robot, above };
        for (index, link) in robot.links.iter().enumerate() {
            if robot.links[..index].iter().any(|before| before.name == link.name) {
                return Err(reader.link_error(&link.name, "is there twice"));
            }
        }
        for (index, joint) in robot.joints.iter().enumerate() {
            if robot.joints[..index].iter().any(|before| before.name == joint.name) {
                return Err(reader.joint_error(&joint.name, "is there twice"));
            }
            let numbers = joint.origin.xyz.0.iter().chain(&joint.origin.rpy.0).chain(&joint.axis.xyz.0);
            if !numbers.clone().all(|number| number.is_finite()) {
                return Err(reader.joint_error(&joint.name, "has a number that is not finite"));
            }
            let known = JOINT_NAMES.contains(&joint.name.as_str());
            let turns = matches!(joint.joint_type, JointType::Revolute | JointType::Continuous);
            if known && !turns {
                return Err(reader.joint_error(&joint.name, "must be of type revolute"));
            }
            if !known && joint.joint_type != JointType::Fixed {
                return Err(reader.joint_error(&joint.name, "is no joint of this robot; make it fixed"));
            }
        }
        Ok(reader)
    }

    fn model(&self) -> Result<Model, ModelError> {
        let mut torso = RigidBody::massless();
        let mut bodies = [RigidBody::massless(); JOINTS];
        for link in &self.robot.links {
            let mount = self.mount(&link.name)?;
            let body = self.body(link)?.seen_from(&mount.body_from_link);
            let carrier = match mount.joint {
                None => &mut torso,
                Some(joint) => &mut bodies[joint],
            };
            *carrier = carrier.joined(&body);
        }
        if torso.mass <= 0.0 {
            return Err(self.link_error(TORSO_LINK, "must have a mass above 0"));
        }

        let mut joints = [Joint {
            parent_from_joint: Isometry3::identity(),
            axis: Vector3::x_axis(),
            body: RigidBody::massless(),
        }; JOINTS];
        let mut limits = [JointVector::zeros(); 4];
        for index in 0..JOINTS {
            let source = self.joint(index)?;
            joints[index] = self.placed(index, source, bodies[index])?;
            let limit = &source.limit;
            let ordered = limit.lower < limit.upper && limit.effort > 0.0 && limit.velocity > 0.0;
            if !ordered {
                let reason = "needs limits with lower < upper and effort and velocity above 0";
                return Err(self.joint_error(&source.name, reason));
            }
            for (of_all, value) in
                limits.iter_mut().zip([limit.lower, limit.upper, limit.velocity, limit.effort])
            {
                of_all[index] = value;
            }
        }

        let mut calf_from_foot = [Isometry3::identity(); 4];
        for (leg, name) in FOOT_LINKS.iter().enumerate() {
            calf_from_foot[leg] = self.frame_on(name, 3 * leg + 2)?;
        }
        let mut hand_from_gripper = [Isometry3::identity(); 2];
        for (side, name) in GRIPPER_LINKS.iter().enumerate() {
            hand_from_gripper[side] = self.frame_on(name, 12 + 3 * side + 2)?;
        }
        let [lower, upper, max_velocity, max_torque] = limits;
        Ok(Model {
            torso,
            joints,
            lower,
            upper,
            max_velocity,
            max_torque,
            armature: JointVector::zeros(),
            collision: CollisionModel::default(),
            calf_from_foot,
            hand_from_gripper,
        })
    }

    /// Follows fixed joints upwards to the body that carries a link.
    fn mount(&self, link: &str) -> Result<Mount, ModelError> {
        let mut body_from_link = Isometry3::identity();
        let mut name = link;
        for _ in 0..=self.robot.joints.len() {
            if name == TORSO_LINK {
                return Ok(Mount { joint: None, body_from_link });
            }
            let Some(joint) = self.above.get(name) else {
                // The root above the torso: it may exist if it is fixed to the torso and weighs nothing.
                return self.root(name).map(|()| Mount { joint: None, body_from_link });
            };
            if let Some(index) = JOINT_NAMES.iter().position(|known| *known == joint.name) {
                return Ok(Mount { joint: Some(index), body_from_link });
            }
            body_from_link = pose(&joint.origin) * body_from_link;
            name = &joint.parent.link;
        }
        Err(self.link_error(link, "hangs in a loop of joints; a URDF is a tree"))
    }

    fn root(&self, name: &str) -> Result<(), ModelError> {
        let massless =
            self.robot.links.iter().any(|link| link.name == name && link.inertial.mass.value == 0.0);
        let carries_torso = self.above.get(TORSO_LINK).is_some_and(|joint| joint.parent.link == name);
        if massless && carries_torso {
            return Ok(());
        }
        Err(self
            .link_error(name, &format!("is not connected to `{TORSO_LINK}`; add the joint that holds it")))
    }

    fn joint(&self, index: usize) -> Result<&'a urdf_rs::Joint, ModelError> {
        let name = JOINT_NAMES[index];
        let found = self.robot.joints.iter().find(|joint| joint.name == name);
        found.ok_or_else(|| self.joint_error(name, "is missing"))
    }

    fn placed(&self, index: usize, source: &urdf_rs::Joint, body: RigidBody) -> Result<Joint, ModelError> {
        let mount = self.mount(&source.parent.link)?;
        if mount.joint != PARENT[index] {
            let expected = PARENT[index].map_or(TORSO_LINK, |parent| JOINT_NAMES[parent]);
            return Err(self.joint_error(&source.name, &format!("must come right after `{expected}`")));
        }
        if body.mass <= 0.0 {
            return Err(self.joint_error(&source.name, "carries no mass; give its link an inertial"));
        }
        let axis = Unit::try_new(Vector3::from(source.axis.xyz.0), 1e-6)
            .ok_or_else(|| self.joint_error(&source.name, "needs an axis that is not zero"))?;
        let parent_from_joint = mount.body_from_link * pose(&source.origin);
        Ok(Joint { parent_from_joint, axis, body })
    }

    fn frame_on(&self, link: &str, joint: usize) -> Result<Isometry3<f64>, ModelError> {
        if !self.robot.links.iter().any(|candidate| candidate.name == link) {
            return Err(self.link_error(link, "is missing"));
        }
        let mount = self.mount(link)?;
        if mount.joint != Some(joint) {
            let reason = format!("must be fixed to the body of `{}`", JOINT_NAMES[joint]);
            return Err(self.link_error(link, &reason));
        }
        Ok(mount.body_from_link)
    }

    fn body(&self, link: &urdf_rs::Link) -> Result<RigidBody, ModelError> {
        let inertial = &link.inertial;
        let i = &inertial.inertia;
        let tensor = Matrix3::new(i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz);
        // A link without `<inertial>` is a mere frame, whatever inertia the parser fills in.
        let inertia = if inertial.mass.value == 0.0 { Matrix3::zeros() } else { tensor };
        let body = RigidBody { mass: inertial.mass.value, com: Vector3::zeros(), inertia }
            .seen_from(&pose(&inertial.origin));
        match body.flaw() {
            None => Ok(body),
            Some(flaw) => Err(self.link_error(&link.name, &format!("has {flaw}; correct its `inertial`"))),
        }
    }

    fn joint_error(&self, name: &str, reason: &str) -> ModelError {
        self.element_error("joint", name, reason)
    }

    fn link_error(&self, name: &str, reason: &str) -> ModelError {
        self.element_error("link", name, reason)
    }

    fn element_error(&self, kind: &str, name: &str, reason: &str) -> ModelError {
        ModelError::Element {
            file: self.path.to_owned(),
            element: format!("{kind} `{name}`"),
            reason: reason.to_owned(),
        }
    }
}

/// URDF's fixed-axis angles: R = Rz(yaw) Ry(pitch) Rx(roll), as nalgebra's.
fn pose(origin: &urdf_rs::Pose) -> Isometry3<f64> {
    let [roll, pitch, yaw] = origin.rpy.0;
    Isometry3::from_parts(
        Translation3::from(Vector3::from(origin.xyz.0)),
        UnitQuaternion::from_euler_angles(roll, pitch, yaw),
    )
}
