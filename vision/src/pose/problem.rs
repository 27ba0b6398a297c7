//! The least-squares problem of [`super`]: normal equations, Levenberg-Marquardt, which tags fit.
//!
//! Each tag counts with ρ(s) of its squared whitened residual s: ρ = s up to k, then k (1 + ln(s/k)), so that
//! what is ordinary counts in full and keeps the covariance true, and what is not fades like Cauchy's kernel.
//! k grows with the lower median of s: while the start is far off, nothing fades. From the minimum that this leads
//! to, it is bounded: then half of the tags may be false.

use nalgebra::{Matrix3, Vector3};

use super::state::{Matrix18, Prior, State, Vector18};
use super::term::{BEHIND, Linear, RESIDUAL, Term, View};
use super::{Fate, Observation, SolverSettings, Views};
use crate::cholesky::Cholesky;
use crate::vector::{Kernel, Vector, fastest};

/// Once a minimum is found, noise larger than promised is allowed for only up to this variance: what lies beyond is
/// false, even if half of the tags are.
const MOST_SCALE2: f64 = 4.0;
/// Median of χ² with eight degrees of freedom.
const MEDIAN: f64 = 7.344;

/// Memory that solves share, so that they need no new one.
#[derive(Debug, Default)]
pub(super) struct Workspace {
    eyes: Vec<View>,
    pub terms: Vec<Option<Term>>,
    pub fates: Vec<Fate>,
    /// Fates that wait while another start is tried.
    pub set_aside: Vec<Fate>,
    here: Vec<Linear>,
    trial: Vec<Linear>,
    sorted: Vec<f64>,
}

/// Normal equations of the data at one state, without the prior.
pub(super) struct Normal {
    pub hessian: Matrix18,
    pub gradient: Vector18,
}

/// A minimum.
pub(super) struct Minimum {
    pub state: State,
    pub normal: Normal,
    /// Σ ρ of the tags that count, and the prior's share, but for what the last step changed.
    pub cost: f64,
}

impl Workspace {
    /// Prepares the observations; all of them count at first.
    pub fn prepare(&mut self, views: &Views<'_>, settings: &SolverSettings) {
        self.eyes.clear();
        self.eyes.extend(views.cameras.iter().map(View::new));
        self.terms.clear();
        let term = |o: &Observation| Term::new(views, o, settings.corner_floor_px);
        self.terms.extend(views.observations.iter().map(term));
        self.here.resize_with(self.terms.len(), Linear::behind);
        self.trial.resize_with(self.terms.len(), Linear::behind);
        self.include_all();
    }

    /// All observations that make sense count again.
    pub fn include_all(&mut self) {
        self.fates.clear();
        let fate = |term: &Option<Term>| if term.is_some() { Fate::Used } else { Fate::Unusable };
        self.fates.extend(self.terms.iter().map(fate));
    }

