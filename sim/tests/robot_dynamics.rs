//! MuJoCo as an oracle: its mass matrix, bias forces, Jacobians and their rates against `robot::dynamics`, on the
//! model without imperfections and in random states. Both are exact, so they must agree to rounding.
#![expect(clippy::unwrap_used, reason = "in a test a panic is the report")]

use std::path::Path;
use std::sync::Arc;

use locoman_robot::dynamics::{DOF, Dynamics, Jacobian, MassMatrix, Motion, State};
use locoman_robot::joints::{JointVector, Leg, Side};
use locoman_robot::model::{Frame, JOINT_NAMES, Model};
use locoman_sim::robot::mjcf::{FOOT_NAMES, GRIPPER_NAMES};
use locoman_sim::robot::{LockstepPlant, Options};
use mujoco_rs::mujoco_c::mj_jacDot;
use mujoco_rs::prelude::{MjData, MjModel, MjtObjBase};
use nalgebra::{Isometry3, Vector3, Vector6};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Of the largest entry: both are exact to rounding.
const AGREEMENT: f64 = 1e-12;
const STATES: usize = 200;

/// MuJoCo in the coordinates of the controller: its free joint has the linear velocity along the world's axes,
/// ours along the torso's.
struct Oracle {
    plant: LockstepPlant,
    model: Arc<MjModel>,
    /// Where each of our velocities is among MuJoCo's; the jaws' are left out.
    at: [usize; DOF],
}

impl Oracle {
    fn new(configs: &Path) -> Self {
        let options =
            Options { profile: "ideal".into(), posture: "standing".into(), seed: 1, ..Options::default() };
        let mut plant = LockstepPlant::new(configs, &options).unwrap();
        let model = plant.robot_mut().world_mut().data_mut().model_clone();
        let mut at = [0; DOF];
        at[..6].copy_from_slice(&[0, 1, 2, 3, 4, 5]);
        for (place, name) in JOINT_NAMES.iter().enumerate() {
            let joint = model.name_to_id(MjtObjBase::mjOBJ_JOINT, name).unwrap();
            at[6 + place] = model.jnt_dofadr()[joint] as usize;
        }
        Self { plant, model, at }
    }

    fn data(&mut self) -> &mut MjData<Arc<MjModel>> {
        self.plant.robot_mut().world_mut().data_mut()
    }

    fn set(&mut self, state: &State) {
        let (model, at) = (Arc::clone(&self.model), self.at);
        let data = self.data();
        data.reset();
        let pose = &state.world_from_torso;
        let [i, j, k, w]: [f64; 4] = pose.rotation.coords.into();
        let qpos = data.qpos_mut();
        qpos[..3].copy_from_slice(pose.translation.vector.as_slice());
        qpos[3..7].copy_from_slice(&[w, i, j, k]);
        for (place, name) in JOINT_NAMES.iter().enumerate() {
            let joint = model.name_to_id(MjtObjBase::mjOBJ_JOINT, name).unwrap();
            qpos[model.jnt_qposadr()[joint] as usize] = state.position[place];
        }
        let velocity = theirs_from_ours(state) * state.motion();
        for dof in 0..DOF {
            data.qvel_mut()[at[dof]] = velocity[dof];
        }
        data.forward();
    }

    fn mass_matrix(&mut self, state: &State) -> MassMatrix {
        let (size, at) = (self.model.nv() as usize, self.at);
        let mut full = vec![0.0; size * size];
        self.data().full_m(&mut full).unwrap();
        let raw = MassMatrix::from_fn(|row, column| full[at[row] * size + at[column]]);
        let turn = theirs_from_ours(state);
        turn.transpose() * raw * turn
    }

    /// With `v_theirs = T v_ours` the accelerations are `a_theirs = T a_ours + Ṫ v_ours`: so is the bias.
    fn bias(&mut self, state: &State) -> Motion {
        let (size, at) = (self.model.nv() as usize, self.at);
        let mut full = vec![0.0; size * size];
        self.data().full_m(&mut full).unwrap();
        let raw = MassMatrix::from_fn(|row, column| full[at[row] * size + at[column]]);
        let bias = Motion::from_fn(|row, _| self.data().qfrc_bias()[at[row]]);
        theirs_from_ours(state).transpose() * (bias + raw * rate_of_theirs(state))
    }

    fn jacobian(&mut self, site: &str, state: &State) -> Jacobian {
        let site = self.model.name_to_id(MjtObjBase::mjOBJ_SITE, site).unwrap();
        let (linear, angular) = self.data().jac_site(true, true, site);
        self.gathered(&linear, &angular) * theirs_from_ours(state)
    }

