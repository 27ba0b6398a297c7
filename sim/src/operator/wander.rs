//! Random hand motion, made from a seed: what a recorded hand would look like, though nobody was recorded.
//!
//! Each body reaches from place to place along a straight line with the minimum-jerk profile of human reaching
//! (Flash and Hogan, J. Neurosci. 5, 1985): `s = 10 u^3 - 15 u^4 + 6 u^5`, at rest at both ends, peak speed
//! 1.875 D / T and peak acceleration 5.77 D / T^2 for a distance D in a time T. It pauses between reaches. The
//! hands tremble all the while at 8 to 12 Hz (physiological tremor).

use std::f64::consts::TAU;

use nalgebra::Vector3;
use serde::Deserialize;

use super::motion::{Body, smoothstep};
use super::sensor::mix;

/// What is added to a body's pose at rest.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Offset {
    /// Along the world's axes, metres.
    pub shift_m: Vector3<f64>,
    /// Rotation vector in the world's axes.
    pub turn_rad: Vector3<f64>,
    /// Opening of a thumb.
    pub open_rad: f64,
}

/// The random motion of all bodies.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "Settings")]
pub struct Wander {
    begin_s: f64,
    end_s: f64,
    /// By `body as usize`.
    reaches: [Vec<Reach>; 5],
    /// By `body as usize`; empty for a body that does not tremble.
    tremors: [Vec<Tremor>; 5],
}

/// Its keys in the scene file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Another seed gives another motion.
    pub seed: u64,
    /// The first reach begins after this time.
    pub begin_s: f64,
    /// All bodies are back at rest by this time.
    pub end_s: f64,
    /// Amplitude of the tremor of the palms.
    pub tremor_m: f64,
}

/// Settings that give no motion.
#[derive(Debug, thiserror::Error)]
pub enum WanderError {
    /// Too short to go anywhere and come back.
    #[error("wander from {0} s to {1} s: give at least 4 s")]
    Short(f64, f64),
    /// No tremor of a healthy hand.
    #[error("tremor_m = {0}: must lie between 0 and 0.005")]
    Tremor(f64),
}

#[derive(Debug, Clone, PartialEq)]
struct Reach {
    begin_s: f64,
    seconds: f64,
    from: Offset,
    to: Offset,
}

#[derive(Debug, Clone, PartialEq)]
struct Tremor {
    frequency_hz: f64,
    phase_turns: f64,
    shift_m: Vector3<f64>,
    turn_rad: Vector3<f64>,
}

/// How far and how long a kind of body reaches.
struct Habit {
    /// Box of places around rest, metres: least and most along x, y, z.
    places_m: [(f64, f64); 3],
    /// Length of a reach, metres: least and most.
    reach_m: (f64, f64),
    /// Farthest turn from rest, and of one reach.
    turn_rad: (f64, f64),
    open_rad: f64,
    seconds: (f64, f64),
    pause_s: (f64, f64),
}

/// Reaches are slowed down to stay below this: peak accelerations of quick reaches are 5 to 10 m/s^2.
const MOST_ACCELERATION_M_S2: f64 = 9.0;
/// Peak acceleration of the minimum-jerk profile for unit distance and time: 10 / sqrt(3).
const PEAK_ACCELERATION: f64 = 5.773_502_7;

impl Habit {
    fn of(body: Body) -> Self {
        let palm = |inwards: (f64, f64)| Self {
            places_m: [(-0.12, 0.08), inwards, (-0.10, 0.12)],
            reach_m: (0.05, 0.30),
            turn_rad: (0.70, 60f64.to_radians()),
            open_rad: 0.0,
            seconds: (0.4, 1.0),
            pause_s: (0.05, 0.6),
        };
        match body {
            // The hands do not run into each other before the chest.
            Body::RightPalm => palm((-0.15, 0.08)),
            Body::LeftPalm => palm((-0.08, 0.15)),
            Body::Torso => Self {
                places_m: [(-0.03, 0.03); 3],
                reach_m: (0.005, 0.05),
                turn_rad: (0.12, 0.2),
                open_rad: 0.0,
                seconds: (0.9, 1.6),
                pause_s: (0.2, 1.5),
            },
            Body::RightThumb | Body::LeftThumb => Self {
                places_m: [(0.0, 0.0); 3],
                reach_m: (0.0, 0.0),
                turn_rad: (0.0, 0.0),
                open_rad: 0.85,
                seconds: (0.3, 0.8),
                pause_s: (0.1, 1.2),
            },
        }
    }

    /// A place that is neither too near to the last one nor too far from it.
    fn next(&self, last: &Offset, dice: &mut Dice) -> Offset {
        const MOST_THROWS: usize = 200;
        for _ in 0..MOST_THROWS {
            let shift_m = Vector3::from(self.places_m.map(|(low, high)| dice.between(low, high)));
            let most = self.turn_rad.0;
            let turn_rad = Vector3::from([(); 3].map(|()| dice.between(-most, most)));
            let reach_m = (shift_m - last.shift_m).norm();
            let fits = (self.reach_m.0..=self.reach_m.1).contains(&reach_m)
                && turn_rad.norm() <= most
                && (turn_rad - last.turn_rad).norm() <= self.turn_rad.1;
            if fits {
                return Offset { shift_m, turn_rad, open_rad: dice.between(0.0, self.open_rad) };
            }
        }
        Offset::default()
    }

