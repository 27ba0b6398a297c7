//! The adjustment: Levenberg-Marquardt with a robust loss, and a verdict on each sighting.
//!
//! Minimised is Σ ρ(χ²) + priors, ρ being Huber's loss on the χ² of a whole sighting, in units of what such sightings
//! have on the whole: stated deviations need not be right, only their ratios. Sightings far beyond are set aside, and
//! the rest is adjusted again.

use locoman_vision::camera::Camera;
use nalgebra::{DMatrix, Matrix6, Vector3, Vector6};

use super::columns::Columns;
use super::motion::{Motion, moved};
use super::normal::{Normal, Step};
use super::problem::Problem;
use super::rotation::{left_jacobian_inverse, right_jacobian_inverse};
use super::term::{self, Linear};

/// How the adjustment works.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// A sighting counts in full up to the mean of its χ² and so many of its standard deviations.
    pub kernel: f64,
    /// Beyond so many it is set aside: what chance never does,
    pub outlier: f64,
    /// unless its points are nearer than this, pixels.
    pub outlier_floor_px: f64,
    /// Times that outliers are sought.
    pub rounds: usize,
    /// Steps a round at most.
    pub steps: usize,
    /// Acceleration of the object on a path, standard deviation per axis, m/s²; a weak prior that carries over gaps,
    pub acceleration_m_s2: f64,
    /// and its angular acceleration, rad/s².
    pub angular_rad_s2: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            kernel: 3.0,
            outlier: 20.0,
            outlier_floor_px: 0.1,
            rounds: 3,
            steps: 60,
            acceleration_m_s2: 30.0,
            angular_rad_s2: 300.0,
        }
    }
}

/// What came of it.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// Whether the last round ended because nothing was left to gain.
    pub converged: bool,
    /// Steps of all rounds.
    pub steps: usize,
    /// χ² of what was used, for each degree of freedom: the variance of the points in units of what was stated.
    pub variance: f64,
    /// Root mean square of the points' errors, pixels: the length of each, as OpenCV counts.
    pub rms_px: f64,
    /// Points that were used.
    pub points: usize,
    /// Sightings that were set aside.
    pub outliers: usize,
    /// Covariance of cameras and parts, in the order of their free parameters; [`Outcome::variance`] is in it.
    pub covariance: Option<DMatrix<f64>>,
    columns: Columns,
}

impl Outcome {
    /// Standard deviation of a camera's parameters: position (m), orientation (rad), intrinsics, clock (s), line time (s);
    /// 0 of what was fixed.
    pub fn eye_sigmas(&self, camera: usize) -> Vec<f64> {
        self.columns.eyes.get(camera).map(|columns| self.sigmas(columns)).unwrap_or_default()
    }

    /// Standard deviations of a part: position (m), orientation (rad), scale.
    pub fn part_sigmas(&self, part: usize) -> Vec<f64> {
        self.columns.parts.get(part).map(|columns| self.sigmas(columns)).unwrap_or_default()
    }

    fn sigmas(&self, columns: &[Option<usize>]) -> Vec<f64> {
        let sigma = |column: &Option<usize>| match (column, &self.covariance) {
            (Some(k), Some(covariance)) => covariance[(*k, *k)].sqrt(),
            (Some(_), None) => f64::INFINITY,
            (None, _) => 0.0,
        };
        columns.iter().map(sigma).collect()
    }

    /// Covariance of a camera's free parameters, and their numbers in the order of [`Outcome::eye_sigmas`].
    pub fn eye_covariance(&self, camera: usize) -> Option<(Vec<usize>, DMatrix<f64>)> {
        let columns = self.columns.eyes.get(camera)?;
        self.block(columns)
    }

    /// Covariance of a part's free parameters, and their numbers.
    pub fn part_covariance(&self, part: usize) -> Option<(Vec<usize>, DMatrix<f64>)> {
        let columns = self.columns.parts.get(part)?;
        self.block(columns)
    }

