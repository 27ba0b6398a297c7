//! Boards to calibrate cameras with: an AprilTag grid, and a checkerboard with tags in its white squares.

use locoman_vision::shells::design::MARGIN_FACTOR;

use super::PrintError;
use super::drawing::{Drawing, Mark, Page, TagPlace};
use super::ruler;
use super::spec::{Checkerboard, Paper};
use crate::board::Board;

/// The page of an AprilTag grid and where its tags lie on it. Numbers rise to the right, then upwards.
pub fn grid(board: &Board, paper: &Paper) -> Result<Page, PrintError> {
    let pitch_mm = board.tag_mm + board.gap_mm;
    let extent_mm = |count: u32| f64::from(count - 1) * pitch_mm + board.tag_mm * MARGIN_FACTOR;
    let (width_mm, height_mm) = (extent_mm(board.columns), extent_mm(board.rows));
    let (mut page, [left, top]) = place("board", width_mm, height_mm, paper)?;
    let white_mm = board.tag_mm * (MARGIN_FACTOR - 1.0) / 2.0;
    let center = |index: u32| white_mm + board.tag_mm / 2.0 + f64::from(index) * pitch_mm;
    let mut tags = Vec::new();
    for row in 0..board.rows {
        for column in 0..board.columns {
            let id = board.first_id + row * board.columns + column;
            let center_mm = [left + center(column), top + height_mm - center(row)];
            tags.push(TagPlace::upright(id, center_mm, board.tag_mm));
        }
    }
    draw_tags(&mut page, &tags, 0.5 * board.gap_mm)?;
    let words = format!(
        "AprilTag grid, tag36h11: {} x {} tags of {} mm, gaps {} mm, numbers from {}",
        board.columns, board.rows, board.tag_mm, board.gap_mm, board.first_id
    );
    finish(&mut page, paper, &words);
    Ok(Page { drawing: page, tags })
}

/// The page of a checkerboard with tags and where its tags lie on it. The upper left square is black; numbers rise
/// to the right, then downwards.
pub fn checkerboard(board: &Checkerboard, paper: &Paper) -> Result<Page, PrintError> {
    let side_mm = board.square_mm;
    let (width_mm, height_mm) = (f64::from(board.columns) * side_mm, f64::from(board.rows) * side_mm);
    let (mut page, [left, top]) = place("checkerboard", width_mm, height_mm, paper)?;
    let squares = (0..board.rows).flat_map(|row| (0..board.columns).map(move |column| (row, column)));
    let corner = |row: u32, column: u32| [left + f64::from(column) * side_mm, top + f64::from(row) * side_mm];
    let (black, white): (Vec<_>, Vec<_>) = squares.partition(|(row, column)| (row + column) % 2 == 0);
    let outlines = black
        .into_iter()
        .map(|(row, column)| {
            [(0, 0), (0, 1), (1, 1), (1, 0)].map(|(down, right)| corner(row + down, column + right)).to_vec()
        })
        .collect();
    page.marks.push(Mark::Fill { outlines, grey: 0.0 });
    let tags: Vec<TagPlace> = (board.first_id..)
        .zip(white)
        .map(|(id, (row, column))| {
            let [x, y] = corner(row, column);
            TagPlace::upright(id, [x + side_mm / 2.0, y + side_mm / 2.0], board.tag_mm)
        })
        .collect();
    for tag in &tags {
        page.tag(tag)?;
    }
    let words = format!(
        "Checkerboard with tags (tag36h11): {} x {} squares of {side_mm} mm, tags of {} mm, numbers from {}",
        board.columns, board.rows, board.tag_mm, board.first_id
    );
    finish(&mut page, paper, &words);
    Ok(Page { drawing: page, tags })
}

/// Draws tags, each with its number in small type outside its white cell.
fn draw_tags(page: &mut Drawing, tags: &[TagPlace], below_mm: f64) -> Result<(), PrintError> {
    const TEXT_MM: f64 = 2.0;
    for tag in tags {
        page.tag(tag)?;
        let half_mm = tag.side_mm / 2.0;
        // In the middle of the gap, whose nearer halves belong to the tags.
        let [x, y] = tag.page_from_tag(-half_mm, -half_mm - below_mm);
        page.text([x, y + 0.35 * TEXT_MM], TEXT_MM, tag.id.to_string());
    }
    Ok(())
}

/// An empty page, turned as the board needs it, and the board's upper left corner on it.
fn place(
    name: &'static str,
    width_mm: f64,
    height_mm: f64,
    paper: &Paper,
) -> Result<(Drawing, [f64; 2]), PrintError> {
    let free_mm = |length_mm: f64, taken_mm: f64| length_mm - 2.0 * paper.margin_mm - taken_mm;
    let sizes = [[paper.width_mm, paper.height_mm], [paper.height_mm, paper.width_mm]];
    let fitting = sizes.into_iter().find(|[width, height]| {
        width_mm <= free_mm(*width, ruler::WIDTH_MM) && height_mm <= free_mm(*height, ruler::HEIGHT_MM)
    });
    let Some(size_mm) = fitting else {
        return Err(PrintError::Paper {
            what: name.to_owned(),
            needs_mm: [width_mm + ruler::WIDTH_MM, height_mm + ruler::HEIGHT_MM],
            has_mm: sizes[1].map(|length| free_mm(length, 0.0)),
        });
    };
    let middle = |length_mm: f64, board_mm: f64, taken_mm: f64, lead_mm: f64| {
        paper.margin_mm + lead_mm + (free_mm(length_mm, taken_mm) - board_mm) / 2.0
    };
    let left = middle(size_mm[0], width_mm, ruler::WIDTH_MM, ruler::WIDTH_MM);
    let top = middle(size_mm[1], height_mm, ruler::HEIGHT_MM, 0.0);
    Ok((Drawing::new(size_mm), [left, top]))
}

fn finish(page: &mut Drawing, paper: &Paper, words: &str) {
    let bottom = page.size_mm[1] - paper.margin_mm - ruler::HEIGHT_MM + 2.0;
    ruler::draw(page, [paper.margin_mm, bottom], words);
}

/// The file that describes a grid to the calibration commands, which read it from the file of dimensions too.
pub fn board_file(board: &Board) -> String {
    format!(
        "# The printed grid, millimetres. Measure the print: if its rulers are off, so are these numbers.\n[board]\n\
         columns = {}\nrows = {}\nfirst_id = {}\ntag_mm = {}\ngap_mm = {}\n",
        board.columns, board.rows, board.first_id, board.tag_mm, board.gap_mm
    )
}
