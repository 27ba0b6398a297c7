//! The dimensions of all that is printed, as `configs/calib/print.toml` gives them: the file explains each number.

use std::path::{Path, PathBuf};

use locoman_vision::shells::design::{Dimensions, EDGE_PER_INRADIUS, MARGIN_FACTOR};
use serde::Deserialize;

use crate::board::Board;

/// All dimensions; millimetres.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spec {
    /// What is printed on.
    pub paper: Paper,
    /// What tags are glued with.
    pub sticker: Sticker,
    /// The AprilTag grid.
    pub board: Board,
    /// The checkerboard with tags.
    pub checkerboard: Checkerboard,
    /// The dome on the back of the hand.
    pub palm: Palm,
    /// The cap on the thumb.
    pub thumb: Thumb,
    /// The plate on the chest.
    pub torso: Torso,
}

/// A sheet of paper, upright.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "names say it; the file explains")]
pub struct Paper {
    pub width_mm: f64,
    pub height_mm: f64,
    pub margin_mm: f64,
}

/// A printed tag with its margin, to be glued into a recess.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "names say it; the file explains")]
pub struct Sticker {
    pub thickness_mm: f64,
    pub clearance_mm: f64,
    pub engraving_mm: f64,
}

/// A checkerboard with tags in its white squares.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "names say it; the file explains")]
pub struct Checkerboard {
    pub columns: u32,
    pub rows: u32,
    pub first_id: u32,
    pub square_mm: f64,
    pub tag_mm: f64,
}

/// The dome on the back of the hand.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "names say it; the file explains")]
pub struct Palm {
    pub tag_mm: f64,
    pub inradius_mm: f64,
    pub wall_mm: f64,
    pub skirt_mm: f64,
    pub slot_mm: [f64; 2],
}

/// The cap on the thumb.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "names say it; the file explains")]
pub struct Thumb {
    pub tag_mm: f64,
    pub inradius_mm: f64,
    pub bore_mm: f64,
    pub bore_end_mm: f64,
    pub skirt_mm: f64,
    pub slot_mm: [f64; 2],
}

/// The plate on the chest.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "names say it; the file explains")]
pub struct Torso {
    pub tag_mm: f64,
    pub facet_mm: f64,
    pub bend_rad: f64,
    pub wall_mm: f64,
    pub flange_mm: f64,
    pub slot_mm: [f64; 2],
}

/// Dimensions that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SpecError {
    /// The file cannot be read.
    #[error("cannot read {}: {source}\n  hint: check the path, or --configs", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// Not TOML, or not the keys that it must have.
    #[error("{}:{line}: {problem}\n  hint: configs/calib/print.toml documents every key", path.display())]
    Form {
        /// The file.
        path: PathBuf,
        /// Counted from 1.
        line: usize,
        /// What the parser says.
        problem: String,
    },
    /// Numbers that do not fit each other.
    #[error("{}: {problem}\n  hint: {remedy}", path.display())]
    Numbers {
        /// The file.
        path: PathBuf,
        /// What is wrong, with the numbers.
        problem: String,
        /// What to do about it.
        remedy: &'static str,
    },
}