    fn block(&self, columns: &[Option<usize>]) -> Option<(Vec<usize>, DMatrix<f64>)> {
        let covariance = self.covariance.as_ref()?;
        let (numbers, own): (Vec<usize>, Vec<usize>) =
            columns.iter().enumerate().filter_map(|(k, column)| Some((k, (*column)?))).unzip();
        Some((numbers, covariance.select_rows(&own).select_columns(&own)))
    }
}

/// Adjusts a problem in place; `progress` hears of each step: its number and the RMS in pixels.
pub fn adjust(problem: &mut Problem, settings: &Settings, progress: &mut dyn FnMut(usize, f64)) -> Outcome {
    let columns = Columns::new(problem);
    let mut work = Work {
        normal: Normal::new(problem.motion.blocks(), problem.motion.reach(), columns.len()),
        strayed: vec![0.0; columns.len()],
        columns,
        settings: *settings,
        level: 1.0,
    };
    let (mut converged, mut steps) = (false, 0);
    for round in 0..settings.rounds.max(1) {
        work.level = level(problem);
        let before = steps;
        (converged, steps) = work.descend(problem, steps, progress);
        work.level = level(problem);
        let changed = work.judge(problem);
        if round > 0 && !changed && steps - before <= 2 {
            break;
        }
    }
    work.conclude(problem, converged, steps)
}

struct Work {
    normal: Normal,
    columns: Columns,
    /// How far each parameter of the border is from the mean of its prior.
    strayed: Vec<f64>,
    settings: Settings,
    /// χ² of a sighting per degree of freedom, on the whole.
    level: f64,
}

impl Work {
    fn descend(
        &mut self,
        problem: &mut Problem,
        mut steps: usize,
        progress: &mut dyn FnMut(usize, f64),
    ) -> (bool, usize) {
        /// Half a χ² that no reported figure depends on.
        const NOTHING: f64 = 1e-4;
        const MOST_DAMPING: f64 = 1e12;
        let mut damping = 1e-4;
        let mut cost = self.linearize(problem);
        for _ in 0..self.settings.steps {
            let Some(step) = self.normal.solve(damping) else {
                damping = (damping * 10.0).max(1e-9);
                if damping > MOST_DAMPING {
                    return (false, steps);
                }
                continue;
            };
            steps += 1;
            let promise = step.promise;
            let kept =
                (problem.eyes.clone(), problem.parts.clone(), problem.motion.clone(), self.strayed.clone());
            self.apply(problem, &step);
            let there = self.cost(problem);
            if there <= cost {
                progress(steps, rms_px(problem).0);
                damping = (damping * 0.1).max(1e-12);
                let gain = cost - there;
                cost = self.linearize(problem);
                if gain < NOTHING.max(1e-9 * cost) && promise < (10.0 * NOTHING).max(1e-8 * cost) {
                    return (true, steps);
                }
            } else {
                (problem.eyes, problem.parts, problem.motion, self.strayed) = kept;
                if promise < NOTHING.max(1e-12 * cost) {
                    return (true, steps);
                }
                damping = (damping * 8.0).max(1e-9);
                if damping > MOST_DAMPING {
                    return (false, steps);
                }
            }
        }
        (false, steps)
    }

    fn apply(&mut self, problem: &mut Problem, step: &Step) {
        self.columns.apply(problem, step.border.as_slice());
        for (pose, step) in problem.motion.poses_mut().iter_mut().zip(&step.motion) {
            let (shift_m, turn_rad): (Vector3<f64>, Vector3<f64>) =
                (step.fixed_rows::<3>(0).into(), step.fixed_rows::<3>(3).into());
            *pose = moved(pose, &shift_m, &turn_rad);
        }
        for (strayed, step) in self.strayed.iter_mut().zip(step.border.iter()) {
            *strayed += step;
        }
    }

