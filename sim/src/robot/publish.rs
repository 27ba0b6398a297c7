//! Tells everyone over Zenoh what is really going on: the simulator's truth at 100 Hz.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use locoman_protocol::messages::SimTruth;
use locoman_protocol::pace::Pace;
use locoman_protocol::{Link, LinkError, geometry};
use nalgebra::Isometry3;
use triple_buffer::Output;

use super::server::Counters;
use super::world::Truth;

const PERIOD_NS: u64 = 10_000_000;
const REPORT_PERIOD: Duration = Duration::from_secs(5);
/// Fewer late exchanges in a report's period (of 2000) are not worth a line.
const LATE_WORTH_TELLING: u64 = 20;

/// Publishes the newest truth until `stop`, and logs what went wrong in the real-time loop.
pub fn publish(
    link: &Link,
    truth: &mut Output<Option<Truth>>,
    counters: &Counters,
    stop: &AtomicBool,
) -> Result<(), LinkError> {
    let mut sender = link.sender::<SimTruth>()?;
    let mut last_ns = 0;
    let mut pace = Pace::new(PERIOD_NS);
    let mut report = Report::new();
    while !stop.load(Ordering::Relaxed) {
        if let Some(truth) = truth.read().as_ref().filter(|truth| truth.time_ns != last_ns) {
            last_ns = truth.time_ns;
            sender.send(truth.time_ns, message(truth))?;
        }
        report.tell(counters);
        pace.wait();
    }
    Ok(())
}

/// The truth as a message; the header is the sender's business.
pub fn message(truth: &Truth) -> SimTruth {
    let [right_gripper, left_gripper] = truth.world_from_gripper.map(|pose| Some(geometry::pose(&pose)));
    let [right_foot, left_foot, ..] =
        truth.feet_in_world.map(|foot| Some(geometry::pose(&Isometry3::from(foot.coords))));
    let [right_opening, left_opening] = truth.opening;
    SimTruth {
        header: None,
        sim_time_s: truth.sim_time_s,
        torso: Some(geometry::pose(&truth.world_from_torso)),
        right_gripper,
        left_gripper,
        right_foot,
        left_foot,
        joint_position_rad: truth.joint_position.iter().copied().collect(),
        foot_force_n: truth.foot_force_n.to_vec(),
        right_opening,
        left_opening,
        fallen: truth.fallen,
    }
}

/// Logs trouble when there is new trouble, and not too often.
struct Report {
    next: Instant,
    late: u64,
    lost_ns: u64,
    malformed: u64,
}

impl Report {
    fn new() -> Self {
        Self { next: Instant::now() + REPORT_PERIOD, late: 0, lost_ns: 0, malformed: 0 }
    }

    fn tell(&mut self, counters: &Counters) {
        if Instant::now() < self.next {
            return;
        }
        self.next += REPORT_PERIOD;
        let late = counters.late_exchanges.load(Ordering::Relaxed);
        let lost_ns = counters.lost_ns.load(Ordering::Relaxed);
        let malformed = counters.malformed.load(Ordering::Relaxed);
        if late > self.late + LATE_WORTH_TELLING || lost_ns > self.lost_ns {
            tracing::warn!(
                late_exchanges = late - self.late,
                lost_ms = (lost_ns - self.lost_ns) / 1_000_000,
                "the machine is too busy for real time"
            );
        }
        if malformed > self.malformed {
            tracing::warn!(datagrams = malformed - self.malformed, "datagrams that were no commands");
        }
        (self.late, self.lost_ns, self.malformed) = (late, lost_ns, malformed);
    }
}
