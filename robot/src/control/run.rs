//! The control loop: a plant, a controller, and the slots to the link.

use locoman_protocol::clock::monotonic_ns;

use super::{Controller, Inputs, SecondHistogram};
use crate::{
    link::{Inbox, Outbox},
    modes::Phase,
    plant::{Plant, PlantError},
    supervisor::Stop,
};

/// What the outside asks of the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wish {
    /// Go on.
    Run,
    /// Lie down, then end.
    Settle,
    /// Damp and end now.
    End,
}

/// Samples that a robot must have spent damped before the loop ends.
const DAMPED_SAMPLES: u32 = 20;

/// Runs until the wish is to end (or to settle, and the robot lies damped). Paced by the plant.
///
/// Allocates nothing and takes no lock, except for the log line when the robot falls silent or returns.
pub fn run(
    plant: &mut dyn Plant,
    controller: &mut Controller,
    inbox: &mut Inbox,
    outbox: &mut Outbox,
    mut wish: impl FnMut() -> Wish,
) -> Result<(), PlantError> {
    let (Some(mut period), Some(mut compute)) = (SecondHistogram::new(), SecondHistogram::new()) else {
        return Ok(());
    };
    let mut command = *controller.command();
    let mut heard_ns = monotonic_ns();
    let mut silent = false;
    let mut damped = 0;
    loop {
        let asked = match wish() {
            Wish::Run => Stop::None,
            Wish::Settle => Stop::Settle,
            Wish::End => Stop::Damp,
        };
        let exchanged = plant.exchange(&command);
        let now_ns = monotonic_ns();
        let inputs =
            Inputs { command: inbox.command(), stop: inbox.take_stop().max(asked), health: plant.health() };
        match exchanged {
            Ok(sensors) => {
                if std::mem::take(&mut silent) {
                    tracing::info!("the robot is back");
                }
                period.record(now_ns, now_ns.saturating_sub(heard_ns));
                heard_ns = now_ns;
                command = controller.tick(now_ns, &sensors, &inputs);
                compute.record(now_ns, monotonic_ns().saturating_sub(now_ns));
                controller.set_timing(period.last_second(), compute.last_second());
            }
            Err(PlantError::Silent { .. }) => {
                let silent_ns = now_ns.saturating_sub(heard_ns);
                if !silent && silent_ns > 500_000_000 {
                    silent = true;
                    tracing::warn!("no state from the robot; waiting for it");
                }
                command = controller.silent(now_ns, silent_ns, &inputs);
            }
            Err(error) => return Err(error),
        }
        outbox.write(Some(*controller.snapshot()));
        let lies = controller.snapshot().phase == Phase::Damped;
        damped = if lies && asked != Stop::None { damped + 1 } else { 0 };
        if damped >= DAMPED_SAMPLES || (silent && asked != Stop::None) {
            return Ok(());
        }
    }
}
