//! A drawing at true scale: what boards, sheets and nets are before they become SVG or PDF.
//!
//! Convention: millimetres; origin at the page's upper left corner, x right, y down.

use locoman_vision::detect::tag_bitmap;

/// A point on the page, millimetres.
pub type PointMm = [f64; 2];

/// One page.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawing {
    /// Width and height.
    pub size_mm: PointMm,
    /// What is on it, later marks over earlier ones.
    pub marks: Vec<Mark>,
}

/// A page and where its tags lie on it.
#[derive(Debug, Clone, PartialEq)]
pub struct Page {
    /// What is printed.
    pub drawing: Drawing,
    /// Its tags.
    pub tags: Vec<TagPlace>,
}

/// Ink.
#[derive(Debug, Clone, PartialEq)]
pub enum Mark {
    /// Closed outlines filled together: no seam shows between those that touch.
    Fill {
        /// Corner by corner; outlines of one mark do not overlap.
        outlines: Vec<Vec<PointMm>>,
        /// 0 is black, 1 is white.
        grey: f64,
    },
    /// A line through points.
    Line {
        /// Where it bends.
        points: Vec<PointMm>,
        /// What it is for.
        kind: LineKind,
    },
    /// A line of text.
    Text {
        /// Left end of its baseline.
        at_mm: PointMm,
        /// Height of the type, from descender to ascender.
        height_mm: f64,
        /// Plain ASCII.
        text: String,
    },
}

/// What a line is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LineKind {
    /// Cut here: thin and light, so that what is left of it beside a tag disturbs nobody.
    Cut,
    /// Fold here: dashed.
    Fold,
    /// A ruler's line.
    Scale,
}

impl LineKind {
    /// Width, millimetres.
    pub fn width_mm(self) -> f64 {
        match self {
            Self::Cut | Self::Fold => 0.12,
            Self::Scale => 0.2,
        }
    }

    /// 0 is black, 1 is white.
    pub fn grey(self) -> f64 {
        match self {
            Self::Cut | Self::Fold => 0.6,
            Self::Scale => 0.0,
        }
    }

    /// Lengths of dash and gap, millimetres; `None` for an unbroken line.
    pub fn dash_mm(self) -> Option<f64> {
        (self == Self::Fold).then_some(1.5)
    }
}

/// Where a tag lies on the page.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TagPlace {
    /// Its number in tag36h11.
    pub id: u32,
    /// Its centre.
    pub center_mm: PointMm,
    /// Side of its black square.
    pub side_mm: f64,
    /// The direction of its x axis on the page (a unit vector); its y axis is this turned upwards by 90 degrees.
    pub right: PointMm,
}

impl TagPlace {
    /// A tag that stands upright.
    pub fn upright(id: u32, center_mm: PointMm, side_mm: f64) -> Self {
        Self { id, center_mm, side_mm, right: [1.0, 0.0] }
    }

    /// The point of the page at (x, y) of the tag's frame: x right, y up, millimetres from its centre.
    pub fn page_from_tag(&self, x_mm: f64, y_mm: f64) -> PointMm {
        let [right_x, right_y] = self.right;
        // The page's y runs down: up is right turned against the clock as one sees it.
        let (up_x, up_y) = (right_y, -right_x);
        let [x, y] = self.center_mm;
        [x + x_mm * right_x + y_mm * up_x, y + x_mm * right_y + y_mm * up_y]
    }

    /// The corners of a square round the centre: bottom left, bottom right, top right, top left.
    pub fn square(&self, side_mm: f64) -> Vec<PointMm> {
        let half = side_mm / 2.0;
        [(-half, -half), (half, -half), (half, half), (-half, half)]
            .map(|(x, y)| self.page_from_tag(x, y))
            .to_vec()
    }
}

/// No such code in the family.
#[derive(Debug, thiserror::Error)]
#[error("tag id {id} does not exist in tag36h11\n  hint: use ids from 0 to 586")]
pub struct NoSuchTag {
    /// The number that was asked for.
    pub id: u32,
}

impl Drawing {
    /// An empty page.
    pub fn new(size_mm: PointMm) -> Self {
        Self { size_mm, marks: Vec::new() }
    }

    /// Draws a tag: its black cells, in one piece.
    pub fn tag(&mut self, place: &TagPlace) -> Result<(), NoSuchTag> {
        let bitmap = tag_bitmap(place.id).ok_or(NoSuchTag { id: place.id })?;
        // The picture has one white cell all round the black square.
        let cell_mm = place.side_mm / f64::from(bitmap.width() - 2);
        let half_cells = f64::from(bitmap.width()) / 2.0;
        let mut outlines = Vec::new();
        for row in 0..bitmap.height() {
            let (top, bottom) = (half_cells - f64::from(row), half_cells - f64::from(row) - 1.0);
            for (start, end) in black_runs(bitmap.row(row)) {
                let (left, right) = (start as f64 - half_cells, end as f64 - half_cells);
                let corners = [(left, bottom), (right, bottom), (right, top), (left, top)];
                outlines.push(corners.map(|(x, y)| place.page_from_tag(x * cell_mm, y * cell_mm)).to_vec());
            }
        }
        self.marks.push(Mark::Fill { outlines, grey: 0.0 });
        Ok(())
    }

    /// A closed line.
    pub fn outline(&mut self, points: &[PointMm], kind: LineKind) {
        let points = points.iter().chain(points.first()).copied().collect();
        self.marks.push(Mark::Line { points, kind });
    }

    /// A line between two points.
    pub fn line(&mut self, from_mm: PointMm, to_mm: PointMm, kind: LineKind) {
        self.marks.push(Mark::Line { points: vec![from_mm, to_mm], kind });
    }

    /// A line of text.
    pub fn text(&mut self, at_mm: PointMm, height_mm: f64, text: impl Into<String>) {
        self.marks.push(Mark::Text { at_mm, height_mm, text: text.into() });
    }
}

/// First and one past the last of each run of black pixels.
fn black_runs(row: &[u8]) -> Vec<(usize, usize)> {
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for (x, _) in row.iter().enumerate().filter(|(_, grey)| **grey < 128) {
        match runs.last_mut() {
            Some((_, end)) if *end == x => *end += 1,
            _ => runs.push((x, x + 1)),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_black_are_found_at_both_ends() {
        assert_eq!(black_runs(&[0, 0, 255, 0, 255, 0]), [(0, 2), (3, 4), (5, 6)]);
        assert_eq!(black_runs(&[255, 255]), []);
    }

    #[test]
    fn a_turned_tag_turns_all_its_corners() {
        // Its x axis points down the page, so its y axis (up) points right.
        let sut = TagPlace { id: 0, center_mm: [10.0, 20.0], side_mm: 2.0, right: [0.0, 1.0] };
        assert_eq!(sut.page_from_tag(1.0, 0.0), [10.0, 21.0]);
        assert_eq!(sut.page_from_tag(0.0, 1.0), [11.0, 20.0]);
    }

    #[test]
    fn an_id_that_the_family_lacks_is_refused() {
        let message = Drawing::new([10.0, 10.0]).tag(&TagPlace::upright(587, [5.0, 5.0], 5.0));
        assert!(message.expect_err("too high").to_string().contains("587"));
    }
}
