//! All servos on an open line: what one cycle does with them.
//!
//! ```text
//! goals out (sync write) ─► angles in (sync read) ─► one errand: a suspect, a missing one, or somebody's health
//! ```
//! A silent servo costs the others nothing but waiting: after some lost answers it is asked alone, and if it is still
//! silent the others go on without it, for in a sync read those behind a silent one may be silent too.

use locoman_protocol::clock::monotonic_ns;

use super::{
    LineCounts, ReadKind, ServoCommand, ServoError, ServoSettings, Zeros,
    bus::Bus,
    line::Line,
    member::Member,
    place::{Place, SERVOS},
    registers::{self as reg, VOLTAGE_STEP_V},
    wire::{HardwareError, Status, timing},
};

/// A missing servo is looked for in each so many cycles.
const LOOK_EVERY: u64 = 20;

/// Servos on a line.
pub struct Station<L> {
    bus: Bus<L>,
    pub members: [Member; SERVOS],
    fast: bool,
    /// Turn of the missing servos, and of the healthy ones.
    look: usize,
    health: usize,
}

impl<L: Line> Station<L> {
    /// Nobody is there yet: [`Self::adopt_all`], or one after another as they are found.
    pub fn new(bus: Bus<L>, settings: &ServoSettings, zeros: &Zeros) -> Self {
        let members = Place::ALL.map(|place| Member::new(place, zeros.of(place), settings));
        Self { bus, members, fast: false, look: 0, health: 0 }
    }

    /// Brings all servos to their settings; those that are silent are named together.
    pub fn adopt_all(&mut self, settings: &ServoSettings) -> Result<(), ServoError> {
        let mut missing = Vec::new();
        for member in &mut self.members {
            match patiently(|| self.bus.ping(member.id)) {
                Err(ServoError::Silent { .. }) => missing.push((member.place, member.id)),
                found => {
                    found?;
                }
            }
        }
        if !missing.is_empty() {
            return Err(ServoError::Missing { missing });
        }
        for member in &mut self.members {
            patiently(|| member.adopt(&mut self.bus, settings))?;
        }
        self.choose_read(settings)?;
        for index in 0..SERVOS {
            patiently(|| self.ask_supply(index))?;
        }
        Ok(())
    }

    /// Whether all servos answer in one packet.
    pub fn reads_fast(&self) -> bool {
        self.fast
    }

    /// What a full cycle takes of the line, ns.
    pub fn cycle_ns(&self) -> u64 {
        let read = usize::from(reg::MOTION.length);
        timing::bytes_ns(timing::cycle_bytes(SERVOS, 4, read, self.fast), self.bus.baud())
    }

    /// One cycle; `elapsed_s` since the last. Fails only with the line.
    pub fn cycle(
        &mut self,
        commands: &[ServoCommand; SERVOS],
        settings: &ServoSettings,
        elapsed_s: f64,
        counts: &mut LineCounts,
    ) -> Result<(), ServoError> {
        self.write_goals(commands, settings, elapsed_s)?;
        self.read_motion(settings, counts)?;
        match self.errand(settings, counts) {
            Err(ServoError::Line(error)) => return Err(ServoError::Line(error)),
            // One that is looked for is expected to be silent.
            Err(ServoError::Silent { id, .. }) if self.present().any(|member| member.id == id) => {
                counts.lost += 1;
            }
            // Tried again when its turn comes.
            _ => {}
        }
        counts.cycles += 1;
        counts.damaged = self.bus.damaged();
        Ok(())
    }

    /// Lets all joints go and switches the watchdogs off. What does not answer is left as it is.
    pub fn release(&mut self) {
        for member in self.members.iter_mut().filter(|member| member.state.present) {
            let switched_off = self
                .bus
                .write(member.id, reg::TORQUE_ENABLE, 0)
                .and_then(|()| self.bus.write(member.id, reg::BUS_WATCHDOG, 0));
            if let Err(error) = switched_off {
                tracing::warn!("{} was not let go: {error}", member.place);
            }
        }
    }

