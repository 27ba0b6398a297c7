//! Rulers that show whether the printer kept the scale: one along the page, one across it.
//!
//! Most printers shrink a page to its margins unless told not to; a person with a ruler sees it here, before a
//! calibration is wrong by 3 percent.

use super::drawing::{Drawing, LineKind, PointMm};

/// Length of the ruler across the page.
pub const ACROSS_MM: f64 = 100.0;
/// Length of the ruler along the page's left edge.
pub const ALONG_MM: f64 = 50.0;
/// Space that the ruler across and its text take.
pub const HEIGHT_MM: f64 = 9.0;
/// Space that the ruler along takes.
pub const WIDTH_MM: f64 = 6.0;

const TICK_MM: f64 = 1.5;
const LONG_TICK_MM: f64 = 3.0;
const TEXT_MM: f64 = 2.6;

/// Draws both rulers from a corner: across to the right of it, along upwards from it; `words` stand beside.
pub fn draw(page: &mut Drawing, corner_mm: PointMm, words: &str) {
    let [x, y] = corner_mm;
    page.line([x, y], [x + ACROSS_MM, y], LineKind::Scale);
    page.line([x, y], [x, y - ALONG_MM], LineKind::Scale);
    let ticks = |length_mm: f64| (0..=(length_mm / 5.0) as u32).map(|k| (k % 2, 5.0 * f64::from(k)));
    let tick_mm = |odd: u32| if odd == 0 { LONG_TICK_MM } else { TICK_MM };
    for (odd, at) in ticks(ACROSS_MM) {
        page.line([x + at, y], [x + at, y + tick_mm(odd)], LineKind::Scale);
    }
    for (odd, at) in ticks(ALONG_MM) {
        page.line([x, y - at], [x + tick_mm(odd), y - at], LineKind::Scale);
    }
    page.text(
        [x, y + LONG_TICK_MM + TEXT_MM],
        TEXT_MM,
        format!(
            "{ACROSS_MM} mm across, {ALONG_MM} mm along: measure both; print at 100 %, not \"fit to page\"."
        ),
    );
    page.text([x + ACROSS_MM + 4.0, y + 1.0], TEXT_MM, words);
}
