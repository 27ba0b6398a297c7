//! Plays one trajectory on the simulated robot and measures how far the bodies are from it, tick by tick.
//!
//! Desired, estimated and true pose are those of the same instant: the sensors' sample of a tick. No delay is
//! taken out. Errors are Euclidean: |p_d - p| and the angle of R_d R⁻¹. The truth's world is brought to the
//! robot's once, by the torso, which both know: the mean over the last 0.25 s of rest before the motion. The
//! gripper's truth comes along, so what the arm sags or the model is wrong by counts as error.

use std::path::Path;

use locoman_robot::trajectory::Trajectory;
use nalgebra::{Isometry3, Vector3};

use super::task::Task;
use crate::eval::body::{Body, align};
use crate::eval::lockstep::{Lockstep, ticks};
use crate::robot::{EXCHANGE_S, Options};

/// Rest in the mode before the motion, and the part of it by which worlds are aligned, s.
const REST_S: f64 = 1.0;
const ALIGN_S: f64 = 0.25;

/// Errors over time: distances in mm, angles in rad.
#[derive(Debug, Clone, Default)]
pub struct Series {
    /// Distances, mm.
    pub position: Vec<f64>,
    /// Angles, rad.
    pub rotation: Vec<f64>,
}

/// Errors of one body.
#[derive(Debug, Clone, Default)]
pub struct BodyErrors {
    /// Of the reference that the commander made of the trajectory: zero unless a limit is in its way.
    pub reference: Series,
    /// Of where the robot believes to be.
    pub estimate: Series,
    /// Of where it is.
    pub truth: Series,
    /// Where it should be, and is, in the robot's world.
    pub path: Vec<[Vector3<f64>; 2]>,
}

/// One run of a task.
#[derive(Debug, Clone)]
pub struct Run {
    /// Which task.
    pub task: Task,
    /// Profile of imperfections.
    pub profile: String,
    /// Torso.
    pub torso: BodyErrors,
    /// Gripper or foot.
    pub limb: Option<BodyErrors>,
}

/// Plays and measures.
pub fn measure(
    configs: &Path,
    task: Task,
    profile: &str,
    seed: u64,
    trajectory: &Trajectory,
) -> anyhow::Result<Run> {
    let side = task.side(seed);
    let options = Options { profile: profile.into(), posture: "standing".into(), seed, ..Options::default() };
    let mut sut = Lockstep::new(configs, &options)?;
    sut.go_to(task.mode(side))?;
    sut.run(REST_S - ALIGN_S)?;
    let sim_from_world = align(&mut sut, ALIGN_S)?;

    let bodies = [Some(Body::Torso), task.limb(side)];
    let anchors = bodies.map(|body| body.map(|body| body.reference(&sut)));
    let mut errors = [BodyErrors::default(), BodyErrors::default()];
    sut.engage(trajectory)?;
    for tick in 1..=ticks(trajectory.duration_s()) {
        sut.tick()?;
        anyhow::ensure!(
            !sut.truth().fallen,
            "the robot fell {:.2} s after engaging",
            tick as f64 * EXCHANGE_S
        );
        let sample = trajectory.at(tick as f64 * EXCHANGE_S);
        let displacements = [&sample.torso, &sample.limbs[side.index()]];
        for (place, body) in bodies.iter().enumerate() {
            let (Some(body), Some(anchor)) = (body, &anchors[place]) else { continue };
            let desired = displacements[place].displacing(anchor).pose();
            let true_pose = body.truth(sut.truth(), &sim_from_world);
            let errors = &mut errors[place];
            errors.reference.push(&desired, &body.reference(&sut));
            errors.estimate.push(&desired, &body.estimate(sut.controller().wbc().dynamics()));
            errors.truth.push(&desired, &true_pose);
            errors.path.push([desired.translation.vector, true_pose.translation.vector]);
        }
    }
    let [torso, limb] = errors;
    let limb = bodies[1].map(|_| limb);
    Ok(Run { task, profile: profile.into(), torso, limb })
}

impl Series {
    fn push(&mut self, desired: &Isometry3<f64>, actual: &Isometry3<f64>) {
        self.position.push(1e3 * (desired.translation.vector - actual.translation.vector).norm());
        self.rotation.push(desired.rotation.angle_to(&actual.rotation));
    }
}
