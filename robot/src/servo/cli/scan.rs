//! `servo scan`: who is on the line, at which speed, and how they are.

use super::Person;
use crate::servo::{
    Bus, Found, Line, Place, SERVOS, ServoError, ServoSettings, latency_timer_ms,
    registers::{self as reg, BAUD_RATES, VOLTAGE_STEP_V, kept_settings},
    wire::{HardwareError, timing},
};

/// Looks at every speed and tells what is there, what is missing and what is not set up.
pub fn scan<L: Line>(
    bus: &mut Bus<L>,
    settings: &ServoSettings,
    port: &str,
    person: &mut dyn Person,
) -> anyhow::Result<()> {
    person.tell(&format!("{port}:"));
    let mut there = [false; SERVOS];
    for (found, baud) in everyone(bus)? {
        let place = Place::ALL.into_iter().find(|place| settings.id(*place) == found.id);
        let (line, good) = describe(bus, settings, found, baud, place);
        person.tell(&line);
        if let Some(place) = place.filter(|_| good) {
            there[place.index()] = true;
        }
    }
    bus.set_baud(settings.baud)?;
    for place in Place::ALL.into_iter().filter(|place| !there[place.index()]) {
        person.tell(&format!("  missing or not set up: {place} (id {})", settings.id(place)));
    }
    if let Some(ms) = latency_timer_ms(port).filter(|ms| *ms > 1) {
        person.tell(&format!(
            "The adapter waits {ms} ms before it hands bytes over, 1 is needed: install packaging/udev/60-locoman.rules"
        ));
    }
    let cycle =
        |fast| timing::bytes_ns(timing::cycle_bytes(SERVOS, 4, 10, fast), settings.baud) as f64 * 1e-6;
    person.tell(&format!(
        "A cycle (write all 8, read all 8) takes {:.2} ms of the line at {} baud, {:.2} ms with the fast read; \
         there are {:.2} ms",
        cycle(false),
        settings.baud,
        cycle(true),
        settings.period().as_secs_f64() * 1e3,
    ));
    Ok(())
}

/// Every servo that answers at any speed, and the speed. The line is left at the last one.
pub fn everyone<L: Line>(bus: &mut Bus<L>) -> Result<Vec<(Found, u32)>, ServoError> {
    let mut all = Vec::new();
    for (_, baud) in BAUD_RATES {
        bus.set_baud(baud)?;
        all.extend(bus.scan()?.into_iter().map(|found| (found, baud)));
    }
    Ok(all)
}

/// A line about one servo, and whether it is as it must be.
fn describe<L: Line>(
    bus: &mut Bus<L>,
    settings: &ServoSettings,
    found: Found,
    baud: u32,
    place: Option<Place>,
) -> (String, bool) {
    let Found { id, model, firmware } = found;
    let name = place.map_or_else(|| "no place".to_owned(), |place| place.to_string());
    let head = format!("  id {id:3}  {name:13}  {baud:7} baud  model {model}, firmware {firmware}");
    if model != reg::MODEL {
        return (format!("{head}: not an XC330-T288-T ({})", reg::MODEL), false);
    }
    match examine(bus, id, baud) {
        Err(error) => (format!("{head}: {error}"), false),
        Ok((health, flaws)) => {
            let wrong_speed = (baud != settings.baud)
                .then(|| format!("speed {baud} in place of {}, run `servo setup`", settings.baud));
            let flaws: Vec<String> = flaws.into_iter().chain(wrong_speed).collect();
            let good = flaws.is_empty();
            let verdict = if good { "ready".to_owned() } else { flaws.join("; ") };
            (format!("{head}, {health}: {verdict}"), good)
        }
    }
}

/// Voltage, temperature and position in words, and what is wrong.
fn examine<L: Line>(bus: &mut Bus<L>, id: u8, baud: u32) -> Result<(String, Vec<String>), ServoError> {
    bus.set_baud(baud)?;
    let volts = f64::from(bus.read_register(id, reg::PRESENT_VOLTAGE)?) * VOLTAGE_STEP_V;
    let degrees = bus.read_register(id, reg::PRESENT_TEMPERATURE)?;
    let count = bus.read_register(id, reg::PRESENT_POSITION)?.cast_signed();
    let error = HardwareError(bus.read_register(id, reg::HARDWARE_ERROR)? as u8);
    let kept = bus.read(id, reg::KEPT, "settings")?.data;
    let mut flaws: Vec<String> = kept_settings()
        .into_iter()
        .filter(|(register, expected)| register.value(&kept) != *expected)
        .map(|(register, expected)| {
            format!("{} {} in place of {expected}, run `servo setup`", register.name, register.value(&kept))
        })
        .collect();
    if !error.is_none() {
        flaws.push(error.to_string());
    }
    Ok((format!("{volts:.1} V, {degrees} °C, count {count}"), flaws))
}
