//! TagSLAM's block of 18 tags before two cameras: calibrated on every other image, then, on the rest, the pose that tags with
//! even numbers give against that of odd ones. Nobody knows the truth; what disagrees is wrong at least by half.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::Context;
use flate2::read::GzDecoder;
use locoman_calib::bundle::FREE;
use locoman_calib::extrinsics::{Freedom, Solved, solve};
use locoman_vision::camera::{Camera, Distortion};
use locoman_vision::detect::CornerCovariance;
use locoman_vision::pose::{Observation, Solver, SolverSettings, Views};
use locoman_vision::rig::Rig;
use locoman_vision::shells::{Shell, ShellTag};
use nalgebra::{Isometry3, Point2, Vector2, Vector3};

use crate::eval::statistics::percentile;
use crate::eval::{Figure, Must, Report};

/// Noise of a corner of the library that they used (measured on static tags of another of their sets).
const SIGMA_PX: f64 = 0.14;

pub fn run(folder: &Path, report: &mut Report) -> anyhow::Result<()> {
    if !folder.is_dir() {
        tracing::warn!(folder = %folder.display(), "left out: TagSLAM's block is not there");
        return Ok(());
    }
    let (rig, block) = (rig(), block(folder)?);
    let observations = observations(folder, &block)?;
    let mut times: Vec<u64> = observations.iter().map(|o| o.capture_ns).collect();
    times.sort_unstable();
    times.dedup();
    let half = |parity: usize| -> Vec<Observation> {
        let own = |o: &&Observation| times.binary_search(&o.capture_ns).is_ok_and(|k| k % 2 == parity);
        observations.iter().filter(own).cloned().collect()
    };
    // Narrow lenses hardly tell their own intrinsics from the block's distance: they keep to about 3 % of TagSLAM's.
    let freedom = Freedom { tags_m: FREE, tags_rad: FREE, intrinsics_px: 100.0, ..Freedom::PLACES };
    let solved = solve(&rig, &block, &half(0), &freedom, &mut |_, _| {})?;
    let before = solve(&rig, &block, &half(0), &Freedom::PLACES, &mut |_, _| {})?;
    let (drawn_mm, drawn_deg) = disagreement(&before, &half(1));
    let (mm, deg) = disagreement(&solved, &half(1));
    let figure =
        |name: &str, value: f64, unit: &'static str| Figure::new(format!("block.{name}"), value, unit);
    report.push(figure("as_drawn_position", drawn_mm, "mm").reference(0.76, "TagSLAM's own calibration"));
    report.push(figure("as_drawn_rotation", drawn_deg, "deg").reference(0.40, "TagSLAM's own calibration"));
    report.push(
        figure("position", mm, "mm").must(Must::AtMost(0.24)).reference(0.76, "TagSLAM's own calibration"),
    );
    report.push(
        figure("rotation", deg, "deg").must(Must::AtMost(0.13)).reference(0.40, "TagSLAM's own calibration"),
    );
    report.push(figure("residual", solved.outcome.rms_px, "px"));
    Ok(())
}

/// Their two cameras, as `cameras.yaml` has them.
fn rig() -> Rig {
    let camera = |id: &str, k: [f64; 9]| Camera {
        id: id.into(),
        width: 1280,
        height: 1024,
        focal_px: Vector2::new(k[0], k[1]),
        center_px: Vector2::new(k[2], k[3]),
        distortion: Distortion::RadTan([k[4], k[5], k[6], k[7], k[8], 0.0, 0.0, 0.0]),
        world_from_camera: Isometry3::identity(),
        line_time_s: 0.0,
    };
    Rig::new(vec![
        camera(
            "cam0",
            [3291.825876, 3288.698371, 654.585950, 511.834746, -0.091469, 4.182381, -0.001340, 0.004499, 0.0],
        ),
        camera(
            "cam1",
            [3256.654940, 3254.623717, 648.390382, 539.262646, 0.010477, 2.580366, -0.002064, 0.000712, 0.0],
        ),
    ])
}

