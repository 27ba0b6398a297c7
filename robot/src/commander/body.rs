//! One body (the torso or a gripper) driven by an operator's displacement.
//!
//! On engagement the body's own target is its anchor; from then on the target is displacement ∘ anchor:
//! p = p_anchor + (p_d - p_d0), R = R_d R_d0⁻¹ R_anchor, with d the displacement now and d0 that at the
//! anchoring (identity, unless the robot changed modes while the operator held on). So anchoring never moves
//! a target, whatever the pose.

use nalgebra::{Isometry3, Translation3};

use super::{
    follower::{Lead, PoseFollower},
    limits::RateLimits,
    ramp::{Ramp, SampleClock},
    reference::PoseReference,
};

/// By how much the limits may move a target that counts as inside them: more than what finding the nearest
/// pose within reach leaves.
const TOLERANCE_M: f64 = 5e-4;
/// The same for its orientation, rad.
const TOLERANCE_RAD: f64 = 3e-3;

/// A driven body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrivenBody {
    /// Where it is to go, whether or not it may.
    wanted: Isometry3<f64>,
    /// How it would go there if it were free: as fast as it may be, so that where limits deflect it, the target
    /// does not run away from the body, which would then cut the corners.
    free: PoseFollower,
    /// Where the follower goes; inside the limits.
    target: Isometry3<f64>,
    follower: PoseFollower,
    drive: Option<Drive>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Drive {
    anchor: Isometry3<f64>,
    first: Isometry3<f64>,
    ramp: Ramp,
}

impl DrivenBody {
    /// Takes over a moving reference, and brings it to rest.
    pub fn new(reference: PoseReference, omega: f64, limits: RateLimits) -> Self {
        let follower = PoseFollower::new(reference, omega, limits);
        let stop = follower.stopping_pose();
        Self { wanted: stop, free: follower, target: stop, follower, drive: None }
    }

    /// Where it should be now.
    pub fn reference(&self) -> &PoseReference {
        self.follower.reference()
    }

    /// Where it goes.
    pub fn target(&self) -> &Isometry3<f64> {
        &self.target
    }

    /// Lets go: comes to rest as soon as it can.
    pub fn release(&mut self) {
        if self.drive.take().is_some() {
            self.free = self.follower;
            self.wanted = self.follower.stopping_pose();
            self.target = self.wanted;
        }
    }

    /// A fresh sample of the displacement, or none if the body is not tracked: it holds.
    pub fn displace(&mut self, displacement: Option<&Isometry3<f64>>, clock: &SampleClock, now_ns: u64) {
        let Some(displacement) = displacement else { return };
        match &mut self.drive {
            Some(drive) => drive.ramp.append(displacement, clock, now_ns),
            None => {
                self.drive = Some(Drive {
                    anchor: self.follower.stopping_pose(),
                    first: *displacement,
                    ramp: Ramp::at(displacement),
                });
            }
        }
    }

    /// Marks the beginning of an engagement at displacement zero: what is displaced already is to be done.
    pub fn engage(&mut self) {
        self.release();
        self.drive = Some(Drive {
            anchor: self.target,
            first: Isometry3::identity(),
            ramp: Ramp::at(&Isometry3::identity()),
        });
    }

    /// The body is brought along another way; from there it goes on.
    pub fn carry(&mut self, reference: PoseReference) {
        self.follower.place(reference);
    }

    /// One control step. `permitted` takes a wanted target to the nearest one inside the limits, which may
    /// move: a body that nobody drives gives way to them, and comes back when they do.
    pub fn advance(
        &mut self,
        now_ns: u64,
        dt_s: f64,
        permitted: impl FnMut(&Isometry3<f64>) -> Isometry3<f64>,
    ) {
        if let Some(drive) = &self.drive {
            let now = drive.ramp.at_time(now_ns);
            let translation = now.translation.vector - drive.first.translation.vector;
            let rotation = now.rotation * drive.first.rotation.inverse();
            self.wanted = Isometry3::from_parts(
                Translation3::from(drive.anchor.translation.vector + translation),
                rotation * drive.anchor.rotation,
            );
        }
        self.free.follow(&self.wanted, dt_s);
        self.follow_free(dt_s, permitted);
    }

    /// One control step along a motion that is known beforehand, the displacement since engagement: exactly, where
    /// it is not too fast, and as long as the pose at which it could be brought to rest is inside the limits.
    pub fn advance_along(
        &mut self,
        displacement: &PoseReference,
        dt_s: f64,
        permitted: impl FnMut(&Isometry3<f64>) -> Isometry3<f64>,
    ) {
        if let Some(drive) = &self.drive {
            let motion = displacement.displacing(&drive.anchor);
            self.wanted = motion.pose();
            self.free.follow_led(&self.wanted, Some(&Lead { motion, share: 1.0 }), dt_s);
        } else {
            self.free.follow(&self.wanted, dt_s);
        }
        self.follow_free(dt_s, permitted);
    }

