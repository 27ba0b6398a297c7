//! Finds packets in a stream of bytes that may begin anywhere and be damaged.

use super::{HEADER, packet::Packet, packet::announced};

/// Collects bytes and gives packets out.
#[derive(Debug, Clone, Default)]
pub struct Scanner {
    pending: Vec<u8>,
    damaged: u64,
}

impl Scanner {
    /// Takes bytes in, in the order in which they came.
    pub fn push(&mut self, bytes: &[u8]) {
        self.pending.extend_from_slice(bytes);
    }

    /// The next whole packet with a right checksum.
    ///
    /// What looked like a packet and was none costs its first byte only: the true beginning may stand inside it.
    pub fn next_packet(&mut self) -> Option<Packet> {
        loop {
            self.drop_until_header();
            // Too short to tell, or not all here.
            if self.pending.len() < super::HEAD_BYTES {
                return None;
            }
            match announced(&self.pending) {
                Some(total) if self.pending.len() < total => return None,
                Some(total) => {
                    if let Ok(packet) = Packet::read(&self.pending[..total]) {
                        self.pending.drain(..total);
                        return Some(packet);
                    }
                }
                None => {}
            }
            self.damaged += 1;
            self.pending.drain(..1);
        }
    }

    /// Forgets what has not become a packet.
    pub fn clear(&mut self) {
        self.pending.clear();
    }

    /// How often something looked like a packet and was none.
    pub fn damaged(&self) -> u64 {
        self.damaged
    }

    /// What has not become a packet.
    pub fn pending(&self) -> &[u8] {
        &self.pending
    }

    /// Drops all before the first header, or before what may become one.
    fn drop_until_header(&mut self) {
        let begins = |at: usize| {
            let rest = &self.pending[at..];
            HEADER.starts_with(&rest[..rest.len().min(HEADER.len())])
        };
        let start = (0..self.pending.len()).find(|at| begins(*at)).unwrap_or(self.pending.len());
        self.pending.drain(..start);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ping(id: u8) -> Packet {
        Packet { id, instruction: 1, parameters: vec![] }
    }

    #[test]
    fn packets_are_found_however_the_bytes_are_cut() {
        let stream: Vec<u8> =
            [&[0xFF, 0x00][..], &ping(1).to_bytes(), &[0xFF, 0xFF], &ping(2).to_bytes()].concat();
        for size in 1..=stream.len() {
            let mut sut = Scanner::default();
            let mut found = Vec::new();
            for piece in stream.chunks(size) {
                sut.push(piece);
                found.extend(std::iter::from_fn(|| sut.next_packet()));
            }
            assert_eq!(found, [ping(1), ping(2)], "pieces of {size} bytes");
        }
    }

    #[test]
    fn a_damaged_packet_does_not_swallow_the_next() {
        let mut damaged = ping(1).to_bytes();
        // Announces more than is there: the next packet stands inside.
        damaged[5] = 13;
        let mut sut = Scanner::default();
        sut.push(&damaged);
        sut.push(&ping(2).to_bytes());
        assert_eq!(sut.next_packet(), Some(ping(2)));
        assert_eq!(sut.damaged(), 1);
    }
}
