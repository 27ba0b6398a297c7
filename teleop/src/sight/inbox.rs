//! The newest of each camera, for a pool of threads: whoever is free takes from the camera that has waited longest.

use std::sync::{Condvar, Mutex, PoisonError};
use std::time::Duration;

use crate::latest::lock;

/// One place a camera. A camera that is being worked on is not given to a second thread.
#[derive(Debug)]
pub struct Inbox<T> {
    state: Mutex<State<T>>,
    changed: Condvar,
}

#[derive(Debug)]
struct State<T> {
    places: Vec<Place<T>>,
    /// Counts what came: who waits longest.
    arrivals: u64,
    closed: bool,
}

#[derive(Debug)]
struct Place<T> {
    newest: Option<T>,
    /// Since which arrival the camera has been waiting; a newer frame does not send it back to the end.
    since: u64,
    busy: bool,
}

impl<T> Inbox<T> {
    /// Empty places of so many cameras.
    pub fn new(cameras: usize) -> Self {
        let places = (0..cameras).map(|_| Place { newest: None, since: 0, busy: false }).collect();
        Self { state: Mutex::new(State { places, arrivals: 0, closed: false }), changed: Condvar::new() }
    }

    /// Puts the newest of a camera; gives back the one that nobody took.
    pub fn put(&self, camera: usize, newest: T) -> Option<T> {
        let mut state = lock(&self.state);
        state.arrivals += 1;
        let arrivals = state.arrivals;
        let place = state.places.get_mut(camera)?;
        let displaced = place.newest.replace(newest);
        if displaced.is_none() {
            place.since = arrivals;
        }
        drop(state);
        self.changed.notify_one();
        displaced
    }

    /// Waits for a camera that has something and is not being worked on; `None` after [`Inbox::close`], once
    /// nothing is left. The camera is reserved until [`Inbox::done`].
    pub fn take(&self) -> Option<(usize, T)> {
        /// Also bounds how long a missed wake-up could last.
        const PATIENCE: Duration = Duration::from_millis(100);
        let mut state = lock(&self.state);
        loop {
            let places = state.places.iter_mut().enumerate();
            let waiting = places.filter(|(_, place)| place.newest.is_some() && !place.busy);
            if let Some((camera, place)) = waiting.min_by_key(|(_, place)| place.since)
                && let Some(newest) = place.newest.take()
            {
                place.busy = true;
                return Some((camera, newest));
            }
            if state.closed && state.places.iter().all(|place| place.newest.is_none()) {
                return None;
            }
            state = self.changed.wait_timeout(state, PATIENCE).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// The work on a camera's frame is done.
    pub fn done(&self, camera: usize) {
        if let Some(place) = lock(&self.state).places.get_mut(camera) {
            place.busy = false;
        }
        self.changed.notify_one();
    }

    /// Nothing more will come.
    pub fn close(&self) {
        lock(&self.state).closed = true;
        self.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_wins_and_the_camera_keeps_its_place_in_the_line() {
        let sut = Inbox::new(2);
        assert_eq!(sut.put(0, "a1"), None);
        assert_eq!(sut.put(1, "b1"), None);
        assert_eq!(sut.put(0, "a2"), Some("a1"));
        assert_eq!(sut.take(), Some((0, "a2")), "waited longer, though its frame is newer");
        assert_eq!(sut.take(), Some((1, "b1")));
    }

    #[test]
    fn two_threads_never_work_on_one_camera() {
        let sut = Inbox::new(2);
        sut.put(0, 1);
        assert_eq!(sut.take(), Some((0, 1)));
        sut.put(0, 2);
        sut.put(1, 3);
        assert_eq!(sut.take(), Some((1, 3)), "camera 0 is being worked on");
        sut.done(0);
        assert_eq!(sut.take(), Some((0, 2)));
    }

    #[test]
    fn what_came_before_the_end_is_still_taken() {
        let sut = Inbox::new(1);
        sut.put(0, 1);
        sut.close();
        assert_eq!((sut.take(), sut.take()), (Some((0, 1)), None));
    }
}
