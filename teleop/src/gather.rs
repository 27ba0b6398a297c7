//! Which readings are solved together: those of cameras that are exposed together, as soon as all of them are
//! there, or after a short wait for stragglers. Pure: time comes from outside.
//!
//! A frame that has arrived here and is still to be read is waited for: it will be read or displaced. One that
//! may still come from somewhere else is waited for `straggler_ns` after the first reading of its instant, but
//! only if its camera has been heard of lately. A reading that comes after its instant was solved goes out alone.

use std::collections::VecDeque;

use locoman_vision::source::SYNC_TOLERANCE_NS;

use crate::sight::Reading;

/// A camera that has been silent for longer is not waited for.
pub const SILENT_NS: u64 = 500_000_000;

/// What is known of a camera.
#[derive(Debug, Clone, Copy, Default)]
struct Known {
    group: usize,
    /// Frames here that are still to be read: one that is being read, one that waits, and one that has come and
    /// displaces that.
    in_flight_ns: [Option<u64>; 3],
    /// Capture time of the newest reading.
    read_ns: u64,
    /// When it was last heard of.
    heard_ns: Option<u64>,
}

/// Readings of one instant.
#[derive(Debug, Default)]
struct Open {
    readings: Vec<Reading>,
    since_ns: u64,
}

/// Puts readings together.
#[derive(Debug)]
pub struct Gather {
    cameras: Vec<Known>,
    /// One a group.
    open: Vec<Open>,
    ready: VecDeque<Vec<Reading>>,
    straggler_ns: u64,
}

impl Gather {
    /// `sync_groups`: the group of each camera, as the rig has it.
    pub fn new(sync_groups: &[usize], straggler_ns: u64) -> Self {
        let groups = sync_groups.iter().max().map_or(0, |most| most + 1);
        let cameras = sync_groups.iter().map(|&group| Known { group, ..Known::default() }).collect();
        let open = (0..groups).map(|_| Open::default()).collect();
        Self { cameras, open, ready: VecDeque::new(), straggler_ns }
    }

    /// A frame is here and will be read or displaced.
    pub fn arrived(&mut self, camera: usize, capture_ns: u64, now_ns: u64) {
        let Some(known) = self.cameras.get_mut(camera) else { return };
        known.heard_ns = Some(now_ns);
        let free = known.in_flight_ns.iter_mut().find(|place| place.is_none());
        match free {
            Some(place) => *place = Some(capture_ns),
            // Cannot be, as long as who displaces says so.
            None => known.in_flight_ns[2] = Some(capture_ns),
        }
    }

    /// A frame will not be read.
    pub fn displaced(&mut self, camera: usize, capture_ns: u64) {
        let Some(known) = self.cameras.get_mut(camera) else { return };
        known.landed(capture_ns);
        let group = known.group;
        self.close_if_complete(group);
    }

    /// A frame has been read.
    pub fn read(&mut self, reading: Reading, now_ns: u64) {
        let (camera, capture_ns) = (reading.update.camera, reading.update.capture_ns);
        let Some(known) = self.cameras.get_mut(camera) else { return };
        known.landed(capture_ns);
        known.heard_ns = Some(now_ns);
        known.read_ns = known.read_ns.max(capture_ns);
        let group = known.group;
        let open = &self.open[group];
        if let Some(first) = open.readings.first() {
            let again = open.readings.iter().any(|other| other.update.camera == camera);
            let near = capture_ns.abs_diff(first.update.capture_ns) <= SYNC_TOLERANCE_NS;
            if !near && capture_ns < first.update.capture_ns {
                self.ready.push_back(vec![reading]);
                return;
            }
            if again || !near {
                self.close(group);
            }
        }
        let open = &mut self.open[group];
        if open.readings.is_empty() {
            open.since_ns = now_ns;
        }
        open.readings.push(reading);
        self.close_if_complete(group);
    }

    /// Closes what has waited long enough.
    pub fn wait_over(&mut self, now_ns: u64) {
        for group in 0..self.open.len() {
            let open = &self.open[group];
            let over = now_ns >= open.since_ns + self.straggler_ns;
            if !open.readings.is_empty() && over && !self.awaits(group, false, now_ns) {
                self.close(group);
            }
        }
    }

    /// When to call [`Gather::wait_over`] next.
    pub fn deadline_ns(&self) -> Option<u64> {
        let waiting = self.open.iter().filter(|open| !open.readings.is_empty());
        waiting.map(|open| open.since_ns + self.straggler_ns).min()
    }

    /// The next readings that belong together.
    pub fn pop(&mut self) -> Option<Vec<Reading>> {
        self.ready.pop_front()
    }

    fn close_if_complete(&mut self, group: usize) {
        let open = &self.open[group];
        if !open.readings.is_empty() && !self.awaits(group, true, open.since_ns) {
            self.close(group);
        }
    }

    /// Whether a camera's reading is still to come: one whose frame is here, or any (`stragglers`).
    fn awaits(&self, group: usize, stragglers: bool, now_ns: u64) -> bool {
        let readings = &self.open[group].readings;
        let Some(first_ns) = readings.first().map(|first| first.update.capture_ns) else { return false };
        self.cameras.iter().enumerate().filter(|(_, known)| known.group == group).any(|(camera, known)| {
            let there = readings.iter().any(|reading| reading.update.camera == camera);
            !there && (known.will_land(first_ns) || (stragglers && known.may_come(first_ns, now_ns)))
        })
    }

    fn close(&mut self, group: usize) {
        let readings = std::mem::take(&mut self.open[group].readings);
        self.ready.push_back(readings);
    }
}

