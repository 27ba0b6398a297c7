//! The protocol's checksum: CRC-16 with polynomial 0x8005, from 0, not reflected, not inverted (CRC-16/UMTS).

const POLYNOMIAL: u16 = 0x8005;

/// The effect of each value of the upper byte.
const TABLE: [u16; 256] = table();

const fn table() -> [u16; 256] {
    let mut table = [0; 256];
    let mut value = 0;
    while value < 256 {
        let mut crc = (value as u16) << 8;
        let mut bit = 0;
        while bit < 8 {
            crc = if crc & 0x8000 == 0 { crc << 1 } else { (crc << 1) ^ POLYNOMIAL };
            bit += 1;
        }
        table[value] = crc;
        value += 1;
    }
    table
}

/// The checksum of some bytes.
pub fn of(bytes: &[u8]) -> u16 {
    continued(0, bytes)
}

/// The checksum of bytes that follow those with the checksum `crc`.
pub fn continued(crc: u16, bytes: &[u8]) -> u16 {
    bytes.iter().fold(crc, |crc, byte| (crc << 8) ^ TABLE[usize::from((crc >> 8) as u8 ^ byte)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_catalogues_crc_16_umts() {
        assert_eq!(of(b"123456789"), 0xFEE8);
        assert_eq!(continued(of(b"1234"), b"56789"), 0xFEE8);
    }
}
