//! The scripted motion: where each shell is at any time, as a closed formula.
//!
//! Every body rests at its home pose; terms of smooth waves under smooth windows, and random reaches if the scene
//! asks for them, are added to it. All of them vanish at both ends of the period, so that the script repeats
//! without a seam. The result is twice continuously differentiable: velocity and acceleration exist everywhere.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use serde::Deserialize;

use super::wander::{Offset, Wander};

/// The five rigid bodies that wear shells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Body {
    /// The plate on the chest.
    Torso,
    /// On the back of the right hand.
    RightPalm,
    /// On the back of the left hand.
    LeftPalm,
    /// On the right thumb, hinged to the right palm.
    RightThumb,
    /// On the left thumb, hinged to the left palm.
    LeftThumb,
}

impl Body {
    /// All of them; a body's place in it is `body as usize`.
    pub const ALL: [Self; 5] =
        [Self::Torso, Self::RightPalm, Self::LeftPalm, Self::RightThumb, Self::LeftThumb];

    /// Its shell's name in shells files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Torso => "torso",
            Self::RightPalm => "right_palm",
            Self::LeftPalm => "left_palm",
            Self::RightThumb => "right_thumb",
            Self::LeftThumb => "left_thumb",
        }
    }

    /// The body that wears the shell of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|body| body.name() == name)
    }
}

/// A coordinate that a term moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// Forward, metres.
    X,
    /// Left, metres.
    Y,
    /// Up, metres.
    Z,
    /// About the world's x axis, radians.
    Roll,
    /// About the world's y axis, radians.
    Pitch,
    /// About the world's z axis, radians.
    Yaw,
    /// Opening of a thumb about its hinge, radians.
    Open,
}

/// The shape of a term in time; all between -1 and 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Wave {
    /// `sin`.
    Sine,
    /// A square wave with rounded edges: `tanh(4 sin) / tanh(4)`.
    Square,
    /// `(1 - cos) / 2`: from 0 up to 1 and back, never below 0.
    Rise,
}

impl Wave {
    fn value(self, turns: f64) -> f64 {
        /// Edge steepness of the square wave relative to the sine's.
        const STEEPNESS: f64 = 4.0;
        match self {
            Self::Sine => (TAU * turns).sin(),
            Self::Square => (STEEPNESS * (TAU * turns).sin()).tanh() / STEEPNESS.tanh(),
            Self::Rise => 0.5 - 0.5 * (TAU * turns).cos(),
        }
    }
}

/// One wave on one coordinate of one body, inside a window of time.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Term {
    /// What moves.
    pub body: Body,
    /// In which coordinate.
    pub axis: Axis,
    /// Its shape.
    pub wave: Wave,
    /// Metres or radians.
    pub amplitude: f64,
    /// Periods a second.
    pub frequency_hz: f64,
    /// Shift of the wave, in turns.
    #[serde(default)]
    pub phase_turns: f64,
    /// Where the window begins to open.
    pub begin_s: f64,
    /// Where it has closed.
    pub end_s: f64,
    /// How long it takes to open, and to close.
    pub ramp_s: f64,
}

impl Term {
    fn value(&self, t_s: f64) -> f64 {
        let window =
            smoothstep((t_s - self.begin_s) / self.ramp_s) * smoothstep((self.end_s - t_s) / self.ramp_s);
        if window == 0.0 {
            return 0.0;
        }
        let turns = self.frequency_hz * (t_s - self.begin_s) + self.phase_turns;
        self.amplitude * window * self.wave.value(turns)
    }
}

/// 0 below 0, 1 above 1, and in between the quintic with two vanishing derivatives at both ends.
pub(super) fn smoothstep(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * x * (x * (6.0 * x - 15.0) + 10.0)
}

/// A pose as the scene file writes it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Home {
    /// Metres.
    pub xyz: [f64; 3],
    /// Roll, pitch, yaw in degrees, about the fixed axes x, then y, then z.
    pub rpy_deg: [f64; 3],
}

impl Home {
    /// As a rigid transform.
    pub fn isometry(&self) -> Isometry3<f64> {
        let [roll, pitch, yaw] = self.rpy_deg.map(f64::to_radians);
        Isometry3::from_parts(
            Translation3::from(self.xyz),
            UnitQuaternion::from_euler_angles(roll, pitch, yaw),
        )
    }
}

