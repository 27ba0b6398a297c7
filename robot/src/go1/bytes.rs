//! Fields at fixed places of a datagram whose length is known; all little-endian.

/// The `N` bytes from `at` on.
pub fn take<const N: usize>(raw: &[u8], at: usize) -> [u8; N] {
    std::array::from_fn(|byte| raw[at + byte])
}

/// Writes a field's bytes from `at` on.
pub fn put<const N: usize>(raw: &mut [u8], at: usize, field: [u8; N]) {
    raw[at..at + N].copy_from_slice(&field);
}

/// A 32-bit float.
pub fn float(raw: &[u8], at: usize) -> f32 {
    f32::from_le_bytes(take(raw, at))
}

/// `N` 32-bit floats in a row.
pub fn floats<const N: usize>(raw: &[u8], at: usize) -> [f32; N] {
    std::array::from_fn(|index| float(raw, at + 4 * index))
}

/// Writes 32-bit floats in a row.
pub fn put_floats(raw: &mut [u8], at: usize, values: &[f32]) {
    for (index, value) in values.iter().enumerate() {
        put(raw, at + 4 * index, value.to_le_bytes());
    }
}

/// A signed 16-bit number.
pub fn short(raw: &[u8], at: usize) -> i16 {
    i16::from_le_bytes(take(raw, at))
}
