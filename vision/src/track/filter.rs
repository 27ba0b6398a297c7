//! Error-state filter on SE(3) for one shell: pose, twist and acceleration.
//!
//! State: position p, velocity v and acceleration a in world axes; orientation R, angular velocity ω and angular
//! acceleration α in shell axes. Error: (δp, δθ, δv, δω, δa, δα) with R = R̂·exp(δθ), as [`crate::pose`] has it.
//! Accelerations are first-order Gauss-Markov processes: they fade with a time constant τ and are renewed by
//! white noise, so that their standard deviation stays σ (Singer's model; Bar-Shalom, Li, Kirubarajan,
//! "Estimation with Applications to Tracking and Navigation", 2001, section 8.2.3). Over a step dt, x = dt/τ:
//!
//! ```text
//! p ← p + v dt + a τ² (x − 1 + e⁻ˣ)      v ← v + a τ (1 − e⁻ˣ)      a ← a e⁻ˣ
//! Q = (2σ²/τ) ∫₀^dt g(s) g(s)ᵀ ds         g(s) = (τ² (s/τ − 1 + e^(−s/τ)), τ (1 − e^(−s/τ)), e^(−s/τ))
//! ```
//!
//! σ follows the data: what was measured is compared with what was predicted, and a hand that moves more (or
//! less) wildly than thought changes σ² within bounds, for translation and rotation apart.
//!
//! A solve gives information about the same eighteen numbers, the prior taken out: the two are added.

use nalgebra::{Isometry3, Matrix3, Matrix6, Vector3};

use crate::pose::{Matrix18, Prior, Solution, State, Vector18};

/// How an acceleration behaves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Manoeuvre {
    /// Standard deviation, m/s² or rad/s².
    pub sigma: f64,
    /// How long it lasts, seconds.
    pub time_s: f64,
}

/// How a hand moves, and what to believe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilterSettings {
    /// Acceleration of the shell's origin, m/s². Reaching 40 cm in 0.8 s takes 3.6 m/s² at most.
    pub linear: Manoeuvre,
    /// Angular acceleration, rad/s². Turning by 90 degrees in half a second takes 36 rad/s² at most.
    pub angular: Manoeuvre,
    /// Bounds of the factor by which the data may change the squares of these standard deviations.
    pub variance_bounds: (f64, f64),
    /// Squared Mahalanobis distance of the state beyond which a measurement is taken for a jump. For eighteen
    /// degrees of freedom 75 is exceeded by chance once in a hundred million.
    pub gate: f64,
}

impl Default for FilterSettings {
    fn default() -> Self {
        Self {
            linear: Manoeuvre { sigma: 3.0, time_s: 0.25 },
            angular: Manoeuvre { sigma: 30.0, time_s: 0.25 },
            variance_bounds: (1e-3, 30.0),
            gate: 75.0,
        }
    }
}

/// Where a shell is, how it moves, and how sure that is, at one instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// The instant.
    pub time_ns: u64,
    /// Pose of the shell in the world.
    pub world_from_shell: Isometry3<f64>,
    /// Velocity of the shell's origin, world axes, m/s.
    pub velocity_m_s: Vector3<f64>,
    /// Angular velocity, shell axes, rad/s.
    pub rate_rad_s: Vector3<f64>,
    /// Acceleration of the shell's origin, world axes, m/s².
    pub acceleration_m_s2: Vector3<f64>,
    /// Angular acceleration, shell axes, rad/s².
    pub angular_rad_s2: Vector3<f64>,
    /// What the data made of the variances of both accelerations, as a factor.
    pub variance: [f64; 2],
    /// Covariance of position, rotation, velocity, angular velocity, acceleration, angular acceleration.
    pub covariance: Matrix18,
}

/// What a solve says of a state at one instant, apart from what was believed before: a normal
/// distribution about a point, up to a factor.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    /// The instant.
    pub time_ns: u64,
    about: State,
    information: Matrix18,
    gradient: Vector18,
}

impl Evidence {
    /// What the data of a solve say, the prior taken out.
    pub fn of(time_ns: u64, solution: &Solution) -> Self {
        Self {
            time_ns,
            about: solution.state,
            information: solution.information,
            gradient: solution.gradient,
        }
    }
}

