//! The servos' thread: it owns the line, keeps the rate and never ends by itself.
//!
//! Whoever drives hands commands over and takes states without waiting ([`triple_buffer`]). If he stops, the servos
//! hold their last goals; if this program ends, their own watchdogs stop them where they are.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::{self, JoinHandle},
    time::Duration,
};

use locoman_protocol::{
    clock::monotonic_ns,
    pace::{Pace, Wake},
    realtime,
};
use triple_buffer::{Input, Output, triple_buffer};

use super::{
    LineCounts, SerialLine, ServoCommand, ServoError, ServoSettings, ServoStates, Zeros,
    bus::Bus,
    line::{find_port, latency_timer_ms},
    place::SERVOS,
    station::Station,
};

/// How often a line that has gone is tried.
const REOPEN: Duration = Duration::from_millis(500);
/// A latency timer up to here leaves the rate as it is, ms.
const GOOD_LATENCY_MS: u32 = 1;

/// Servos that are driven.
#[derive(Debug)]
pub struct ServoDriver {
    commands: Input<[ServoCommand; SERVOS]>,
    states: Output<ServoStates>,
    refused: u64,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl ServoDriver {
    /// Opens the line, brings all eight servos to their settings, limp where they stand, and starts the thread.
    pub fn start(settings: &ServoSettings, zeros: &Zeros) -> Result<Self, ServoError> {
        let (port, bus) = open(settings)?;
        let mut station = Station::new(bus, settings, zeros);
        station.adopt_all(settings)?;
        if let Some(ms) = latency_timer_ms(&port).filter(|ms| *ms > GOOD_LATENCY_MS) {
            tracing::warn!(
                "the adapter {port} waits {ms} ms before it hands bytes over: the servos will not reach their rate; \
                 install packaging/udev/60-locoman.rules"
            );
        }
        tracing::info!(
            "8 servos on {port}: a cycle takes {:.2} of {:.2} ms of the line ({} baud, {})",
            station.cycle_ns() as f64 * 1e-6,
            settings.period().as_secs_f64() * 1e3,
            settings.baud,
            if station.reads_fast() { "all in one answer" } else { "an answer each" },
        );
        let (commands, commands_out) = triple_buffer(&[ServoCommand::RELEASED; SERVOS]);
        let first = ServoStates {
            servos: std::array::from_fn(|index| station.members[index].state),
            stamp_ns: monotonic_ns(),
            line_open: true,
            counts: LineCounts::default(),
        };
        let (states_in, states) = triple_buffer(&first);
        let stop = Arc::new(AtomicBool::new(false));
        let worker = Worker {
            settings: settings.clone(),
            zeros: *zeros,
            commands: commands_out,
            states: states_in,
            known: first,
            stop: Arc::clone(&stop),
        };
        let thread = thread::Builder::new()
            .name("servos".into())
            .spawn(move || worker.run(station))
            .map_err(ServoError::Thread)?;
        Ok(Self { commands, states, refused: 0, stop, thread: Some(thread) })
    }

    /// Hands commands over, in the order of places. Never waits. Commands with numbers that are none are not handed
    /// over: the servos keep what they have, and [`LineCounts::refused`] counts.
    pub fn send(&mut self, commands: &[ServoCommand; SERVOS]) {
        if commands.iter().all(ServoCommand::is_finite) {
            self.commands.write(*commands);
        } else {
            self.refused += 1;
        }
    }

    /// The newest states. Never waits.
    pub fn latest(&mut self) -> ServoStates {
        let mut states = *self.states.read();
        states.counts.refused = self.refused;
        states
    }
}

impl Drop for ServoDriver {
    /// Lets all joints go.
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            tracing::error!("the servos' thread died; their watchdogs have stopped them");
        }
    }
}

fn open(settings: &ServoSettings) -> Result<(String, Bus<SerialLine>), ServoError> {
    let port = find_port(&settings.port)?;
    let line = SerialLine::open(&port, settings.baud)?;
    Ok((port, Bus::new(line, settings.baud, settings.reply_slack())))
}

struct Worker {
    settings: ServoSettings,
    zeros: Zeros,
    commands: Output<[ServoCommand; SERVOS]>,
    states: Input<ServoStates>,
    known: ServoStates,
    stop: Arc<AtomicBool>,
}

impl Worker {
    fn run(mut self, first: Station<SerialLine>) {
        realtime::run_before_others();
        let mut station = Some(first);
        while !self.stopped() {
            match station.take() {
                Some(mut open) => match self.drive(&mut open) {
                    Ok(()) => {
                        open.release();
                        return;
                    }
                    Err(error) => {
                        tracing::error!("{error}; trying again each {} ms", REOPEN.as_millis());
                        self.publish(None);
                    }
                },
                None => {
                    thread::sleep(REOPEN);
                    station = self.reopen();
                }
            }
        }
    }

    /// Cycle after cycle, until it shall end or the line fails.
    fn drive(&mut self, station: &mut Station<SerialLine>) -> Result<(), ServoError> {
        let period = self.settings.period();
        let mut pace = Pace::new(u64::try_from(period.as_nanos()).unwrap_or(u64::MAX));
        while !self.stopped() {
            let Wake { missed, .. } = pace.wait();
            self.known.counts.missed += missed;
            let elapsed_s = period.as_secs_f64() * (1 + missed) as f64;
            station.cycle(self.commands.read(), &self.settings, elapsed_s, &mut self.known.counts)?;
            self.publish(Some(station));
        }
        Ok(())
    }

    fn publish(&mut self, station: Option<&Station<SerialLine>>) {
        for (index, state) in self.known.servos.iter_mut().enumerate() {
            match station {
                Some(station) => *state = station.members[index].state,
                None => state.present = false,
            }
        }
        self.known.line_open = station.is_some();
        self.known.stamp_ns = monotonic_ns();
        self.states.write(self.known);
    }

    fn reopen(&mut self) -> Option<Station<SerialLine>> {
        let (port, bus) = open(&self.settings).ok()?;
        self.known.counts.reopened += 1;
        tracing::info!("the servos' line {port} is open again; looking for servos");
        let mut station = Station::new(bus, &self.settings, &self.zeros);
        for (member, known) in station.members.iter_mut().zip(&self.known.servos) {
            member.state = *known;
        }
        Some(station)
    }

    fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
