//! How far, how fast and how hard a quantity may go towards a limit.
//!
//! A limit is c(q) ≥ 0: the room left before a joint's end, above the ground, between two links. What is
//! permitted depends on c and ċ alone and without jumps, so that a motion slows down and stops instead of
//! hitting the limit, and a motion away is never hindered. It is a control barrier of second order (Ames et
//! al., "Control barrier functions: theory and applications", ECC 2019) whose speed profile can brake:
//!
//! ```text
//! v(c) = α c                     for c < a/α²          ċ ≥ -v(c)
//!        √(2 a (c - a/2α²))      beyond                c̈ ≥ -v'(c) ċ - α (ċ + v(c))
//!        but at most v_max
//! ```
//! Following the bound, c decays as e^(-αt) without overshoot; a joint at v_max brakes with a and no more.

use super::StopSettings;

/// Values that a solution may have along one row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Interval {
    lower: f64,
    upper: f64,
}

impl Interval {
    const ALL: Self = Self { lower: f64::NEG_INFINITY, upper: f64::INFINITY };

    pub(super) const fn lower(&self) -> f64 {
        self.lower
    }

    pub(super) const fn upper(&self) -> f64 {
        self.upper
    }

    /// The nearest value inside.
    pub(super) fn nearest(&self, value: f64) -> f64 {
        value.max(self.lower).min(self.upper)
    }

    /// How far a value is outside.
    pub(super) fn excess(&self, value: f64) -> f64 {
        (value - self.nearest(value)).abs()
    }

    /// Values permitted by both; where there are none, the nearest to the other that this one permits.
    fn and(&self, other: &Self) -> Self {
        Self { lower: self.nearest(other.lower), upper: self.nearest(other.upper) }
    }

    fn mirrored(&self) -> Self {
        Self { lower: -self.upper, upper: -self.lower }
    }
}

/// What is permitted to a quantity's step, velocity and acceleration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Window {
    pub(super) step: Interval,
    pub(super) velocity: Interval,
    pub(super) acceleration: Interval,
}

impl Window {
    /// Everything is permitted.
    pub(super) const fn free() -> Self {
        Self { step: Interval::ALL, velocity: Interval::ALL, acceleration: Interval::ALL }
    }

    /// Not below 0. `room` is c, `speed` is ċ; the step may use up `share` of the room.
    pub(super) fn above(room: f64, speed: f64, share: f64, settings: &StopSettings) -> Self {
        let Approach { speed: permitted, slope } = approach(room, settings);
        let most = settings.max_acceleration;
        let brake = -slope * speed - settings.rate * (speed + permitted);
        let step = if room > 0.0 { share * room } else { room.max(-RECOVERY) };
        let lower = |lower: f64| Interval { lower, ..Interval::ALL };
        Self { step: lower(-step), velocity: lower(-permitted), acceleration: lower(brake.min(most)) }
    }

    /// A joint between the ends of its range, not faster than `speed_limit`. `below` and `over` are what is left
    /// to its lower and upper end.
    pub(super) fn joint(
        below: f64,
        over: f64,
        speed: f64,
        speed_limit: f64,
        settings: &StopSettings,
    ) -> Self {
        let lower = Self::above(below, speed, 1.0, settings);
        let upper = Self::above(over, -speed, 1.0, settings).mirrored();
        Self::speed(speed, speed_limit, settings).and(&lower).and(&upper)
    }

    /// Not faster than `limit`.
    ///
    /// The step, too, ends where the speed does: the joint's own law pulls towards where the joint should be, and would
    /// pull one that is at its limit beyond it. What is left of the speed is what it may be ahead by; a joint that is
    /// too fast is held back.
    fn speed(speed: f64, limit: f64, settings: &StopSettings) -> Self {
        let most = settings.max_acceleration;
        let around = |half: f64| Interval { lower: -half, upper: half };
        let ahead = |speed: f64| settings.step_time_s * (limit - speed).clamp(-limit, limit);
        let acceleration = Interval {
            lower: (-settings.rate * (limit + speed)).min(most),
            upper: (settings.rate * (limit - speed)).max(-most),
        };
        let step = Interval { lower: -ahead(-speed), upper: ahead(speed) };
        Self { step, velocity: around(limit), acceleration }
    }

    /// The later limit goes first where the two cannot both be kept.
    fn and(&self, stronger: &Self) -> Self {
        Self {
            step: stronger.step.and(&self.step),
            velocity: stronger.velocity.and(&self.velocity),
            acceleration: stronger.acceleration.and(&self.acceleration),
        }
    }

    fn mirrored(&self) -> Self {
        Self {
            step: self.step.mirrored(),
            velocity: self.velocity.mirrored(),
            acceleration: self.acceleration.mirrored(),
        }
    }
}

