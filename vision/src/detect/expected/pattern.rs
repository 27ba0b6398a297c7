//! What is printed: the cells of a tag with its white margin.
//!
//! Coordinates: u in cells to the right, v in cells downwards, both from the top left of the white margin;
//! the tag's corners (of the black square) lie at 1 and 9.

use crate::detect::tag_bitmap;

/// Cells along a side, the white margin included.
pub const CELLS: usize = 10;
/// The middle of the tag.
pub const MIDDLE: f64 = 5.0;

/// The tag's corners: bottom left, bottom right, top right, top left.
pub const CORNERS: [[f64; 2]; 4] = [[1.0, 9.0], [9.0, 9.0], [9.0, 1.0], [1.0, 1.0]];

/// The cells of one tag, framed by one more ring of white so that each cell has neighbours.
#[derive(Debug, Clone)]
pub struct Pattern {
    /// 1 white, 0 black; row by row, `FRAMED` a row.
    cells: [f32; FRAMED * FRAMED],
    /// For each cell, whether its left, right, upper and lower neighbour has another colour.
    steps: [[bool; 4]; FRAMED * FRAMED],
}

/// Cells along a side with the frame.
pub const FRAMED: usize = CELLS + 2;

impl Pattern {
    /// `None` if the family has no such tag.
    pub fn new(id: u32) -> Option<Self> {
        let bitmap = tag_bitmap(id)?;
        let mut cells = [1.0; FRAMED * FRAMED];
        for row in 0..CELLS {
            let line = bitmap.row(u32::try_from(row).ok()?);
            for column in 0..CELLS {
                cells[(row + 1) * FRAMED + column + 1] = if line[column] == 0 { 0.0 } else { 1.0 };
            }
        }
        let mut steps = [[false; 4]; FRAMED * FRAMED];
        for row in 1..=CELLS {
            for column in 1..=CELLS {
                let at = row * FRAMED + column;
                steps[at] = [at - 1, at + 1, at - FRAMED, at + FRAMED].map(|other| cells[other] != cells[at]);
            }
        }
        Some(Self { cells, steps })
    }

    /// The place of a cell in the tables, given the integer parts of u and v inside the margin.
    #[inline]
    fn place(column: usize, row: usize) -> usize {
        (row + 1) * FRAMED + column + 1
    }

    /// A cell and its eight neighbours, row by row from the top left.
    #[inline]
    pub fn around(&self, column: usize, row: usize) -> [f32; 9] {
        let place = Self::place(column, row);
        let [above, here, below] = [place - FRAMED, place, place + FRAMED]
            .map(|at| [self.cells[at - 1], self.cells[at], self.cells[at + 1]]);
        [above[0], above[1], above[2], here[0], here[1], here[2], below[0], below[1], below[2]]
    }

    /// Whether the left, right, upper and lower neighbours have other colours.
    #[inline]
    pub fn steps(&self, column: usize, row: usize) -> [bool; 4] {
        self.steps[Self::place(column, row)]
    }

    /// Whether a cell is white.
    pub fn is_white(&self, column: usize, row: usize) -> bool {
        self.cells[Self::place(column, row)] > 0.5
    }
}