impl Spec {
    /// Reads and checks the file.
    pub fn load(path: &Path) -> Result<Self, SpecError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| SpecError::Read { path: path.to_owned(), source })?;
        Self::parse(path, &text)
    }

    fn parse(path: &Path, text: &str) -> Result<Self, SpecError> {
        let spec: Self = toml::from_str(text).map_err(|error| {
            let offset = error.span().map_or(0, |span| span.start);
            let line = 1 + text.bytes().take(offset).filter(|byte| *byte == b'\n').count();
            SpecError::Form { path: path.to_owned(), line, problem: error.message().to_owned() }
        })?;
        spec.check().map_err(|(problem, remedy)| SpecError::Numbers {
            path: path.to_owned(),
            problem,
            remedy,
        })?;
        Ok(spec)
    }

    /// The dimensions of the shells as the tracker's design knows them.
    pub fn dimensions(&self) -> Dimensions {
        Dimensions {
            palm_tag_m: self.palm.tag_mm / 1e3,
            palm_inradius_m: self.palm.inradius_mm / 1e3,
            thumb_tag_m: self.thumb.tag_mm / 1e3,
            thumb_inradius_m: self.thumb.inradius_mm / 1e3,
            torso_tag_m: self.torso.tag_mm / 1e3,
            torso_facet_m: self.torso.facet_mm / 1e3,
            torso_bend_rad: self.torso.bend_rad,
        }
    }

    /// Problem and remedy.
    fn check(&self) -> Result<(), (String, &'static str)> {
        let Self { board, checkerboard, palm, thumb, torso, sticker, .. } = self;
        self.check_signs()?;
        let white_mm = board.tag_mm / 4.0;
        if board.gap_mm < white_mm {
            return Err((
                format!("board.gap_mm = {}, tags of {} mm need {white_mm:.2} mm", board.gap_mm, board.tag_mm),
                "tags that touch are not found: leave two white cells between black squares",
            ));
        }
        let recess = |tag_mm: f64| tag_mm * MARGIN_FACTOR + 2.0 * sticker.clearance_mm;
        let edge = |inradius_mm: f64| inradius_mm * EDGE_PER_INRADIUS;
        let places = [
            ("checkerboard", checkerboard.tag_mm * MARGIN_FACTOR, checkerboard.square_mm),
            ("palm", recess(palm.tag_mm), edge(palm.inradius_mm)),
            ("thumb", recess(thumb.tag_mm), edge(thumb.inradius_mm)),
            ("torso", recess(torso.tag_mm), torso.facet_mm),
        ];
        for (name, needed_mm, facet_mm) in places {
            if needed_mm > facet_mm {
                return Err((
                    format!(
                        "{name}: a tag takes {needed_mm:.2} mm with its margin, its facet has {facet_mm:.2} mm"
                    ),
                    "make the tag smaller or the facet larger",
                ));
            }
        }
        Ok(())
    }

    fn check_signs(&self) -> Result<(), (String, &'static str)> {
        let Self { paper, sticker, board, checkerboard, palm, thumb, torso } = self;
        let lengths = [
            ("paper.width_mm", paper.width_mm),
            ("paper.height_mm", paper.height_mm),
            ("sticker.thickness_mm", sticker.thickness_mm),
            ("sticker.engraving_mm", sticker.engraving_mm),
            ("board.tag_mm", board.tag_mm),
            ("checkerboard.square_mm", checkerboard.square_mm),
            ("checkerboard.tag_mm", checkerboard.tag_mm),
            ("palm.tag_mm", palm.tag_mm),
            ("palm.inradius_mm", palm.inradius_mm),
            ("palm.wall_mm", palm.wall_mm),
            ("palm.skirt_mm", palm.skirt_mm),
            ("thumb.tag_mm", thumb.tag_mm),
            ("thumb.inradius_mm", thumb.inradius_mm),
            ("thumb.bore_mm", thumb.bore_mm),
            ("thumb.skirt_mm", thumb.skirt_mm),
            ("torso.tag_mm", torso.tag_mm),
            ("torso.facet_mm", torso.facet_mm),
            ("torso.bend_rad", torso.bend_rad),
            ("torso.wall_mm", torso.wall_mm),
            ("torso.flange_mm", torso.flange_mm),
        ];
        for (name, value) in lengths {
            if !(value.is_finite() && value > 0.0) {
                return Err((format!("{name} = {value}"), "write a positive number"));
            }
        }
        if board.columns * board.rows == 0 || checkerboard.columns * checkerboard.rows == 0 {
            return Err(("a board without columns or rows".to_owned(), "write at least 1 of each"));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file() -> (PathBuf, String) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/calib/print.toml");
        let text = std::fs::read_to_string(&path).expect("print.toml");
        (path, text)
    }

    #[test]
    fn the_file_gives_the_standard_shells() {
        let (path, _) = file();
        assert_eq!(Spec::load(&path).expect("valid").dimensions(), Dimensions::default());
    }

    #[test]
    fn numbers_that_do_not_fit_are_named_with_a_remedy() {
        let (path, text) = file();
        let cases = [
            ("gap_mm = 9.2", "gap_mm = 5.0", "board.gap_mm = 5, tags of 27.2 mm need 6.80 mm"),
            ("tag_mm = 25.0", "tag_mm = 32.0", "palm: a tag takes 40.20 mm"),
            ("wall_mm = 2.4", "wall_mm = -2.4", "palm.wall_mm = -2.4"),
            ("columns = 7", "columns = 0", "without columns"),
            ("rows = 5", "rwos = 5", "print.toml:20: unknown field `rwos`"),
        ];
        for (good, bad, expected) in cases {
            assert!(text.contains(good), "{good}");
            let message = Spec::parse(&path, &text.replace(good, bad)).expect_err("bad").to_string();
            assert!(message.contains(expected) && message.contains("hint: "), "{message}");
        }
    }
}
