//! Where the torso is, from the joints of the legs that stand, the gyroscope, and gravity.
//!
//! The paper's kinematic estimator (appendix, "State Estimation"), with what it leaves out:
//! - the foot is a sphere that rolls: its centre moves by r δφ × n when the foot turns by δφ (n: up), which
//!   the paper's fixed foot centres take for motion of the torso (2 to 4 mm);
//! - the angular velocity is the gyroscope's, the linear velocity that of the standing feet, in place of
//!   differences of poses;
//! - a foot that lands gets its place from the others, so contacts change without a new world.
//!
//! The *world* is the torso's frame at the last reset with its tilt taken out by the IMU: x is the torso's
//! heading, z is up. A reset of a torso that stands level is the paper's.

mod procrustes;

use nalgebra::{Isometry3, UnitQuaternion, Vector3, Vector6};
pub use procrustes::{Pair, align};
use serde::Deserialize;

use crate::{
    dynamics::State,
    joints::Leg,
    kinematics::{FootKinematics, of_leg},
    model::Model,
    plant::Sensors,
    wbc::ContactSet,
};

/// Numbers of the estimator; `configs/robot/control.toml` says where they come from.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EstimatorSettings {
    /// Radius of the foot's sphere, m.
    pub foot_radius_m: f64,
    /// Cut-off of the linear velocity's low-pass filter, Hz.
    pub velocity_cutoff_hz: f64,
    /// Cut-off of the gyroscope's low-pass filter, Hz.
    pub gyro_cutoff_hz: f64,
}

impl Default for EstimatorSettings {
    fn default() -> Self {
        Self { foot_radius_m: 0.02, velocity_cutoff_hz: 40.0, gyro_cutoff_hz: 80.0 }
    }
}

/// A standing foot.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Anchor {
    centre_in_world: Vector3<f64>,
    world_from_foot: UnitQuaternion<f64>,
}

/// Estimates the state of torso and joints. Allocates nothing.
#[derive(Debug, Clone)]
pub struct KinematicEstimator {
    settings: EstimatorSettings,
    world_from_torso: Isometry3<f64>,
    /// In the world.
    linear_velocity: Vector3<f64>,
    /// In the torso's frame.
    angular_velocity: Vector3<f64>,
    anchors: [Option<Anchor>; 4],
    resets: u64,
}

impl KinematicEstimator {
    /// An estimator that needs a [`Self::reset`] before it says anything.
    pub fn new(settings: EstimatorSettings) -> Self {
        Self {
            settings,
            world_from_torso: Isometry3::identity(),
            linear_velocity: Vector3::zeros(),
            angular_velocity: Vector3::zeros(),
            anchors: [None; 4],
            resets: 0,
        }
    }

    /// Makes a new world of the torso's frame as it is now: origin and heading are the torso's, z is up.
    pub fn reset(&mut self, model: &Model, sensors: &Sensors, contacts: &ContactSet) {
        self.world_from_torso = Isometry3::from_parts(Vector3::zeros().into(), tilt(&sensors.attitude));
        self.linear_velocity = Vector3::zeros();
        self.angular_velocity = Vector3::from(sensors.gyro);
        for leg in Leg::ALL {
            let foot = FootKinematics::new(model, &sensors.position, leg);
            self.anchors[leg.index()] = contacts.contains(leg).then(|| self.anchor(&foot));
        }
        self.resets += 1;
    }

    /// Moves the world: whatever was at x in the old one is at `new_from_old` x in the new one.
    pub fn rebase(&mut self, new_from_old: &Isometry3<f64>) {
        self.world_from_torso = new_from_old * self.world_from_torso;
        self.linear_velocity = new_from_old.rotation * self.linear_velocity;
        for anchor in self.anchors.iter_mut().flatten() {
            anchor.centre_in_world = new_from_old.transform_point(&anchor.centre_in_world.into()).coords;
            anchor.world_from_foot = new_from_old.rotation * anchor.world_from_foot;
        }
        self.resets += 1;
    }

    /// Takes in one sample. `contacts` are the feet that stand, by plan.
    pub fn update(&mut self, model: &Model, sensors: &Sensors, contacts: &ContactSet, dt_s: f64) {
        let feet = Leg::ALL.map(|leg| FootKinematics::new(model, &sensors.position, leg));
        for leg in Leg::ALL.into_iter().filter(|leg| !contacts.contains(*leg)) {
            self.anchors[leg.index()] = None;
        }
        self.locate(&feet);
        for (anchor, foot) in self.anchors.iter_mut().zip(&feet) {
            if let Some(anchor) = anchor {
                *anchor = rolled(anchor, &self.world_from_torso, foot, self.settings.foot_radius_m);
            }
        }
        for leg in contacts.legs() {
            if self.anchors[leg.index()].is_none() {
                self.anchors[leg.index()] = Some(self.anchor(&feet[leg.index()]));
            }
        }
        self.follow_velocity(&feet, sensors, contacts, dt_s);
    }