    fn write_goals(
        &mut self,
        commands: &[ServoCommand; SERVOS],
        settings: &ServoSettings,
        elapsed_s: f64,
    ) -> Result<(), ServoError> {
        let mut goals = Vec::with_capacity(SERVOS);
        let mut currents = Vec::new();
        for (member, command) in
            self.members.iter_mut().zip(commands).filter(|(member, _)| member.state.present)
        {
            goals.push((member.id, member.goal(command, settings, elapsed_s).to_le_bytes()));
            currents
                .extend(member.current_to_tell(settings).map(|current| (member.id, current.to_le_bytes())));
        }
        if goals.is_empty() {
            return Ok(());
        }
        self.bus.sync_write(reg::GOAL_POSITION.address, &goals)?;
        if currents.is_empty() { Ok(()) } else { self.bus.sync_write(reg::GOAL_CURRENT.address, &currents) }
    }

    fn read_motion(&mut self, settings: &ServoSettings, counts: &mut LineCounts) -> Result<(), ServoError> {
        let ids: Vec<u8> = self.present().map(|member| member.id).collect();
        if ids.is_empty() {
            return Ok(());
        }
        let statuses = self.bus.sync_read(reg::MOTION, &ids, self.fast)?;
        let now_ns = monotonic_ns();
        for member in self.members.iter_mut().filter(|member| member.state.present) {
            match statuses.iter().find(|status| status.id == member.id) {
                Some(status) => member.take_motion(status, settings, now_ns),
                None => {
                    member.lose();
                    counts.lost += 1;
                }
            }
        }
        Ok(())
    }

    fn errand(&mut self, settings: &ServoSettings, counts: &mut LineCounts) -> Result<(), ServoError> {
        let suspect = |member: &Member| member.state.present && member.lost_in_row >= settings.missing_after;
        if let Some(index) = self.members.iter().position(suspect) {
            return self.question(index, settings);
        }
        if let Some(index) = self.members.iter().position(|member| member.state.present && member.alert) {
            return self.ask_condition(index, settings, counts);
        }
        if counts.cycles.is_multiple_of(LOOK_EVERY)
            && let Some(index) = next(&mut self.look, |index| !self.members[index].state.present)
        {
            return self.look_for(index, settings, counts);
        }
        if counts.cycles.is_multiple_of(settings.health_every.into())
            && let Some(index) = next(&mut self.health, |index| self.members[index % SERVOS].state.present)
        {
            return self.ask_condition(index, settings, counts).and_then(|()| self.watch(index, settings));
        }
        Ok(())
    }

    /// Asks one whose answers have been lost alone.
    fn question(&mut self, index: usize, settings: &ServoSettings) -> Result<(), ServoError> {
        let answered = self.bus.ping(self.members[index].id);
        let member = &mut self.members[index];
        match answered {
            Err(ServoError::Silent { .. }) => {
                member.state.present = false;
                let (place, id, lost) = (member.place, member.id, member.lost_in_row);
                tracing::error!(
                    "servo {id} ({place}) is missing: {lost} answers in a row and a ping were lost; the others go on without it"
                );
                self.choose_read(settings)
            }
            _ => {
                member.lost_in_row = 0;
                answered.map(|_| ())
            }
        }
    }

    /// Looks for one that is missing, and sets it up anew if it is there.
    fn look_for(
        &mut self,
        index: usize,
        settings: &ServoSettings,
        counts: &mut LineCounts,
    ) -> Result<(), ServoError> {
        self.bus.ping(self.members[index].id)?;
        self.adopt_again(index, settings, counts)
    }

    fn adopt_again(
        &mut self,
        index: usize,
        settings: &ServoSettings,
        counts: &mut LineCounts,
    ) -> Result<(), ServoError> {
        let member = &mut self.members[index];
        let (place, id, known) = (member.place, member.id, member.state.error);
        member.state.present = false;
        let adopted = member.adopt(&mut self.bus, settings);
        match &adopted {
            Ok(()) => {
                counts.adopted += 1;
                tracing::info!("servo {id} ({place}) is back and set up anew");
                self.choose_read(settings)?;
            }
            Err(ServoError::Hardware { error, .. }) if *error == known => {}
            Err(error) => tracing::warn!("{place} cannot be taken back: {error}"),
        }
        adopted
    }

