//! The MuJoCo side: loads the generated scene, applies torques, reads states, contacts and truth.

use std::sync::Arc;

use locoman_robot::joints::{JOINTS, JointVector};
use locoman_robot::model::JOINT_NAMES;
use mujoco_rs::prelude::{MjData, MjModel, MjtObjBase};
use nalgebra::{Isometry3, Matrix3, Point3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::mjcf::{FOOT_NAMES, GRASP_NAMES, GRIPPER_NAMES, GROUND, JAW_NAMES, ROTOR, TRUNK};
use super::profile::FootCompliance;
use super::scene::Posture;
use super::{SimRobotError, rubber};

/// Motors: the joints, then the jaws right and left.
pub const MOTORS: usize = JOINTS + 2;

/// The free joint is the first in the file: its coordinates open the state.
const TRUNK_POSITION: usize = 0;
const TRUNK_QUATERNION: usize = 3;
const TRUNK_ANGULAR_VELOCITY: usize = 3;

/// The physics.
#[derive(Debug)]
pub struct World {
    pub(super) data: MjData<Arc<MjModel>>,
    /// The model without disturbances.
    pub(super) calm: Arc<MjModel>,
    position_at: [usize; MOTORS],
    velocity_at: [usize; MOTORS],
    /// Where the motors are: the joints themselves, or rotors before the play of their gears.
    rotor_position_at: [usize; MOTORS],
    rotor_velocity_at: [usize; MOTORS],
    partner_position_at: [usize; 2],
    foot_sites: [usize; 4],
    pub(super) foot_geoms: [usize; 4],
    gripper_sites: [usize; 2],
    /// Which foot a geom is, if it is one.
    foot_of_geom: Vec<Option<u8>>,
    is_trunk_geom: Vec<bool>,
    is_ground_geom: Vec<bool>,
    pub(super) trunk: usize,
    pub(super) grasps: [usize; 2],
}

/// What the simulator knows and no robot does. Poses map body points into the simulator's world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// Clock of the sensors' sample that it belongs to, ns.
    pub time_ns: u64,
    /// Simulated time, s.
    pub sim_time_s: f64,
    /// Trunk frame.
    pub world_from_torso: Isometry3<f64>,
    /// Grasp frames, right and left.
    pub world_from_gripper: [Isometry3<f64>; 2],
    /// Centres of the feet FR, FL, RR, RL.
    pub feet_in_world: [Point3<f64>; 4],
    /// Joint angles, rad.
    pub joint_position: JointVector,
    /// Vertical forces on the feet, N.
    pub foot_force_n: [f64; 4],
    /// Openings, 0 to 1.
    pub opening: [f64; 2],
    /// The trunk touches the ground or is tilted beyond 60 degrees.
    pub fallen: bool,
}

/// A contact that no plan has, of geoms by their names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unplanned {
    /// Two links touch.
    OfItself([String; 2]),
    /// Something other than a foot touches the ground.
    WithGround(String),
}

impl World {
    /// Compiles the scene and puts rubber under the feet.
    pub fn new(mjcf: &str, feet: &FootCompliance) -> Result<Self, SimRobotError> {
        let mut model = MjModel::from_xml_string(mjcf).map_err(mujoco)?;
        let joint = |name: &str| id(&model, MjtObjBase::mjOBJ_JOINT, name);
        let site = |name: &str| id(&model, MjtObjBase::mjOBJ_SITE, name);

        let mut position_at = [0; MOTORS];
        let mut velocity_at = [0; MOTORS];
        for (place, name) in JOINT_NAMES.iter().chain(&JAW_NAMES).enumerate() {
            let joint = joint(name)?;
            position_at[place] = address(model.jnt_qposadr()[joint]);
            velocity_at[place] = address(model.jnt_dofadr()[joint]);
        }
        let (mut rotor_position_at, mut rotor_velocity_at) = (position_at, velocity_at);
        for (place, name) in JOINT_NAMES.iter().enumerate() {
            if let Some(rotor) = model.name_to_id(MjtObjBase::mjOBJ_JOINT, &format!("{name}{ROTOR}")) {
                rotor_position_at[place] = address(model.jnt_qposadr()[rotor]);
                rotor_velocity_at[place] = address(model.jnt_dofadr()[rotor]);
            }
        }
        let mut partner_position_at = [0; 2];
        for (place, name) in JAW_NAMES.iter().enumerate() {
            partner_position_at[place] = address(model.jnt_qposadr()[joint(&format!("{name}_partner"))?]);
        }
        let mut foot_sites = [0; 4];
        let mut foot_geoms = [0; 4];
        let mut foot_of_geom = vec![None; address(model.ngeom())];
        for (foot, name) in FOOT_NAMES.iter().enumerate() {
            foot_sites[foot] = site(name)?;
            foot_geoms[foot] = id(&model, MjtObjBase::mjOBJ_GEOM, &format!("{name}_0"))?;
            foot_of_geom[foot_geoms[foot]] = u8::try_from(foot).ok();
        }
        let mut gripper_sites = [0; 2];
        for (side, name) in GRIPPER_NAMES.iter().enumerate() {
            gripper_sites[side] = site(name)?;
        }
        let body = |name: &str| id(&model, MjtObjBase::mjOBJ_BODY, name);
        let trunk = body(TRUNK)?;
        let grasps = [body(GRASP_NAMES[0])?, body(GRASP_NAMES[1])?];
        let is_trunk_geom = model.geom_bodyid().iter().map(|&body| address(body) == trunk).collect();
        let is_ground = |geom: usize| {
            model.id_to_name(MjtObjBase::mjOBJ_GEOM, geom).is_some_and(|name| name.starts_with(GROUND))
        };
        let is_ground_geom = (0..model.geom_bodyid().len()).map(is_ground).collect();
        if feet.stiffness_n_m > 0.0 {
            rubber::soften(&mut model, &foot_geoms, feet);
        }
        let calm = Arc::new(model);
        let data = MjData::try_new(Arc::clone(&calm)).map_err(mujoco)?;
        Ok(Self {
            data,
            calm,
            position_at,
            velocity_at,
            rotor_position_at,
            rotor_velocity_at,
            partner_position_at,
            foot_sites,
            foot_geoms,
            gripper_sites,
            foot_of_geom,
            is_trunk_geom,
            is_ground_geom,
            trunk,
            grasps,
        })
    }