    /// Which observations count, and their terms.
    fn used(&self) -> impl Iterator<Item = usize> + '_ {
        self.fates.iter().enumerate().filter(|(_, fate)| **fate == Fate::Used).map(|(k, _)| k)
    }

    pub fn used_count(&self) -> usize {
        self.used().count()
    }

    /// How well a state explains all observations: the smaller the better.
    pub fn fit(&mut self, views: &Views<'_>, state: &State) -> f64 {
        /// Poses from single tags lie some pixels beside the others': this tells near from far.
        const LIMIT: f64 = 1e4;
        Self::linearize(&self.terms, &self.eyes, views, state, &mut self.here);
        self.here.iter().map(|linear| kernel(linear.squared, LIMIT)).sum()
    }

    /// Minimises from a start, leaves out what does not fit, minimises again.
    pub fn refine(
        &mut self,
        views: &Views<'_>,
        start: &State,
        prior: &Prior,
        settings: &SolverSettings,
    ) -> Option<Minimum> {
        /// Each round may uncover further outliers; more than this are not needed.
        const ROUNDS: usize = 4;
        self.include_all();
        let mut minimum = self.minimize(views, start, prior, settings)?;
        for _ in 0..ROUNDS {
            if !self.judge(settings) {
                break;
            }
            minimum = self.minimize(views, &minimum.state, prior, settings)?;
        }
        Some(minimum)
    }

    /// Levenberg-Marquardt from a start; `None` if nothing counts. [`Workspace::here`] is at the minimum then.
    fn minimize(
        &mut self,
        views: &Views<'_>,
        start: &State,
        prior: &Prior,
        settings: &SolverSettings,
    ) -> Option<Minimum> {
        /// Damping after the first bad step, its factors after good and bad steps, and where to give up.
        const FIRST: f64 = 1e-4;
        const DOWN: f64 = 0.1;
        const UP: f64 = 8.0;
        const GIVE_UP: f64 = 1e8;
        /// A step that promises to lower the cost by less is the last, a sixth of a standard deviation long: it ends where
        /// the linear equations say, and nothing is computed anew there.
        const LAST: f64 = 0.03;
        let mut state = *start;
        let mut damping = 0.0;
        Self::linearize(&self.terms, &self.eyes, views, &state, &mut self.here);
        let mut most = f64::INFINITY;
        let mut limit = self.kernel_limit(settings, most)?;
        let mut normal = self.normal(&state, limit);
        for _ in 0..settings.max_steps {
            let (prior_hessian, prior_gradient) = prior.linearized(&state);
            let gradient = normal.gradient + prior_gradient;
            let mut hessian = normal.hessian + prior_hessian;
            for k in 0..18 {
                hessian[(k, k)] *= 1.0 + damping;
            }
            let Some(factor) = Cholesky::of(&hessian.data.0) else {
                // Singular without damping: four corners on a line, or numbers at their end.
                damping = f64::max(damping * UP, FIRST);
                if damping > GIVE_UP {
                    break;
                }
                continue;
            };
            let step = -Vector18::from(factor.solve(&gradient.data.0[0]));
            if -step.dot(&gradient) < LAST {
                let bounded = self.kernel_limit(settings, MOST_SCALE2)?;
                if bounded >= limit {
                    state = state.moved(&step);
                    normal.gradient += normal.hessian * step;
                    break;
                }
                (most, limit) = (MOST_SCALE2, bounded);
                normal = self.normal(&state, limit);
                continue;
            }
            let moved = state.moved(&step);
            Self::linearize(&self.terms, &self.eyes, views, &moved, &mut self.trial);
            let before = self.cost(&self.here, limit) + prior.distance2(&state);
            let after = self.cost(&self.trial, limit) + prior.distance2(&moved);
            if after <= before {
                state = moved;
                std::mem::swap(&mut self.here, &mut self.trial);
                damping = if damping > FIRST { damping * DOWN } else { 0.0 };
                limit = self.kernel_limit(settings, most)?;
                normal = self.normal(&state, limit);
            } else {
                damping = f64::max(damping * UP, FIRST);
                if damping > GIVE_UP {
                    break;
                }
            }
        }
        let cost = self.cost(&self.here, limit) + prior.distance2(&state);
        Some(Minimum { state, normal, cost })
    }

    fn linearize(
        terms: &[Option<Term>],
        eyes: &[View],
        views: &Views<'_>,
        state: &State,
        into: &mut [Linear],
    ) {
        for (term, linear) in terms.iter().zip(into) {
            if let Some(term) = term {
                term.linearize(views, eyes, state, linear);
            }
        }
    }

    /// Where the kernel begins to fade: grows with the lower median of what counts; `None` if nothing does.
    fn kernel_limit(&mut self, settings: &SolverSettings, most: f64) -> Option<f64> {
        Some(settings.kernel_chi2 * self.scale2()?.min(most))
    }

    /// The variance that the data show, in units of the promised one: from the lower median, at least 1.
    fn scale2(&mut self) -> Option<f64> {
        let Self { sorted, here, fates, .. } = self;
        sorted.clear();
        let used = here.iter().zip(fates.iter()).filter(|(_, fate)| **fate == Fate::Used);
        sorted.extend(used.map(|(linear, _)| linear.squared));
        let middle = sorted.len().checked_sub(1)? / 2;
        let (_, median, _) = sorted.select_nth_unstable_by(middle, f64::total_cmp);
        Some((*median / MEDIAN).max(1.0))
    }

    fn cost(&self, linear: &[Linear], limit: f64) -> f64 {
        self.used().map(|k| kernel(linear[k].squared, limit)).sum()
    }

    /// Σ w JᵀJ and Σ w Jᵀr of what counts, with the kernel's weights w.
    ///
    /// From the products of six columns, times dt to the power that position, velocity and acceleration have.
    fn normal(&self, state: &State, limit: f64) -> Normal {
        let mut sums = PowerSums::default();
        for k in self.used() {
            let (Linear { products, squared, .. }, Some(term)) = (&self.here[k], &self.terms[k]) else {
                continue;
            };
            if *squared >= BEHIND {
                continue;
            }
            let factor = if *squared > limit { limit / squared } else { 1.0 };
            fastest(AddPowers { sums: &mut sums, products, factor, dt_s: term.dt_s });
        }
        // From rotations about world axes to those about shell axes.
        let rotation = state.world_from_shell.rotation.to_rotation_matrix().into_inner();
        let mut hessian = Matrix18::zeros();
        let mut gradient = Vector18::zeros();
        /// The derivative by the k-th derivative of the pose is dt^k / k! times that by the pose.
        const FACTORS: [f64; 3] = [1.0, 1.0, 0.5];
        for (power, sum) in sums.iter().enumerate() {
            let block = |i: usize, j: usize| Matrix3::from_fn(|r, c| sum[3 * i + r][3 * j + c]);
            let (linear, mixed) = (block(0, 0), block(0, 1) * rotation);
            let angular = rotation.tr_mul(&(block(1, 1) * rotation));
            for m in power.saturating_sub(2)..=power.min(2) {
                let n = power - m;
                let factor = FACTORS[m] * FACTORS[n];
                let mut put = |i: usize, j: usize, value: Matrix3<f64>| {
                    hessian.fixed_view_mut::<3, 3>(6 * m + 3 * i, 6 * n + 3 * j).copy_from(&(value * factor));
                };
                put(0, 0, linear);
                put(0, 1, mixed);
                put(1, 0, mixed.transpose());
                put(1, 1, angular);
            }
        }
        for (power, factor) in FACTORS.into_iter().enumerate() {
            let part = |i: usize| Vector3::from_fn(|r, _| factor * sums[power][3 * i + r][RESIDUAL]);
            gradient.fixed_rows_mut::<3>(6 * power).copy_from(&part(0));
            gradient.fixed_rows_mut::<3>(6 * power + 3).copy_from(&rotation.tr_mul(&part(1)));
        }
        Normal { hessian, gradient }
    }

    /// Sum of the squared residual lengths of what counts, at the minimum, pixels.
    pub fn squares_px2(&self) -> f64 {
        self.used().map(|k| self.here[k].squared_px2).sum()
    }

    /// χ² of what counts, at the minimum.
    pub fn chi2(&self) -> f64 {
        self.used().map(|k| self.here[k].squared).sum()
    }

    /// Says of each observation whether it fits the minimum; whether anything changed.
    fn judge(&mut self, settings: &SolverSettings) -> bool {
        /// With fewer tags the median says nothing of the noise: one of them may be false.
        const ENOUGH: usize = 3;
        let scale2 = if self.used_count() < ENOUGH { 1.0 } else { self.scale2().unwrap_or(1.0) };
        let limit = settings.outlier_chi2 * scale2.min(MOST_SCALE2);
        let mut changed = false;
        for k in 0..self.terms.len() {
            let (Some(_), Linear { squared, squared_px2, faces, .. }) = (&self.terms[k], &self.here[k])
            else {
                continue;
            };
            let fits = *squared <= limit || *squared_px2 < 4.0 * settings.outlier_floor_px.powi(2);
            let fate = match (faces, fits) {
                (false, _) => Fate::FacingAway,
                (true, true) => Fate::Used,
                (true, false) => Fate::Outlier,
            };
            changed |= self.fates[k] != fate;
            self.fates[k] = fate;
        }
        changed
    }
}

/// Sums of products, times dt to the power of 0 to 4.
type PowerSums = [[[f64; 8]; 8]; 5];

/// Adds products, times a factor and the powers of dt.
struct AddPowers<'a> {
    sums: &'a mut PowerSums,
    products: &'a [[f64; 8]; 8],
    factor: f64,
    dt_s: f64,
}

impl Kernel for AddPowers<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self) {
        let mut factor = self.factor;
        for sum in self.sums {
            for (sum, row) in sum.iter_mut().zip(self.products).take(RESIDUAL) {
                for (sum, value) in sum.iter_mut().zip(row) {
                    *sum += factor * value;
                }
            }
            factor *= self.dt_s;
        }
    }
}

fn kernel(squared: f64, limit: f64) -> f64 {
    if squared <= limit { squared } else { limit * (1.0 + (squared / limit).ln()) }
}