    /// One control step along what is played, if anything is, or else as the operator moves.
    pub fn advance_by(
        &mut self,
        played: Option<&PoseReference>,
        now_ns: u64,
        dt_s: f64,
        permitted: impl FnMut(&Isometry3<f64>) -> Isometry3<f64>,
    ) {
        match played {
            Some(displacement) => self.advance_along(displacement, dt_s, permitted),
            None => self.advance(now_ns, dt_s, permitted),
        }
    }

    /// Where the limits leave the free motion alone, exactly along with it.
    fn follow_free(&mut self, dt_s: f64, mut permitted: impl FnMut(&Isometry3<f64>) -> Isometry3<f64>) {
        let stop = self.free.stopping_pose();
        self.target = permitted(&stop);
        let lead = Lead { motion: *self.free.reference(), share: share_inside(&stop, &self.target) };
        self.follower.follow_led(&self.target, Some(&lead), dt_s);
    }
}

/// How far a motion may lead: 1 while the limits leave its target alone, 0 where they move it, without a step.
fn share_inside(wanted: &Isometry3<f64>, permitted: &Isometry3<f64>) -> f64 {
    let moved = (permitted.translation.vector - wanted.translation.vector).norm();
    let turned = permitted.rotation.angle_to(&wanted.rotation);
    (2.0 - (moved / TOLERANCE_M).max(turned / TOLERANCE_RAD)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const LIMITS: RateLimits = RateLimits {
        speed_m_s: 0.5,
        acceleration_m_s2: 2.0,
        turn_rad_s: 1.5,
        turn_acceleration_rad_s2: 10.0,
    };
    const DT_S: f64 = 0.0025;
    const DT_NS: u64 = 2_500_000;

    fn pose() -> impl Strategy<Value = Isometry3<f64>> {
        (prop::array::uniform3(-1.0..1.0f64), prop::array::uniform3(-1.7..1.7f64))
            .prop_map(|(p, r)| Isometry3::new(p.into(), r.into()))
    }

    fn close(a: &Isometry3<f64>, b: &Isometry3<f64>) -> bool {
        (a.translation.vector - b.translation.vector).norm() < 1e-9 && a.rotation.angle_to(&b.rotation) < 1e-7
    }

    proptest! {
        #[test]
        fn engaging_does_not_move_the_target_whatever_the_poses(
            start in pose(), displacement in pose(), fresh: bool,
        ) {
            let mut sut = DrivenBody::new(PoseReference::hold(&start), 30.0, LIMITS);
            let clock = SampleClock::default();
            // Fresh: the operator engages now. Else: he held on while the robot changed modes.
            let at = if fresh { sut.engage(); Isometry3::identity() } else { displacement };
            sut.displace(Some(&at), &clock, 0);
            for tick in 0..40 {
                sut.advance(tick * DT_NS, DT_S, |wanted| *wanted);
                prop_assert!(close(sut.target(), &start));
                prop_assert!(close(&sut.reference().pose(), &start));
            }
        }

        #[test]
        fn the_target_comes_to_the_displacement_after_the_anchor(start in pose(), displacement in pose()) {
            let mut sut = DrivenBody::new(PoseReference::hold(&start), 30.0, LIMITS);
            let clock = SampleClock::default();
            sut.engage();
            sut.displace(Some(&displacement), &clock, 0);
            for tick in 0..2500 {
                sut.advance(tick * DT_NS, DT_S, |wanted| *wanted);
            }
            let expected = Isometry3::from_parts(
                (start.translation.vector + displacement.translation.vector).into(),
                displacement.rotation * start.rotation,
            );
            prop_assert!(close(sut.target(), &expected));
            prop_assert!(close(&sut.reference().pose(), &expected));
        }

        #[test]
        fn releasing_holds(start in pose(), displacement in pose()) {
            let mut sut = DrivenBody::new(PoseReference::hold(&start), 30.0, LIMITS);
            let clock = SampleClock::default();
            sut.engage();
            sut.displace(Some(&displacement), &clock, 0);
            for tick in 0..100 {
                sut.advance(tick * DT_NS, DT_S, |wanted| *wanted);
            }
            sut.release();
            let held = *sut.target();
            let before = sut.reference().pose();
            let braking_m = LIMITS.speed_m_s.powi(2) / LIMITS.acceleration_m_s2;
            prop_assert!((held.translation.vector - before.translation.vector).norm() < braking_m * 1.1);
            for tick in 100..500 {
                sut.advance(tick * DT_NS, DT_S, |wanted| *wanted);
            }
            prop_assert!(close(sut.target(), &held));
            prop_assert!((sut.reference().pose().translation.vector - held.translation.vector).norm() < 1e-4);
        }
    }
}
