//! What a control step takes in besides the sensors: commands, stops, and the supervisor's judgement.

use nalgebra::{UnitQuaternion, Vector3};

use super::{
    controller::{Controller, Inputs},
    snapshot::CommandTrace,
};
use crate::{
    commander::Grip,
    estimator::{tilt, tilt_angle},
    joints::Leg,
    plant::Sensors,
    supervisor::{Assessment, Flags, SensorHealth, Severity, Stop, assess},
};

impl Controller {
    /// A stop stays in force, also one of the remote control.
    pub(super) fn latch(&mut self, inputs: &Inputs) {
        let remote = if inputs.health.remote_stop { Stop::Damp } else { Stop::None };
        self.stop = self.stop.max(inputs.stop).max(remote);
    }

    /// Takes in the latest command: whether it is new, and what it means.
    pub(super) fn listen(&mut self, now_ns: u64, inputs: &Inputs) -> (bool, Option<Grip>) {
        let Some(command) = &inputs.command else { return (false, None) };
        let fresh = (command.source, command.sequence) != (self.trace.source, self.trace.sequence);
        if fresh {
            self.clock.tick(command.received_ns);
            self.trace = CommandTrace {
                source: command.source,
                sequence: command.sequence,
                capture_ns: command.capture_ns,
                received_ns: command.received_ns,
                applied_ns: now_ns,
            };
        }
        let driven = self.machine.phase().is_driven();
        let permitted = driven && self.snapshot.assessment.severity < Severity::Hold;
        (fresh, Some(self.engagement.update(command, permitted)))
    }

    pub(super) fn flags(&self, now_ns: u64, tilt_rad: f64, sensors: SensorHealth, inputs: &Inputs) -> Flags {
        Flags {
            now_ns,
            command_ns: inputs.command.as_ref().map(|command| command.received_ns),
            manipulating: self.machine.phase().is_manipulating(),
            sensors,
            tilt_rad,
            stop: self.stop,
            unloaded_ns: self.unloaded_ns,
            control_fault: self.machine.phase().is_balanced() && self.output.status.fault.is_some(),
            no_ground: self.progress.no_ground,
            health: inputs.health,
        }
    }

    /// How far the torso leans: from level, or from where it should be while it sits up, is upright and comes down.
    pub(super) fn lean(&self, sensors: &Sensors) -> f64 {
        if !self.machine.phase().is_upright() {
            return tilt_angle(&sensors.attitude);
        }
        let by_plan = self.choreography.setpoint().torso.rotation.orientation;
        let up = |torso: UnitQuaternion<f64>| torso.inverse_transform_vector(&Vector3::z());
        up(by_plan).angle(&up(tilt(&sensors.attitude)))
    }

    pub(super) fn assess(
        &mut self,
        now_ns: u64,
        sensors: &Sensors,
        health: SensorHealth,
        inputs: &Inputs,
    ) -> Assessment {
        let threshold = self.config.thresholds.foot_unloaded_n;
        let contacts = &self.choreography.setpoint().contacts;
        let floating = Leg::ALL
            .into_iter()
            .any(|leg| contacts.share(leg) >= 1.0 && sensors.foot_force[leg.index()] < threshold);
        let counts = floating && self.machine.phase().is_balanced();
        self.unloaded_ns = if counts { self.unloaded_ns + (self.dt_s * 1e9) as u64 } else { 0 };
        let flags = self.flags(now_ns, self.lean(sensors), health, inputs);
        let assessment = assess(&self.config.thresholds, &flags);
        if assessment.severity >= Severity::Disengage {
            self.engagement.end(inputs.command.as_ref());
        }
        assessment
    }
}
