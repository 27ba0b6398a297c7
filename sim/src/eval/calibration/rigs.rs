//! Random rigs from scratch: two to six cameras, radtan and fisheye, some with rolling rows, some with a clock of their
//! own, before a board that is waved by hand. Nothing is given but the size of the images and the model.

use locoman_calib::board::Board;
use locoman_calib::bundle::{FREE, Part, Sighting};
use locoman_calib::extrinsics::{Freedom, Solved, solve};
use locoman_calib::intrinsics::{Model, PartView, Settings, View, calibrate};
use locoman_calib::projection::{Coverage, differences_px};
use locoman_vision::camera::Distortion;
use locoman_vision::pose::Observation;
use locoman_vision::rig::Rig;
use locoman_vision::shells::Shell;
use nalgebra::{DVector, Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::stage::{Draw, Wave, camera, looking, record};
use crate::eval::statistics::{mean, percentile};
use crate::eval::{Figure, Must, Report};

/// Length of a recording, seconds, and images a second.
const FILM: (f64, f64) = (30.0, 15.0);
/// Every so many images are views for the intrinsics.
const STRIDE: usize = 5;

struct Truth {
    rig: Rig,
    models: Vec<Model>,
    offsets_s: Vec<f64>,
}

#[derive(Default)]
struct Tally {
    converged: usize,
    /// 95 % of each imager, pixels.
    imagers_px: Vec<f64>,
    positions_mm: Vec<f64>,
    turns_deg: Vec<f64>,
    clocks_ms: Vec<f64>,
    rows_percent: Vec<f64>,
    /// Squared errors in units of what was stated, for each degree of freedom.
    honesty: Vec<f64>,
}

pub fn run(rigs: usize, seed: u64, report: &mut Report) {
    let board = Board { columns: 7, rows: 5, first_id: 100, tag_mm: 40.0, gap_mm: 12.0 }.to_shell();
    let mut tally = Tally::default();
    for k in 0..rigs {
        let mut draw = Draw::new(seed.wrapping_mul(1000) + k as u64);
        let truth = truth(&mut draw);
        let facing = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[
            Vector3::y(),
            Vector3::z(),
            Vector3::x(),
        ]));
        let base = Isometry3::from_parts(
            Vector3::new(0.05, 0.0, 1.1).into(),
            UnitQuaternion::from_rotation_matrix(&facing),
        );
        let wave = Wave::new(base, 0.28, 0.6, &mut draw);
        let observations = record(&truth.rig, &board, &|t| wave.at(t), &truth.offsets_s, FILM, &mut draw);
        match from_scratch(&truth, &board, &observations) {
            Ok(solved) => tally.add(&truth, &solved, &observations),
            Err(error) => tracing::warn!(rig = k, "{error:#}"),
        }
    }
    tally.report(rigs, report);
}

fn truth(draw: &mut Draw) -> Truth {
    let count = draw.between(2.0, 7.0) as usize;
    let mut models = Vec::new();
    let mut cameras = Vec::new();
    let (mut offsets_s, mut groups) = (Vec::new(), Vec::new());
    for k in 0..count {
        let side = (k as f64 - 0.5 * (count as f64 - 1.0)) * draw.between(0.25, 0.35);
        let eye = Vector3::new(draw.between(0.85, 1.0), side, draw.between(0.95, 1.4));
        let place = looking(eye, Vector3::new(draw.between(-0.05, 0.05), 0.0, 1.1));
        let rows = if draw.between(0.0, 1.0) < 0.5 { draw.between(12e-6, 30e-6) } else { 0.0 };
        let (focal, lens, model) = if draw.between(0.0, 1.0) < 0.35 {
            let lens =
                Distortion::Fisheye([draw.between(-0.03, 0.05), draw.between(-0.01, 0.01), 0.002, 0.0]);
            (draw.between(420.0, 520.0), lens, Model::Fisheye)
        } else {
            let k1 = draw.between(-0.3, 0.05);
            let lens = Distortion::RadTan([
                k1,
                -0.3 * k1,
                draw.between(-1e-3, 1e-3),
                draw.between(-1e-3, 1e-3),
                0.0,
                0.0,
                0.0,
                0.0,
            ]);
            (draw.between(650.0, 950.0), lens, Model::Radtan5)
        };
        let mut own = camera(k, focal, lens, place, rows);
        own.center_px.x += draw.between(-25.0, 25.0);
        own.center_px.y += draw.between(-25.0, 25.0);
        cameras.push(own);
        models.push(model);
        let alone = k > 0 && draw.between(0.0, 1.0) < 0.6;
        groups.push(if alone { k } else { 0 });
        offsets_s.push(if alone { draw.between(-0.2, 0.2) } else { 0.0 });
    }
    let mut rig = Rig::new(cameras);
    rig.sync_groups = groups;
    Truth { rig, models, offsets_s }
}

