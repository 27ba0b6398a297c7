//! Sheets of tags to cut out and glue into the shells' recesses: one shell a sheet.

use locoman_vision::shells::Shell;
use locoman_vision::shells::design::MARGIN_FACTOR;

use super::PrintError;
use super::drawing::{Drawing, LineKind, Page, TagPlace};
use super::ruler;
use super::spec::Paper;

/// Space between stickers: room for a number, and for scissors.
const GAP_MM: f64 = 5.0;
const TEXT_MM: f64 = 2.2;

/// The pages of a shell's stickers, and where the tags lie on each.
///
/// Each sticker is a tag with its white margin of one cell, cutting lines all round, its number below.
pub fn pages(shell: &Shell, paper: &Paper) -> Result<Vec<Page>, PrintError> {
    let sticker_mm = |size_m: f64| 1e3 * size_m * MARGIN_FACTOR;
    let largest_mm = shell.tags.iter().map(|tag| sticker_mm(tag.size_m)).fold(0.0, f64::max);
    let pitch_mm = largest_mm + GAP_MM;
    let free_mm = [
        paper.width_mm - 2.0 * paper.margin_mm - ruler::WIDTH_MM,
        paper.height_mm - 2.0 * paper.margin_mm - ruler::HEIGHT_MM,
    ];
    let [columns, rows] = free_mm.map(|length| (length / pitch_mm) as usize);
    if columns * rows == 0 {
        return Err(PrintError::Paper {
            what: format!("a sticker of {}", shell.name),
            needs_mm: [pitch_mm; 2],
            has_mm: free_mm,
        });
    }
    let left = paper.margin_mm + ruler::WIDTH_MM + (free_mm[0] - columns as f64 * pitch_mm) / 2.0;
    shell
        .tags
        .chunks(columns * rows)
        .map(|tags| {
            let mut page = Drawing::new([paper.width_mm, paper.height_mm]);
            let mut places = Vec::new();
            for (index, tag) in tags.iter().enumerate() {
                let (row, column) = (index / columns, index % columns);
                let center_mm = [
                    left + (column as f64 + 0.5) * pitch_mm,
                    paper.margin_mm + (row as f64 + 0.5) * pitch_mm,
                ];
                let place = TagPlace::upright(tag.id, center_mm, 1e3 * tag.size_m);
                page.outline(&place.square(sticker_mm(tag.size_m)), LineKind::Cut);
                page.tag(&place)?;
                let half_mm = sticker_mm(tag.size_m) / 2.0;
                let at_mm = place.page_from_tag(-half_mm, -half_mm - TEXT_MM);
                page.text(at_mm, TEXT_MM, tag.id.to_string());
                places.push(place);
            }
            let bottom = paper.height_mm - paper.margin_mm - ruler::HEIGHT_MM + 2.0;
            let words = format!("{}: cut along the lines; glue upright", shell.name);
            ruler::draw(&mut page, [paper.margin_mm, bottom], &words);
            Ok(Page { drawing: page, tags: places })
        })
        .collect()
}
