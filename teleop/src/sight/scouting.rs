//! The search of images: beside the eyes and after them while something is lost or not where it was expected, by the eyes
//! themselves while all is lost.

use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Mutex};

use locoman_protocol::realtime;
use locoman_vision::detect::{DetectorError, Region};
use locoman_vision::image::GrayImage;
use locoman_vision::rig::Rig;
use locoman_vision::shells::ShellSet;
use locoman_vision::track::{CameraUpdate, Eye, Scout, TrackerSettings};

use super::eyes::Doubtful;
use super::{Counters, Inbox, Outlook, Sighting};
use crate::latest::lock;

/// While nobody is seen, each camera's images are searched whole at this distance: cameras that are exposed together
/// see the first person together, and an empty room does not keep the processor busy.
const ALERT_NS: u64 = 90_000_000;

/// Searches images of one camera.
#[derive(Debug)]
pub(super) struct Lookout {
    scout: Scout,
    /// Sharpens corners; not the one that reads: that must not wait for a search.
    eye: Eye,
    /// Capture time of the last image that was searched because nothing was known.
    alert_ns: u64,
}

impl Lookout {
    /// For the camera of this index.
    pub fn new(
        rig: &Rig,
        camera: usize,
        shells: &ShellSet,
        settings: &TrackerSettings,
    ) -> Result<Self, DetectorError> {
        let (scout, eye) =
            (Scout::new(rig, camera, shells, settings)?, Eye::new(rig, camera, shells, settings));
        Ok(Self { scout, eye, alert_ns: 0 })
    }

    /// Whether an image is to be searched because nothing is known.
    pub fn alert(&mut self, capture_ns: u64) -> bool {
        let due = capture_ns.abs_diff(self.alert_ns) >= ALERT_NS;
        if due {
            self.alert_ns = capture_ns;
        }
        due
    }

    /// Adds all tags of shells in an image, or in a region of it.
    pub fn add_to(&mut self, update: &mut CameraUpdate, image: &GrayImage, region: Option<Region>) {
        self.scout.add_to(update, &mut self.eye, image, region);
    }
}

/// Searches until there are no more images; those that were put before the lost was found are left aside.
pub(super) fn run(
    lookouts: &[Mutex<Lookout>],
    doubtful: &Arc<Inbox<Doubtful>>,
    outlook: &Outlook,
    counters: &Counters,
    sightings: &SyncSender<Sighting>,
) {
    realtime::run_after_others();
    while let Some((camera, Doubtful { image, capture_ns, region })) = doubtful.take() {
        if (region.is_some() || outlook.something_lost())
            && let Some(lookout) = lookouts.get(camera)
        {
            let mut found = CameraUpdate::nothing(camera, capture_ns);
            lock(lookout).add_to(&mut found, &image, region);
            if found.searched_whole {
                counters.count(camera, |counters| &counters.searched_whole);
            }
            // The receiver goes last.
            let _ = sightings.send(Sighting::Searched(Box::new(found)));
        }
        doubtful.done(camera);
    }
}