/// What became of a measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Judgement {
    /// It agrees with the motion and was taken in.
    Accepted,
    /// It jumps farther than the motion allows and was left aside.
    Jump,
}

impl Motion {
    /// Begins with a measured state.
    pub fn begin(time_ns: u64, state: &State, covariance: &Matrix18) -> Self {
        Self::of(time_ns, state, [1.0; 2], *covariance)
    }

    fn of(time_ns: u64, state: &State, variance: [f64; 2], covariance: Matrix18) -> Self {
        let State { world_from_shell, velocity_m_s, rate_rad_s, acceleration_m_s2, angular_rad_s2 } = *state;
        Self {
            time_ns,
            world_from_shell,
            velocity_m_s,
            rate_rad_s,
            acceleration_m_s2,
            angular_rad_s2,
            variance,
            covariance,
        }
    }

    /// Pose, twist and accelerations.
    pub fn state(&self) -> State {
        State {
            world_from_shell: self.world_from_shell,
            velocity_m_s: self.velocity_m_s,
            rate_rad_s: self.rate_rad_s,
            acceleration_m_s2: self.acceleration_m_s2,
            angular_rad_s2: self.angular_rad_s2,
        }
    }

    /// Covariance of position (world axes), then rotation (shell axes).
    pub fn pose_covariance(&self) -> Matrix6<f64> {
        self.covariance.fixed_view::<6, 6>(0, 0).into()
    }

    /// Covariance of the state, in the order of [`State::moved`].
    pub fn state_covariance(&self) -> &Matrix18 {
        &self.covariance
    }

    /// What is believed, for a solve at this instant; `None` if the numbers have come to their end.
    pub fn prior(&self) -> Option<Prior> {
        let information = self.covariance.cholesky()?.inverse();
        Some(Prior { state: self.state(), information })
    }

    /// As if the shell may move as wildly as the bounds of its variances allow.
    pub fn loosened(&self, settings: &FilterSettings) -> Self {
        Self { variance: [settings.variance_bounds.1; 2], ..self.clone() }
    }

