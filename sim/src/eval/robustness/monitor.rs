//! Watches a robot tick by tick for what must never happen, and keeps how it moved.

use locoman_robot::joints::{JOINTS, Leg, Side};
use locoman_robot::model::{JOINT_NAMES, Model};
use locoman_robot::supervisor::Severity;
use nalgebra::{Isometry3, Point3, Vector3};

use crate::eval::body::Body;
use crate::eval::lockstep::{Lockstep, ticks};
use crate::robot::world::Unplanned;
use crate::robot::{EXCHANGE_S, Truth};

/// Ticks between the positions whose third difference is the jerk: 20 ms. What is faster than 25 Hz is noise of
/// gears and contacts, and no shaking.
const JERK_TICKS: usize = 8;
/// Half of the window whose mean is taken out of an error to see it shake, ticks: what is slower than 4 Hz is
/// no shaking.
const TREMOR_TICKS: usize = 50;

/// The greatest of something, and where it was.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Peak {
    /// How great.
    pub value: f64,
    /// Which joint.
    pub joint: usize,
}

impl Peak {
    fn raise(&mut self, value: f64, joint: usize) {
        if value > self.value {
            *self = Self { value, joint };
        }
    }

    /// Name of the joint.
    pub fn place(&self) -> &'static str {
        if self.value > 0.0 { JOINT_NAMES[self.joint] } else { "" }
    }
}

/// What must never happen, counted; and how near the limits came.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Findings {
    /// Ticks watched.
    pub ticks: u64,
    /// The trunk touched the ground or leaned beyond 60 degrees.
    pub falls: u64,
    /// The supervisor took the robot back to four feet, or ended the engagement.
    pub interventions: u64,
    /// Ticks with a command that is no number.
    pub not_finite: u64,
    /// Farthest that a joint truly was beyond its range, rad.
    pub position_over_rad: Peak,
    /// Greatest true speed of a joint, as a share of its limit.
    pub speed_share: Peak,
    /// Greatest torque, as a share of its limit: of the legs' motors; of the arms, what is commanded (their servos
    /// see to their own currents, and brake with more than they drive).
    pub torque_share: Peak,
    /// Farthest that a standing foot was from where it began, mm.
    pub slip_mm: f64,
    /// Ticks in which an arm touched the trunk or the other arm.
    pub self_contacts: u64,
    /// Ticks in which something other than a foot touched the ground.
    pub ground_contacts: u64,
}

impl Findings {
    /// Takes in those of another run.
    pub fn add(&mut self, other: &Self) {
        self.ticks += other.ticks;
        self.falls += other.falls;
        self.interventions += other.interventions;
        self.not_finite += other.not_finite;
        for (mine, its) in [
            (&mut self.position_over_rad, other.position_over_rad),
            (&mut self.speed_share, other.speed_share),
            (&mut self.torque_share, other.torque_share),
        ] {
            mine.raise(its.value, its.joint);
        }
        self.slip_mm = self.slip_mm.max(other.slip_mm);
        self.self_contacts += other.self_contacts;
        self.ground_contacts += other.ground_contacts;
    }

    /// Which joints broke which limits, in words; nothing if none did.
    pub fn broken(&self) -> Option<String> {
        let Self { position_over_rad, speed_share, torque_share, .. } = self;
        let beyond = |what: &str, peak: &Peak| {
            (peak.value > 1.0)
                .then(|| format!("{} at {:.1}% of its {what}", peak.place(), 100.0 * peak.value))
        };
        let range = (position_over_rad.value > 0.0).then(|| {
            format!("{} {:.4} rad beyond its range", position_over_rad.place(), position_over_rad.value)
        });
        let broken: Vec<String> = [range, beyond("speed", speed_share), beyond("torque", torque_share)]
            .into_iter()
            .flatten()
            .collect();
        (!broken.is_empty()).then(|| broken.join(", "))
    }

    /// The robot is no longer where a trial can go on.
    /// Joints against the ends of their ranges, their speeds and torques; what touches what it should not.
    pub fn watch_limits(&mut self, sut: &mut Lockstep, model: &Model, mut touched: impl FnMut(&Unplanned)) {
        let commanded = sut.command().torque;
        let robot = sut.plant_mut().robot_mut();
        let applied = *robot.applied_torques();
        let world = robot.world_mut();
        let (position, velocity) = (world.joint_position(), world.joint_velocity());
        for joint in 0..JOINTS {
            let over = (position[joint] - model.upper[joint]).max(model.lower[joint] - position[joint]);
            self.position_over_rad.raise(over, joint);
            self.speed_share.raise(velocity[joint].abs() / model.max_velocity[joint], joint);
            let torque = if joint < 12 { applied[joint] } else { commanded[joint] };
            self.torque_share.raise(torque.abs() / model.max_torque[joint], joint);
        }
        let (mut own, mut ground) = (false, false);
        for contact in world.unplanned_contacts() {
            match &contact {
                Unplanned::OfItself(_) => own = true,
                Unplanned::WithGround(_) => ground = true,
            }
            touched(&contact);
        }
        self.self_contacts += u64::from(own);
        self.ground_contacts += u64::from(ground);
    }

    pub fn is_over(&self) -> bool {
        self.falls + self.interventions > 0
    }
}

/// Poses of a body over time, in the robot's world.
#[derive(Debug, Clone, Default)]
pub struct Track {
    /// Where the commander wanted it.
    pub reference: Vec<Isometry3<f64>>,
    /// Where it was.
    pub truth: Vec<Isometry3<f64>>,
}

