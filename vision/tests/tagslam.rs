//! Our joint solve against TagSLAM's on its own recording of a block with 18 tags before two cameras.
//!
//! The data (berndpfrommer/tagslam_test, test 15, Apache-2.0) stay outside the repository, in
//! `shared/real/tagslam_block` of a folder above it; without them the test says so and passes.
//!
//! - Cameras: Kalibr's pinhole and radtan, OpenCV's order k1 k2 p1 p2 k3. TagSLAM gives the detector's corners to
//!   OpenCV as they are, so whatever its detector calls a pixel's centre is inside its calibration: no half
//!   pixel is taken off here.
//! - Corners: counter-clockwise as seen, from the printed tag's bottom left, in a tag frame with x right, y up,
//!   z towards the viewer: our own order (the residuals of the other seven are hundreds of pixels).
//! - Poses: `tf` holds `parent_from_child` as TagSLAM had optimised it after its last two frames: block, cameras
//!   and tags. `map`, `grasp_lab` and the second camera are one frame.
//! - Noise: one pixel a corner, as `tagslam.yaml` has it; no robust kernel in either within this noise.

#![expect(clippy::unwrap_used, reason = "in a test a panic is the report")]

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use locoman_vision::camera::{Camera, Distortion};
use locoman_vision::detect::CornerCovariance;
use locoman_vision::pose::{Observation, Prior, Refusal, Solution, Solver, SolverSettings, Views};
use locoman_vision::shells::{Shell, ShellTag};
use nalgebra::{Isometry3, Point2, Quaternion, Translation3, UnitQuaternion, Vector2, Vector3};

/// What the issue asks for.
const AGREES_M: f64 = 1e-5;
const AGREES_RAD: f64 = 1.745e-5;

/// Frames, of 233 with tags, that must be solved. One shows a single tag of 45 pixels to one camera amid a fast turn.
const LEAST_SOLVED: usize = 232;
/// A pose whose residuals are larger by this factor than they need be is no minimum.
const SETTLED: f64 = 1.001;

/// `None` where the data are not at hand.
fn folder() -> Option<PathBuf> {
    let here = Path::new(env!("CARGO_MANIFEST_DIR")).canonicalize().ok()?;
    here.ancestors().map(|above| above.join("shared/real/tagslam_block")).find(|folder| folder.is_dir())
}

/// Rows of a packed CSV file, without its head.
fn rows(path: &Path) -> Vec<Vec<String>> {
    let mut text = String::new();
    let file = std::fs::File::open(path).unwrap();
    flate2::read::GzDecoder::new(file).read_to_string(&mut text).unwrap();
    text.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

fn numbers(fields: &[String]) -> Vec<f64> {
    fields.iter().map(|field| field.parse().unwrap()).collect()
}

/// Poses at one instant: parent_from_child by the child's name.
type Poses = BTreeMap<String, Isometry3<f64>>;

/// All instants of `tf.csv.gz`.
fn transforms(folder: &Path) -> BTreeMap<u64, Poses> {
    let mut instants: BTreeMap<u64, Poses> = BTreeMap::new();
    for row in rows(&folder.join("tf.csv.gz")) {
        let n = numbers(&row[3..]);
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(n[6], n[3], n[4], n[5]));
        let pose = Isometry3::from_parts(Translation3::new(n[0], n[1], n[2]), rotation);
        instants.entry(row[0].parse().unwrap()).or_default().insert(row[2].clone(), pose);
    }
    instants
}

/// The list after a key of one camera in Kalibr's file.
fn list(text: &str, camera: &str, key: &str) -> Vec<f64> {
    let of_camera = text.split_once(&format!("{camera}:")).unwrap().1;
    let line = of_camera.split_once(&format!("{key}:")).unwrap().1.lines().next().unwrap();
    line.trim().trim_matches(['[', ']']).split(',').map(|number| number.trim().parse().unwrap()).collect()
}

