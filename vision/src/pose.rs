//! The pose of one shell from all corners of its tags in all views, jointly.
//!
//! # Equations
//! Unknown: T = (p, R), the shell's pose in the world. Tangent δ = (δp, δθ): p ← p + δp in world axes,
//! R ← R·exp(δθ) in shell axes. A corner X (shell frame) seen by camera c with pose (R_c, t_c) at pixel z:
//!
//! ```text
//! r = (π(R_cᵀ (R X + p − t_c)) − z) / σ          π: projection with the lens distortion
//! J = (1/σ) · ∂π/∂x_c · R_cᵀ · [ I₃   −R [X]× ]
//! ```
//!
//! The lens stands in the projection, so measurements stay as they were and keep their noise. Minimised is
//! Σ ρ(|r|²) with Cauchy's ρ(s) = k² ln(1 + s/k²), by iteratively reweighted Levenberg-Marquardt (Triggs et
//! al., "Bundle adjustment: a modern synthesis", 1999). Tags that do not fit (half covered, swapped, wrong
//! id) are left out as a whole, and the rest is solved again. Covariance: (Σ w JᵀJ)⁻¹, widened where the
//! residuals are larger than σ says.
//!
//! A start comes from the prediction, or from OpenCV's planar PnP (IPPE) of single tags: each gives two
//! poses, and the one that explains all views best wins. One tag in one view alone is two-fold ambiguous;
//! it is solved only if the views tell the two apart or a prediction does.

mod initial;
mod problem;

use nalgebra::{Isometry3, Matrix6, Point2};

use crate::camera::Camera;
use crate::shells::Shell;
use problem::Problem;

/// The corners of one tag in one view.
#[derive(Debug, Clone, PartialEq)]
pub struct Observation {
    /// Index into the cameras.
    pub camera: usize,
    /// Index into the shell's tags.
    pub tag: usize,
    /// Corners in the order of [`crate::shells::ShellTag::corners`], pixel centres at integers.
    pub corners_px: [Point2<f64>; 4],
    /// Standard deviation of a corner along each axis.
    pub sigma_px: f64,
}

/// A solved pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// The shell's pose in the world.
    pub world_from_shell: Isometry3<f64>,
    /// Covariance of position (world axes, m²), then rotation (shell axes, rad²).
    pub covariance: Matrix6<f64>,
    /// Root mean square of the corners' residual lengths in pixels, outliers left out.
    pub rms_px: f64,
    /// For each observation, whether it was used.
    pub used: Vec<bool>,
    /// Different tags that were used.
    pub tags: usize,
    /// Different cameras that were used.
    pub cameras: usize,
}

/// Limits of the solver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolverSettings {
    /// Scale k of Cauchy's kernel, in standard deviations of a corner.
    pub kernel_sigmas: f64,
    /// A tag whose corners' RMS exceeds this many standard deviations is left out,
    pub outlier_sigmas: f64,
    /// but not below this many pixels.
    pub outlier_floor_px: f64,
    /// Steps of Levenberg-Marquardt at most.
    pub max_steps: usize,
    /// Two poses from one tag whose costs differ by less (in units of σ²) are not told apart by it.
    pub ambiguity_cost: f64,
}

impl Default for SolverSettings {
    fn default() -> Self {
        Self {
            kernel_sigmas: 3.0,
            outlier_sigmas: 6.0,
            outlier_floor_px: 0.6,
            max_steps: 20,
            ambiguity_cost: 25.0,
        }
    }
}

/// Solves the pose of a shell; `None` if nothing was seen, if nothing agrees, or if it is ambiguous.
///
/// `guess` is the predicted pose, if there is one.
pub fn solve(
    shell: &Shell,
    cameras: &[Camera],
    observations: &[Observation],
    guess: Option<&Isometry3<f64>>,
    settings: &SolverSettings,
) -> Option<Solution> {
    let problem = Problem::new(shell, cameras, observations, settings);
    if problem.is_empty() {
        return None;
    }
    let everything = vec![true; observations.len()];
    if let Some(guess) = guess
        && let Some(solution) = from_start(&problem, guess, &everything)
        && solution.explains_most()
    {
        return Some(solution);
    }
    let mut candidates: Vec<Solution> = initial::hypotheses(&problem)
        .iter()
        .filter_map(|start| from_start(&problem, start, &everything))
        .filter(Solution::explains_most)
        .collect();
    candidates.sort_by(|a, b| {
        let cost = |s: &Solution| problem.cost(&s.world_from_shell, &everything);
        cost(a).total_cmp(&cost(b))
    });
    let best = candidates.first()?;
    let rival = candidates.iter().skip(1).find(|other| is_rival(&problem, best, other));
    match (rival, guess) {
        (None, _) => Some(best.clone()),
        (Some(rival), Some(guess)) => {
            let turn = |s: &Solution| s.world_from_shell.rotation.angle_to(&guess.rotation);
            Some(if turn(rival) < turn(best) { rival.clone() } else { best.clone() })
        }
        (Some(_), None) => None,
    }
}

/// Whether another pose explains the views nearly as well and is not the same.
fn is_rival(problem: &Problem<'_>, best: &Solution, other: &Solution) -> bool {
    /// Poses nearer to each other have the same minimum.
    const SAME_RAD: f64 = 0.02;
    let everything = vec![true; best.used.len()];
    let cost = |s: &Solution| problem.cost(&s.world_from_shell, &everything);
    let apart = other.world_from_shell.rotation.angle_to(&best.world_from_shell.rotation);
    apart > SAME_RAD && cost(other) - cost(best) < problem.settings.ambiguity_cost
}

/// Minimises from a start, leaves out what does not fit, minimises again.
fn from_start(problem: &Problem<'_>, start: &Isometry3<f64>, everything: &[bool]) -> Option<Solution> {
    /// Each round may uncover further outliers; more than this are not needed.
    const ROUNDS: usize = 3;
    let mut used = everything.to_vec();
    let mut pose = problem.minimize(start, &used);
    for _ in 0..ROUNDS {
        let fits = problem.fitting(&pose);
        let settled = fits == used;
        used = fits;
        if settled || !used.contains(&true) {
            break;
        }
        pose = problem.minimize(&pose, &used);
    }
    problem.conclude(&pose, used)
}

impl Solution {
    /// At least half of what was seen agrees: what two of five tags say is no pose.
    fn explains_most(&self) -> bool {
        let used = self.used.iter().filter(|used| **used).count();
        2 * used >= self.used.len()
    }
}

#[cfg(test)]
mod tests;
