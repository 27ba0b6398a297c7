//! The pose and the motion of one shell from all corners of its tags in all views, jointly.
//!
//! Cameras need not be exposed together, nor their rows: each corner is compared with the shell at the corner's
//! own time ([`term`](self) has the equations, [`State`] the motion). Minimised is
//!
//! ```text
//! Σ ρ(|L⁻¹ r|²) + eᵀ Λ e        r: eight residuals of a tag, L Lᵀ: covariance of its corners
//!                               e: from the predicted state, Λ: its information
//! ```
//!
//! over the eighteen numbers of pose, twist and accelerations, by iteratively reweighted Levenberg-Marquardt (Triggs et al.,
//! "Bundle adjustment: a modern synthesis", 1999). The lens stands in the projection, so measurements stay as
//! they were and keep their noise. Tags that do not fit (half covered, swapped, wrong id) are left out as a
//! whole and named ([`Fate`]), and the rest is solved again. The covariance is the inverse of the information,
//! the data's share widened where residuals are larger than chance makes them.
//!
//! [`Solver::near`] starts from a prediction. [`Solver::afresh`] has none: a start comes from OpenCV's planar
//! PnP (IPPE) of single tags: each gives two poses, and the one that explains all views best wins. Where the
//! views do not tell two poses apart, neither is given ([`Refusal::Ambiguous`]).

mod initial;
mod problem;
mod state;
mod term;

use nalgebra::{ArrayStorage, Isometry3, Point2};

use crate::camera::Camera;
use crate::cholesky::Cholesky;
use crate::detect::CornerCovariance;
use crate::shells::Shell;
use problem::{Minimum, Workspace};
pub use state::{Matrix18, Prior, State, Vector18};

/// The corners of one tag in one view.
#[derive(Debug, Clone, PartialEq)]
pub struct Observation {
    /// Index into the cameras.
    pub camera: usize,
    /// Index into the shell's tags.
    pub tag: usize,
    /// When the camera's frame was exposed: see [`Camera::row_delay_s`].
    pub capture_ns: u64,
    /// Corners in the order of [`crate::shells::ShellTag::corners`], pixel centres at integers.
    pub corners_px: [Point2<f64>; 4],
    /// Their covariance, without the floor of [`SolverSettings::corner_floor_px`].
    pub covariance_px2: CornerCovariance,
}

/// What is to be solved: all observations of one shell, about one instant.
#[derive(Debug, Clone, Copy)]
pub struct Views<'a> {
    /// The shell.
    pub shell: &'a Shell,
    /// All cameras of the rig.
    pub cameras: &'a [Camera],
    /// What they saw of the shell.
    pub observations: &'a [Observation],
    /// The instant whose state is asked for; best [`exposure_ns`].
    pub time_ns: u64,
    /// Variance of the corners in units of what their covariances say; 1 if they are right.
    pub variance: f64,
}

/// What became of an observation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fate {
    /// The pose rests on it.
    Used,
    /// Its corners do not fit the pose that the others give.
    Outlier,
    /// The pose would show its back to the camera.
    FacingAway,
    /// It fits two poses equally well.
    Ambiguous,
    /// It names no camera or tag, or has numbers that cannot be.
    Unusable,
    /// No pose was found, or the pose was not believed.
    Unsolved,
}

impl std::fmt::Display for Fate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Used => "used",
            Self::Outlier => "does not fit",
            Self::FacingAway => "faces away",
            Self::Ambiguous => "ambiguous",
            Self::Unusable => "unusable",
            Self::Unsolved => "no pose",
        })
    }
}

/// Why there is no solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// Nothing usable was seen.
    NothingSeen,
    /// Most of what was seen contradicts every pose that was tried.
    NothingAgrees,
    /// Two poses explain it equally well.
    Ambiguous,
}

/// A solved state.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// Pose, twist and accelerations at the instant that was asked for.
    pub state: State,
    /// Covariance of the state's tangent, the prior taken into account.
    pub covariance: Matrix18,
    /// What the data alone say, as information about [`Solution::state`]'s tangent,
    pub information: Matrix18,
    /// and the gradient of half their cost there: the data pull towards `state − information⁻¹ gradient`.
    pub gradient: Vector18,
    /// χ² of the tags that were used, for each degree of freedom: about 1 if the corners' covariances are true.
    pub excess: f64,
    /// Degrees of freedom behind [`Solution::excess`].
    pub freedom: f64,
    /// Root mean square of the corners' residual lengths in pixels, outliers left out.
    pub rms_px: f64,
    /// Different tags that were used.
    pub tags: usize,
    /// Different cameras that were used.
    pub cameras: usize,
}