    /// Huber's loss of a χ² and its weight.
    fn robust(&self, chi2: f64, rows: usize) -> (f64, f64) {
        let kernel = self.level * above_mean(rows, self.settings.kernel);
        if chi2 <= kernel {
            (0.5 * chi2, 1.0)
        } else {
            ((kernel * chi2).sqrt() - 0.5 * kernel, (kernel / chi2).sqrt())
        }
    }

    fn linearize(&mut self, problem: &Problem) -> f64 {
        self.normal.clear();
        let mut cost = 0.0;
        for sighting in problem.sightings.iter().filter(|sighting| !sighting.outlier) {
            let rows = 2 * problem.points(sighting).len();
            match Linear::new(problem, &self.columns, sighting) {
                Some(linear) => {
                    let (loss, weight) = self.robust(linear.chi2(), rows);
                    cost += loss;
                    self.normal.add(&linear, weight);
                }
                None => cost += self.robust(UNSEEN_CHI2, rows).0,
            }
        }
        for (column, information) in self.columns.information.iter().enumerate() {
            // Priors are in true units, points in stated ones.
            let (information, moved) = (information * self.level, self.strayed[column]);
            self.normal.add_prior(column, information, moved);
            cost += 0.5 * information * moved * moved;
        }
        cost + self.smoothness(problem, true)
    }

    fn cost(&mut self, problem: &Problem) -> f64 {
        let mut cost = 0.0;
        for sighting in problem.sightings.iter().filter(|sighting| !sighting.outlier) {
            let residuals = term::residuals_px(problem, sighting);
            let chi2 = residuals.map_or(UNSEEN_CHI2, |residuals| term::chi2(sighting, &residuals));
            cost += self.robust(chi2, 2 * problem.points(sighting).len()).0;
        }
        for (information, moved) in self.columns.information.iter().zip(&self.strayed) {
            cost += 0.5 * self.level * information * moved * moved;
        }
        cost + self.smoothness(problem, false)
    }

    /// Half the cost of accelerations on a path: second differences of its controls.
    fn smoothness(&mut self, problem: &Problem, add: bool) -> f64 {
        let Motion::Path(path) = &problem.motion else { return 0.0 };
        let step2 = path.step_s * path.step_s;
        let unit = self.level.sqrt() / step2;
        let (shift, turn) = (unit / self.settings.acceleration_m_s2, unit / self.settings.angular_rad_s2);
        let mut cost = 0.0;
        for (first, triple) in path.controls.windows(3).enumerate() {
            let p = |k: usize| triple[k].translation.vector;
            let d = |k: usize| (triple[k].rotation.inverse() * triple[k + 1].rotation).scaled_axis();
            let (bend, twist) = ((p(0) - p(1) * 2.0 + p(2)) * shift, (d(1) - d(0)) * turn);
            let residual = Vector6::new(bend.x, bend.y, bend.z, twist.x, twist.y, twist.z);
            cost += 0.5 * residual.norm_squared();
            if !add {
                continue;
            }
            let mut jacobians = [Matrix6::zeros(); 3];
            for (k, factor) in [1.0, -2.0, 1.0].into_iter().enumerate() {
                jacobians[k].fixed_view_mut::<3, 3>(0, 0).fill_diagonal(factor * shift);
            }
            let (d0, d1) = (d(0), d(1));
            let turns = [
                left_jacobian_inverse(&d0) * turn,
                -(right_jacobian_inverse(&d0) + left_jacobian_inverse(&d1)) * turn,
                right_jacobian_inverse(&d1) * turn,
            ];
            for (jacobian, turn) in jacobians.iter_mut().zip(&turns) {
                jacobian.fixed_view_mut::<3, 3>(3, 3).copy_from(turn);
            }
            self.normal.add_motion(first, &jacobians, &residual);
        }
        cost
    }

