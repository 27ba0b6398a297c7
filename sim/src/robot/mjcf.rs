//! Writes the MuJoCo scene from the controller's own model at start-up: one source of masses and frames.
//!
//! Added here, because a URDF has no words for it: the free joint, joint friction, the jaws, the motors, the
//! ground, the contact model, and which parts may touch each other.

use std::fmt::Write as _;

use locoman_robot::joints::{JOINTS, Leg, Side};
use locoman_robot::model::{JOINT_NAMES, Joint, Model, PARENT, RigidBody};
use nalgebra::Vector3;

use super::SimRobotError;
use super::jaws::{JAW_RADIUS_M, Jaw, without};
use super::profile::Profile;
use super::scene::Scene;
use super::shapes::{Part, Shape, shapes};
use super::terrain::Block;

/// The jaw that each gripper's servo turns; its partner (`…_partner`) is geared to it.
pub const JAW_NAMES: [&str; 2] = ["right_jaw", "left_jaw"];
/// Sites at the centres of the feet.
pub const FOOT_NAMES: [&str; 4] = ["FR_foot", "FL_foot", "RR_foot", "RL_foot"];
/// Sites at the grasp frames.
pub const GRIPPER_NAMES: [&str; 2] = ["right_gripper", "left_gripper"];
/// Bodies without mass at the grasp frames: where loads are held and pushes act.
pub const GRASP_NAMES: [&str; 2] = ["right_grasp", "left_grasp"];
/// Ending of the names of the servos' rotors, which stand for motor and gears where there is play.
pub const ROTOR: &str = "_rotor";
/// The first joint that has a servo.
const ARMS_FROM: usize = 12;
/// The trunk's body.
pub const TRUNK: &str = "trunk";
/// The ground's geom; those of what lies on it have numbers after it.
pub const GROUND: &str = "ground";

/// Contact bits: who may touch whom. The ground touches everything; an arm touches the trunk and the other
/// arm; other self-contacts are left out (the primitives of neighbours overlap on purpose).
#[derive(Clone, Copy)]
struct ContactBits {
    is: u32,
    touches: u32,
}
const GROUND_BITS: ContactBits = ContactBits { is: 1, touches: 0 };
const TRUNK_BITS: ContactBits = ContactBits { is: 2, touches: 1 };
const LEG_BITS: ContactBits = ContactBits { is: 0, touches: 1 };
const ARM_BITS: [ContactBits; 2] =
    [ContactBits { is: 4, touches: 1 | 2 }, ContactBits { is: 8, touches: 1 | 2 | 4 }];

/// As stiff as MuJoCo allows: by default its dry friction gives way like honey, and no joint ever sticks.
const JOINT_FRICTION: &str = r#"solreffriction="0.001 1" solimpfriction="0.9999 0.9999 0.001""#;
/// Where a foot touches, its own parameters count and not those of what it touches.
const FOOT_CONTACT: &str = r#" priority="1""#;

/// The scene as MJCF text.
pub fn write(
    model: &Model,
    scene: &Scene,
    profile: &Profile,
    blocks: &[Block],
) -> Result<String, SimRobotError> {
    let turned = model.joints.iter().position(|joint| joint.parent_from_joint.rotation.angle() != 0.0);
    if let Some(joint) = turned {
        return Err(SimRobotError::MuJoCo(format!(
            "the URDF's joint {} has a rotated origin, which the scene writer does not know; make its rpy 0 0 0",
            JOINT_NAMES[joint]
        )));
    }
    let mut writer = Writer { model, scene, profile, blocks, text: String::new() };
    writer.document();
    Ok(writer.text)
}

struct Writer<'a> {
    model: &'a Model,
    scene: &'a Scene,
    profile: &'a Profile,
    blocks: &'a [Block],
    text: String,
}

