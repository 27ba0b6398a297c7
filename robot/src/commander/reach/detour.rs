//! The way of a limb from one posture to another through the space of its joints.
//!
//! Straight, all joints together: q̇ = λ (q_goal - q) with λ such that none is faster than it may be, taken up
//! with a bounded acceleration. Limits on the way bend it ([`crate::polyhedron`]); where they leave no way on, it
//! ends.

use nalgebra::Vector6;

/// Greatest speeds, rad/s: a leg of 0.4 m then moves its foot, and an arm of 0.2 m its gripper, at 0.5 m/s.
const SPEEDS_RAD_S: [f64; 6] = [1.25, 1.25, 1.25, 2.5, 2.5, 2.5];
/// Greatest change of the velocity, rad/s².
const ACCELERATION_RAD_S2: f64 = 12.0;
/// λ at the end of the way, 1/s: braking takes no more than the acceleration.
const CLOSING_1_S: f64 = 15.0;
/// Nearer than this it is over, rad.
const ARRIVED_RAD: f64 = 0.01;
/// Nearing its goal slower than this for so long, it has stopped, rad/s and s.
const STOPPED_RAD_S: f64 = 0.05;
const STOPPED_S: f64 = 0.25;

/// A limb on its way.
#[derive(Debug, Clone, Copy)]
pub(super) struct Detour {
    goal: Vector6<f64>,
    velocity: Vector6<f64>,
    stopped_s: f64,
}

impl Detour {
    /// Of a limb that moves.
    pub(super) fn new(goal: Vector6<f64>, velocity: &Vector6<f64>) -> Self {
        let velocity = velocity.zip_map(&SPEEDS_RAD_S.into(), |velocity, most| velocity.clamp(-most, most));
        Self { goal, velocity, stopped_s: 0.0 }
    }

    /// Where to.
    pub(super) fn goal(&self) -> &Vector6<f64> {
        &self.goal
    }

    /// Of the joints, without what limits push them by, rad/s.
    pub(super) fn velocity(&self) -> &Vector6<f64> {
        &self.velocity
    }

    /// The goal moves.
    pub(super) fn aim(&mut self, goal: &Vector6<f64>) {
        self.goal = *goal;
    }

    /// What the joints should change by: towards the goal, or to come to rest.
    pub(super) fn change(&self, limb: &Vector6<f64>, rests: bool, dt_s: f64) -> Vector6<f64> {
        if rests {
            return self.towards(&Vector6::zeros(), dt_s) * dt_s;
        }
        let gap = self.goal - limb;
        let at_speed_s = gap.zip_map(&SPEEDS_RAD_S.into(), |gap, speed| gap.abs() / speed).max();
        // v² = 2 a |gap| with half of the acceleration.
        let braking_s = (gap.norm() / ACCELERATION_RAD_S2).sqrt();
        let wanted = gap / at_speed_s.max(braking_s).max(1.0 / CLOSING_1_S);
        self.towards(&wanted, dt_s) * dt_s
    }

    /// The velocity, changed as far as the acceleration permits.
    fn towards(&self, velocity: &Vector6<f64>, dt_s: f64) -> Vector6<f64> {
        let most = ACCELERATION_RAD_S2 * dt_s;
        let more = velocity - self.velocity;
        self.velocity + more * (most / more.norm().max(most))
    }

    /// After the joints have changed by what was permitted.
    #[must_use]
    pub(super) fn after(&self, change: &Vector6<f64>, limb: &Vector6<f64>, rests: bool, dt_s: f64) -> Self {
        let gap = self.goal - limb;
        let closing = change.dot(&gap) / (gap.norm().max(ARRIVED_RAD) * dt_s);
        let stopped_s = if closing < STOPPED_RAD_S && !rests { self.stopped_s + dt_s } else { 0.0 };
        Self { velocity: self.towards(&(change / dt_s), dt_s), stopped_s, ..*self }
    }

    /// The limb is there.
    pub(super) fn is_over(&self, limb: &Vector6<f64>) -> bool {
        (self.goal - limb).amax() < ARRIVED_RAD
    }

    /// There is no way on, nor need for one.
    pub(super) fn has_stopped(&self) -> bool {
        self.stopped_s > STOPPED_S
    }
}