    /// Sets aside what does not fit, takes back what does; whether anything changed.
    fn judge(&self, problem: &mut Problem) -> bool {
        let verdicts: Vec<bool> = problem
            .sightings
            .iter()
            .map(|sighting| {
                let Some(residuals) = term::residuals_px(problem, sighting) else { return true };
                let points = problem.points(sighting).len();
                let limit = self.level * above_mean(2 * points, self.settings.outlier);
                let far2 = residuals.iter().map(|r| r * r).sum::<f64>() / points as f64;
                term::chi2(sighting, &residuals) > limit && far2 > self.settings.outlier_floor_px.powi(2)
            })
            .collect();
        let mut changed = false;
        for (sighting, verdict) in problem.sightings.iter_mut().zip(verdicts) {
            changed |= sighting.outlier != verdict;
            sighting.outlier = verdict;
        }
        changed
    }

    fn conclude(mut self, problem: &Problem, converged: bool, steps: usize) -> Outcome {
        self.linearize(problem);
        let (rms_px, points) = rms_px(problem);
        let used = || problem.sightings.iter().filter(|sighting| !sighting.outlier);
        // Of the robust loss's weights, not of the raw squares: a few heavy tails shall not widen everything.
        let mut sum = 0.0;
        for sighting in used() {
            let rows = 2 * problem.points(sighting).len();
            if let Some(residuals) = term::residuals_px(problem, sighting) {
                sum += 2.0 * self.robust(term::chi2(sighting, &residuals), rows).0;
            }
        }
        let parameters = self.columns.len() + 6 * problem.motion.blocks();
        let freedom = (2.0 * points as f64 - parameters as f64).max(1.0);
        let variance = sum / freedom;
        let covariance = self.normal.border_covariance().map(|covariance| covariance * variance);
        let outliers = problem.sightings.len() - used().count();
        Outcome { converged, steps, variance, rms_px, points, outliers, covariance, columns: self.columns }
    }
}

/// χ² of a part that the state does not show to the camera.
const UNSEEN_CHI2: f64 = 1e8;

/// The χ² of some degrees of freedom that lies so many standard deviations above the mean.
fn above_mean(rows: usize, sigmas: f64) -> f64 {
    rows as f64 + sigmas * (2.0 * rows as f64).sqrt()
}

/// The χ² per degree of freedom of what is used, as its median tells: 1 if stated deviations are right.
fn level(problem: &Problem) -> f64 {
    let used = problem.sightings.iter().filter(|sighting| !sighting.outlier);
    let ratio = |sighting| {
        let rows = 2.0 * problem.points(sighting).len() as f64;
        // Wilson and Hilferty's median of χ².
        let median = rows * (1.0 - 2.0 / (9.0 * rows)).powi(3);
        term::residuals_px(problem, sighting).map_or(UNSEEN_CHI2, |r| term::chi2(sighting, &r)) / median
    };
    let mut ratios: Vec<f64> = used.map(ratio).collect();
    let middle = ratios.len() / 2;
    if ratios.is_empty() {
        return 1.0;
    }
    ratios.select_nth_unstable_by(middle, f64::total_cmp).1.max(1e-12)
}

/// Root mean square of the lengths of used points' errors, and their number.
fn rms_px(problem: &Problem) -> (f64, usize) {
    let (mut sum, mut points) = (0.0, 0);
    for sighting in problem.sightings.iter().filter(|sighting| !sighting.outlier) {
        if let Some(residuals) = term::residuals_px(problem, sighting) {
            sum += residuals.iter().map(|r| r * r).sum::<f64>();
            points += problem.points(sighting).len();
        }
    }
    ((sum / points.max(1) as f64).sqrt(), points)
}

/// The errors of a sighting's points, pixels; `None` if it is not in view.
pub fn errors_px(problem: &Problem, sighting: &super::Sighting) -> Option<Vec<nalgebra::Vector2<f64>>> {
    let residuals = term::residuals_px(problem, sighting)?;
    let points = problem.points(sighting).len();
    Some(residuals.chunks(2).take(points).map(|pair| nalgebra::Vector2::new(pair[0], pair[1])).collect())
}

/// The cameras as they stand.
pub fn cameras(problem: &Problem) -> Vec<Camera> {
    problem.eyes.iter().map(|eye| eye.camera.clone()).collect()
}