/// Watches a robot that uses a gripper.
#[derive(Debug, Clone)]
pub struct Monitor {
    side: Side,
    sim_from_world: Isometry3<f64>,
    feet: [Point3<f64>; 4],
    /// What it found.
    pub findings: Findings,
    /// Torso, gripper.
    pub tracks: [Track; 2],
    /// When and why it ended early.
    pub end: Option<String>,
    /// What touched what, though it should not.
    pub touched: Vec<Unplanned>,
}

impl Monitor {
    /// Of a robot whose world is there in the simulator's.
    pub fn new(side: Side, sim_from_world: Isometry3<f64>, truth: &Truth) -> Self {
        let feet = truth.feet_in_world;
        Self {
            side,
            sim_from_world,
            feet,
            findings: Findings::default(),
            tracks: Default::default(),
            end: None,
            touched: Vec::new(),
        }
    }

    /// Looks at the robot after a tick. False once there is nothing more to watch.
    pub fn watch(&mut self, sut: &mut Lockstep, model: &Model) -> bool {
        let found = &mut self.findings;
        found.ticks += 1;
        found.falls = u64::from(sut.truth().fallen);
        for leg in Leg::ALL.into_iter().filter(|leg| *leg != self.side.leg()) {
            let moved = sut.truth().feet_in_world[leg.index()] - self.feet[leg.index()];
            found.slip_mm = found.slip_mm.max(1e3 * moved.norm());
        }
        let snapshot = sut.snapshot();
        let at_work = snapshot.phase.is_driven() && snapshot.assessment.severity < Severity::Hold;
        found.interventions = u64::from(!at_work);
        found.not_finite += u64::from(!sut.command().is_finite());
        for (body, track) in [Body::Torso, Body::Gripper(self.side)].into_iter().zip(&mut self.tracks) {
            track.reference.push(body.reference(sut));
            track.truth.push(body.truth(sut.truth(), &self.sim_from_world));
        }
        if found.is_over() && self.end.is_none() {
            let tilt =
                (self.tracks[0].truth.last().map_or(1.0, |torso| (torso.rotation * Vector3::z()).z)).acos();
            self.end = Some(format!(
                "{:.2} s: {}, {:?}, leaning {tilt:.2} rad",
                found.ticks as f64 * EXCHANGE_S,
                if sut.truth().fallen { "fallen" } else { "stopped" },
                sut.snapshot().assessment,
            ));
        }
        let touched = &mut self.touched;
        found.watch_limits(sut, model, |contact| {
            if !touched.contains(contact) {
                touched.push(contact.clone());
            }
        });
        !found.is_over()
    }
}

impl Monitor {
    /// A robot that the supervisor has stopped: does it fall within 3 s?
    pub fn see_off(&mut self, sut: &mut Lockstep) -> anyhow::Result<()> {
        for _ in 0..ticks(3.0) {
            sut.tick()?;
            self.findings.falls = self.findings.falls.max(u64::from(sut.truth().fallen));
        }
        Ok(())
    }
}

impl Track {
    /// Distances of reference and truth, mm.
    pub fn errors_mm(&self) -> Vec<f64> {
        let pairs = self.reference.iter().zip(&self.truth);
        pairs.map(|(a, b)| 1e3 * (a.translation.vector - b.translation.vector).norm()).collect()
    }

    /// Greatest third derivative of the true position, m/s³.
    pub fn peak_jerk(&self) -> f64 {
        let h = JERK_TICKS as f64 * EXCHANGE_S;
        let at = |tick: usize| self.truth[tick].translation.vector;
        let jerk = |tick: usize| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|step| at(tick + step * JERK_TICKS));
            (d - 3.0 * c + 3.0 * b - a).norm() / h.powi(3)
        };
        (0..self.truth.len().saturating_sub(3 * JERK_TICKS)).map(jerk).fold(0.0, f64::max)
    }

    /// Greatest distance of the error from its own mean over 0.25 s, mm: what shakes.
    pub fn tremor_mm(&self) -> f64 {
        let errors: Vec<Vector3<f64>> = self
            .reference
            .iter()
            .zip(&self.truth)
            .map(|(a, b)| 1e3 * (b.translation.vector - a.translation.vector))
            .collect();
        let shaken = |window: &[Vector3<f64>]| {
            let mean = window.iter().sum::<Vector3<f64>>() / window.len() as f64;
            (window[TREMOR_TICKS] - mean).norm()
        };
        errors.windows(2 * TREMOR_TICKS + 1).map(shaken).fold(0.0, f64::max)
    }

    /// Time after `from` until the true position stays within `within_m` of its mean over the last 0.5 s, s.
    pub fn settling_s(&self, from: usize, within_m: f64) -> f64 {
        let last = self.truth.len().saturating_sub((0.5 / EXCHANGE_S) as usize);
        let rest = &self.truth[last..];
        let mean = rest.iter().map(|pose| pose.translation.vector).sum::<Vector3<f64>>() / rest.len() as f64;
        let away = |pose: &Isometry3<f64>| (pose.translation.vector - mean).norm() > within_m;
        let after = self.truth.get(from..).unwrap_or_default();
        after.iter().rposition(away).map_or(0.0, |tick| (tick + 1) as f64 * EXCHANGE_S)
    }

    /// Greatest true speed over the last half second, mm/s, seen over 20 ms.
    pub fn last_speed_mm_s(&self) -> f64 {
        let h = JERK_TICKS as f64 * EXCHANGE_S;
        let last = self.truth.len().saturating_sub((0.5 / EXCHANGE_S) as usize);
        let speed = |pair: &[Isometry3<f64>]| {
            1e3 * (pair[JERK_TICKS].translation.vector - pair[0].translation.vector).norm() / h
        };
        self.truth[last..].windows(JERK_TICKS + 1).map(speed).fold(0.0, f64::max)
    }
}
