//! What a person prints: boards, tag sheets, shells (solid or folded from paper), and the file that describes them.
//!
//! ```text
//!  configs/calib/print.toml ──► spec ─┬─► vision's design ──► shells.toml (what the tracker reads)
//!                                     │        │ where the tags are
//!                                     │        ▼
//!                                     │     facets ─┬─► solid ──► mesh ──► STL
//!                                     │             └─► net ───┐
//!                                     ├─► sheets ──────────────┼─► drawing ─┬─► SVG
//!                                     └─► boards ──────────────┘            └─► PDF
//! ```
//! Drawings are in millimetres on paper, solids in millimetres in the shell's frame.

pub mod boards;
pub mod drawing;
pub mod facets;
pub mod mesh;
pub mod net;
pub mod numerals;
pub mod pdf;
pub mod ruler;
pub mod sheets;
pub mod solid;
pub mod spec;
pub mod svg;
pub mod triangulate;

/// Why something cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub enum PrintError {
    /// An id that the family does not have.
    #[error(transparent)]
    NoSuchTag(#[from] drawing::NoSuchTag),
    /// Too large for the paper.
    #[error(
        "{what} takes {:.1} x {:.1} mm, the paper has {:.1} x {:.1} mm\n  hint: use larger paper ([paper]) or smaller \
         dimensions",
        needs_mm[0], needs_mm[1], has_mm[0], has_mm[1]
    )]
    Paper {
        /// What does not fit.
        what: String,
        /// Width and height that it takes, with its ruler.
        needs_mm: [f64; 2],
        /// Width and height without margins.
        has_mm: [f64; 2],
    },
    /// A shell that has no solid.
    #[error(
        "there is no solid for a shell named `{name}`\n  hint: torso, right_palm, left_palm, right_thumb, left_thumb"
    )]
    UnknownShell {
        /// Its name.
        name: String,
    },
    /// A wall would be too thin.
    #[error(
        "{name}: {left_mm:.2} mm of wall are left below the engraving, at least {least_mm} mm are needed\n  hint: a \
         thicker wall, a smaller bore, or less engraving"
    )]
    Wall {
        /// The shell.
        name: String,
        /// What is left.
        left_mm: f64,
        /// What must be left.
        least_mm: f64,
    },
    /// A strap slot is larger than where it goes.
    #[error(
        "{name}: a strap slot of {:.1} x {:.1} mm does not fit {:.1} x {:.1} mm\n  hint: a smaller slot_mm, or a larger \
         skirt or flange",
        slot_mm[0], slot_mm[1], room_mm[0], room_mm[1]
    )]
    Slot {
        /// The shell.
        name: String,
        /// The slot.
        slot_mm: [f64; 2],
        /// The room for it.
        room_mm: [f64; 2],
    },
}