impl Writer<'_> {
    fn line(&mut self, text: impl AsRef<str>) {
        self.text.push_str(text.as_ref());
        self.text.push('\n');
    }

    fn document(&mut self) {
        let physics = &self.scene.physics;
        let head = format!(
            r#"<mujoco model="locoman">
<compiler angle="radian" autolimits="true"/>
<option timestep="{}" integrator="implicitfast" cone="elliptic" impratio="{}" gravity="0 0 -9.81">
<flag autoreset="disable"/></option>
<default><geom friction="{} 0.005 0.0001" solref="{} 1" condim="3"/><joint solreflimit="0.01 1" {JOINT_FRICTION}/></default>
<worldbody>
<geom name="{GROUND}" type="plane" size="0 0 1" {}/>"#,
            physics.timestep_s,
            physics.friction_stiffness_ratio,
            physics.friction,
            physics.contact_time_s,
            contact_attributes(GROUND_BITS),
        );
        self.line(head);
        for (number, block) in self.blocks.iter().enumerate() {
            let turn = block.rotation;
            self.line(format!(
                r#"<geom name="{GROUND}_{number}" type="box" pos="{}" size="{}" quat="{}" {}/>"#,
                numbers(block.center.as_slice()),
                numbers(block.half.as_slice()),
                numbers(&[turn.w, turn.i, turn.j, turn.k]),
                contact_attributes(GROUND_BITS),
            ));
        }
        self.trunk();
        self.line("</worldbody>");
        self.play();
        self.line("<equality>");
        for jaw in JAW_NAMES {
            self.line(format!(r#"<joint joint1="{jaw}_partner" joint2="{jaw}" polycoef="0 1 0 0 0"/>"#));
        }
        self.line("</equality>\n<actuator>");
        for (index, joint) in JOINT_NAMES.iter().chain(&JAW_NAMES).enumerate() {
            let has_rotor = (ARMS_FROM..JOINTS).contains(&index) && self.plays();
            self.line(format!(r#"<motor joint="{joint}{}"/>"#, if has_rotor { ROTOR } else { "" }));
        }
        self.line("</actuator>\n<sensor><accelerometer site=\"imu\"/></sensor>\n</mujoco>");
    }

    fn trunk(&mut self) {
        self.line(format!("<body name=\"{TRUNK}\"><freejoint/><site name=\"imu\"/>"));
        self.line(inertial(&self.model.torso));
        self.geoms(TRUNK, Part::Trunk, Side::Right, &Vector3::zeros(), TRUNK_BITS);
        self.children(None);
        self.line("</body>");
    }

    /// Whether the servos' gears have play.
    fn plays(&self) -> bool {
        self.profile.servos.backlash_rad > 0.0
    }

    /// Play: the difference of rotor and joint is limited. The limits are stiff, for gears are of metal.
    fn play(&mut self) {
        if !self.plays() {
            return;
        }
        let half = 0.5 * self.profile.servos.backlash_rad;
        self.line("<tendon>");
        for joint in &JOINT_NAMES[ARMS_FROM..] {
            self.line(format!(
                r#"<fixed name="{joint}_play" limited="true" range="-{half} {half}" solreflimit="0.002 1" solimplimit="0.99 0.999 0.0005"><joint joint="{joint}{ROTOR}" coef="1"/><joint joint="{joint}" coef="-1"/></fixed>"#
            ));
        }
        self.line("</tendon>");
    }

    fn children(&mut self, parent: Option<usize>) {
        for child in 0..JOINTS {
            if PARENT[child] == parent {
                self.moving_body(child);
            }
        }
    }

    fn moving_body(&mut self, index: usize) {
        let model = self.model;
        let Joint { parent_from_joint, axis, body } = &model.joints[index];
        let name = JOINT_NAMES[index];
        let place = numbers(parent_from_joint.translation.vector.as_slice());
        let axis = numbers(axis.as_slice());
        let friction = self.profile.joints;
        let mut coulomb = friction.arm_coulomb_nm + friction.arm_bearing_nm;
        let (mut viscous, mut armature) = (0.0, model.armature[index]);
        if index < ARMS_FROM {
            (viscous, coulomb) = (friction.leg_viscous_nm_s, friction.leg_coulomb_nm);
        } else if self.plays() {
            // The motor and its gears, up to the play: a wheel on the joint's axis, as good as massless.
            self.line(format!(
                r#"<body name="{name}{ROTOR}" pos="{place}"><joint name="{name}{ROTOR}" axis="{axis}" armature="{armature}" frictionloss="{}"/><inertial mass="1e-6" pos="0 0 0" diaginertia="1e-9 1e-9 1e-9"/></body>"#,
                friction.arm_coulomb_nm
            ));
            (coulomb, armature) = (friction.arm_bearing_nm, 0.0);
        }
        self.line(format!(
            r#"<body name="{name}" pos="{place}"><joint name="{name}" axis="{axis}" range="{} {}" armature="{armature}" damping="{viscous}" frictionloss="{coulomb}"/>"#,
            model.lower[index],
            model.upper[index],
        ));
        match index {
            0..12 => self.leg_link(Leg::ALL[index / 3], index % 3, body),
            _ => self.arm_link(Side::ALL[(index - 12) / 3], index % 3, body),
        }
        self.children(Some(index));
        self.line("</body>");
    }

    fn leg_link(&mut self, leg: Leg, place: usize, body: &RigidBody) {
        self.line(inertial(body));
        let side = if leg.index().is_multiple_of(2) { Side::Right } else { Side::Left };
        let part = [Part::Hip, Part::Thigh, Part::Calf][place];
        let name = FOOT_NAMES[leg.index()];
        self.geoms(&format!("{name}_{part:?}"), part, side, &Vector3::zeros(), LEG_BITS);
        if part == Part::Calf {
            let foot = self.model.calf_from_foot(leg).translation.vector;
            self.line(format!(r#"<site name="{name}" pos="{}"/>"#, numbers(foot.as_slice())));
            self.geoms(name, Part::Foot, side, &foot, LEG_BITS);
        }
    }

    fn arm_link(&mut self, side: Side, place: usize, body: &RigidBody) {
        let bits = ARM_BITS[side.index()];
        let name = GRIPPER_NAMES[side.index()];
        match place {
            0 => {
                self.line(inertial(body));
                // The mount belongs to the calf, but it is round about the first joint's axis.
                self.geoms(&format!("{name}_mount"), Part::ArmMount, side, &Vector3::zeros(), LEG_BITS);
                self.geoms(&format!("{name}_link_2"), Part::ArmLink2, side, &Vector3::zeros(), bits);
            }
            1 => {
                self.line(inertial(body));
                self.geoms(&format!("{name}_link_3"), Part::ArmLink3, side, &Vector3::zeros(), bits);
            }
            _ => self.hand(side, body, bits),
        }
    }

    fn hand(&mut self, side: Side, body: &RigidBody, bits: ContactBits) {
        let name = GRIPPER_NAMES[side.index()];
        let gripper = &self.scene.gripper;
        let (armature, upper) = (gripper.jaw_armature, gripper.open_rad + 0.05);
        let hand_from_gripper = *self.model.hand_from_gripper(side);
        let grasp = hand_from_gripper.translation.vector;
        let jaws = [1.0, -1.0].map(|sign| Jaw { sign, mass: gripper.jaw_mass_kg });
        let mut rest = *body;
        for jaw in &jaws {
            let mut part = jaw.body();
            part.com += grasp + jaw.pivot();
            rest = without(&rest, &part);
        }
        self.line(inertial(&rest));
        self.line(format!(r#"<site name="{name}" pos="{}"/>"#, numbers(grasp.as_slice())));
        self.line(format!(
            r#"<body name="{}" pos="{}"><inertial mass="0" pos="0 0 0" diaginertia="0 0 0"/></body>"#,
            GRASP_NAMES[side.index()],
            numbers(grasp.as_slice()),
        ));
        self.geoms(&format!("{name}_servo"), Part::EndEffector, side, &grasp, bits);
        for (jaw, suffix) in jaws.iter().zip(["", "_partner"]) {
            let jaw_name = format!("{}{suffix}", JAW_NAMES[side.index()]);
            self.line(format!(
                r#"<body name="{jaw_name}" pos="{}"><joint name="{jaw_name}" axis="{} 0 0" range="0 {upper}" armature="{armature}"/>"#,
                numbers((grasp + jaw.pivot()).as_slice()),
                jaw.sign,
            ));
            self.line(inertial(&jaw.body()));
            let shape = Shape::Capsule { from: [0.0; 3], to: jaw.tip().into(), radius: JAW_RADIUS_M };
            self.line(geom(&jaw_name, shape, &Vector3::zeros(), &contact_attributes(bits)));
            self.line("</body>");
        }
    }

    fn geoms(&mut self, name: &str, part: Part, side: Side, origin: &Vector3<f64>, bits: ContactBits) {
        let mut attributes = contact_attributes(bits);
        if part == Part::Foot {
            attributes.push_str(FOOT_CONTACT);
        }
        for (number, shape) in shapes(part, side).into_iter().enumerate() {
            self.line(geom(&format!("{name}_{number}"), shape, origin, &attributes));
        }
    }
}

fn contact_attributes(bits: ContactBits) -> String {
    format!(r#"contype="{}" conaffinity="{}""#, bits.is, bits.touches)
}

fn inertial(body: &RigidBody) -> String {
    let i = &body.inertia;
    format!(
        r#"<inertial mass="{}" pos="{}" fullinertia="{}"/>"#,
        body.mass,
        numbers(body.com.as_slice()),
        numbers(&[i[(0, 0)], i[(1, 1)], i[(2, 2)], i[(0, 1)], i[(0, 2)], i[(1, 2)]]),
    )
}

fn geom(name: &str, shape: Shape, origin: &Vector3<f64>, attributes: &str) -> String {
    let at = |p: [f64; 3]| numbers((origin + Vector3::from(p)).as_slice());
    let form = match shape {
        Shape::Sphere { center, radius } => format!(r#"type="sphere" pos="{}" size="{radius}""#, at(center)),
        Shape::Capsule { from, to, radius } => {
            format!(r#"type="capsule" fromto="{} {}" size="{radius}""#, at(from), at(to))
        }
        Shape::Box { center, half } => {
            format!(r#"type="box" pos="{}" size="{}""#, at(center), numbers(&half))
        }
    };
    format!(r#"<geom name="{name}" {form} {attributes}/>"#)
}

/// Shortest decimal forms that read back to the same numbers, so nothing is lost on the way.
fn numbers(values: &[f64]) -> String {
    let mut text = String::new();
    for value in values {
        let _ = write!(text, "{}{value}", if text.is_empty() { "" } else { " " });
    }
    text
}