    /// The motion at another instant; backwards too, although with no less doubt.
    pub fn predicted(&self, time_ns: u64, settings: &FilterSettings) -> Self {
        let dt_s = (i128::from(time_ns) - i128::from(self.time_ns)) as f64 * 1e-9;
        let linear = Reach::new(dt_s, settings.linear.time_s);
        let angular = Reach::new(dt_s, settings.angular.time_s);
        let turn = self.rate_rad_s * dt_s + self.angular_rad_s2 * angular.position;
        let parts = [
            self.velocity_m_s * dt_s + self.acceleration_m_s2 * linear.position,
            turn,
            self.acceleration_m_s2 * linear.velocity,
            self.angular_rad_s2 * angular.velocity,
            self.acceleration_m_s2 * (linear.fade - 1.0),
            self.angular_rad_s2 * (angular.fade - 1.0),
        ];
        let step = Vector18::from_fn(|row, _| parts[row / 3][row % 3]);

        let mut transition = Matrix18::identity();
        let mut block = |row, column, value: Matrix3<f64>| {
            transition.fixed_view_mut::<3, 3>(row, column).copy_from(&value);
        };
        let eye = Matrix3::identity();
        block(0, 6, eye * dt_s);
        block(0, 12, eye * linear.position);
        block(6, 12, eye * linear.velocity);
        block(12, 12, eye * linear.fade);
        block(3, 3, nalgebra::Rotation3::new(-turn).into_inner());
        block(3, 9, eye * dt_s);
        block(3, 15, eye * angular.position);
        block(9, 15, eye * angular.velocity);
        block(15, 15, eye * angular.fade);
        let mut covariance = transition * self.covariance * transition.transpose();
        let noises = [(0, &settings.linear), (3, &settings.angular)];
        for ((offset, manoeuvre), variance) in noises.into_iter().zip(self.variance) {
            let noise = noise(dt_s, manoeuvre) * variance;
            for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
                for k in 0..3 {
                    covariance[(offset + 6 * i + k, offset + 6 * j + k)] += noise[(i, j)];
                }
            }
        }
        let covariance = (covariance + covariance.transpose()) * 0.5;
        Self::of(time_ns, &self.state().moved(&step), self.variance, covariance)
    }

    /// Takes in what a solve says of this instant: call [`Motion::predicted`] first.
    ///
    /// With Λ the information of the prior and e the step from its mean to the evidence's point, the joint
    /// minimum lies at δ = −(Λ + H)⁻¹ (Λ e + g) from there.
    pub fn correct(&mut self, evidence: &Evidence, settings: &FilterSettings) -> Judgement {
        let Some(information) = self.covariance.cholesky().map(|factor| factor.inverse()) else {
            return Judgement::Jump;
        };
        let Some(joint) = (information + evidence.information).cholesky() else { return Judgement::Jump };
        let away = self.state().step_to(&evidence.about);
        let back = joint.solve(&(information * away + evidence.gradient));
        let state = evidence.about.moved(&-back);
        let step = self.state().step_to(&state);
        if step.dot(&(information * step)) > settings.gate {
            return Judgement::Jump;
        }
        let covariance = joint.inverse();
        let variance = self.learned(&covariance, &step, settings);
        *self = Self::of(self.time_ns, &state, variance, (covariance + covariance.transpose()) * 0.5);
        Judgement::Accepted
    }

    /// Compares the correction of position and velocity (and of rotation and rate) with what was expected: the
    /// mean of dᵀ P⁻¹ d is the number of degrees of freedom that the data determine, tr(I − P⁻¹ P').
    fn learned(&self, after: &Matrix18, step: &Vector18, settings: &FilterSettings) -> [f64; 2] {
        /// With fewer degrees of freedom a ratio says nothing.
        const LEAST: f64 = 1.0;
        /// What one measurement changes in the logarithm of the variance, for each degree of freedom, and the
        /// ratio beyond which it does not count for more: manoeuvres begin suddenly.
        const GAIN: f64 = 0.05;
        const MOST: f64 = 6.0;
        let (low, high) = settings.variance_bounds;
        let mut variances = self.variance;
        for (offset, variance) in [0, 3].into_iter().zip(&mut variances) {
            let index = |k: usize| offset + if k < 3 { k } else { k + 3 };
            let part = |of: &Matrix18| Matrix6::from_fn(|i, j| of[(index(i), index(j))]);
            let d = nalgebra::Vector6::from_fn(|k, _| step[index(k)]);
            let Some(factor) = part(&self.covariance).cholesky() else { continue };
            let freedom = 6.0 - factor.solve(&part(after)).trace();
            if freedom < LEAST {
                continue;
            }
            let ratio = d.dot(&factor.solve(&d)) / freedom;
            let change = GAIN * freedom * (ratio.min(MOST) - 1.0);
            *variance = (*variance * change.exp()).clamp(low, high);
        }
        variances
    }
}

/// How far an acceleration of 1 at the start reaches in a time: into position and velocity, and what is left.
struct Reach {
    position: f64,
    velocity: f64,
    fade: f64,
}

impl Reach {
    /// Backwards an acceleration that fades would have been larger and larger: it is taken to have been constant.
    fn new(dt_s: f64, time_s: f64) -> Self {
        if dt_s <= 0.0 {
            return Self { position: 0.5 * dt_s * dt_s, velocity: dt_s, fade: 1.0 };
        }
        let x = dt_s / time_s;
        let gone = -(-x).exp_m1();
        Self { position: time_s * time_s * (x - gone), velocity: time_s * gone, fade: 1.0 - gone }
    }
}

/// Q for one axis: position, velocity, acceleration. Integrated by Gauss and Legendre at four points, which
/// has no differences of nearly equal numbers as the closed form has.
fn noise(dt_s: f64, manoeuvre: &Manoeuvre) -> Matrix3<f64> {
    const NODES: [(f64, f64); 4] = [
        (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
        (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
        (0.669_990_521_792_428_13, 0.326_072_577_431_273_07),
        (0.930_568_155_797_026_29, 0.173_927_422_568_726_93),
    ];
    let mut sum = Matrix3::zeros();
    for (node, weight) in NODES {
        let sign = dt_s.signum();
        let reach = Reach::new(dt_s.abs() * node, manoeuvre.time_s);
        // Backwards, position and acceleration change as forwards, velocity the other way.
        let g = Vector3::new(reach.position, reach.velocity * sign, reach.fade);
        sum += g * g.transpose() * weight;
    }
    sum * (2.0 * manoeuvre.sigma.powi(2) / manoeuvre.time_s * dt_s.abs())
}

#[cfg(test)]
mod tests;
