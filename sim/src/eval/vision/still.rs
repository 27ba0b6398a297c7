//! A shell at rest, given the rig: how far from the truth, how much it trembles, and how much it would have to.
//!
//! The operator stands in several postures near that of `static.toml`. Accuracy is that of JPEG-coded images, jitter that
//! of images without compression: the bound is one of the sensor's noise. Jitter is the standard deviation about the mean
//! of a posture, once of the tracker's filtered poses after it has settled, and once of a solve of each instant
//! alone, without any knowledge of earlier ones. Only the latter may be compared with the bound, which knows one instant
//! too ([`super::bound`] says of what); the filter is expected to go below it.

use locoman_vision::pose::{Observation, Solver, SolverSettings, Views, exposure_ns};
use locoman_vision::track::{TrackUpdate, TrackerSettings, Verdict};
use nalgebra::{Isometry3, Matrix6, Vector3};

use super::bound;
use super::film::{Coding, Film, STILL_DRAWS, Shot, truth_at};
use super::stage::Stage;
use super::tally::Tally;
use crate::eval::statistics::rms;
use crate::eval::{Figure, Must, Report};
use crate::operator::motion::{Body, Home};
use crate::operator::scene::Scene;
use crate::operator::sensor::mix;
use crate::operator::studio::Picture;

/// Images a second of each camera.
const RATE_HZ: f64 = 30.0;
/// Postures.
const POSTURES: u64 = 12;
/// How long each is held, by default.
pub const SECONDS: f64 = 1.5;
/// When the filter has settled.
const SETTLED_S: f64 = 0.5;
/// Tags that show smaller sides than this are not read by anybody.
const LEAST_SIDE_PX: f64 = 12.0;
/// Nor are those that are seen more obliquely.
const MOST_FACING_DEG: f64 = 78.0;

/// One shell in all postures.
#[derive(Debug, Default)]
struct Jitter {
    /// Squared deviations from the mean of a posture: position in m², rotation in rad², of the filtered poses,
    filtered: [Vec<f64>; 2],
    /// and of single instants.
    single: [Vec<f64>; 2],
    /// The bound of the same, once a posture.
    bound: [Vec<f64>; 2],
    /// Distance of the mean of a posture from the truth: what is no noise.
    bias: [Vec<f64>; 2],
}

/// Films all postures; adds the figures.
pub fn run(stage: &Stage, seed: u64, seconds: f64, report: &mut Report) -> anyhow::Result<Tally> {
    let mut tally = Tally::new(&stage.shells);
    let mut jitters: Vec<Jitter> = stage.shells.shells.iter().map(|_| Jitter::default()).collect();
    for posture in 0..POSTURES {
        let stage = stage.with_scene(moved(stage.studio.scene(), mix(seed ^ mix(posture))))?;
        let film =
            Film { studio: &stage.studio, begin_s: 0.0, seconds, rate_hz: RATE_HZ, coding: Coding::Jpeg };
        let mut tracker = stage.tracker()?;
        film.show_still(|shot| {
            tally.add(&stage.studio, &shot, &tracker.update(&shot.frames));
            Ok(())
        })?;
        still(&stage, &Film { coding: Coding::Raw, ..film }, &mut jitters)?;
    }
    for (shell, jitter) in tally.shells.iter().zip(&jitters) {
        let figure =
            |what: &str, value: f64, unit| Figure::new(format!("static.{}.{what}", shell.name), value, unit);
        let (most_mm, most_deg) = match shell.body {
            Some(Body::Torso) => (0.1, 0.05),
            Some(Body::RightThumb | Body::LeftThumb) => (0.2, 0.4),
            _ => (0.1, 0.1),
        };
        report.push(
            figure("position_rms", shell.position_rms_mm(), "mm")
                .must(Must::AtMost(most_mm))
                .reference(0.15, "Vicon, static, mean: Merriaux 2017"),
        );
        report.push(
            figure("rotation_rms", shell.rotation_rms_deg(), "deg")
                .must(Must::AtMost(most_deg))
                .reference(0.35, "mono dodecahedron, Sensors 2026, static"),
        );
        let kinds = [("position", 1e3, "mm"), ("rotation", 1f64.to_degrees(), "deg")];
        for (k, (kind, scale, unit)) in kinds.into_iter().enumerate() {
            let [filtered, single, bound, bias] =
                [&jitter.filtered, &jitter.single, &jitter.bound, &jitter.bias].map(|of| scale * rms(&of[k]));
            report.push(figure(&format!("{kind}_bias"), bias, unit));
            report.push(figure(&format!("{kind}_jitter_filtered"), filtered, unit));
            report.push(figure(&format!("{kind}_jitter_single"), single, unit));
            report.push(figure(&format!("{kind}_bound_single"), bound, unit));
            let of_bound = figure(&format!("{kind}_jitter_single_of_bound"), single / bound, "");
            report.push(of_bound.must(Must::AtMost(1.5)));
            report.push(figure(&format!("{kind}_jitter_filtered_of_bound"), filtered / bound, ""));
        }
    }
    Ok(tally)
}

