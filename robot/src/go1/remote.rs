//! The maker's remote control, as it travels in the robot's state.

/// L2 and B together: the maker's own chord for damping.
const STOP: u16 = 0x0220;

/// Buttons and sticks of a remote control that is switched on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Remote {
    /// Bits from R1, L1, start, select, R2, L2, F1, F2, A, B, X, Y to up, right, down, left.
    pub buttons: u16,
    /// Left stick to the right and up, right stick to the right and up, −1 to 1.
    pub sticks: [f32; 4],
}

impl Remote {
    /// Reads the remote's part of a state; `None` while it is switched off.
    pub fn decode(raw: &[u8; 40]) -> Option<Self> {
        use super::bytes::float;
        (raw[..2] == [0x55, 0x51]).then(|| Self {
            buttons: u16::from_le_bytes([raw[2], raw[3]]),
            sticks: [float(raw, 4), float(raw, 20), float(raw, 8), float(raw, 12)],
        })
    }

    /// Whether the person asks for a stop: L2 and B, whatever else is pressed.
    pub const fn asks_for_stop(&self) -> bool {
        self.buttons & STOP == STOP
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_both_buttons_of_a_remote_that_is_on_stop() {
        let mut raw = [0; 40];
        raw[2..4].copy_from_slice(&[0x20, 0x02]);
        assert_eq!(Remote::decode(&raw), None);
        raw[..2].copy_from_slice(&[0x55, 0x51]);
        assert!(Remote::decode(&raw).unwrap().asks_for_stop());
        raw[2] = 0;
        assert!(!Remote::decode(&raw).unwrap().asks_for_stop());
    }
}