/// How a thumb hangs on its palm.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hinge {
    /// A point of the hinge's axis, in the palm's frame, metres.
    pub xyz: [f64; 3],
    /// Direction of the axis in the palm's frame; a positive turn opens.
    pub axis: [f64; 3],
    /// The thumb's pose on the palm when closed.
    pub palm_from_thumb: Home,
}

impl Hinge {
    fn palm_from_thumb(&self, opening_rad: f64) -> Isometry3<f64> {
        let center = Translation3::from(self.xyz);
        let axis = nalgebra::Unit::new_normalize(Vector3::from(self.axis));
        let turn = UnitQuaternion::from_axis_angle(&axis, opening_rad);
        center * turn * center.inverse() * self.palm_from_thumb.isometry()
    }
}

/// The whole motion.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motion {
    /// After this time it starts over.
    pub period_s: f64,
    /// Torso at rest, in the world.
    pub torso: Home,
    /// Right palm at rest, in the world.
    pub right_palm: Home,
    /// Left palm at rest, in the world.
    pub left_palm: Home,
    /// Right thumb on the right palm.
    pub right_thumb: Hinge,
    /// Left thumb on the left palm.
    pub left_thumb: Hinge,
    /// What moves; nothing if there is none.
    #[serde(default, rename = "term")]
    pub terms: Vec<Term>,
    /// Random motion on top.
    pub wander: Option<Wander>,
}

/// How fast a body moves over a stretch of time.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Pace {
    /// Highest speed of its origin.
    pub peak_m_s: f64,
    /// Root mean square of that speed.
    pub rms_m_s: f64,
    /// Highest angular speed.
    pub peak_rad_s: f64,
    /// Root mean square of that speed.
    pub rms_rad_s: f64,
    /// Highest acceleration of its origin.
    pub peak_m_s2: f64,
}

/// `world_from_shell` of every body at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Posture([Isometry3<f64>; 5]);

impl Posture {
    /// `world_from_shell` of one body.
    pub fn of(&self, body: Body) -> &Isometry3<f64> {
        &self.0[body as usize]
    }
}

impl Motion {
    /// Where all shells are at a time.
    pub fn posture(&self, t_s: f64) -> Posture {
        let t_s = t_s.rem_euclid(self.period_s);
        let right_palm = self.moved(Body::RightPalm, &self.right_palm, t_s);
        let left_palm = self.moved(Body::LeftPalm, &self.left_palm, t_s);
        Posture([
            self.moved(Body::Torso, &self.torso, t_s),
            right_palm,
            left_palm,
            right_palm * self.right_thumb.palm_from_thumb(self.opening_rad(Body::RightThumb, t_s)),
            left_palm * self.left_thumb.palm_from_thumb(self.opening_rad(Body::LeftThumb, t_s)),
        ])
    }

    /// How fast a body moves between two times, sampled every millisecond.
    pub fn pace(&self, body: Body, begin_s: f64, end_s: f64) -> Pace {
        const STEP_S: f64 = 1e-3;
        let count = ((end_s - begin_s) / STEP_S).max(1.0) as usize;
        let mut pace = Pace::default();
        let mut last: Option<Vector3<f64>> = None;
        for i in 0..count {
            let (linear, angular) = self.velocity(body, begin_s + STEP_S * i as f64);
            pace.peak_m_s = pace.peak_m_s.max(linear.norm());
            pace.peak_rad_s = pace.peak_rad_s.max(angular.norm());
            pace.rms_m_s += linear.norm_squared() / count as f64;
            pace.rms_rad_s += angular.norm_squared() / count as f64;
            if let Some(last) = last {
                pace.peak_m_s2 = pace.peak_m_s2.max((linear - last).norm() / STEP_S);
            }
            last = Some(linear);
        }
        Pace { rms_m_s: pace.rms_m_s.sqrt(), rms_rad_s: pace.rms_rad_s.sqrt(), ..pace }
    }

    /// Velocity of a shell's origin (m/s) and angular velocity (rad/s), both in world axes.
    ///
    /// Central difference of the closed formula; its error is of the order 1e-9.
    pub fn velocity(&self, body: Body, t_s: f64) -> (Vector3<f64>, Vector3<f64>) {
        const STEP_S: f64 = 1e-4;
        let (before, after) = (self.posture(t_s - STEP_S), self.posture(t_s + STEP_S));
        let (before, after) = (before.of(body), after.of(body));
        let turn = after.rotation * before.rotation.inverse();
        (
            (after.translation.vector - before.translation.vector) / (2.0 * STEP_S),
            turn.scaled_axis() / (2.0 * STEP_S),
        )
    }

