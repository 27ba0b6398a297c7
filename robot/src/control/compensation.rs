//! What the model does not know about the joints, learned while the robot moves.
//!
//! Masses are wrong by some per cent, joints rub, servos have no integral part: a joint law that is only
//! proportional leaves an error that the load decides. Two numbers for each joint take it away:
//!
//! ```text
//! q_cmd = q̄ + ψ + t_lead dq̄      dψ/dt = k_ψ (q̄ - q)             what stays whichever way the joint moves
//! τ_cmd = τ̄ + f s(dq̄)            df/dt = k_f (q̄ - q) s(dq̄)       what turns round with the motion: friction
//! ```
//! with s(v) = tanh(v / v_s), and t_lead the time until the command acts. Both laws are the gradient law of
//! Slotine and Li, "On the adaptive control of robot manipulators", International Journal of Robotics
//! Research 6 (1987), for the regressors 1 and s. s takes the commanded velocity, which has no noise, so that
//! the compensation of friction cannot chatter; on joints without friction f goes to zero.
//!
//! q̄ - q is the step of the whole-body controller's hierarchy: the legs that stand are only asked for what
//! their contacts allow, and a joint at an end of its range learns nothing from what it cannot reach.

use serde::Deserialize;

use crate::{
    joints::{JOINTS, JointVector, Leg},
    model::Model,
    plant::JointCommand,
    wbc::ContactSet,
};

/// How fast and how far one kind of joint learns.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LearningSettings {
    /// k_ψ of a joint that carries no foot's load, 1/s.
    pub free_rate: f64,
    /// k_ψ of a leg that stands, 1/s; without effect on arms.
    pub standing_rate: f64,
    /// Greatest ψ, rad.
    pub max_offset_rad: f64,
    /// k_f, N m/(rad s).
    pub friction_rate: f64,
    /// Greatest f, N m.
    pub max_friction_nm: f64,
}

/// `[compensation]` of `control.toml`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CompensationSettings {
    /// t_lead: from the sample to the middle of the time in which its command acts, s.
    pub lead_s: f64,
    /// v_s: friction is compensated fully well above this speed, rad/s.
    pub friction_speed_rad_s: f64,
    /// Greatest q̄ - q that is learned from, rad.
    pub max_error_rad: f64,
    /// Hips, thighs, calves.
    pub leg: LearningSettings,
    /// Joints of the arms.
    pub arm: LearningSettings,
}

impl Default for CompensationSettings {
    fn default() -> Self {
        Self {
            lead_s: 0.00325,
            friction_speed_rad_s: 0.015,
            max_error_rad: 0.02,
            leg: LearningSettings {
                free_rate: 5.0,
                standing_rate: 3.0,
                max_offset_rad: 0.08,
                friction_rate: 200.0,
                max_friction_nm: 0.5,
            },
            arm: LearningSettings {
                free_rate: 10.0,
                standing_rate: 0.0,
                max_offset_rad: 0.08,
                friction_rate: 40.0,
                max_friction_nm: 0.08,
            },
        }
    }
}

/// ψ and f of every joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Compensation {
    settings: CompensationSettings,
    /// ψ, rad.
    offset: JointVector,
    /// f, N m; at least 0.
    friction: JointVector,
    /// Share of the load of each foot in the last step.
    share: [f64; 4],
    /// Whether the legs' offsets grow.
    legs_learn: bool,
}

impl Compensation {
    /// Knows nothing yet.
    pub fn new(settings: CompensationSettings) -> Self {
        let (offset, friction) = (JointVector::zeros(), JointVector::zeros());
        Self { settings, offset, friction, share: [0.0; 4], legs_learn: true }
    }

    /// Forgets the offsets, which belong to a load and a posture; friction is the joint's own.
    pub fn restart(&mut self) {
        self.offset.fill(0.0);
        self.share = [0.0; 4];
    }

    /// Whether the legs' offsets grow. They must not while a foot seeks the ground: one that touches and does not feel it
    /// would press harder and harder. A leg that walks has no load for long enough.
    pub fn set_legs_learn(&mut self, learn: bool) {
        self.legs_learn = learn;
    }

    /// Learns from the step q̄ - q, and adds to a command for q̄ what was learned.
    pub fn apply(
        &mut self,
        model: &Model,
        step: &JointVector,
        contacts: &ContactSet,
        dt_s: f64,
        command: &mut JointCommand,
    ) {
        self.unload(contacts);
        for joint in 0..JOINTS {
            let (rate, of) = self.rates(joint, contacts);
            let cap = self.settings.max_error_rad;
            let error = step[joint].clamp(-cap, cap) * dt_s;
            let direction = (command.velocity[joint] / self.settings.friction_speed_rad_s).tanh();

            let rate = if self.legs_learn || joint / 3 >= Leg::ALL.len() { rate } else { 0.0 };
            let offset = self.offset[joint] + rate * error;
            self.offset[joint] = offset.clamp(-of.max_offset_rad, of.max_offset_rad);
            let friction = self.friction[joint] + of.friction_rate * error * direction;
            self.friction[joint] = friction.clamp(0.0, of.max_friction_nm);

            let ahead = self.offset[joint] + command.velocity[joint] * self.settings.lead_s;
            let wanted = command.position[joint] + ahead;
            command.position[joint] = wanted.max(model.lower[joint]).min(model.upper[joint]);
            let most = model.max_torque[joint];
            let torque = command.torque[joint] + self.friction[joint] * direction;
            command.torque[joint] = torque.clamp(-most, most);
        }
    }