impl Known {
    fn landed(&mut self, capture_ns: u64) {
        for place in &mut self.in_flight_ns {
            place.take_if(|in_flight| *in_flight == capture_ns);
        }
    }

    /// Its frame of an instant is here, to be read.
    fn will_land(&self, instant_ns: u64) -> bool {
        self.in_flight_ns
            .iter()
            .flatten()
            .any(|in_flight| in_flight.abs_diff(instant_ns) <= SYNC_TOLERANCE_NS)
    }

    /// Its frame of an instant may still come.
    fn may_come(&self, instant_ns: u64, now_ns: u64) -> bool {
        let newest_ns = self.in_flight_ns.iter().flatten().copied().max().unwrap_or(0).max(self.read_ns);
        let lately = self.heard_ns.is_some_and(|heard| now_ns.saturating_sub(heard) <= SILENT_NS);
        lately && newest_ns + SYNC_TOLERANCE_NS < instant_ns
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use locoman_vision::track::CameraUpdate;

    const MS: u64 = 1_000_000;

    /// Two pairs; cameras 2 and 3 are read elsewhere.
    fn sut() -> Gather {
        Gather::new(&[0, 0, 1, 1], 5 * MS)
    }

    fn reading(camera: usize, capture_ms: u64) -> Reading {
        Reading { update: CameraUpdate::nothing(camera, capture_ms * MS), in_memory_ns: 0, image: None }
    }

    fn popped(sut: &mut Gather) -> Vec<(usize, u64)> {
        let readings = sut.pop().unwrap_or_default();
        readings.iter().map(|reading| (reading.update.camera, reading.update.capture_ns / MS)).collect()
    }

    /// Both cameras of a pair have been heard of.
    fn warm(sut: &mut Gather, cameras: [usize; 2]) {
        for camera in cameras {
            sut.read(reading(camera, 70), 80 * MS);
        }
        while sut.pop().is_some() {}
    }

    #[test]
    fn a_pair_is_solved_as_soon_as_both_are_read() {
        let mut sut = sut();
        for camera in [0, 1] {
            sut.arrived(camera, 100 * MS, 101 * MS);
        }
        sut.read(reading(0, 100), 105 * MS);
        sut.wait_over(400 * MS);
        assert_eq!(popped(&mut sut), [], "the other is here, and being read");
        sut.read(reading(1, 100), 401 * MS);
        assert_eq!(popped(&mut sut), [(0, 100), (1, 100)]);
    }

    #[test]
    fn a_displaced_frame_is_not_waited_for() {
        let mut sut = sut();
        for camera in [0, 1] {
            sut.arrived(camera, 100 * MS, 101 * MS);
        }
        sut.read(reading(0, 100), 105 * MS);
        sut.arrived(1, 133 * MS, 134 * MS);
        sut.displaced(1, 100 * MS);
        assert_eq!(popped(&mut sut), [(0, 100)]);
    }

    #[test]
    fn a_frame_that_is_being_read_is_waited_for_while_others_come_and_are_displaced() {
        let mut sut = sut();
        for (camera, ms) in [(0, 100), (1, 100), (1, 133), (1, 166)] {
            sut.arrived(camera, ms * MS, (ms + 1) * MS);
        }
        sut.displaced(1, 133 * MS);
        sut.read(reading(0, 100), 170 * MS);
        sut.wait_over(180 * MS);
        assert_eq!(popped(&mut sut), []);
        sut.read(reading(1, 100), 181 * MS);
        assert_eq!(popped(&mut sut), [(0, 100), (1, 100)]);
    }

    #[test]
    fn a_straggler_from_elsewhere_is_waited_for_shortly() {
        let mut sut = sut();
        warm(&mut sut, [2, 3]);
        sut.read(reading(2, 100), 110 * MS);
        assert_eq!(sut.deadline_ns(), Some(115 * MS));
        sut.wait_over(114 * MS);
        assert_eq!(popped(&mut sut), []);
        sut.wait_over(115 * MS);
        assert_eq!(popped(&mut sut), [(2, 100)]);
        sut.read(reading(3, 100), 116 * MS);
        assert_eq!(popped(&mut sut), [(3, 100)], "late, and solved alone: its partner has had its turn");
    }

    #[test]
    fn a_camera_that_was_never_heard_of_or_fell_silent_is_not_waited_for() {
        let mut sut = sut();
        sut.read(reading(2, 100), 110 * MS);
        assert_eq!(popped(&mut sut), [(2, 100)]);
        warm(&mut sut, [2, 3]);
        sut.read(reading(2, 700), 710 * MS);
        assert_eq!(popped(&mut sut), [(2, 700)]);
    }

    #[test]
    fn pairs_that_are_not_synchronised_are_solved_at_their_own_times() {
        let mut sut = sut();
        sut.read(reading(0, 100), 101 * MS);
        sut.read(reading(2, 101), 102 * MS);
        assert_eq!((popped(&mut sut), popped(&mut sut)), (vec![(0, 100)], vec![(2, 101)]));
    }

    #[test]
    fn the_next_instant_closes_the_one_before() {
        let mut sut = sut();
        warm(&mut sut, [2, 3]);
        sut.read(reading(2, 100), 101 * MS);
        sut.read(reading(2, 133), 102 * MS);
        assert_eq!(popped(&mut sut), [(2, 100)]);
        sut.read(reading(3, 133), 103 * MS);
        assert_eq!(popped(&mut sut), [(2, 133), (3, 133)]);
    }
}