    /// The compiled model and state, for tests against other dynamics.
    pub fn data_mut(&mut self) -> &mut MjData<Arc<MjModel>> {
        &mut self.data
    }

    /// Puts the robot at rest in a posture, jaws at `jaw_rad`.
    pub fn place(&mut self, posture: &Posture, jaw_rad: f64) {
        self.data.reset();
        let mut angles = [0.0; MOTORS];
        for (place, angle) in angles.iter_mut().enumerate() {
            *angle = match place {
                0..12 => posture.leg[place % 3],
                12..15 => posture.right_arm[place - 12],
                15..18 => posture.left_arm[place - 15],
                _ => jaw_rad,
            };
        }
        let qpos = self.data.qpos_mut();
        qpos[TRUNK_POSITION..TRUNK_POSITION + 3].copy_from_slice(&[0.0, 0.0, posture.trunk_height_m]);
        qpos[TRUNK_QUATERNION..TRUNK_QUATERNION + 4].copy_from_slice(&[1.0, 0.0, 0.0, 0.0]);
        for motor in 0..MOTORS {
            qpos[self.position_at[motor]] = angles[motor];
            qpos[self.rotor_position_at[motor]] = angles[motor];
        }
        for at in self.partner_position_at {
            qpos[at] = jaw_rad;
        }
        self.data.forward();
    }

    /// One MuJoCo step under these motor torques, N m.
    pub fn step(&mut self, torque: &[f64; MOTORS]) {
        self.data.ctrl_mut().copy_from_slice(torque);
        self.data.step();
    }

    /// Angle of the joint that a motor drives, rad.
    pub fn angle(&self, motor: usize) -> f64 {
        self.data.qpos()[self.position_at[motor]]
    }

    /// Speed of the joint that a motor drives, rad/s.
    pub fn speed(&self, motor: usize) -> f64 {
        self.data.qvel()[self.velocity_at[motor]]
    }

    /// Speed of a motor itself, before the play of its gears, rad/s.
    pub fn motor_speed(&self, motor: usize) -> f64 {
        self.data.qvel()[self.rotor_velocity_at[motor]]
    }

    /// Angles of the 18 joints.
    pub fn joint_position(&self) -> JointVector {
        JointVector::from_fn(|joint, _| self.angle(joint))
    }

    /// Speeds of the 18 joints.
    pub fn joint_velocity(&self) -> JointVector {
        JointVector::from_fn(|joint, _| self.speed(joint))
    }

