//! The checksum of the Go1's datagrams.
//!
//! CRC-32 with the polynomial 04C11DB7, begun with all ones, not reflected, over little-endian words, the
//! highest bit first. It covers whole words only and leaves the last four bytes out, where it stands. Some
//! robots (Air, Pro) want it "encrypted": xor with a constant, then rotated. Only the checksum is.

use serde::Deserialize;

/// How the checksum is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Checksum {
    /// As it is: what the maker's library sends to an EDU robot.
    #[default]
    Plain,
    /// Disguised: what Air and Pro robots are said to want.
    Encrypted,
}

/// The constant of the encrypted form.
const MASK: u32 = 0xEDCA_B9DE;
const POLYNOMIAL: u32 = 0x04C1_1DB7;
const TABLE: [u32; 256] = table();

impl Checksum {
    /// What is written for a plain checksum.
    pub const fn seal(self, plain: u32) -> u32 {
        match self {
            Self::Plain => plain,
            Self::Encrypted => (plain ^ MASK).rotate_right(8),
        }
    }

    /// In which of the two ways `found` is the plain checksum, if in any.
    pub fn of(found: u32, plain: u32) -> Option<Self> {
        [Self::Plain, Self::Encrypted].into_iter().find(|kind| kind.seal(plain) == found)
    }
}

/// The plain checksum of a datagram whose last four bytes hold one: over the words before it.
pub fn of_words(datagram: &[u8]) -> u32 {
    let words = (datagram.len() / 4).saturating_sub(1);
    datagram
        .chunks_exact(4)
        .take(words)
        .flat_map(|word| word.iter().rev())
        .fold(u32::MAX, |crc, byte| (crc << 8) ^ TABLE[usize::from((crc >> 24) as u8 ^ byte)])
}

/// The remainders of all bytes.
const fn table() -> [u32; 256] {
    let mut table = [0; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut crc = (byte as u32) << 24;
        let mut bit = 0;
        while bit < 8 {
            crc = if crc >> 31 == 1 { (crc << 1) ^ POLYNOMIAL } else { crc << 1 };
            bit += 1;
        }
        table[byte] = crc;
        byte += 1;
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_have_the_checksums_that_were_observed() {
        for (words, crc) in [
            (&[0][..], 0xc704_dd7b_u32),
            (&[u32::MAX], 0),
            (&[1], 0xc3c5_c0cc),
            (&[0x1234_5678], 0xdf8a_8a2b),
            (&[0, 0], 0x6904_bb59),
        ] {
            let mut raw: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
            raw.extend([0; 4]);
            assert_eq!(of_words(&raw), crc, "{words:08x?}");
        }
    }

    #[test]
    fn encrypted_checksums_are_those_that_were_observed() {
        for (plain, sealed) in
            [(0, 0xdeed_cab9), (1, 0xdfed_cab9), (0x1234_5678, 0xa6ff_feef), (0xdead_beef, 0x3133_6707)]
        {
            assert_eq!(Checksum::Encrypted.seal(plain), sealed);
        }
    }
}
