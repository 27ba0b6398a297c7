//! Numbers as seven-segment digits, to engrave: separate rectangles, so that no islands stand in a recess.

/// Lower left and upper right corner of a rectangle.
pub type Rectangle = ([f64; 2], [f64; 2]);

/// Width and stroke per height of a digit, and the gap between two strokes or digits.
const WIDTH: f64 = 0.55;
const STROKE: f64 = 0.12;
const GAP: f64 = 0.05;
const SPACE: f64 = 0.2;

/// Segments, from the top clockwise, the middle one last: bit 0 to bit 6.
const DIGITS: [u8; 10] = [
    0b011_1111, 0b000_0110, 0b101_1011, 0b100_1111, 0b110_0110, 0b110_1101, 0b111_1101, 0b000_0111,
    0b111_1111, 0b110_1111,
];
const LETTER_L: u8 = 0b011_1000;
const LETTER_R: u8 = 0b101_0000;

/// Rectangles that spell a number (or `L`, `r` for the side), centred on the origin, with a bar below that shows which
/// way is up. Other characters are left out.
pub fn rectangles(text: &str, height: f64) -> Vec<Rectangle> {
    let patterns: Vec<u8> = text.chars().filter_map(pattern).collect();
    let count = patterns.len() as f64;
    let total = height * (count * WIDTH + (count - 1.0).max(0.0) * SPACE);
    let mut all: Vec<Rectangle> = Vec::new();
    for (k, pattern) in patterns.iter().enumerate() {
        let left = k as f64 * height * (WIDTH + SPACE) - total / 2.0;
        for (segment, (low, high)) in segments().into_iter().enumerate() {
            if pattern >> segment & 1 == 1 {
                let place = |[x, y]: [f64; 2]| [left + x * height, (y - 0.5) * height];
                all.push((place(low), place(high)));
            }
        }
    }
    let bar = |side: f64, y: f64| [side * total / 2.0, y * height];
    all.push((bar(-1.0, -0.5 - 3.0 * STROKE), bar(1.0, -0.5 - 2.0 * STROKE)));
    all
}

fn pattern(character: char) -> Option<u8> {
    match character {
        'L' => Some(LETTER_L),
        'r' => Some(LETTER_R),
        _ => DIGITS.get(character.to_digit(10)? as usize).copied(),
    }
}

/// The seven rectangles of a digit of height 1, its lower left corner at the origin.
fn segments() -> [Rectangle; 7] {
    let (inner, outer) = (STROKE + GAP, WIDTH - STROKE - GAP);
    let level = |y: f64| ([inner, y], [outer, y + STROKE]);
    let middle = (1.0 - STROKE) / 2.0;
    let (low, high) = ((GAP, 0.5 - GAP / 2.0), (0.5 + GAP / 2.0, 1.0 - GAP));
    let upright = |x: f64, (from, to): (f64, f64)| ([x, from], [x + STROKE, to]);
    let right = WIDTH - STROKE;
    [
        level(1.0 - STROKE),
        upright(right, high),
        upright(right, low),
        level(0.0),
        upright(0.0, low),
        upright(0.0, high),
        level(middle),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strokes_of_all_digits_are_apart() {
        let sut = rectangles("8888", 10.0);
        assert_eq!(sut.len(), 4 * 7 + 1);
        for (k, (low, high)) in sut.iter().enumerate() {
            for (other_low, other_high) in &sut[k + 1..] {
                let apart =
                    (0..2).map(|axis| (other_low[axis] - high[axis]).max(low[axis] - other_high[axis]));
                assert!(apart.fold(f64::NEG_INFINITY, f64::max) > 0.3);
            }
        }
    }
}
