//! `servo setup`: a new servo gets its id, speed and settings.
//!
//! One servo at a time: two with the same id (all come with id 1) would both take what is written.

use std::{thread, time::Duration};

use anyhow::{bail, ensure};

use super::{Person, scan::everyone};
use crate::servo::{
    Bus, Found, Line, Place, ServoError, ServoSettings,
    registers::{self as reg, AnyRegister, CURRENT_STEP_A, baud_code, kept_settings},
    wire::HardwareError,
};

/// A servo needs so long to keep a register and to change its speed.
const SETTLE: Duration = Duration::from_millis(50);

/// Sets up the only servo on the line for a place, after the person has agreed.
pub fn set_up<L: Line>(
    bus: &mut Bus<L>,
    place: Place,
    settings: &ServoSettings,
    person: &mut dyn Person,
) -> anyhow::Result<()> {
    let wanted = settings.id(place);
    if !person
        .has_done(&format!("{place}: connect this servo to the adapter, no other, and switch its power on."))
    {
        bail!("ended before {place}");
    }
    let found = everyone(bus)?;
    let [(Found { id, model, .. }, baud)] = found[..] else {
        let names: Vec<String> =
            found.iter().map(|(found, baud)| format!("id {} at {baud} baud", found.id)).collect();
        bail!(
            "{} servos answer ({}), one is needed: connect the servo of {place} alone; if it is alone and does not \
             answer, look at its power and cable",
            found.len(),
            names.join(", ")
        );
    };
    ensure!(model == reg::MODEL, "this servo is of model {model}, XC330-T288-T ({}) is needed", reg::MODEL);
    bus.set_baud(baud)?;
    let error = HardwareError(bus.read_register(id, reg::HARDWARE_ERROR)? as u8);
    if !error.is_none() {
        return Err(ServoError::Hardware { id, place, error }.into());
    }
    let changes = changes(bus, id, place, settings)?;
    if changes.is_empty() && id == wanted && baud == settings.baud {
        person.tell(&format!("{place}: servo {id} is set up already."));
        return Ok(());
    }
    person.tell(&format!("{place}: servo {id} at {baud} baud gets id {wanted}, {} baud", settings.baud));
    for (register, from, to) in &changes {
        person.tell(&format!("  {}: {from} becomes {to}", register.name));
    }
    if !person.agrees("Write this into the servo?") {
        bail!("nothing was written for {place}");
    }
    bus.write(id, reg::TORQUE_ENABLE, 0)?;
    for (register, _, to) in &changes {
        bus.write_any(id, *register, *to)?;
        thread::sleep(SETTLE);
    }
    move_to(bus, id, wanted, settings)?;
    let left = self::changes(bus, wanted, place, settings)?;
    if let Some((register, found, expected)) = left.first() {
        return Err(ServoError::Setup {
            id: wanted,
            place,
            register: register.name,
            found: *found,
            expected: *expected,
        }
        .into());
    }
    person.tell(&format!("{place}: servo {wanted} is set up. Write `{place}` on it."));
    Ok(())
}

/// Kept registers that hold something else than they must: the register, what it holds, what it must hold.
fn changes<L: Line>(
    bus: &mut Bus<L>,
    id: u8,
    place: Place,
    settings: &ServoSettings,
) -> Result<Vec<(AnyRegister, i64, i64)>, ServoError> {
    let kept = bus.read(id, reg::KEPT, "settings")?.data;
    let needed = (settings.current_a(place) / CURRENT_STEP_A).round() as i64;
    let permitted = AnyRegister::from(reg::CURRENT_LIMIT).value(&kept);
    let too_low = (permitted < needed).then_some((reg::CURRENT_LIMIT.into(), permitted, needed));
    let different = kept_settings()
        .into_iter()
        .map(|(register, expected)| (register, register.value(&kept), expected))
        .filter(|(_, found, expected)| found != expected);
    Ok(different.chain(too_low).collect())
}

/// Changes id and speed, and makes sure that the servo answers with both. Whether it answers these two writes with the
/// old or the new ones is not documented, so silence is no failure.
fn move_to<L: Line>(
    bus: &mut Bus<L>,
    id: u8,
    wanted: u8,
    settings: &ServoSettings,
) -> Result<(), ServoError> {
    let code = baud_code(settings.baud).unwrap_or_default();
    let may_be_silent = |outcome| match outcome {
        Err(ServoError::Silent { .. }) => Ok(()),
        other => other,
    };
    may_be_silent(bus.write(id, reg::ID, wanted.into()))?;
    thread::sleep(SETTLE);
    may_be_silent(bus.write(wanted, reg::BAUD_RATE, code.into()))?;
    thread::sleep(SETTLE);
    bus.set_baud(settings.baud)?;
    bus.ping(wanted).map(|_| ())
}
