//! Both grippers of a robot that sits upright, as the operator moves them, inside every limit.

use nalgebra::{Isometry3, Vector3};

use super::{scene::Scene, setpoint::Setpoint};
use crate::{
    collision::Ground,
    commander::{Command, DrivenBody, Limits, PoseReference, Reach, SampleClock, rebased_point},
    joints::Side,
    kinematics::torso_from_frame,
    model::Frame,
    trajectory::Sample,
};

/// What is driven while the robot sits upright. Its torso stays.
#[derive(Debug, Clone)]
pub struct Bimanual {
    limits: Limits,
    /// Right, left.
    hands: [Hand; 2],
}

/// A gripper that is driven.
#[derive(Debug, Clone)]
struct Hand {
    side: Side,
    gripper: DrivenBody,
    start: Vector3<f64>,
    reach: Reach,
}

impl Bimanual {
    /// From where the desired joints hold the grippers.
    pub fn begin(limits: &Limits, setpoint: &mut Setpoint, scene: &Scene<'_>) -> Self {
        let hands = Side::ALL.map(|side| {
            let torso_from_gripper = torso_from_frame(scene.model, scene.desired, Frame::Gripper(side));
            let gripper = PoseReference::hold(&(scene.state.world_from_torso * torso_from_gripper));
            Hand {
                side,
                gripper: DrivenBody::new(gripper, limits.follower_rad_s, limits.gripper_rate),
                start: gripper.point.position,
                reach: Reach::new(side, scene.desired, limits.upright_reach),
            }
        });
        setpoint.grasp_upright(hands.each_ref().map(|hand| *hand.gripper.reference()), [false; 2]);
        Self { limits: *limits, hands }
    }

    /// Marks the beginning of an engagement.
    pub fn engage(&mut self) {
        self.hands.iter_mut().for_each(|hand| hand.gripper.engage());
    }

    /// Nobody says at present that a limb may move on by itself, or somebody does.
    pub fn pause(&mut self, paused: bool) {
        self.hands.iter_mut().for_each(|hand| hand.reach.pause(paused));
    }

    /// Lets go: comes to rest.
    pub fn release(&mut self) {
        for hand in &mut self.hands {
            hand.gripper.release();
            hand.reach.stay();
        }
    }

    /// A fresh sample of where the grippers are to be.
    pub fn displace(&mut self, command: &Command, clock: &SampleClock, now_ns: u64) {
        for hand in &mut self.hands {
            hand.gripper.displace(command.palms[hand.side.index()].as_ref(), clock, now_ns);
        }
    }

    /// One step: within their boxes, within reach. On a detour to another posture foot and arm are led.
    pub fn step(&mut self, played: Option<&Sample>, scene: &Scene<'_>, setpoint: &mut Setpoint) {
        // Where it really is: on its shanks it cannot go everywhere, and may be off its reference by millimetres for good.
        let world_from_torso = scene.state.world_from_torso;
        let ground = Ground::at(scene.ground(&setpoint.contacts), &world_from_torso);
        let range = self.limits.bimanual;
        for Hand { side, gripper, start, reach } in &mut self.hands {
            let along = played.map(|sample| &sample.limbs[side.index()]);
            gripper.advance_by(along, scene.now_ns, scene.dt_s, |wanted: &Isometry3<f64>| {
                let position = range.clamp(&wanted.translation.vector, start, *side);
                let target =
                    world_from_torso.inv_mul(&Isometry3::from_parts(position.into(), wanted.rotation));
                world_from_torso * reach.nearest(scene.model, scene.desired, &ground, &target, scene.dt_s)
            });
        }
        let detours = self.hands.each_ref().map(|hand| hand.reach.detour(scene.model));
        for (hand, detour) in self.hands.iter_mut().zip(&detours) {
            let Some(motion) = detour else { continue };
            hand.gripper.carry(motion.gripper.rebased(&world_from_torso));
            setpoint.lead_foot(hand.side.leg(), rebased_point(&motion.foot, &world_from_torso));
            setpoint.hold_arm(hand.side, motion.arm);
        }
        let grippers = self.hands.each_ref().map(|hand| *hand.gripper.reference());
        setpoint.grasp_upright(grippers, detours.map(|detour| detour.is_some()));
    }
}