    fn seconds(&self, from: &Offset, to: &Offset, dice: &mut Dice) -> f64 {
        let least = (PEAK_ACCELERATION * (to.shift_m - from.shift_m).norm() / MOST_ACCELERATION_M_S2).sqrt();
        dice.between(self.seconds.0, self.seconds.1).max(least)
    }
}

impl TryFrom<Settings> for Wander {
    type Error = WanderError;

    fn try_from(settings: Settings) -> Result<Self, WanderError> {
        const LEAST_S: f64 = 4.0;
        let Settings { seed, begin_s, end_s, tremor_m } = settings;
        if begin_s.is_nan() || end_s.is_nan() || end_s - begin_s < LEAST_S {
            return Err(WanderError::Short(begin_s, end_s));
        }
        if !(0.0..=0.005).contains(&tremor_m) {
            return Err(WanderError::Tremor(tremor_m));
        }
        let dice = |body: Body, salt: u64| Dice(mix(seed ^ mix(body as u64 ^ salt)));
        Ok(Self {
            begin_s,
            end_s,
            reaches: Body::ALL.map(|body| reaches(body, (begin_s, end_s), &mut dice(body, 0))),
            tremors: Body::ALL.map(|body| tremors(body, tremor_m, &mut dice(body, 1 << 32))),
        })
    }
}

/// From rest, from place to place, and back to rest in time.
fn reaches(body: Body, (begin_s, end_s): (f64, f64), dice: &mut Dice) -> Vec<Reach> {
    let habit = Habit::of(body);
    let (longest_s, pause_s) = (habit.seconds.1, habit.pause_s);
    let mut reaches = Vec::new();
    let mut now_s = begin_s + dice.between(pause_s.0, pause_s.1);
    let mut from = Offset::default();
    loop {
        // This reach, a pause and the way home must still fit.
        let home = now_s + 2.0 * longest_s + pause_s.1 > end_s;
        let to = if home { Offset::default() } else { habit.next(&from, dice) };
        let seconds = habit.seconds(&from, &to, dice);
        reaches.push(Reach { begin_s: now_s, seconds, from, to });
        if home {
            return reaches;
        }
        now_s += seconds + dice.between(pause_s.0, pause_s.1);
        from = to;
    }
}

/// Two waves in random directions on each palm.
fn tremors(body: Body, tremor_m: f64, dice: &mut Dice) -> Vec<Tremor> {
    /// The hand shakes about the wrist, 10 cm away.
    const LEVER_M: f64 = 0.1;
    if !matches!(body, Body::RightPalm | Body::LeftPalm) {
        return Vec::new();
    }
    (0..2)
        .map(|_| {
            let mut direction = || {
                let free = Vector3::from([(); 3].map(|()| dice.between(-1.0, 1.0)));
                if free.norm() > 0.1 { free.normalize() } else { Vector3::z() }
            };
            let (shift, turn) = (direction(), direction());
            Tremor {
                frequency_hz: dice.between(8.0, 12.0),
                phase_turns: dice.between(0.0, 1.0),
                shift_m: shift * (tremor_m / 2.0),
                turn_rad: turn * (tremor_m / 2.0 / LEVER_M),
            }
        })
        .collect()
}

impl Wander {
    /// What is added to a body's pose at rest.
    pub fn offset(&self, body: Body, t_s: f64) -> Offset {
        let reaches = &self.reaches[body as usize];
        let begun = reaches.partition_point(|reach| reach.begin_s <= t_s);
        let mut offset = begun.checked_sub(1).and_then(|last| reaches.get(last)).map_or_else(
            Offset::default,
            |Reach { begin_s, seconds, from, to }| {
                let share = smoothstep((t_s - begin_s) / seconds);
                Offset {
                    shift_m: from.shift_m.lerp(&to.shift_m, share),
                    turn_rad: from.turn_rad.lerp(&to.turn_rad, share),
                    open_rad: from.open_rad + share * (to.open_rad - from.open_rad),
                }
            },
        );
        /// The tremor comes and goes within this time.
        const RAMP_S: f64 = 0.5;
        let window = smoothstep((t_s - self.begin_s) / RAMP_S) * smoothstep((self.end_s - t_s) / RAMP_S);
        if window > 0.0 {
            for tremor in &self.tremors[body as usize] {
                let wave = window * (TAU * (tremor.frequency_hz * t_s + tremor.phase_turns)).sin();
                offset.shift_m += tremor.shift_m * wave;
                offset.turn_rad += tremor.turn_rad * wave;
            }
        }
        offset
    }

    /// By when all bodies are back at rest.
    pub fn end_s(&self) -> f64 {
        self.end_s
    }
}

/// Reproducible random numbers.
struct Dice(u64);

impl Dice {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = mix(self.0);
        low + (high - low) * ((self.0 >> 11) as f64 / (1u64 << 53) as f64)
    }
}