/// Limits of the solver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolverSettings {
    /// What calibration, print and lens leave in each corner at least: standard deviation per axis, pixels. What they leave
    /// beyond it the residuals show ([`Views::variance`]); a larger floor made poses seem worse than they were.
    pub corner_floor_px: f64,
    /// χ² of a tag (eight residuals) up to which it counts in full. 20 is exceeded by chance once in a hundred.
    pub kernel_chi2: f64,
    /// A tag whose χ² is larger is left out (60: by chance never),
    pub outlier_chi2: f64,
    /// but not if its corners' RMS is smaller than this, pixels: calibration may leave as much.
    pub outlier_floor_px: f64,
    /// Steps of Levenberg-Marquardt at most.
    pub max_steps: usize,
    /// Two poses whose costs differ by less are not told apart. 25: five standard deviations.
    pub ambiguity_cost: f64,
    /// Speed of a shell of which nothing is known, standard deviation per axis, m/s,
    pub free_speed_m_s: f64,
    /// its angular velocity, rad/s,
    pub free_rate_rad_s: f64,
    /// its acceleration, m/s²,
    pub free_acceleration_m_s2: f64,
    /// and its angular acceleration, rad/s².
    pub free_angular_rad_s2: f64,
}

impl Default for SolverSettings {
    fn default() -> Self {
        Self {
            corner_floor_px: 0.01,
            kernel_chi2: 20.0,
            outlier_chi2: 60.0,
            outlier_floor_px: 0.6,
            max_steps: 25,
            ambiguity_cost: 25.0,
            free_speed_m_s: 1.0,
            free_rate_rad_s: 5.0,
            free_acceleration_m_s2: 3.0,
            free_angular_rad_s2: 30.0,
        }
    }
}

/// The mean time at which the corners were exposed, rounded to a nanosecond; `None` of nothing.
pub fn exposure_ns(cameras: &[Camera], observations: &[Observation]) -> Option<u64> {
    let first_ns = observations.first()?.capture_ns;
    let mut sum_s = 0.0;
    for observation in observations {
        let delay_s = |y_px: f64| cameras.get(observation.camera).map_or(0.0, |c| c.row_delay_s(y_px));
        let since_s = (i128::from(observation.capture_ns) - i128::from(first_ns)) as f64 * 1e-9;
        let rows_s: f64 = observation.corners_px.iter().map(|corner| delay_s(corner.y)).sum();
        sum_s += since_s + rows_s / 4.0;
    }
    let offset_ns = (sum_s / observations.len() as f64 * 1e9).round();
    first_ns.checked_add_signed(offset_ns as i64)
}

/// Solves shells; keeps its memory, so that a solve near a prediction needs no new one.
#[derive(Debug, Default)]
pub struct Solver {
    work: Workspace,
}

impl Solver {
    /// What became of each observation of the last solve.
    pub fn fates(&self) -> &[Fate] {
        &self.work.fates
    }

    /// Says of what was just used that nothing came of it: its pose was not believed.
    pub fn refuse(&mut self) {
        for fate in self.work.fates.iter_mut().filter(|fate| **fate == Fate::Used) {
            *fate = Fate::Unsolved;
        }
    }

    /// Says of observations that nobody tried to solve them.
    pub fn leave(&mut self, views: &Views<'_>) {
        self.work.fates.clear();
        self.work.fates.resize(views.observations.len(), Fate::Unsolved);
    }

    /// Solves near a prediction. Where views alone are ambiguous the prediction decides, if it is sure enough.
    pub fn near(
        &mut self,
        views: &Views<'_>,
        prior: &Prior,
        settings: &SolverSettings,
    ) -> Result<Solution, Refusal> {
        self.work.prepare(views, settings);
        let outcome = self.near_prepared(views, prior, settings);
        self.explained(outcome)
    }

    /// Solves without a prediction.
    pub fn afresh(&mut self, views: &Views<'_>, settings: &SolverSettings) -> Result<Solution, Refusal> {
        self.work.prepare(views, settings);
        let outcome = self.afresh_prepared(views, settings);
        self.explained(outcome)
    }

    fn near_prepared(
        &mut self,
        views: &Views<'_>,
        prior: &Prior,
        settings: &SolverSettings,
    ) -> Result<Solution, Refusal> {
        let nothing = self.nothing();
        let minimum = self.work.refine(views, &prior.state, prior, settings).ok_or(nothing)?;
        let solution = self.conclude(views, &minimum, prior)?;
        if solution.cameras == 1 && solution.tags <= 2 {
            // Few tags in one view look alike from two sides. The mirrored pose must be clearly worse.
            let mirrored = initial::mirrored(views, &self.work.fates, &minimum.state);
            std::mem::swap(&mut self.work.fates, &mut self.work.set_aside);
            let rival = mirrored.and_then(|start| self.work.refine(views, &start, prior, settings));
            std::mem::swap(&mut self.work.fates, &mut self.work.set_aside);
            if rival.is_some_and(|rival| rivals(&minimum, &rival, settings)) {
                return Err(Refusal::Ambiguous);
            }
        }
        Ok(solution)
    }

