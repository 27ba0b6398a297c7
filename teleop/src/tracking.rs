//! The tracker thread: the newest frames to poses, to the board, to the link, to the recorder.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use locoman_protocol::clock::monotonic_ns;
use locoman_protocol::messages::{self, CameraStats, Header, ShellPose, Verdict};
use locoman_protocol::{Sender, geometry};
use locoman_vision::track::{self, TrackUpdate, Tracker};

use crate::board::{Board, Preview};
use crate::feed::Feed;
use crate::latency::Stage;
use crate::latest::lock;
use crate::observe::Observer;
use crate::recorder::{Item, Tap};

/// Reports over which the rate is measured.
const RATE_WINDOW: usize = 40;

/// Tracks until the feed closes.
pub fn run(
    mut tracker: Tracker,
    feed: &Feed,
    board: &Board,
    mut sender: Sender<messages::Tracking>,
    tap: &Tap,
    predicted_max_ms: u64,
) {
    let mut observer = Observer::new(predicted_max_ms);
    while let Some(frames) = feed.sets.take() {
        let update = tracker.update(&frames);
        let mut report = report(&tracker, &update, Some(feed));
        let now_ns = monotonic_ns();
        report.age_ns = now_ns.saturating_sub(update.time_ns);
        report.header = Some(Header { capture_ns: update.time_ns, ..Header::default() });
        *lock(&board.seen) = Some(observer.observe(&report));
        {
            let mut latency = lock(&board.latency);
            latency.add(Stage::Decode, update.decode_ns);
            latency.add(Stage::Detect, update.detect_ns);
            latency.add(Stage::Solve, update.solve_ns);
            latency.add(Stage::Solved, report.age_ns);
        }
        let report = match sender.send(update.time_ns, report.clone()) {
            Ok(sent) => sent,
            Err(error) => {
                tracing::debug!("tracking not published: {error}");
                report
            }
        };
        let report = Arc::new(report);
        tap.offer(Item::Tracking(Arc::clone(&report)));
        *lock(&board.tracking) = Some(report);
        {
            let mut times = lock(&board.tracked_ns);
            if times.len() == RATE_WINDOW {
                times.pop_front();
            }
            times.push_back(now_ns);
        }
        if board.viewers.load(Ordering::Relaxed) > 0 {
            let preview = Preview { frames: Arc::new(frames), update: Arc::new(update) };
            *lock(&board.preview) = Some(preview);
        }
    }
}

/// The tracker's outcome as a message; header and age are the caller's.
pub fn report(tracker: &Tracker, update: &TrackUpdate, feed: Option<&Feed>) -> messages::Tracking {
    let shells = tracker.shells().shells.iter().zip(&update.shells).map(|(shell, seen)| ShellPose {
        shell: shell.name.clone(),
        verdict: match seen.verdict {
            track::Verdict::Tracked => Verdict::Tracked,
            track::Verdict::Predicted => Verdict::Predicted,
            track::Verdict::Lost => Verdict::Lost,
        }
        .into(),
        pose: seen.world_from_shell.as_ref().map(geometry::pose),
        // Symmetric, so the order of storage does not matter.
        covariance: seen.covariance.iter().copied().collect(),
        rms_px: seen.rms_px,
        tags: u32::try_from(seen.tags).unwrap_or(u32::MAX),
        cameras: u32::try_from(seen.cameras).unwrap_or(u32::MAX),
    });
    let cameras = tracker.rig().cameras.iter().enumerate();
    let cameras = cameras.map(|(index, camera)| CameraStats {
        camera: camera.id.clone(),
        frames: feed.and_then(|feed| feed.frames.get(index)).map_or(0, |n| n.load(Ordering::Relaxed)),
        dropped: feed.and_then(|feed| feed.dropped.get(index)).map_or(0, |n| n.load(Ordering::Relaxed)),
        tags: update.camera(index).map_or(0, |seen| u32::try_from(seen.tags.len()).unwrap_or(u32::MAX)),
    });
    messages::Tracking {
        shells: shells.collect(),
        cameras: cameras.collect(),
        decode_ns: update.decode_ns,
        detect_ns: update.detect_ns,
        solve_ns: update.solve_ns,
        ..messages::Tracking::default()
    }
}
