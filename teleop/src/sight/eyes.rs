//! A thread of the pool that reads images: decodes, reads the tags where they are expected, hands on.

use std::sync::atomic::Ordering;
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Mutex};

use locoman_vision::detect::Region;
use locoman_vision::image::{Frame, GrayImage, ImageError, Pixels};
use locoman_vision::track::{CameraUpdate, Eye};

use super::scouting::Lookout;
use super::{Counters, Inbox, Outlook, Reading, Sighting};
use crate::latest::lock;

/// An image that may have to be searched.
#[derive(Debug)]
pub(super) struct Doubtful {
    pub image: Arc<GrayImage>,
    pub capture_ns: u64,
    /// Where; `None`: whole, if something is lost by then.
    pub region: Option<Region>,
}

/// One thread of the pool.
pub(super) struct Reader {
    /// One a camera; the inbox keeps two threads from one.
    pub eyes: Arc<Vec<Mutex<Eye>>>,
    /// Likewise; the scout has them while something, not everything, is lost.
    pub lookouts: Arc<Vec<Mutex<Lookout>>>,
    pub frames: Arc<Inbox<Frame>>,
    /// For the scout.
    pub doubtful: Arc<Inbox<Doubtful>>,
    pub outlook: Arc<Outlook>,
    pub counters: Arc<Counters>,
    pub sightings: SyncSender<Sighting>,
    pub now_ns: Arc<dyn Fn() -> u64 + Send + Sync>,
}

impl Reader {
    /// Reads until there are no more frames.
    pub fn run(self) {
        while let Some((camera, frame)) = self.frames.take() {
            let reading = self.read(frame);
            self.frames.done(camera);
            // The receiver goes last.
            let _ = self.sightings.send(Sighting::Read(Box::new(reading)));
        }
        self.doubtful.close();
    }

    fn read(&self, frame: Frame) -> Reading {
        let Frame { camera, capture_ns, pixels } = frame;
        let begun_ns = (self.now_ns)();
        let (image, in_memory_ns) = match decode(pixels) {
            Ok(image) => (Arc::new(image), (self.now_ns)()),
            Err(error) => {
                let update = CameraUpdate::unusable(camera, capture_ns, error.to_string());
                return self.noted(Reading { update, in_memory_ns: 0, image: None }, begun_ns);
            }
        };
        let motions = self.outlook.motions();
        let (mut update, region) = match self.eyes.get(camera) {
            Some(eye) => {
                let mut eye = lock(eye);
                (eye.look(&image, capture_ns, &motions), eye.wanted())
            }
            None => (CameraUpdate::nothing(camera, capture_ns), None),
        };
        update.searched.extend(region.map(|region| region.rect));
        update.decode_ns = in_memory_ns.saturating_sub(begun_ns);
        if motions.nothing_known_at(capture_ns) {
            // Nothing is tracked that this could delay, and all cameras together find a shell best.
            self.search_at_once(&image, &mut update);
        } else if region.is_some() || self.outlook.something_lost() {
            let region = region.filter(|_| !self.outlook.something_lost());
            // A search that waits is replaced by the newer one.
            let _ = self.doubtful.put(camera, Doubtful { image: Arc::clone(&image), capture_ns, region });
        }
        let image = self.outlook.watched.load(Ordering::Relaxed).then_some(image);
        self.noted(Reading { update, in_memory_ns, image }, begun_ns)
    }

    fn search_at_once(&self, image: &GrayImage, update: &mut CameraUpdate) {
        let Some(lookout) = self.lookouts.get(update.camera) else { return };
        let mut lookout = lock(lookout);
        if lookout.alert(update.capture_ns) {
            lookout.add_to(update, image, None);
            self.counters.count(update.camera, |counters| &counters.searched_whole);
        }
    }

    fn noted(&self, reading: Reading, begun_ns: u64) -> Reading {
        let update = &reading.update;
        let took_ns = (self.now_ns)().saturating_sub(begun_ns);
        self.counters.set(update.camera, |counters| &counters.read_ns, took_ns);
        if let Some(counters) = self.counters.cameras.get(update.camera)
            && counters.set_problem(update.problem.as_deref())
        {
            let camera = self.counters.ids().get(update.camera).map_or("", String::as_str);
            tracing::warn!("camera {camera}: {}", update.problem.as_deref().unwrap_or_default());
        }
        reading
    }
}

fn decode(pixels: Pixels) -> Result<GrayImage, ImageError> {
    match pixels {
        Pixels::Gray(image) => Ok(image),
        Pixels::Encoded(bytes) => GrayImage::decode(&bytes),
    }
}
