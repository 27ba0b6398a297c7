//! From views of a target to the intrinsics of the camera that took them.
//!
//! Every model starts alike: focal lengths are tried, the target's poses follow from each (PnP), the best is adjusted,
//! first without, then with the lens's coefficients. So partial views, fisheyes and outliers need no path of their own.

use locoman_vision::camera::Camera;
use nalgebra::{Isometry3, Vector2};

use super::IntrinsicsError;
use super::model::Model;
use super::view::{View, choose};
use crate::bundle::{self, Eye, EyeLoose, Motion, Outcome, Part, Problem, Sighting};
use crate::pnp::planar_pose;
use crate::projection::{Coverage, intrinsics_of, uncertainty_px};

/// How to calibrate.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The camera's name in the rig file.
    pub id: String,
    /// Its image, pixels.
    pub width: u32,
    /// Its image, pixels.
    pub height: u32,
    /// The lens model.
    pub model: Model,
    /// Views that are used at most.
    pub most_views: usize,
}

/// A calibrated camera and how good it is.
#[derive(Debug, Clone)]
pub struct Calibration {
    /// The camera, at the world's origin.
    pub camera: Camera,
    /// The adjustment.
    pub outcome: Outcome,
    /// Of each view: index into what was given, RMS in pixels, `camera_from_target`, points that were set aside.
    pub views: Vec<ViewResult>,
    /// What the used points cover.
    pub coverage: Coverage,
    /// Of each cell of the coverage: standard deviation of a projection, pixels.
    pub uncertainty_px: Vec<f64>,
    /// The model that was fitted.
    pub model: Model,
}

/// A view in a calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewResult {
    /// Index into the views that were given.
    pub view: usize,
    /// Root mean square of the lengths of its points' errors.
    pub rms_px: f64,
    /// The target before the camera.
    pub camera_from_target: Isometry3<f64>,
    /// Parts that were set aside.
    pub outliers: usize,
}

/// Fewest points of a view that says something: a homography has eight numbers.
const LEAST_POINTS: usize = 8;
/// Fewest views.
pub(super) const LEAST_VIEWS: usize = 5;

/// Calibrates a camera from views of a flat target.
pub fn calibrate(
    views: &[View],
    target: &[Part],
    settings: &Settings,
) -> Result<Calibration, IntrinsicsError> {
    let usable: Vec<usize> =
        (0..views.len()).filter(|k| views[*k].points(target).count() >= LEAST_POINTS).collect();
    if usable.len() < LEAST_VIEWS {
        return Err(IntrinsicsError::TooFewViews {
            usable: usable.len(),
            given: views.len(),
            needed: LEAST_VIEWS,
        });
    }
    let sharp = sharp(views, &usable)?;
    let candidates: Vec<View> = sharp.iter().map(|k| views[*k].clone()).collect();
    let chosen: Vec<usize> =
        choose(&candidates, target, settings.width, settings.height, settings.most_views)
            .iter()
            .map(|k| sharp[*k])
            .collect();
    let (mut problem, chosen) = start(views, &chosen, target, settings)?;
    let outcome = finish(&mut problem, settings.model);
    let calibration = conclude(&problem, outcome, chosen, settings)?;
    super::verdict::refuse_wrong_board(&problem, &calibration)?;
    Ok(calibration)
}

/// Views whose edges are not much wider than most.
fn sharp(views: &[View], usable: &[usize]) -> Result<Vec<usize>, IntrinsicsError> {
    /// Edges wider than this say little of where they are, pixels.
    const BLURRED_PX: f64 = 6.0;
    let sharp: Vec<usize> =
        usable.iter().copied().filter(|k| views[*k].blur_px.is_none_or(|blur| blur <= BLURRED_PX)).collect();
    if sharp.len() < LEAST_VIEWS {
        let mut blurs: Vec<f64> = usable.iter().filter_map(|k| views[*k].blur_px).collect();
        blurs.sort_by(f64::total_cmp);
        let median_px = blurs.get(blurs.len() / 2).copied().unwrap_or(0.0);
        return Err(IntrinsicsError::Blurred {
            sharp: sharp.len(),
            given: usable.len(),
            median_px,
            most_px: BLURRED_PX,
        });
    }
    Ok(sharp)
}

