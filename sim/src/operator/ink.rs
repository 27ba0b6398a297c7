//! What is printed: the black and white cells of a tag, from the detector's own family tables.

use locoman_vision::detect::tag_bitmap;

/// Cells along a printed tag, its white margin included: 8 for the black square and 1 on each side.
pub const CELLS: usize = 10;
/// Side of the printed tag, margin included, relative to the side of its black square.
pub const MARGIN_RATIO: f64 = CELLS as f64 / 8.0;

/// How many tags the family has.
pub const IDS: u32 = 587;

/// A printed tag: row 0 on top, column 0 on the left of the viewer; `true` is white.
pub type Bitmap = [[bool; CELLS]; CELLS];

/// A family or an id that cannot be printed.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum InkError {
    /// Only tag36h11 is drawn.
    #[error("the shells ask for family `{0}`; only `tag36h11` can be rendered")]
    Family(String),
    /// Beyond the end of the family.
    #[error("tag36h11 has no tag {0}; its ids end at 586")]
    Id(u32),
}

/// The cells of one tag.
pub fn bitmap(family: &str, id: u32) -> Result<Bitmap, InkError> {
    if family != "tag36h11" {
        return Err(InkError::Family(family.to_owned()));
    }
    let picture = tag_bitmap(id).ok_or(InkError::Id(id))?;
    let white = |row: usize, column: usize| {
        picture.data().get(row * picture.width() as usize + column).is_some_and(|grey| *grey > 127)
    };
    Ok(std::array::from_fn(|row| std::array::from_fn(|column| white(row, column))))
}
