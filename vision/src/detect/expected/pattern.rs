//! What is printed: the cells of a tag with its white margin, and where along their edges to look.
//!
//! Coordinates: u in cells to the right, v in cells downwards, both from the top left of the white margin;
//! the tag's corners (of the black square) lie at 1 and 9.

use crate::detect::tag_bitmap;
use crate::vector::LANES;

/// Cells along a side, the white margin included.
pub const CELLS: usize = 10;
/// Cells along a side of the black square.
pub const BLACK_CELLS: usize = CELLS - 2;
/// The middle of the tag.
pub const MIDDLE: f64 = 5.0;
/// Eights of spots along the edges.
pub const EIGHTS: usize = 36;

/// The tag's corners: bottom left, bottom right, top right, top left.
pub const CORNERS: [[f64; 2]; 4] = [[1.0, 9.0], [9.0, 9.0], [9.0, 1.0], [1.0, 1.0]];

/// The cells of one tag, framed by one more ring of white so that each cell has neighbours.
#[derive(Debug, Clone)]
pub struct Pattern {
    /// For each cell the colours of it and its eight neighbours, a bit each, 1 white: row by row from the top left.
    around: [u16; CELLS * CELLS],
    /// Spots along the edges, dealt so that each eight, and every third eight, are spread over the whole tag.
    spots: Vec<Spots>,
}

/// Eight spots on edges between black and white.
#[derive(Debug, Clone, Default)]
pub struct Spots {
    /// Place on the edge.
    pub u: [f32; LANES],
    /// See [`Spots::u`].
    pub v: [f32; LANES],
    /// The edge's normal, of length 1, towards white.
    pub normal_u: [f32; LANES],
    /// See [`Spots::normal_u`].
    pub normal_v: [f32; LANES],
    /// Where beside the edge to look: from 0, far on the black side, to 1, far on the white one.
    pub aside: [f32; LANES],
}

/// An edge between two cells, one cell long.
struct Edge {
    from: [f32; 2],
    along: [f32; 2],
    normal: [f32; 2],
}

impl Pattern {
    /// `None` if the family has no such tag.
    pub fn new(id: u32) -> Option<Self> {
        let bitmap = tag_bitmap(id)?;
        // Beyond the margin all is taken to be white.
        let is_white = |column: i32, row: i32| {
            let inside = |index: i32| usize::try_from(index).ok().filter(|index| *index < CELLS);
            match (inside(column), inside(row)) {
                (Some(column), Some(row)) => bitmap.row(row as u32)[column] != 0,
                _ => true,
            }
        };
        let mut around = [0; CELLS * CELLS];
        let mut edges = Vec::new();
        for (place, bits) in around.iter_mut().enumerate() {
            let (column, row) = ((place % CELLS) as i32, (place / CELLS) as i32);
            for k in 0..9 {
                *bits |= u16::from(is_white(column + k % 3 - 1, row + k / 3 - 1)) << k;
            }
            let here = is_white(column, row);
            let sign = if here { -1.0 } else { 1.0 };
            let (u, v) = (column as f32, row as f32);
            if here != is_white(column + 1, row) {
                edges.push(Edge { from: [u + 1.0, v], along: [0.0, 1.0], normal: [sign, 0.0] });
            }
            if here != is_white(column, row + 1) {
                edges.push(Edge { from: [u, v + 1.0], along: [1.0, 0.0], normal: [0.0, sign] });
            }
        }
        Some(Self { around, spots: spots(&edges) })
    }

    /// The colours of a cell, counted row by row, and its eight neighbours: see [`Pattern`].
    #[inline(always)]
    pub fn around(&self, cell: usize) -> u16 {
        self.around[cell]
    }

    /// Whether a cell is white.
    #[inline]
    pub fn is_white(&self, column: usize, row: usize) -> bool {
        self.around(row * CELLS + column) & 1 << 4 != 0
    }

    /// Every `stride`-th eight of spots on the edges.
    pub fn spots(&self, stride: usize) -> impl Iterator<Item = &Spots> {
        self.spots.iter().step_by(stride)
    }
}

/// Spreads spots evenly along all edges, and beside them by the golden ratio.
fn spots(edges: &[Edge]) -> Vec<Spots> {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    const COUNT: usize = EIGHTS * LANES;
    let mut spots = vec![Spots::default(); EIGHTS];
    for k in 0..COUNT {
        let (lane, eight) = (k / EIGHTS, k % EIGHTS);
        let place = (k as f64 + 0.5) / COUNT as f64 * edges.len() as f64;
        let edge = &edges[place as usize];
        let share = place.fract() as f32;
        let spots = &mut spots[eight];
        spots.u[lane] = edge.from[0] + share * edge.along[0];
        spots.v[lane] = edge.from[1] + share * edge.along[1];
        spots.normal_u[lane] = edge.normal[0];
        spots.normal_v[lane] = edge.normal[1];
        spots.aside[lane] = (k as f64 * GOLDEN).fract() as f32;
    }
    spots
}