/// The jitter of one posture.
fn still(stage: &Stage, film: &Film<'_>, jitters: &mut [Jitter]) -> anyhow::Result<()> {
    let mut tracker = stage.tracker()?;
    let mut solver = Solver::default();
    let mut filtered: Vec<Vec<Isometry3<f64>>> = vec![Vec::new(); jitters.len()];
    let mut single = filtered.clone();
    let mut last = None;
    film.show_still(|shot| {
        let update = tracker.update(&shot.frames);
        for (shell, found) in update.shells.iter().enumerate() {
            let settled = shot.time_s >= SETTLED_S && found.verdict == Verdict::Tracked;
            if let (true, Some(pose)) = (settled, found.world_from_shell) {
                filtered[shell].push(pose);
                single[shell].extend(alone(stage, &mut solver, shell, &update));
            }
        }
        last = Some((shot, update.time_ns));
        Ok(())
    })?;
    let Some((shot, time_ns)) = last else { return Ok(()) };
    let truth = truth_at(&stage.studio, time_ns);
    let pictures = noiseless(stage, &shot)?;
    for (shell, jitter) in jitters.iter_mut().enumerate() {
        let Some(body) = Body::from_name(&stage.shells.shells[shell].name) else { continue };
        spread(truth.of(body), &filtered[shell], &mut jitter.filtered, Some(&mut jitter.bias));
        spread(truth.of(body), &single[shell], &mut jitter.single, None);
        let Some(bound) = pose_bound(stage, shell, truth.of(body), &shot, &pictures) else { continue };
        for (k, of) in jitter.bound.iter_mut().enumerate() {
            of.push((0..3).map(|axis| bound[(3 * k + axis, 3 * k + axis)]).sum::<f64>().sqrt());
        }
    }
    Ok(())
}

/// The same solve that the tracker makes, of one update's tags, as if nothing were known before.
fn alone(stage: &Stage, solver: &mut Solver, shell: usize, update: &TrackUpdate) -> Option<Isometry3<f64>> {
    let settings = TrackerSettings::default();
    let observations: Vec<Observation> = update
        .cameras
        .iter()
        .flat_map(|camera| camera.tags.iter().map(move |seen| (camera, seen)))
        .filter(|(_, seen)| seen.shell == shell)
        .map(|(camera, seen)| Observation {
            camera: camera.camera,
            tag: seen.tag,
            capture_ns: camera.capture_ns,
            corners_px: seen.detection.corners_px,
            covariance_px2: settings.corner_covariance_px2(&seen.detection),
        })
        .collect();
    let views = Views {
        shell: &stage.shells.shells[shell],
        cameras: &stage.rig.cameras,
        observations: &observations,
        time_ns: exposure_ns(&stage.rig.cameras, &observations)?,
        variance: 1.0,
    };
    Some(solver.afresh(&views, &SolverSettings::default()).ok()?.state.world_from_shell)
}