/// Greatest way and speed with which a limit that is exceeded is returned to, rad and rad/s (or m, m/s).
const RECOVERY: f64 = 0.05;
const RECOVERY_SPEED: f64 = 0.5;

/// v and v'.
struct Approach {
    speed: f64,
    slope: f64,
}

fn approach(room: f64, settings: &StopSettings) -> Approach {
    let (rate, braking) = (settings.rate, settings.braking);
    let bend = braking / (rate * rate);
    if room < -RECOVERY_SPEED / rate {
        Approach { speed: -RECOVERY_SPEED, slope: 0.0 }
    } else if room < bend {
        Approach { speed: rate * room, slope: rate }
    } else {
        let speed = (2.0 * braking * (room - 0.5 * bend)).sqrt();
        Approach { speed, slope: braking / speed }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const DT_S: f64 = 0.0025;

    fn settings() -> StopSettings {
        StopSettings::default()
    }

    proptest! {
        /// A quantity that always wants to go on with great acceleration.
        #[test]
        fn whatever_is_wanted_the_limit_is_not_crossed(
            room in 0.0..3.0f64, speed in -4.0..4.0f64, wanted in -300.0..300.0f64,
        ) {
            let settings = settings();
            let (mut c, mut speed) = (room, speed);
            // What could be stopped at the beginning.
            prop_assume!(speed >= -approach(c, &settings).speed);
            let mut last = None;
            for _ in 0..2000 {
                let window = Window::joint(c, 1e9, speed, 5.0, &settings);
                let acceleration = window.acceleration.nearest(wanted);
                if let Some(last) = last {
                    let jump: f64 = acceleration - last;
                    prop_assert!(jump.abs() < 0.15 * settings.max_acceleration, "{last} {acceleration}");
                }
                last = Some(acceleration);
                speed += acceleration * DT_S;
                c += speed * DT_S;
                prop_assert!(c > -2e-3, "{c}");
                prop_assert!(speed.abs() < 5.0 + 1e-9);
            }
        }

        /// An arm's servo with its position loop, as the simulator has it: goals are late, the load is unknown. Its
        /// target runs away from it.
        #[test]
        fn whatever_is_wanted_a_servo_does_not_run_beyond_its_speed(
            speed in -4.0..4.0f64, inertia in 0.002..0.01f64, load in -0.15..0.15f64, late in 1..5usize,
        ) {
            /// N m, rad/s, N m/rad
            const STALL: f64 = 0.92;
            const NO_LOAD: f64 = 6.81;
            const STIFFNESS: f64 = 5.4;
            let limit = 0.6 * NO_LOAD;
            let mut speed = speed;
            let mut pulls = [0.0; 5];
            for _ in 0..400 {
                let window = Window::joint(1e9, 1e9, speed, limit, &settings());
                pulls.rotate_right(1);
                pulls[0] = STIFFNESS * window.step.nearest(1.0)
                    + STALL / NO_LOAD * window.velocity.nearest(10.0)
                    + inertia * window.acceleration.nearest(300.0);
                let torque = pulls[late].clamp(-STALL, STALL) - STALL / NO_LOAD * speed + load;
                speed += torque / inertia * DT_S;
                prop_assert!(speed.abs() < 0.9 * NO_LOAD, "{speed}");
            }
        }

        #[test]
        fn beyond_a_limit_the_way_back_is_slow_and_ends_there(room in -1.0..0.0f64) {
            let settings = settings();
            let (mut c, mut speed) = (room, 0.0);
            for _ in 0..4000 {
                speed += Window::joint(c, 1e9, speed, 5.0, &settings).acceleration.nearest(-100.0) * DT_S;
                c += speed * DT_S;
                prop_assert!((-0.1..RECOVERY_SPEED * 1.01).contains(&speed), "{speed}");
            }
            prop_assert!(c.abs() < 1e-3, "{c}");
        }

        #[test]
        fn leaving_is_free(room in 0.2..1.0f64, speed in 0.0..3.0f64) {
            let window = Window::above(room, speed, 1.0, &settings());
            prop_assert_eq!(window.velocity.excess(10.0), 0.0);
            prop_assert_eq!(window.acceleration.excess(1000.0), 0.0);
            prop_assert_eq!(window.step.excess(1.0), 0.0);
        }
    }

    #[test]
    fn limits_that_exclude_each_other_leave_the_nearest_value_to_both() {
        let (a, b) = (Interval { lower: 0.0, upper: 1.0 }, Interval { lower: 2.0, upper: 3.0 });
        assert_eq!(a.and(&b), Interval { lower: 1.0, upper: 1.0 });
        assert_eq!(b.and(&a), Interval { lower: 2.0, upper: 2.0 });
    }
}