    /// Attitude of the trunk.
    pub fn attitude(&self) -> UnitQuaternion<f64> {
        let q = &self.data.qpos()[TRUNK_QUATERNION..TRUNK_QUATERNION + 4];
        UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3]))
    }

    /// Angular velocity of the trunk in its own frame, rad/s.
    pub fn angular_velocity(&self) -> Vector3<f64> {
        Vector3::from_column_slice(&self.data.qvel()[TRUNK_ANGULAR_VELOCITY..TRUNK_ANGULAR_VELOCITY + 3])
    }

    /// Specific force at the trunk's origin in its frame at the last step, m/s2.
    pub fn specific_force(&self) -> Vector3<f64> {
        Vector3::from_column_slice(&self.data.sensordata()[..3])
    }

    /// Vertical forces of the ground on the feet at the last step, N.
    pub fn foot_force(&self) -> [f64; 4] {
        let mut force = [0.0; 4];
        for (index, contact) in self.data.contact().iter().enumerate() {
            let feet = contact.geom.map(|geom| self.foot_of_geom.get(address(geom)).copied().flatten());
            if let Some(foot) = feet[0].or(feet[1]) {
                // The contact's normal is vertical on flat ground; its first component is the normal force.
                force[usize::from(foot)] += self.data.contact_force(index)[0];
            }
        }
        force
    }

    /// Contacts that no plan has: of arms with the trunk or each other, and of anything but feet with the ground.
    pub fn unplanned_contacts(&self) -> impl Iterator<Item = Unplanned> + '_ {
        let is_foot = |geom: i32| self.foot_of_geom.get(address(geom)).copied().flatten().is_some();
        self.data.contact().iter().filter(|contact| contact.dist < 0.0).filter_map(move |contact| {
            let [a, b] = contact.geom;
            match (self.is_ground(a), self.is_ground(b)) {
                (false, false) => Some(Unplanned::OfItself([a, b].map(|geom| self.geom_name(geom)))),
                (true, _) if !is_foot(b) => Some(Unplanned::WithGround(self.geom_name(b))),
                (_, true) if !is_foot(a) => Some(Unplanned::WithGround(self.geom_name(a))),
                _ => None,
            }
        })
    }

    fn is_ground(&self, geom: i32) -> bool {
        self.is_ground_geom.get(address(geom)).copied().unwrap_or(false)
    }

    fn geom_name(&self, geom: i32) -> String {
        let name = self.calm.id_to_name(MjtObjBase::mjOBJ_GEOM, address(geom));
        name.unwrap_or_default().to_owned()
    }

    /// Whether the trunk touches the ground, or is tilted beyond 60 degrees without its nose being up.
    pub fn fallen(&self) -> bool {
        const COS_60_DEG: f64 = 0.5;
        let touches = self.data.contact().iter().any(|contact| {
            let is_trunk = |geom: i32| self.is_trunk_geom.get(address(geom)).copied().unwrap_or(false);
            let [a, b] = contact.geom;
            (self.is_ground(a) && is_trunk(b)) || (self.is_ground(b) && is_trunk(a))
        });
        let attitude = self.attitude();
        let sits = (attitude * Vector3::x()).z > COS_60_DEG;
        touches || (!sits && (attitude * Vector3::z()).z < COS_60_DEG)
    }

    /// Whether every state is a number: false when the physics blew up.
    pub fn is_finite(&self) -> bool {
        self.data.qpos().iter().chain(self.data.qvel()).all(|value| value.is_finite())
    }

    /// Seconds since the last reset, settling included.
    pub fn time_s(&self) -> f64 {
        self.data.time()
    }

    /// Everything, exact. Brings the frames up to the present state first.
    pub fn truth(&mut self) -> Truth {
        self.data.kinematics();
        Truth {
            time_ns: 0,
            sim_time_s: self.time_s(),
            world_from_torso: isometry(&self.data.xpos()[self.trunk], &self.data.xmat()[self.trunk]),
            world_from_gripper: self
                .gripper_sites
                .map(|site| isometry(&self.data.site_xpos()[site], &self.data.site_xmat()[site])),
            feet_in_world: self.foot_sites.map(|site| Point3::from(self.data.site_xpos()[site])),
            joint_position: self.joint_position(),
            foot_force_n: self.foot_force(),
            opening: [0.0; 2],
            fallen: self.fallen(),
        }
    }
}

pub(super) fn mujoco(error: impl std::fmt::Display) -> SimRobotError {
    SimRobotError::MuJoCo(error.to_string())
}

fn id(model: &MjModel, kind: MjtObjBase, name: &str) -> Result<usize, SimRobotError> {
    model.name_to_id(kind, name).ok_or_else(|| {
        SimRobotError::MuJoCo(format!(
            "the robot's URDF has nothing named `{name}`, which the simulator needs"
        ))
    })
}

/// MuJoCo's indices are `int`s that are never negative here.
pub(super) fn address(index: impl TryInto<usize>) -> usize {
    index.try_into().unwrap_or_default()
}

/// From MuJoCo's position and row-major rotation.
fn isometry(position: &[f64; 3], rotation: &[f64; 9]) -> Isometry3<f64> {
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_row_slice(rotation));
    Isometry3::from_parts(Translation3::from(*position), UnitQuaternion::from_rotation_matrix(&rotation))
}
