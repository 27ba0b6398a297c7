//! The scout thread: searches whole images for what is lost, beside the eyes and after them.

use std::sync::Arc;
use std::sync::mpsc::SyncSender;

use locoman_protocol::realtime;
use locoman_vision::track::Scout;

use super::eyes::Doubtful;
use super::{Counters, Inbox, Outlook, Sighting};

/// Searches until there are no more images; those that were put before the lost was found are left aside.
pub(super) fn run(
    mut scouts: Vec<Scout>,
    doubtful: &Arc<Inbox<Doubtful>>,
    outlook: &Outlook,
    counters: &Counters,
    sightings: &SyncSender<Sighting>,
) {
    realtime::run_after_others();
    while let Some((camera, (image, capture_ns))) = doubtful.take() {
        if outlook.something_lost()
            && let Some(scout) = scouts.get_mut(camera)
        {
            let found = scout.search(&image, capture_ns);
            counters.count(camera, |counters| &counters.searched_whole);
            // The receiver goes last.
            let _ = sightings.send(Sighting::Searched(Box::new(found)));
        }
        doubtful.done(camera);
    }
}
