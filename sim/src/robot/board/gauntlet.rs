//! A line that loses, delays, shuffles and damages datagrams. Deterministic from its seed.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::Faults;

/// A datagram under way; ordered by when it comes out, then by when it went in.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct UnderWay {
    due_ns: u64,
    number: u64,
    datagram: Vec<u8>,
}

/// One direction of the line.
#[derive(Debug)]
pub struct Gauntlet {
    random: ChaCha8Rng,
    under_way: BinaryHeap<Reverse<UnderWay>>,
    number: u64,
}

impl Gauntlet {
    /// An empty line.
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(stream);
        Self { random, under_way: BinaryHeap::new(), number: 0 }
    }

    /// A datagram goes in at this time.
    pub fn enter(&mut self, faults: &Faults, mut datagram: Vec<u8>, now_ns: u64) {
        let mut happens = |share: f64| share > 0.0 && self.random.random::<f64>() < share;
        if happens(faults.loss) {
            return;
        }
        if happens(faults.corruption) && !datagram.is_empty() {
            let byte = self.random.random_range(0..datagram.len());
            datagram[byte] ^= 1 << self.random.random_range(0..8);
        }
        let jitter_ms =
            if faults.jitter_ms > 0.0 { faults.jitter_ms * self.random.random::<f64>() } else { 0.0 };
        self.number += 1;
        let due_ns = now_ns + ((faults.delay_ms + jitter_ms) * 1e6) as u64;
        self.under_way.push(Reverse(UnderWay { due_ns, number: self.number, datagram }));
    }

    /// The next datagram that has come out by this time, and when.
    pub fn leave(&mut self, now_ns: u64) -> Option<(Vec<u8>, u64)> {
        let Reverse(next) = self.under_way.peek()?;
        if next.due_ns > now_ns {
            return None;
        }
        self.under_way.pop().map(|Reverse(next)| (next.datagram, next.due_ns))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn through(faults: &Faults) -> Vec<(Vec<u8>, u64)> {
        let mut sut = Gauntlet::new(1, 0);
        for number in 0..1000_u64 {
            sut.enter(faults, number.to_le_bytes().to_vec(), number * 1_000_000);
        }
        std::iter::from_fn(|| sut.leave(u64::MAX)).collect()
    }

    #[test]
    fn a_good_line_changes_nothing() {
        let out = through(&Faults::default());
        assert_eq!(out.len(), 1000);
        for (number, (datagram, due_ns)) in (0..1000_u64).zip(out) {
            assert_eq!((datagram, due_ns), (number.to_le_bytes().to_vec(), number * 1_000_000));
        }
    }

    #[test]
    fn a_bad_line_loses_its_share_and_shuffles_within_its_jitter() {
        let out = through(&Faults { loss: 0.05, jitter_ms: 5.0, corruption: 0.02, ..Faults::default() });
        // Five standard deviations of 1000 draws.
        assert!((915..985).contains(&out.len()), "{}", out.len());
        assert!(out.windows(2).all(|pair| pair[0].1 <= pair[1].1), "by the time of coming out");
        let numbers =
            out.iter().map(|(datagram, _)| u64::from_le_bytes(std::array::from_fn(|byte| datagram[byte])));
        let overtaken = numbers.clone().zip(numbers.skip(1)).filter(|(first, second)| second < first).count();
        assert!(overtaken > 100, "{overtaken}");
    }
}
