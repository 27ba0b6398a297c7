//! A slot for the newest value between two threads: the writer never waits, the reader gets the newest.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Locks, also after another holder has panicked: what is kept here is replaced whole, never half.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The newest value, taken once.
#[derive(Debug)]
pub struct Latest<T> {
    slot: Mutex<(Option<T>, bool)>,
    changed: Condvar,
}

impl<T> Default for Latest<T> {
    fn default() -> Self {
        Self { slot: Mutex::new((None, false)), changed: Condvar::new() }
    }
}

impl<T> Latest<T> {
    /// Puts a value; gives back the one that nobody took.
    pub fn put(&self, value: T) -> Option<T> {
        let dropped = lock(&self.slot).0.replace(value);
        self.changed.notify_one();
        dropped
    }

    /// Nothing more will come.
    pub fn close(&self) {
        lock(&self.slot).1 = true;
        self.changed.notify_all();
    }

    /// Waits for a value; `None` after [`Latest::close`].
    pub fn take(&self) -> Option<T> {
        /// Also bounds how long a missed wake-up could last.
        const PATIENCE: Duration = Duration::from_millis(200);
        let mut slot = lock(&self.slot);
        loop {
            if let Some(value) = slot.0.take() {
                return Some(value);
            }
            if slot.1 {
                return None;
            }
            slot = self.changed.wait_timeout(slot, PATIENCE).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_wins_and_the_displaced_one_is_given_back() {
        let sut = Latest::default();
        assert_eq!(sut.put(1), None);
        assert_eq!(sut.put(2), Some(1));
        assert_eq!(sut.take(), Some(2));
        sut.close();
        assert_eq!(sut.take(), None);
    }

    #[test]
    fn a_waiting_reader_is_woken() {
        let sut = Latest::default();
        std::thread::scope(|scope| {
            let reader = scope.spawn(|| sut.take());
            sut.put(7);
            assert_eq!(reader.join().unwrap(), Some(7));
        });
    }
}