    fn afresh_prepared(&mut self, views: &Views<'_>, settings: &SolverSettings) -> Result<Solution, Refusal> {
        let mut found: Vec<(Minimum, Solution, Vec<Fate>)> = Vec::new();
        let mut refusal = self.nothing();
        for start in self.hypotheses(views) {
            let prior = Prior::free(start, settings);
            let Some(minimum) = self.work.refine(views, &prior.state, &prior, settings) else { continue };
            match self.conclude(views, &minimum, &prior) {
                Ok(solution) => found.push((minimum, solution, self.work.fates.clone())),
                Err(reason) => refusal = reason,
            }
        }
        found.sort_by(|a, b| a.0.cost.total_cmp(&b.0.cost));
        let mut found = found.into_iter();
        let (minimum, solution, fates) = found.next().ok_or(refusal)?;
        if found.any(|(rival, ..)| rivals(&minimum, &rival, settings)) {
            return Err(Refusal::Ambiguous);
        }
        self.work.fates = fates;
        Ok(solution)
    }

    /// Why there is no minimum: nothing was usable, or what was contradicts itself.
    fn nothing(&self) -> Refusal {
        if self.work.used_count() == 0 { Refusal::NothingSeen } else { Refusal::NothingAgrees }
    }

    /// Start poses, the best first.
    fn hypotheses(&mut self, views: &Views<'_>) -> Vec<Isometry3<f64>> {
        /// Poses that are worth refining.
        const KEPT: usize = 4;
        let mut scored: Vec<(f64, Isometry3<f64>)> = initial::hypotheses(views)
            .into_iter()
            .map(|pose| (self.work.fit(views, &State::still(pose)), pose))
            .collect();
        scored.sort_by(|a, b| a.0.total_cmp(&b.0));
        scored.into_iter().take(KEPT).map(|(_, pose)| pose).collect()
    }

    /// The solution at a minimum.
    fn conclude(&self, views: &Views<'_>, minimum: &Minimum, prior: &Prior) -> Result<Solution, Refusal> {
        let used = self.work.used_count();
        // What two of five tags say is no pose.
        if used == 0 || 2 * used < views.observations.len() {
            return Err(Refusal::NothingAgrees);
        }
        let data = &minimum.normal.hessian;
        let inverse = |information: Matrix18| {
            let factor = Cholesky::of(&information.data.0)?;
            Some(Matrix18::from_data(ArrayStorage(factor.inverse())))
        };
        let mut covariance = inverse(data + prior.information).ok_or(Refusal::NothingAgrees)?;
        // The numbers that the data, not the prior, determine: the trace of the share of their information.
        let determined = 18.0 - covariance.dot(&prior.information);
        let freedom = (8.0 * used as f64 - determined).max(1.0);
        let excess = self.work.chi2() / freedom;
        // By chance χ² exceeds its mean by three standard deviations once in several hundred solves.
        let widening = (excess / (1.0 + 3.0 * (2.0 / freedom).sqrt())).max(1.0);
        let information = data / widening;
        if widening > 1.0 {
            covariance = inverse(information + prior.information).ok_or(Refusal::NothingAgrees)?;
        }
        if !covariance.iter().all(|number| number.is_finite()) {
            return Err(Refusal::NothingAgrees);
        }
        Ok(Solution {
            state: minimum.state,
            covariance,
            information,
            gradient: minimum.normal.gradient / widening,
            excess,
            freedom,
            rms_px: (self.work.squares_px2() / (4.0 * used as f64)).sqrt(),
            tags: self.distinct(views, |observation| observation.tag),
            cameras: self.distinct(views, |observation| observation.camera),
        })
    }

    /// Different values of something among what was used.
    fn distinct(&self, views: &Views<'_>, of: impl Fn(&Observation) -> usize) -> usize {
        let used = |k: &usize| self.work.fates[*k] == Fate::Used;
        let values = || (0..views.observations.len()).filter(used).map(|k| of(&views.observations[k]));
        values().enumerate().filter(|(k, value)| !values().take(*k).any(|earlier| earlier == *value)).count()
    }

    /// Names what a refusal makes of the observations.
    fn explained(&mut self, outcome: Result<Solution, Refusal>) -> Result<Solution, Refusal> {
        let fate = match outcome {
            Ok(_) => return outcome,
            Err(Refusal::Ambiguous) => Fate::Ambiguous,
            Err(_) => Fate::Unsolved,
        };
        for known in self.work.fates.iter_mut().filter(|known| **known == Fate::Used) {
            *known = fate;
        }
        outcome
    }
}

/// Whether another minimum is about as good and is not the same.
fn rivals(best: &Minimum, other: &Minimum, settings: &SolverSettings) -> bool {
    /// Poses nearer to each other have the same minimum.
    const SAME_RAD: f64 = 0.02;
    let rotation = |minimum: &Minimum| minimum.state.world_from_shell.rotation;
    rotation(other).angle_to(&rotation(best)) > SAME_RAD && other.cost - best.cost < settings.ambiguity_cost
}

#[cfg(test)]
mod tests;
