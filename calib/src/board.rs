//! The board: a flat grid of AprilTags, as its file (TOML) describes it.
//!
//! Board frame: origin at the grid's centre, x right, y up, z out of the printed face; so a board that lies on the
//! floor has z up. Tags are numbered row by row from the bottom left, as Kalibr's AprilGrid is.

use std::path::{Path, PathBuf};

use locoman_vision::shells::{Shell, ShellTag};
use nalgebra::Isometry3;
use serde::Deserialize;

/// A grid of tags of the family 36h11.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Board {
    /// Tags in a row.
    pub columns: u32,
    /// Rows.
    pub rows: u32,
    /// The number of the tag at the bottom left.
    pub first_id: u32,
    /// Side of a tag's black square, millimetres.
    pub tag_mm: f64,
    /// White between the black squares of neighbours, millimetres.
    pub gap_mm: f64,
}

/// The file: other tables in it describe what else is printed.
#[derive(Deserialize)]
struct BoardFile {
    board: Board,
}

/// A board file that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum BoardError {
    /// The file cannot be read.
    #[error("cannot read {}: {source}\n  hint: check the path and its permissions", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A key or a value is wrong; the text shows the line.
    #[error("{}: {source}", path.display())]
    Parse {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        source: Box<toml::de::Error>,
    },
    /// The numbers describe no board.
    #[error("{}: {problem}\n  hint: {remedy}", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: String,
        /// What to do.
        remedy: &'static str,
    },
}

impl Board {
    /// Reads and checks a board file.
    pub fn load(path: &Path) -> Result<Self, BoardError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| BoardError::Read { path: path.to_owned(), source })?;
        let BoardFile { board } = toml::from_str(&text)
            .map_err(|source| BoardError::Parse { path: path.to_owned(), source: Box::new(source) })?;
        match board.fault() {
            Some((problem, remedy)) => Err(BoardError::Value { path: path.to_owned(), problem, remedy }),
            None => Ok(board),
        }
    }

    fn fault(&self) -> Option<(String, &'static str)> {
        /// Codes of the family.
        const CODES: u32 = 587;
        let last = u64::from(self.first_id) + u64::from(self.columns) * u64::from(self.rows);
        if self.columns == 0 || self.rows == 0 || last > u64::from(CODES) {
            let problem = format!("{}x{} tags from number {}", self.columns, self.rows, self.first_id);
            return Some((problem, "at least one column and one row; tag36h11 has the numbers 0 to 586"));
        }
        if !(self.tag_mm > 0.0 && self.tag_mm.is_finite() && self.gap_mm >= 0.0 && self.gap_mm.is_finite()) {
            let problem = format!("tags of {} mm with {} mm between them", self.tag_mm, self.gap_mm);
            return Some((problem, "measure both on the print with a ruler, and write millimetres"));
        }
        None
    }

    /// The board as a flat shell, named `board`.
    pub fn to_shell(&self) -> Shell {
        let pitch_m = 1e-3 * (self.tag_mm + self.gap_mm);
        let place = |k: u32, count: u32| (f64::from(k) - 0.5 * f64::from(count - 1)) * pitch_m;
        let tags = (0..self.rows * self.columns).map(|k| ShellTag {
            id: self.first_id + k,
            size_m: 1e-3 * self.tag_mm,
            shell_from_tag: Isometry3::translation(
                place(k % self.columns, self.columns),
                place(k / self.columns, self.rows),
                0.0,
            ),
        });
        Shell { name: "board".into(), tags: tags.collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load(text: &str) -> Result<Board, BoardError> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("board.toml");
        std::fs::write(&path, text).expect("written");
        Board::load(&path)
    }

    const GOOD: &str =
        "[palm]\ntag_mm = 25\n[board]\ncolumns = 6\nrows = 4\nfirst_id = 100\ntag_mm = 30.0\ngap_mm = 9\n";

    #[test]
    fn tags_are_numbered_from_the_bottom_left() {
        let sut = load(GOOD).expect("valid").to_shell();
        assert_eq!((sut.tags.len(), sut.tags[23].id), (24, 123));
        let (first, last) = (sut.tags[0].center(), sut.tags[23].center());
        assert!((first.x + 2.5 * 0.039).abs() < 1e-12 && (first.y + 1.5 * 0.039).abs() < 1e-12);
        assert!((first + last.coords).coords.norm() < 1e-12);
    }

    #[test]
    fn mistakes_are_named() {
        let cases = [
            ("columns = 6", "columns = 0", "0x4 tags"),
            ("columns = 6", "columns = 160", "0 to 586"),
            ("= 30.0", "= -1", "-1 mm"),
            ("gap_mm", "gap_cm", "gap_cm"),
            ("[board]", "[baord]", "board"),
        ];
        for (good, bad, expected) in cases {
            let message = load(&GOOD.replacen(good, bad, 1)).expect_err("wrong").to_string();
            assert!(message.contains(expected), "{message}");
        }
    }
}