/// The best of several focal lengths, adjusted without distortion.
fn start(
    views: &[View],
    chosen: &[usize],
    target: &[Part],
    settings: &Settings,
) -> Result<(Problem, Vec<usize>), IntrinsicsError> {
    /// Focal lengths in units of the image's longer side: from fisheyes to telephoto lenses.
    const FOCALS: [f64; 8] = [0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8];
    /// Views that are enough to tell them apart.
    const FEW: usize = 16;
    let few: Vec<usize> = chosen.iter().copied().step_by(chosen.len().div_ceil(FEW)).collect();
    let longer = f64::from(settings.width.max(settings.height));
    let mut best: Option<(f64, Camera)> = None;
    for focal in FOCALS {
        let camera = Camera {
            id: settings.id.clone(),
            width: settings.width,
            height: settings.height,
            focal_px: Vector2::repeat(focal * longer),
            center_px: Vector2::new(f64::from(settings.width) - 1.0, f64::from(settings.height) - 1.0) / 2.0,
            distortion: settings.model.straight(),
            world_from_camera: Isometry3::identity(),
            line_time_s: 0.0,
        };
        let (mut problem, kept) = posed(views, &few, target, &camera);
        if kept.len() < LEAST_VIEWS.max(few.len() / 2) {
            continue;
        }
        problem.eyes[0].loose.intrinsics[0] = bundle::FREE;
        problem.eyes[0].loose.intrinsics[1] = bundle::FREE;
        // One look at where this leads: nothing is set aside yet.
        let quick =
            bundle::Settings { rounds: 1, steps: 12, outlier: f64::INFINITY, ..bundle::Settings::default() };
        let outcome = bundle::adjust(&mut problem, &quick, &mut |_, _| {});
        let sane = problem.eyes[0].camera.focal_px.iter().all(|f| (0.1..20.0).contains(&(f / longer)));
        let merit = outcome.rms_px * (few.len() as f64 / kept.len() as f64);
        if sane && merit.is_finite() && best.as_ref().is_none_or(|(known, _)| merit < *known) {
            best = Some((merit, problem.eyes[0].camera.clone()));
        }
    }
    let (_, camera) = best.ok_or(IntrinsicsError::NoStart { views: chosen.len() })?;
    Ok(posed(views, chosen, target, &camera))
}

/// A problem in which each view has the pose that PnP gives; views without are left out.
fn posed(views: &[View], chosen: &[usize], target: &[Part], camera: &Camera) -> (Problem, Vec<usize>) {
    let (mut poses, mut sightings, mut kept) = (Vec::new(), Vec::new(), Vec::new());
    for &k in chosen {
        let points: Vec<_> = views[k].points(target).collect();
        let Some((pose, _)) = planar_pose(camera, &points) else { continue };
        sightings.extend(views[k].parts.iter().map(|seen| Sighting {
            camera: 0,
            part: seen.part,
            instant: poses.len(),
            capture_s: 0.0,
            points_px: seen.points_px,
            whitening: seen.whitening,
            outlier: false,
        }));
        poses.push(pose);
        kept.push(k);
    }
    let eye = Eye { camera: camera.clone(), offset_s: 0.0, loose: EyeLoose::FIXED };
    (Problem { eyes: vec![eye], parts: target.to_vec(), motion: Motion::Instants(poses), sightings }, kept)
}

/// Frees the lens step by step, so that no coefficient takes over what the focal length should explain.
fn finish(problem: &mut Problem, model: Model) -> Outcome {
    let stages = [4.min(4 + model.coefficients()), 6, 8, 4 + model.coefficients()];
    let all = model.loose();
    let mut outcome = None;
    for (k, count) in stages.into_iter().enumerate() {
        let last = k + 1 == stages.len();
        for (index, loose) in problem.eyes[0].loose.intrinsics.iter_mut().enumerate() {
            *loose = if index < count { all[index] } else { bundle::FIXED };
        }
        let rough =
            bundle::Settings { rounds: 1, steps: 20, outlier: f64::INFINITY, ..bundle::Settings::default() };
        let settings = if last { bundle::Settings::default() } else { rough };
        outcome = Some(bundle::adjust(problem, &settings, &mut |_, _| {}));
    }
    outcome.unwrap_or_else(|| bundle::adjust(problem, &bundle::Settings::default(), &mut |_, _| {}))
}

fn conclude(
    problem: &Problem,
    outcome: Outcome,
    chosen: Vec<usize>,
    settings: &Settings,
) -> Result<Calibration, IntrinsicsError> {
    let Motion::Instants(poses) = &problem.motion else {
        return Err(IntrinsicsError::NoStart { views: chosen.len() });
    };
    let camera = problem.eyes[0].camera.clone();
    let views = poses.iter().zip(chosen).enumerate().map(|(instant, (pose, view))| {
        let (mut sum, mut points, mut outliers) = (0.0, 0, 0);
        for sighting in problem.sightings.iter().filter(|sighting| sighting.instant == instant) {
            if sighting.outlier {
                outliers += 1;
                continue;
            }
            for error in bundle::errors_px(problem, sighting).unwrap_or_default() {
                sum += error.norm_squared();
                points += 1;
            }
        }
        let rms_px = (sum / f64::from(points)).sqrt();
        ViewResult { view, rms_px, camera_from_target: *pose, outliers }
    });
    let views = views.collect();
    let used = problem.sightings.iter().filter(|sighting| !sighting.outlier);
    let pixels = used.flat_map(|sighting| {
        let count = target_points(problem, sighting);
        sighting.points_px[..count].to_vec()
    });
    let coverage = Coverage::new(settings.width, settings.height, pixels);
    let uncertainty = outcome.eye_covariance(0).map(intrinsics_of);
    let uncertainty_px = match &uncertainty {
        Some((numbers, covariance)) => uncertainty_px(&camera, &coverage, numbers, covariance),
        None => return Err(IntrinsicsError::Undetermined { views: problem.motion.blocks() }),
    };
    Ok(Calibration { camera, outcome, views, coverage, uncertainty_px, model: settings.model })
}

fn target_points(problem: &Problem, sighting: &Sighting) -> usize {
    problem.parts.get(sighting.part).map_or(0, |part| part.points.len())
}