fn cameras(folder: &Path, poses: &Poses) -> Vec<Camera> {
    let text = std::fs::read_to_string(folder.join("cameras.yaml")).unwrap();
    let camera = |id: &str| {
        let k = list(&text, id, "intrinsics");
        let d = list(&text, id, "distortion_coeffs");
        Camera {
            id: id.to_owned(),
            width: 1280,
            height: 1024,
            focal_px: Vector2::new(k[0], k[1]),
            center_px: Vector2::new(k[2], k[3]),
            distortion: Distortion::RadTan([d[0], d[1], d[2], d[3], d[4], 0.0, 0.0, 0.0]),
            world_from_camera: poses[id],
            line_time_s: 0.0,
        }
    };
    vec![camera("cam0"), camera("cam1")]
}

/// The block: poses of its tags from `tf`, sizes from `tagslam.yaml`.
fn block(folder: &Path, poses: &Poses) -> Shell {
    let text = std::fs::read_to_string(folder.join("tagslam.yaml")).unwrap();
    let tag = |part: &str| {
        let id: u32 = part.lines().next().unwrap().trim().parse().unwrap();
        let size = part.split_once("size:").unwrap().1.lines().next().unwrap();
        let shell_from_tag = poses[&format!("tag_{id}")];
        ShellTag { id, size_m: size.trim().parse().unwrap(), shell_from_tag }
    };
    Shell { name: "block".to_owned(), tags: text.split("- id:").skip(1).map(tag).collect() }
}

/// Observations of each frame.
fn frames(folder: &Path, block: &Shell) -> BTreeMap<u64, Vec<Observation>> {
    let mut frames: BTreeMap<u64, Vec<Observation>> = BTreeMap::new();
    for row in rows(&folder.join("detections.csv.gz")) {
        let capture_ns = row[1].parse().unwrap();
        // A camera that saw nothing has one row with the id −1.
        let Ok(id) = row[3].parse::<u32>() else { continue };
        let c = numbers(&row[5..]);
        frames.entry(capture_ns).or_default().push(Observation {
            camera: usize::from(row[2].contains("detector_1")),
            tag: block.tags.iter().position(|tag| tag.id == id).unwrap(),
            capture_ns,
            corners_px: [0, 2, 4, 6].map(|k| Point2::new(c[k], c[k + 1])),
            covariance_px2: CornerCovariance::identity(),
        });
    }
    frames
}

/// Tags that TagSLAM used: it moved them from where `tagslam.yaml` has them. The others, among them one that it
/// saw too obliquely in one of the two frames, still stand there to the last digit.
fn optimised(folder: &Path, poses: &Poses) -> Vec<u32> {
    /// Both files have eight digits and more.
    const SAME_M: f64 = 2e-8;
    let text = std::fs::read_to_string(folder.join("tagslam.yaml")).unwrap();
    let moved = |part: &str| {
        let id: u32 = part.lines().next().unwrap().trim().parse().unwrap();
        let position = part.split_once("position:").unwrap().1;
        let axis = |name: &str| -> f64 {
            let number = position.split_once(name).unwrap().1.lines().next().unwrap();
            number.trim().parse().unwrap()
        };
        let given = Vector3::new(axis("x:"), axis("y:"), axis("z:"));
        let stands = poses[&format!("tag_{id}")].translation.vector;
        ((given - stands).norm() > SAME_M).then_some(id)
    };
    text.split("- id:").skip(1).filter_map(moved).collect()
}

/// Without a prediction, and where that is ambiguous (one tag in one view), near the pose of the frame before.
fn solve(
    shell: &Shell,
    cameras: &[Camera],
    observations: &[Observation],
    before: Option<&Solution>,
) -> Result<Solution, Refusal> {
    /// Between two frames, 0.2 s apart, the block is moved by hand.
    const MOVED_M: f64 = 0.1;
    const TURNED_RAD: f64 = 0.4;
    // As TagSLAM: squares alone. Tags that it never optimised stand several pixels from where they are seen; only
    // those 12 px off are left out.
    let settings = SolverSettings {
        corner_floor_px: 0.0,
        kernel_chi2: 1e4,
        outlier_chi2: 600.0,
        ..SolverSettings::default()
    };
    let time_ns = observations[0].capture_ns;
    let views = Views { shell, cameras, observations, time_ns, variance: 1.0 };
    let mut solver = Solver::default();
    match (solver.afresh(&views, &settings), before) {
        (Err(Refusal::Ambiguous), Some(before)) => {
            let mut prior = Prior::free(before.state.world_from_shell, &settings);
            for k in 0..3 {
                prior.information[(k, k)] = MOVED_M.powi(-2);
                prior.information[(3 + k, 3 + k)] = TURNED_RAD.powi(-2);
            }
            solver.near(&views, &prior, &settings)
        }
        (outcome, _) => outcome,
    }
}