    /// The acceleration of a site when dv/dt = 0: `J̇ v` in their coordinates, and their `J` times `Ṫ v`.
    fn bias_acceleration(&mut self, site: &str, state: &State) -> Vector6<f64> {
        let model = Arc::clone(&self.model);
        let site = model.name_to_id(MjtObjBase::mjOBJ_SITE, site).unwrap();
        let size = model.nv() as usize;
        let (mut linear, mut angular) = (vec![0.0; 3 * size], vec![0.0; 3 * size]);
        let data = self.data();
        let (point, body) = (data.site_xpos()[site], model.site_bodyid()[site]);
        // SAFETY: model and data belong together, and the matrices have 3 nv entries as the function wants.
        unsafe {
            mj_jacDot(model.ffi(), data.ffi(), linear.as_mut_ptr(), angular.as_mut_ptr(), &point, body);
        }
        let rate = self.gathered(&linear, &angular);
        let (linear, angular) = self.data().jac_site(true, true, site);
        let jacobian = self.gathered(&linear, &angular);
        rate * theirs_from_ours(state) * state.motion() + jacobian * rate_of_theirs(state)
    }

    fn gathered(&self, linear: &[f64], angular: &[f64]) -> Jacobian {
        let size = self.model.nv() as usize;
        Jacobian::from_fn(|row, column| {
            let rows = if row < 3 { linear } else { angular };
            rows[row % 3 * size + self.at[column]]
        })
    }
}

/// T, which turns the torso's linear velocity to the world's axes.
fn theirs_from_ours(state: &State) -> MassMatrix {
    let mut turn = MassMatrix::identity();
    let rotation = state.world_from_torso.rotation.to_rotation_matrix();
    turn.fixed_view_mut::<3, 3>(0, 0).copy_from(rotation.matrix());
    turn
}

/// Ṫ v: the turning of the torso's linear velocity.
fn rate_of_theirs(state: &State) -> Motion {
    let linear: Vector3<f64> = state.torso_twist.fixed_rows::<3>(0).into();
    let angular: Vector3<f64> = state.torso_twist.fixed_rows::<3>(3).into();
    let mut rate = Motion::zeros();
    rate.fixed_rows_mut::<3>(0).copy_from(&(state.world_from_torso.rotation * angular.cross(&linear)));
    rate
}

fn random_state(model: &Model, random: &mut ChaCha8Rng) -> State {
    let mut draw = || 2.0 * random.random::<f64>() - 1.0;
    State {
        world_from_torso: Isometry3::new(
            Vector3::from_fn(|_, _| draw()),
            Vector3::from_fn(|_, _| 2.0 * draw()),
        ),
        torso_twist: Vector6::from_fn(|_, _| draw()),
        position: model.lower
            + (model.upper - model.lower).component_mul(&JointVector::from_fn(|_, _| 0.5 + 0.5 * draw())),
        velocity: JointVector::from_fn(|_, _| 5.0 * draw()),
    }
}

#[test]
fn simulator_and_controller_have_the_same_dynamics() {
    let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs");
    let model = Model::load(&configs.join("robot")).unwrap();
    let mut oracle = Oracle::new(&configs);
    let mut sut = Dynamics::new();
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let frames = Leg::ALL
        .map(|leg| (Frame::Foot(leg), FOOT_NAMES[leg.index()]))
        .into_iter()
        .chain(Side::ALL.map(|side| (Frame::Gripper(side), GRIPPER_NAMES[side.index()])));
    let frames: Vec<_> = frames.collect();
    let mut worst = [0.0_f64; 4];
    for _ in 0..STATES {
        let state = random_state(&model, &mut random);
        sut.update(&model, &state);
        oracle.set(&state);
        let mut compare = |what: usize, difference: f64, size: f64| {
            worst[what] = worst[what].max(difference / size);
        };
        let mass = oracle.mass_matrix(&state);
        compare(0, (mass - sut.mass_matrix()).amax(), mass.amax());
        let bias = oracle.bias(&state);
        compare(1, (bias - sut.bias()).amax(), bias.amax());
        for (frame, site) in &frames {
            let ours = sut.frame(*frame);
            let jacobian = oracle.jacobian(site, &state);
            compare(2, (jacobian - ours.jacobian).amax(), jacobian.amax());
            let acceleration = oracle.bias_acceleration(site, &state);
            compare(3, (acceleration - ours.bias_acceleration).amax(), acceleration.amax());
        }
        let truth = oracle.plant.truth();
        for (leg, theirs) in Leg::ALL.into_iter().zip(truth.feet_in_world) {
            let ours = sut.frame(Frame::Foot(leg)).world_from_frame.translation.vector;
            assert!((ours - theirs.coords).norm() < AGREEMENT);
        }
        for (side, theirs) in Side::ALL.into_iter().zip(truth.world_from_gripper) {
            let difference = sut.frame(Frame::Gripper(side)).world_from_frame.inverse() * theirs;
            // An angle from a trace has half of the digits.
            assert!(difference.translation.vector.norm() < AGREEMENT && difference.rotation.angle() < 1e-7);
        }
    }
    println!("mass matrix, bias, Jacobians, bias accelerations agree to {worst:?}");
    assert!(worst.iter().all(|difference| *difference < AGREEMENT), "{worst:?}");
}