    /// A foot that gives its load away gives away the offsets that belong to it, in the same proportion.
    fn unload(&mut self, contacts: &ContactSet) {
        for leg in Leg::ALL {
            let (now, before) = (contacts.share(leg), &mut self.share[leg.index()]);
            if now < *before {
                self.offset.fixed_rows_mut::<3>(leg.first_joint()).scale_mut(now / *before);
            }
            *before = now;
        }
    }

    fn rates(&self, joint: usize, contacts: &ContactSet) -> (f64, LearningSettings) {
        match Leg::ALL.get(joint / 3) {
            Some(leg) if contacts.contains(*leg) => (self.settings.leg.standing_rate, self.settings.leg),
            Some(_) => (self.settings.leg.free_rate, self.settings.leg),
            None => (self.settings.arm.free_rate, self.settings.arm),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::test_model;

    const DT_S: f64 = 0.0025;
    const CALF: usize = 2;

    fn command(velocity: f64) -> JointCommand {
        let mut command = JointCommand::damping();
        command.position = JointVector::from_element(-1.0);
        command.velocity.fill(velocity);
        command
    }

    /// A calf on which nothing acts but Coulomb friction and the joint law, without inertia: it stands still
    /// until the wish exceeds the friction, and then keeps so far behind. Returns the last error.
    fn drag(sut: &mut Compensation, friction_nm: f64, seconds: f64) -> f64 {
        const KP: f64 = 60.0;
        let (model, air) = (test_model(), ContactSet::STANCE.with_share(Leg::FrontRight, 0.0));
        let (mut angle, mut error) = (-1.5, 0.0_f64);
        for tick in 0..(seconds / DT_S) as usize {
            let t = tick as f64 * DT_S;
            let (wanted, speed) = (-1.5 + 0.1 * (1.0 - (2.0 * t).cos()), 0.2 * (2.0 * t).sin());
            error = wanted - angle;
            let mut step = JointVector::zeros();
            step[CALF] = error;
            let mut to_joint = command(speed);
            to_joint.position[CALF] = wanted;
            sut.apply(&model, &step, &air, DT_S, &mut to_joint);
            let pull = to_joint.torque[CALF] + KP * (to_joint.position[CALF] - angle);
            angle += (pull.abs() - friction_nm).max(0.0) * pull.signum() / KP;
        }
        error
    }

    #[test]
    fn friction_is_learned_and_no_friction_is_not() {
        let settings = CompensationSettings { lead_s: 0.0, ..CompensationSettings::default() };
        let mut sut = Compensation::new(settings);
        drag(&mut sut, 0.2, 20.0);
        assert!((sut.friction[CALF] - 0.2).abs() < 0.03, "{}", sut.friction[CALF]);
        drag(&mut sut, 0.0, 20.0);
        assert!(sut.friction[CALF] < 0.02, "{}", sut.friction[CALF]);
    }

    #[test]
    fn a_lasting_error_is_taken_away_within_bounds() {
        let (model, mut sut) = (test_model(), Compensation::new(CompensationSettings::default()));
        let step = JointVector::from_element(0.01);
        let mut last = command(0.0);
        for _ in 0..40_000 {
            last = command(0.0);
            sut.apply(&model, &step, &ContactSet::STANCE, DT_S, &mut last);
        }
        for joint in 0..JOINTS {
            let of = if joint < 12 { sut.settings.leg } else { sut.settings.arm };
            assert!((sut.offset[joint] - of.max_offset_rad).abs() < 1e-12);
            assert!((model.lower[joint]..=model.upper[joint]).contains(&last.position[joint]));
        }
    }

    #[test]
    fn a_foot_in_the_air_has_no_offset_of_its_load() {
        let (model, mut sut) = (test_model(), Compensation::new(CompensationSettings::default()));
        let mut contacts = ContactSet::STANCE;
        for _ in 0..400 {
            sut.apply(&model, &JointVector::from_element(0.01), &contacts, DT_S, &mut command(0.0));
        }
        let loaded = sut.offset[CALF];
        for share in [0.8, 0.5, 0.2, 0.0] {
            contacts = contacts.with_share(Leg::FrontRight, share);
            sut.apply(&model, &JointVector::zeros(), &contacts, DT_S, &mut command(0.0));
            assert!((sut.offset[CALF] - share * loaded).abs() < 1e-12);
        }
    }
}