    /// Without standing feet: keeps the place, follows tilt and turn rate.
    pub fn follow_tilt(&mut self, sensors: &Sensors) {
        self.world_from_torso.rotation = tilt(&sensors.attitude);
        self.linear_velocity = Vector3::zeros();
        self.angular_velocity = Vector3::from(sensors.gyro);
    }

    /// Pose of the torso by the anchors, rolled along with the feet.
    fn locate(&mut self, feet: &[FootKinematics; 4]) {
        // How far a foot has rolled depends on the torso's attitude, which depends on how far the feet have
        // rolled: the second pass leaves less than a nanometre.
        for _ in 0..2 {
            let pose = self.world_from_torso;
            let pairs = self.anchors.iter().zip(feet).filter_map(|(anchor, foot)| {
                let to = rolled(anchor.as_ref()?, &pose, foot, self.settings.foot_radius_m).centre_in_world;
                Some(Pair { from: foot.position(), to, weight: 1.0 })
            });
            if let Some(pose) = align(pairs) {
                self.world_from_torso = pose;
            }
        }
    }

    /// ω from the gyroscope; v such that the standing feet roll without slipping, in the mean:
    /// v = ω_foot × r n - R (J dq + ω × p).
    fn follow_velocity(
        &mut self,
        feet: &[FootKinematics; 4],
        sensors: &Sensors,
        contacts: &ContactSet,
        dt_s: f64,
    ) {
        let gyro = Vector3::from(sensors.gyro);
        let radius = self.settings.foot_radius_m * Vector3::z();
        let world_from_torso = self.world_from_torso.rotation;
        let (mut sum, mut count) = (Vector3::zeros(), 0.0);
        for leg in contacts.legs() {
            let foot = &feet[leg.index()];
            let joints = of_leg(&sensors.velocity, leg);
            let turning = world_from_torso * (gyro + foot.angular * joints);
            let moving = foot.linear * joints + gyro.cross(&foot.position());
            sum += turning.cross(&radius) - world_from_torso * moving;
            count += 1.0;
        }
        if count > 0.0 {
            let velocity = sum / count;
            self.linear_velocity +=
                low_pass(self.settings.velocity_cutoff_hz, dt_s) * (velocity - self.linear_velocity);
        }
        self.angular_velocity +=
            low_pass(self.settings.gyro_cutoff_hz, dt_s) * (gyro - self.angular_velocity);
    }

    fn anchor(&self, foot: &FootKinematics) -> Anchor {
        let world_from_foot = self.world_from_torso * foot.torso_from_foot;
        Anchor {
            centre_in_world: world_from_foot.translation.vector,
            world_from_foot: world_from_foot.rotation,
        }
    }

    /// The state of the robot, with joints as measured.
    pub fn state(&self, sensors: &Sensors) -> State {
        let linear = self.world_from_torso.rotation.inverse_transform_vector(&self.linear_velocity);
        let mut torso_twist = Vector6::zeros();
        torso_twist.fixed_rows_mut::<3>(0).copy_from(&linear);
        torso_twist.fixed_rows_mut::<3>(3).copy_from(&self.angular_velocity);
        State {
            world_from_torso: self.world_from_torso,
            torso_twist,
            position: sensors.position,
            velocity: sensors.velocity,
        }
    }

    /// Pose of the torso in the world.
    pub fn world_from_torso(&self) -> &Isometry3<f64> {
        &self.world_from_torso
    }

    /// How often the world was set anew.
    pub fn resets(&self) -> u64 {
        self.resets
    }
}

/// An anchor after its foot has turned to where it is now: c' = c + r δφ × n.
fn rolled(
    anchor: &Anchor,
    world_from_torso: &Isometry3<f64>,
    foot: &FootKinematics,
    radius_m: f64,
) -> Anchor {
    let world_from_foot = world_from_torso.rotation * foot.torso_from_foot.rotation;
    let turned = (world_from_foot * anchor.world_from_foot.inverse()).scaled_axis();
    let centre_in_world = anchor.centre_in_world + radius_m * turned.cross(&Vector3::z());
    Anchor { centre_in_world, world_from_foot }
}

/// Share of the way that a first-order low-pass filter goes in one step.
fn low_pass(cutoff_hz: f64, dt_s: f64) -> f64 {
    1.0 - (-std::f64::consts::TAU * cutoff_hz * dt_s).exp()
}

/// Roll and pitch of an attitude, without its heading: takes the torso's axes to axes with z up.
pub fn tilt(attitude: &[f64; 4]) -> UnitQuaternion<f64> {
    let [w, x, y, z] = *attitude;
    let quaternion = nalgebra::Quaternion::new(w, x, y, z);
    let attitude = UnitQuaternion::try_new(quaternion, 1e-6).unwrap_or_default();
    heading(&attitude).inverse() * attitude
}

/// The rotation about z by which an attitude's x axis points aside.
pub fn heading(attitude: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    let forward = attitude * Vector3::x();
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), forward.y.atan2(forward.x))
}

/// Angle between the torso's z axis and up, rad.
pub fn tilt_angle(attitude: &[f64; 4]) -> f64 {
    (tilt(attitude) * Vector3::z()).z.clamp(-1.0, 1.0).acos()
}