    fn moved(&self, body: Body, home: &Home, t_s: f64) -> Isometry3<f64> {
        let sum = |axis| self.sum(body, axis, t_s);
        let home = home.isometry();
        let turn = UnitQuaternion::from_euler_angles(sum(Axis::Roll), sum(Axis::Pitch), sum(Axis::Yaw));
        let shift = Vector3::new(sum(Axis::X), sum(Axis::Y), sum(Axis::Z));
        let (turn, shift) = match self.wandered(body, t_s) {
            Some(offset) => (UnitQuaternion::new(offset.turn_rad) * turn, shift + offset.shift_m),
            None => (turn, shift),
        };
        Isometry3::from_parts(Translation3::from(home.translation.vector + shift), turn * home.rotation)
    }

    fn opening_rad(&self, body: Body, t_s: f64) -> f64 {
        self.sum(body, Axis::Open, t_s) + self.wandered(body, t_s).map_or(0.0, |offset| offset.open_rad)
    }

    fn wandered(&self, body: Body, t_s: f64) -> Option<Offset> {
        self.wander.as_ref().map(|wander| wander.offset(body, t_s))
    }

    fn sum(&self, body: Body, axis: Axis, t_s: f64) -> f64 {
        self.terms
            .iter()
            .filter(|term| term.body == body && term.axis == axis)
            .map(|term| term.value(t_s))
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn term(body: Body, axis: Axis, wave: Wave, amplitude: f64) -> Term {
        Term {
            body,
            axis,
            wave,
            amplitude,
            frequency_hz: 0.37,
            phase_turns: 0.1,
            begin_s: 1.0,
            end_s: 7.0,
            ramp_s: 1.5,
        }
    }

    fn motion() -> Motion {
        let home = |xyz| Home { xyz, rpy_deg: [3.0, -5.0, 20.0] };
        let hinge = |side: f64| Hinge {
            xyz: [-0.03, 0.02 * side, -0.04],
            axis: [0.0, 0.0, side],
            palm_from_thumb: Home { xyz: [0.05, 0.06 * side, -0.045], rpy_deg: [0.0; 3] },
        };
        Motion {
            period_s: 8.0,
            torso: home([0.12, 0.0, 1.25]),
            right_palm: home([0.45, -0.2, 1.1]),
            left_palm: home([0.45, 0.2, 1.1]),
            right_thumb: hinge(1.0),
            left_thumb: hinge(-1.0),
            terms: vec![
                term(Body::RightPalm, Axis::X, Wave::Sine, 0.08),
                term(Body::RightPalm, Axis::Yaw, Wave::Square, 0.3),
                term(Body::RightThumb, Axis::Open, Wave::Rise, 0.8),
            ],
            wander: None,
        }
    }

    #[test]
    fn the_script_repeats_without_a_seam() {
        let sut = motion();
        for body in Body::ALL {
            assert_eq!(sut.posture(0.0).of(body), sut.posture(sut.period_s).of(body));
            let (linear, angular) = sut.velocity(body, sut.period_s);
            assert!(linear.norm() < 1e-12 && angular.norm() < 1e-12);
        }
    }

    #[test]
    fn the_velocity_carries_the_pose_forward() {
        let sut = motion();
        const STEP_S: f64 = 1e-3;
        for i in 0..160 {
            let t_s = 0.05 * f64::from(i);
            for body in Body::ALL {
                let (linear, angular) = sut.velocity(body, t_s + STEP_S / 2.0);
                let (now, then) = (sut.posture(t_s), sut.posture(t_s + STEP_S));
                let (now, then) = (now.of(body), then.of(body));
                let moved = then.translation.vector - now.translation.vector;
                let turned = (then.rotation * now.rotation.inverse()).scaled_axis();
                // Third order in the step: 1e-9 times the jerk, below 1 m/s^3 and 1e2 rad/s^3.
                assert!((moved - linear * STEP_S).norm() < 1e-8, "{body:?} at {t_s}");
                assert!((turned - angular * STEP_S).norm() < 1e-7, "{body:?} at {t_s}");
            }
        }
    }

    #[test]
    fn a_thumb_turns_against_its_palm_by_its_opening() {
        let sut = motion();
        let posture = sut.posture(2.5);
        let turned = posture.of(Body::RightPalm).rotation.angle_to(&posture.of(Body::RightThumb).rotation);
        let opening = sut.sum(Body::RightThumb, Axis::Open, 2.5);
        assert!(opening > 0.1 && (turned - opening).abs() < 1e-9, "{turned} for {opening}");
    }
}