    /// Reads whether a servo is as it was set up, and what is wrong with it if it is not.
    fn ask_condition(
        &mut self,
        index: usize,
        settings: &ServoSettings,
        counts: &mut LineCounts,
    ) -> Result<(), ServoError> {
        let member = &mut self.members[index];
        let (place, id) = (member.place, member.id);
        let status = self.bus.read(id, reg::CONDITION, "condition")?;
        let first = reg::CONDITION.address;
        let error = HardwareError(reg::HARDWARE_ERROR.bytes_in(&status.data, first)[0]);
        if error != member.state.error && !error.is_none() {
            tracing::error!("servo {id} ({place}) reports: {error}");
        }
        member.state.error = error;
        member.alert = false;
        let torque_on = reg::TORQUE_ENABLE.bytes_in(&status.data, first) == [1];
        let tripped = reg::BUS_WATCHDOG.bytes_in(&status.data, first) == [reg::WATCHDOG_TRIPPED];
        if error.is_none() && (tripped || !torque_on) {
            let why =
                if tripped { "its bus watchdog has tripped" } else { "it has been switched off and on" };
            tracing::warn!("servo {id} ({place}): {why}");
            return self.adopt_again(index, settings, counts);
        }
        Ok(())
    }

    fn ask_supply(&mut self, index: usize) -> Result<(), ServoError> {
        let member = &mut self.members[index];
        let Status { data, .. } = self.bus.read(member.id, reg::SUPPLY, "supply")?;
        let first = reg::SUPPLY.address;
        let voltage = u16::from_le_bytes(reg::PRESENT_VOLTAGE.bytes_in(&data, first));
        member.state.voltage_v = f64::from(voltage) * VOLTAGE_STEP_V;
        member.state.temperature_c = f64::from(reg::PRESENT_TEMPERATURE.bytes_in(&data, first)[0]);
        Ok(())
    }

    /// Reads temperature and voltage, and tells when they leave what is good.
    fn watch(&mut self, index: usize, settings: &ServoSettings) -> Result<(), ServoError> {
        let before = self.members[index].state;
        self.ask_supply(index)?;
        let Member { place, id, state, .. } = &self.members[index];
        let watch = &settings.watch;
        if state.temperature_c >= watch.warm_c && before.temperature_c < watch.warm_c {
            tracing::warn!(
                "servo {id} ({place}) is at {:.0} °C; it switches itself off at 70 °C",
                state.temperature_c
            );
        }
        let good = |volts: f64| (watch.min_voltage_v..=watch.max_voltage_v).contains(&volts);
        if !good(state.voltage_v) && good(before.voltage_v) {
            tracing::warn!("servo {id} ({place}) has {:.1} V; look at the arms' supply", state.voltage_v);
        }
        Ok(())
    }

    fn choose_read(&mut self, settings: &ServoSettings) -> Result<(), ServoError> {
        let old = self.present().find(|member| member.firmware < reg::FAST_READ_FIRMWARE);
        self.fast = match (settings.read, old) {
            (ReadKind::Classic, _) | (ReadKind::Auto, Some(_)) => false,
            (ReadKind::Auto | ReadKind::Fast, None) => true,
            (ReadKind::Fast, Some(Member { id, place, firmware, .. })) => {
                return Err(ServoError::Firmware { id: *id, place: *place, firmware: *firmware });
            }
        };
        Ok(())
    }

    fn present(&self) -> impl Iterator<Item = &Member> {
        self.members.iter().filter(|member| member.state.present)
    }
}

/// The next index after the cursor that is wanted; the cursor goes there.
fn next(cursor: &mut usize, wanted: impl Fn(usize) -> bool) -> Option<usize> {
    let found = (1..=SERVOS).map(|step| (*cursor + step) % SERVOS).find(|index| wanted(*index))?;
    *cursor = found;
    Some(found)
}

/// Tries a few times before it believes a silence: at the start a lost answer must not look like a missing servo.
fn patiently<T>(mut exchange: impl FnMut() -> Result<T, ServoError>) -> Result<T, ServoError> {
    /// Times altogether.
    const TRIES: usize = 4;
    for _ in 1..TRIES {
        match exchange() {
            Err(ServoError::Silent { .. }) => {}
            outcome => return outcome,
        }
    }
    exchange()
}