/// Deviations of poses from their mean; and the mean's from the truth.
fn spread(
    truth: &Isometry3<f64>,
    poses: &[Isometry3<f64>],
    deviations: &mut [Vec<f64>; 2],
    bias: Option<&mut [Vec<f64>; 2]>,
) {
    let count = poses.len() as f64;
    if count < 2.0 {
        return;
    }
    let errors = |of: fn(&Isometry3<f64>, &Isometry3<f64>) -> Vector3<f64>| -> Vec<Vector3<f64>> {
        poses.iter().map(|pose| of(truth, pose)).collect()
    };
    let kinds = [
        errors(|truth, pose| pose.translation.vector - truth.translation.vector),
        errors(|truth, pose| (truth.rotation.inverse() * pose.rotation).scaled_axis()),
    ];
    // The mean was taken from the same poses: n − 1 of n deviations are free.
    let scale = (count / (count - 1.0)).sqrt();
    for (k, errors) in kinds.iter().enumerate() {
        let mean = errors.iter().sum::<Vector3<f64>>() / count;
        deviations[k].extend(errors.iter().map(|error| scale * (error - mean).norm()));
    }
    if let Some(bias) = bias {
        for (k, errors) in kinds.iter().enumerate() {
            bias[k].push((errors.iter().sum::<Vector3<f64>>() / count).norm());
        }
    }
}

/// What the cameras would see without noise.
fn noiseless(stage: &Stage, shot: &Shot) -> anyhow::Result<Vec<(usize, Picture)>> {
    let mut scene = stage.studio.scene().clone();
    (scene.sensor.read_noise, scene.sensor.shot_noise) = (0.0, 0.0);
    let studio = stage.studio.with_scene(scene)?;
    let cameras = shot.sightings.iter().map(|(camera, _)| *camera);
    let picture = |camera| studio.develop(&studio.expose(camera, shot.time_s, STILL_DRAWS), 0);
    Ok(cameras.map(|camera| (camera, picture(camera))).collect())
}

fn pose_bound(
    stage: &Stage,
    shell: usize,
    world_from_shell: &Isometry3<f64>,
    shot: &Shot,
    pictures: &[(usize, Picture)],
) -> Option<Matrix6<f64>> {
    let sensor = &stage.studio.scene().sensor;
    let mut information = Matrix6::zeros();
    for ((camera, sightings), (_, picture)) in shot.sightings.iter().zip(pictures) {
        let camera = stage.rig.cameras.get(*camera)?;
        let whole = sightings.iter().filter(|seen| {
            seen.clear && seen.side_px >= LEAST_SIDE_PX && seen.facing_rad < MOST_FACING_DEG.to_radians()
        });
        for seen in whole {
            let Some(tag) = stage.shells.shells[shell].tags.iter().find(|tag| tag.id == seen.id) else {
                continue;
            };
            let corners =
                bound::of_corners(picture, &seen.corners_px, |grey| bound::noise_variance(sensor, grey));
            information += corners
                .and_then(|corners| bound::information(camera, world_from_shell, tag, &corners))
                .unwrap_or_else(Matrix6::zeros);
        }
    }
    information.cholesky().map(|factor| factor.inverse())
}

/// The scene with torso and palms moved by up to 5 cm and 20 degrees about each axis.
fn moved(scene: &Scene, mut random: u64) -> Scene {
    const SHIFT_M: f64 = 0.05;
    const TURN_DEG: f64 = 20.0;
    let mut draw = |most: f64| {
        random = mix(random);
        most * (2.0 * ((random >> 11) as f64 / (1u64 << 53) as f64) - 1.0)
    };
    let mut moved = |home: &Home| Home {
        xyz: home.xyz.map(|x| x + draw(SHIFT_M)),
        rpy_deg: home.rpy_deg.map(|angle| angle + draw(TURN_DEG)),
    };
    let mut scene = scene.clone();
    scene.motion.torso = moved(&scene.motion.torso);
    scene.motion.right_palm = moved(&scene.motion.right_palm);
    scene.motion.left_palm = moved(&scene.motion.left_palm);
    scene
}
