//! `servo move`: one joint, slowly, to an angle.

use std::{
    thread,
    time::{Duration, Instant},
};

use anyhow::{bail, ensure};

use super::Person;
use crate::servo::{
    Bus, Line, Place, ServoError, ServoSettings, Zeros,
    member::Member,
    registers::{self as reg, CURRENT_STEP_A},
    wire::HardwareError,
};

/// Speeds that a person can still react to, rad/s.
const SPEEDS_RAD_S: [f64; 2] = [0.05, 1.0];
/// Share of the permitted current: a finger in the way is pressed, not crushed.
const EFFORT: f64 = 0.5;
/// Time of one step.
const STEP: Duration = Duration::from_millis(20);
/// Further behind its goal than this for as long as below, a joint is blocked, rad.
const BEHIND_RAD: f64 = 0.15;
/// See above.
const PATIENCE: Duration = Duration::from_millis(300);
/// As near as this it has arrived, rad: two counts of play and the load's sag.
const ARRIVED_RAD: f64 = 0.05;

/// Which joint goes where.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Going {
    /// Which.
    pub place: Place,
    /// Where to, rad.
    pub angle_rad: f64,
    /// How fast, rad/s.
    pub speed_rad_s: f64,
}

/// Moves the joint after the person has agreed, and lets it go at the end.
pub fn go<L: Line>(
    bus: &mut Bus<L>,
    going: &Going,
    settings: &ServoSettings,
    zeros: &Zeros,
    person: &mut dyn Person,
) -> anyhow::Result<()> {
    let Going { place, angle_rad, speed_rad_s } = *going;
    let [min, max] = settings.range_rad(place);
    ensure!(
        (min..=max).contains(&angle_rad),
        "{place} reaches from {min:.2} to {max:.2} rad, {angle_rad} is outside"
    );
    let [slow, fast] = SPEEDS_RAD_S;
    ensure!(
        (slow..=fast).contains(&speed_rad_s),
        "the speed must be between {slow} and {fast} rad/s, not {speed_rad_s}"
    );
    let id = settings.id(place);
    let degrees = bus.read_register(id, reg::PRESENT_TEMPERATURE)?;
    ensure!(
        f64::from(degrees) < settings.watch.warm_c,
        "{place} is at {degrees} °C: let it cool below {:.0} °C",
        settings.watch.warm_c
    );
    let mut member = Member::new(place, zeros.of(place), settings);
    member.adopt(bus, settings)?;
    let outcome = moved(bus, &mut member, going, settings, person);
    // Whatever happened, the joint is let go and its watchdog is put off.
    let released = bus.write(id, reg::TORQUE_ENABLE, 0).and_then(|()| bus.write(id, reg::BUS_WATCHDOG, 0));
    outcome?;
    Ok(released?)
}

fn moved<L: Line>(
    bus: &mut Bus<L>,
    member: &mut Member,
    going: &Going,
    settings: &ServoSettings,
    person: &mut dyn Person,
) -> anyhow::Result<()> {
    let Going { place, angle_rad, speed_rad_s } = *going;
    let id = member.id;
    let start_rad = member.state.position_rad;
    let current = EFFORT * settings.current_a(place) / CURRENT_STEP_A;
    let question = format!(
        "{place} goes from {start_rad:.2} to {angle_rad:.2} rad at {speed_rad_s} rad/s with at most {:.2} A. Hands off, \
         nothing in the way? Ctrl-C stops it",
        current * CURRENT_STEP_A
    );
    // While the person thinks, the servo hears nothing: its watchdog would trip.
    bus.write(id, reg::BUS_WATCHDOG, 0)?;
    if !person.agrees(&question) {
        bail!("{place} was not moved");
    }
    bus.write(id, reg::BUS_WATCHDOG, settings.watchdog_ms / reg::WATCHDOG_STEP_MS)?;
    bus.write(id, reg::GOAL_CURRENT, current.round() as u32)?;
    let way = angle_rad - start_rad;
    let duration = Duration::from_secs_f64(way.abs() / speed_rad_s);
    let started = Instant::now();
    let mut in_time = Instant::now();
    loop {
        let elapsed = started.elapsed().min(duration);
        let goal_rad = if elapsed == duration {
            angle_rad
        } else {
            start_rad + way * elapsed.as_secs_f64() / duration.as_secs_f64()
        };
        bus.write(id, reg::GOAL_POSITION, member.count(goal_rad).cast_unsigned())?;
        let count = bus.read_register(id, reg::PRESENT_POSITION)?.cast_signed();
        let behind_rad = (goal_rad - member.angle_rad(count)).abs();
        let error = HardwareError(bus.read_register(id, reg::HARDWARE_ERROR)? as u8);
        if !error.is_none() {
            bail!(ServoError::Hardware { id, place, error });
        }
        if behind_rad < ARRIVED_RAD && elapsed == duration {
            person.tell(&format!("{place} is at {:.3} rad; it is let go now.", member.angle_rad(count)));
            return Ok(());
        }
        if behind_rad < if elapsed == duration { ARRIVED_RAD } else { BEHIND_RAD } {
            in_time = Instant::now();
        } else if in_time.elapsed() > PATIENCE {
            bail!(
                "{place} stands at {:.2} rad and does not follow: something is in its way, or the load is too much; \
                 it is let go",
                member.angle_rad(count)
            );
        }
        thread::sleep(STEP);
    }
}