/// The tags of the body `cube` of `tagslam.yaml`: numbers in the order id, size, position, rotation vector.
fn block(folder: &Path) -> anyhow::Result<Shell> {
    let path = folder.join("tagslam.yaml");
    let text = std::fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let cube = text.split("- cube:").nth(1).context("tagslam.yaml has no body `cube`")?;
    let mut tags = Vec::new();
    for entry in cube.split("- id:").skip(1) {
        let mut words = entry.split_whitespace();
        let id: u32 = words.next().context("a tag without a number")?.parse()?;
        // Deviations follow, which nobody believes.
        let entry = entry.split("position_noise").next().unwrap_or(entry);
        let numbers: Result<Vec<f64>, _> =
            entry.split_whitespace().skip(1).filter(|word| !word.ends_with(':')).map(str::parse).collect();
        let numbers = numbers.with_context(|| format!("tag {id} of {}", path.display()))?;
        let [size, x, y, z, a, b, c] = numbers[..] else {
            anyhow::bail!("tag {id} of {} has {} numbers, 7 are expected", path.display(), numbers.len());
        };
        let shell_from_tag = Isometry3::new(Vector3::new(x, y, z), Vector3::new(a, b, c));
        tags.push(ShellTag { id, size_m: size, shell_from_tag });
    }
    Ok(Shell { name: "block".into(), tags })
}

fn observations(folder: &Path, block: &Shell) -> anyhow::Result<Vec<Observation>> {
    let path = folder.join("detections.csv.gz");
    let file = std::fs::File::open(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let mut observations = Vec::new();
    for row in csv::Reader::from_reader(GzDecoder::new(file)).records() {
        let row = row?;
        let field = |k: usize| row.get(k).unwrap_or_default();
        // An image without tags has the number -1.
        let id: i64 = field(3).parse()?;
        let Some(tag) = block.tags.iter().position(|tag| i64::from(tag.id) == id) else { continue };
        let number = |k: usize| field(k).parse::<f64>();
        observations.push(Observation {
            camera: usize::from(field(2).contains("detector_1")),
            tag,
            capture_ns: field(1).parse()?,
            corners_px: [
                Point2::new(number(5)?, number(6)?),
                Point2::new(number(7)?, number(8)?),
                Point2::new(number(9)?, number(10)?),
                Point2::new(number(11)?, number(12)?),
            ],
            covariance_px2: CornerCovariance::from_diagonal_element(SIGMA_PX * SIGMA_PX),
        });
    }
    Ok(observations)
}

/// Median difference of the block's poses by even tags and by odd ones, mm and degrees.
fn disagreement(solved: &Solved, observations: &[Observation]) -> (f64, f64) {
    let mut images: BTreeMap<u64, Vec<Observation>> = BTreeMap::new();
    for observation in observations {
        images.entry(observation.capture_ns).or_default().push(observation.clone());
    }
    let settings = SolverSettings { outlier_floor_px: 2.0, ..SolverSettings::default() };
    let pose = |time_ns: u64, seen: &[Observation], parity: u32| {
        let own: Vec<Observation> =
            seen.iter().filter(|o| solved.body.tags[o.tag].id % 2 == parity).cloned().collect();
        let views = Views {
            shell: &solved.body,
            cameras: &solved.rig.cameras,
            observations: &own,
            time_ns,
            variance: 1.0,
        };
        Solver::default().afresh(&views, &settings).ok().map(|solution| solution.state.world_from_shell)
    };
    let (mut mm, mut deg) = (Vec::new(), Vec::new());
    for (time_ns, seen) in &images {
        let (Some(even), Some(odd)) = (pose(*time_ns, seen, 0), pose(*time_ns, seen, 1)) else { continue };
        let error = even.inverse() * odd;
        mm.push(1e3 * error.translation.vector.norm());
        deg.push(error.rotation.angle().to_degrees());
    }
    (percentile(&mm, 0.5), percentile(&deg, 0.5))
}