fn from_scratch(truth: &Truth, board: &Shell, observations: &[Observation]) -> anyhow::Result<Solved> {
    let mut rig = truth.rig.clone();
    let target = Part::tags_of(board);
    for (k, camera) in rig.cameras.iter_mut().enumerate() {
        let views = views(observations, k);
        let settings = Settings {
            id: camera.id.clone(),
            width: camera.width,
            height: camera.height,
            model: truth.models[k],
            most_views: 60,
        };
        let found = calibrate(&views, &target, &settings)?.camera;
        camera.focal_px = found.focal_px;
        camera.center_px = found.center_px;
        camera.distortion = found.distortion;
        camera.line_time_s = 0.0;
        if k > 0 {
            camera.world_from_camera = Isometry3::identity();
        }
    }
    let freedom = Freedom { clocks: true, line_times: true, intrinsics_px: FREE, ..Freedom::PLACES };
    Ok(solve(&rig, board, observations, &freedom, &mut |_, _| {})?)
}

fn views(observations: &[Observation], camera: usize) -> Vec<View> {
    let mut views: Vec<View> = Vec::new();
    let own: Vec<&Observation> = observations.iter().filter(|o| o.camera == camera).collect();
    for image in own.chunk_by(|a, b| a.capture_ns == b.capture_ns).step_by(STRIDE) {
        let parts = image.iter().filter_map(|o| Sighting::of_tag(o, 0, 0)).map(|seen| PartView {
            part: seen.part,
            points_px: seen.points_px,
            whitening: seen.whitening,
        });
        views.push(View { name: String::new(), parts: parts.collect(), blur_px: None });
    }
    views
}

impl Tally {
    fn add(&mut self, truth: &Truth, solved: &Solved, observations: &[Observation]) {
        self.converged += usize::from(solved.outcome.converged);
        let first = |rig: &Rig, k: usize| {
            rig.cameras[0].world_from_camera.inverse() * rig.cameras[k].world_from_camera
        };
        for (k, (found, known)) in solved.rig.cameras.iter().zip(&truth.rig.cameras).enumerate() {
            let points = observations.iter().filter(|o| o.camera == k).flat_map(|o| o.corners_px);
            let coverage = Coverage::new(known.width, known.height, points);
            self.imagers_px.push(percentile(&differences_px(known, found, &coverage), 0.95));
            if known.line_time_s > 0.0 {
                self.rows_percent.push(100.0 * (found.line_time_s / known.line_time_s - 1.0).abs());
            }
            if k == 0 {
                continue;
            }
            let error = first(&truth.rig, k).inverse() * first(&solved.rig, k);
            self.positions_mm.push(1e3 * error.translation.vector.norm());
            self.turns_deg.push(error.rotation.angle().to_degrees());
            if truth.rig.sync_groups[k] != truth.rig.sync_groups[0] {
                self.clocks_ms.push(1e3 * (solved.offsets_s[k] - truth.offsets_s[k]).abs());
            }
            if let Some(squared) = normalized(solved, known.world_from_camera, k) {
                self.honesty.push(squared);
            }
        }
    }

    fn report(&self, rigs: usize, report: &mut Report) {
        let mut figure = |name: &str, value: f64, unit: &'static str, must: Must| {
            report.push(Figure::new(format!("rigs.{name}"), value, unit).must(must));
        };
        figure("converged", self.converged as f64, "", Must::AtLeast(rigs as f64));
        figure("imager_95_median", percentile(&self.imagers_px, 0.5), "px", Must::AtMost(0.1));
        figure("imager_95_worst", percentile(&self.imagers_px, 1.0), "px", Must::AtMost(0.1));
        figure("position_median", percentile(&self.positions_mm, 0.5), "mm", Must::AtMost(0.3));
        figure("position_worst", percentile(&self.positions_mm, 1.0), "mm", Must::AtMost(0.3));
        figure("rotation_median", percentile(&self.turns_deg, 0.5), "deg", Must::AtMost(0.02));
        figure("rotation_worst", percentile(&self.turns_deg, 1.0), "deg", Must::AtMost(0.02));
        figure("clock_worst", percentile(&self.clocks_ms, 1.0), "ms", Must::AtMost(0.5));
        figure("line_time_worst", percentile(&self.rows_percent, 1.0), "%", Must::AtMost(5.0));
        figure("normalised_error_squared", mean(&self.honesty), "", Must::Between(0.8, 1.25));
    }
}

/// The squared error of a camera's place and orientation in units of what was stated, for each degree of freedom.
fn normalized(solved: &Solved, known: Isometry3<f64>, k: usize) -> Option<f64> {
    let (numbers, covariance) = solved.outcome.eye_covariance(k)?;
    let found = solved.rig.cameras[k].world_from_camera;
    let shift = known.translation.vector - found.translation.vector;
    let turn = (found.rotation.inverse() * known.rotation).scaled_axis();
    let own: Vec<usize> = (0..numbers.len()).filter(|i| numbers[*i] < 6).collect();
    let covariance = covariance.select_rows(&own).select_columns(&own);
    let error = DVector::from_iterator(6, shift.iter().chain(turn.iter()).copied());
    Some(error.dot(&covariance.cholesky()?.solve(&error)) / 6.0)
}