/// Root mean square of the corners' residual lengths at a pose.
fn rms_px(shell: &Shell, cameras: &[Camera], observations: &[Observation], pose: &Isometry3<f64>) -> f64 {
    let mut sum = 0.0;
    for seen in observations {
        let camera = &cameras[seen.camera];
        for (corner, measured) in shell.tags[seen.tag].corners().iter().zip(&seen.corners_px) {
            let in_camera = camera.world_from_camera.inverse() * (pose * corner);
            sum += (camera.project(&in_camera).unwrap() - measured).norm_squared();
        }
    }
    (sum / (4.0 * observations.len() as f64)).sqrt()
}

#[test]
fn our_solve_agrees_with_tagslams_and_every_frame_solves_that_can() {
    let Some(folder) = folder() else {
        println!("skipped: shared/real/tagslam_block is not above this repository");
        return;
    };
    let instants = transforms(&folder);
    let mut apart = Vec::new();
    for (time_ns, poses) in &instants {
        let (shell, cameras) = (block(&folder, poses), cameras(&folder, poses));
        let used = optimised(&folder, poses);
        let mut observations = frames(&folder, &shell)[time_ns].clone();
        observations.retain(|seen| used.contains(&shell.tags[seen.tag].id));
        let solution = solve(&shell, &cameras, &observations, None).expect("solvable");
        let error = poses["cube"].inverse() * solution.state.world_from_shell;
        let theirs_px = rms_px(&shell, &cameras, &observations, &poses["cube"]);
        println!(
            "{time_ns}: {} tags, {} cameras, rms {:.3} px ({theirs_px:.3} px at TagSLAM's pose): {:.5} mm, \
             {:.5} deg from TagSLAM",
            solution.tags,
            solution.cameras,
            solution.rms_px,
            1e3 * error.translation.vector.norm(),
            error.rotation.angle().to_degrees()
        );
        // Where TagSLAM's own pose explains its corners worse, with its own calibration, than another pose does,
        // its graph had not settled: there is nothing to agree with. The block rests during both instants.
        if theirs_px > SETTLED * solution.rms_px {
            continue;
        }
        apart.push((error.translation.vector.norm(), error.rotation.angle()));
    }
    assert!(!apart.is_empty());
    for (position_m, rotation_rad) in apart {
        assert!(position_m < AGREES_M && rotation_rad < AGREES_RAD, "{position_m} m, {rotation_rad} rad");
    }

    let (_, poses) = instants.last_key_value().unwrap();
    let (shell, cameras) = (block(&folder, poses), cameras(&folder, poses));
    let frames = frames(&folder, &shell);
    let mut solved: Vec<Solution> = Vec::new();
    for (time_ns, observations) in &frames {
        match solve(&shell, &cameras, observations, solved.last()) {
            Ok(solution) => solved.push(solution),
            Err(refusal) => {
                println!("{time_ns}, {} tag: {refusal:?}", observations.len());
                // Only what cannot be solved is not: one tag, two poses, and a hand that was too fast for time to
                // tell them apart.
                assert_eq!((refusal, observations.len()), (Refusal::Ambiguous, 1));
            }
        }
    }
    let mut rms_px: Vec<f64> = solved.iter().map(|solution| solution.rms_px).collect();
    rms_px.sort_by(f64::total_cmp);
    println!(
        "{} of {} frames solved, median rms {:.3} px",
        solved.len(),
        frames.len(),
        rms_px[rms_px.len() / 2]
    );
    assert!(solved.len() >= LEAST_SOLVED, "{}", solved.len());
}
