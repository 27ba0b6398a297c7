//! Dynamics against an independent implementation.
//!
//! `golden/model.urdf` is the published LocoMan model without meshes; `golden/dynamics.json` holds 12 random
//! states of it evaluated with Pinocchio 4.1.0 (conventions are written in the file).

#![expect(clippy::unwrap_used, reason = "in a test a panic is the report")]

use std::path::{Path, PathBuf};

use locoman_robot::{
    dynamics::{DOF, Dynamics, Motion, State},
    joints::{JOINTS, JointVector, Leg, Side},
    model::{Frame, JOINT_NAMES, Model},
};
use nalgebra::{DMatrix, Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3, Vector6};
use serde_json::Value;

/// Relative to the greatest entry of what is compared; the issue's own number.
const TOLERANCE: f64 = 1e-9;

const FRAMES: [(&str, Frame); 6] = [
    ("1_FR_foot", Frame::Foot(Leg::FrontRight)),
    ("2_FL_foot", Frame::Foot(Leg::FrontLeft)),
    ("3_RR_foot", Frame::Foot(Leg::RearRight)),
    ("4_RL_foot", Frame::Foot(Leg::RearLeft)),
    ("1_FR_eef", Frame::Gripper(Side::Right)),
    ("2_FL_eef", Frame::Gripper(Side::Left)),
];

fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(name)
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

fn matrix(value: &Value) -> DMatrix<f64> {
    let rows: Vec<Vec<f64>> = value.as_array().unwrap().iter().map(numbers).collect();
    DMatrix::from_fn(rows.len(), rows[0].len(), |row, column| rows[row][column])
}

/// The golden file's joint order is the URDF's; ours goes legs first.
struct Order {
    /// Place in the file's motion vector of each of our degrees of freedom.
    of_ours: [usize; DOF],
}

impl Order {
    fn read(file: &Value) -> Self {
        let names: Vec<&str> =
            file["joint_order"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
        let mut of_ours = std::array::from_fn(|index| index);
        for joint in 0..JOINTS {
            of_ours[6 + joint] = 6 + names.iter().position(|name| *name == JOINT_NAMES[joint]).unwrap();
        }
        Self { of_ours }
    }

    fn motion(&self, value: &Value) -> Motion {
        let theirs = numbers(value);
        Motion::from_fn(|row, _| theirs[self.of_ours[row]])
    }

    fn columns(&self, value: &Value) -> DMatrix<f64> {
        let theirs = matrix(value);
        DMatrix::from_fn(theirs.nrows(), DOF, |row, column| theirs[(row, self.of_ours[column])])
    }

    fn square(&self, value: &Value) -> DMatrix<f64> {
        let theirs = self.columns(value);
        DMatrix::from_fn(DOF, DOF, |row, column| theirs[(self.of_ours[row], column)])
    }

    fn state(&self, case: &Value) -> State {
        let q = numbers(&case["q"]);
        let v = self.motion(&case["v"]);
        State {
            world_from_torso: Isometry3::from_parts(
                Translation3::new(q[0], q[1], q[2]),
                UnitQuaternion::new_normalize(Quaternion::new(q[6], q[3], q[4], q[5])),
            ),
            torso_twist: v.fixed_rows::<6>(0).into_owned(),
            position: JointVector::from_fn(|row, _| q[self.of_ours[6 + row] + 1]),
            velocity: v.fixed_rows::<JOINTS>(6).into_owned(),
        }
    }
}

#[track_caller]
fn assert_close(what: &str, ours: &[f64], theirs: &[f64]) {
    assert_eq!(ours.len(), theirs.len(), "{what}");
    let scale = theirs.iter().fold(0.0_f64, |greatest, number| greatest.max(number.abs()));
    for (index, (a, b)) in ours.iter().zip(theirs).enumerate() {
        assert!((a - b).abs() <= TOLERANCE * scale, "{what}[{index}]: {a} against {b}, scale {scale}");
    }
}

#[test]
fn dynamics_agree_with_pinocchio() {
    let model = Model::from_urdf(&golden("model.urdf")).unwrap();
    let text = std::fs::read_to_string(golden("dynamics.json")).unwrap();
    let file: Value = serde_json::from_str(&text).unwrap();
    let order = Order::read(&file);
    let cases = file["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 12);

    let mut sut = Dynamics::new();
    for case in cases {
        sut.update(&model, &order.state(case));

        let mass_matrix = order.square(&case["mass_matrix"]);
        assert_close("mass matrix", sut.mass_matrix().as_slice(), mass_matrix.as_slice());
        assert_close("bias", sut.bias().as_slice(), order.motion(&case["bias"]).as_slice());
        assert_close("gravity", sut.gravity().as_slice(), order.motion(&case["gravity"]).as_slice());
        let inverse = sut.inverse_dynamics(&order.motion(&case["a"]));
        let theirs = order.motion(&case["inverse_dynamics"]);
        assert_close("inverse dynamics", inverse.as_slice(), theirs.as_slice());
        assert_close("centre of mass", sut.com().as_slice(), &numbers(&case["com"]));

        for (name, frame) in FRAMES {
            let theirs = &case["frames"][name];
            let ours = sut.frame(frame);
            let position = ours.world_from_frame.translation.vector;
            assert_close(name, position.as_slice(), &numbers(&theirs["position"]));
            let rotation = ours.world_from_frame.rotation.to_rotation_matrix();
            assert_close(name, rotation.matrix().as_slice(), matrix(&theirs["rotation"]).as_slice());
            assert_close(name, ours.jacobian.as_slice(), order.columns(&theirs["jacobian"]).as_slice());
            assert_close(name, ours.bias_acceleration.as_slice(), &numbers(&theirs["jdot_v"]));
        }
    }
}

#[test]
fn the_torso_is_a_frame_like_any_other() {
    let model = Model::from_urdf(&golden("model.urdf")).unwrap();
    let mut state = State::at_rest(JointVector::zeros());
    state.world_from_torso.rotation = UnitQuaternion::from_euler_angles(0.1, 0.2, 0.3);
    state.torso_twist = Vector6::new(0.1, 0.2, 0.3, 0.4, 0.5, 0.6);
    let mut sut = Dynamics::new();
    sut.update(&model, &state);

    let torso = sut.frame(Frame::Torso);
    let rotation = state.world_from_torso.rotation;
    let linear = rotation * Vector3::new(0.1, 0.2, 0.3);
    let turning = rotation * Vector3::new(0.4, 0.5, 0.6).cross(&Vector3::new(0.1, 0.2, 0.3));
    assert_close("velocity", &torso.velocity.as_slice()[..3], linear.as_slice());
    assert_close("turning", &torso.bias_acceleration.as_slice()[..3], turning.as_slice());
    assert_eq!(torso.jacobian * state.motion(), torso.velocity);
}
