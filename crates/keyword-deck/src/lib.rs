//! LS-DYNA keyword decks (`.k`, `.key`, `.dyn`) as plain data: nodes, elements, parts with their titles, sections, sets,
//! and what holds parts together. Any bytes may be given: the answer is a deck or an error that names file and line.
//!
//! In the order of the flow: `files` (disk or memory), `lines` (a window on a file), `row` (a card cut into fields),
//! `number`, `parameter`, `expression` (what stands in a field), `cards/` (one file a family of keywords), `include` and
//! `transform` (other files, and where their nodes go), `reader` (the walk through all of it), `check` (what is looked at
//! in the end), [`deck`](Deck) (the result), [`Resolver`] (what its sets mean).
//!
//! A deck is read once from front to back, a window at a time; besides the result nothing grows with its size.
//! Keywords that are not read are counted by name ([`Deck::skipped`]); a missing include is a [`Warning`], a circle of
//! includes an [`Error`].
//!
//! ```
//! use keyword_deck::{Deck, Memory};
//!
//! let text = b"*KEYWORD
//! *PARAMETER
//! Rheight        5.0
//! *PART
//! lid
//!          7         1         1
//! *NODE
//!        1             0.0             0.0         &height
//!        2            10.0             0.0         &height
//!        3             0.0            10.0         &height
//! *ELEMENT_SHELL
//!        1       7       1       2       3
//! *END
//! ";
//! let files = Memory([("lid.k".into(), text.to_vec())].into());
//! let deck = Deck::read_from(&files, "lid.k".as_ref())?;
//! assert_eq!(deck.part_table()[0].title, "lid");
//! assert_eq!(deck.coordinates[2], [0.0, 10.0, 5.0]);
//! assert_eq!(deck.shells[0].nodes, [1, 2, 3, 3]);
//! # Ok::<(), keyword_deck::Error>(())
//! ```

mod cards;
mod check;
mod deck;
mod error;
mod expression;
mod files;
mod include;
mod keyword;
mod lines;
mod number;
mod parameter;
mod reader;
mod resolver;
mod row;
mod set;
mod transform;
mod warning;

use std::path::Path;

pub use deck::{
    Beam, Connection, Deck, DeckFile, ElementCounts, Holds, Material, Part, PartRow, Section, Shell, ShellCards,
    Skipped, Solid, Surface, SurfaceKind, Tie,
};
pub use error::{Error, Place};
pub use files::{Disk, Files, Memory};
pub use resolver::{Face, Resolver, Unresolved};
pub use set::{Clause, Set, SetKind};
pub use warning::Warning;

impl Deck {
    /// Reads the deck whose main file is at `path`, with all its includes.
    ///
    /// # Errors
    /// Everything that [`Error`] names.
    pub fn read(path: &Path) -> Result<Deck, Error> {
        if path.is_dir() {
            return Err(Error::Folder { path: path.to_owned() });
        }
        if !path.exists() {
            return Err(Error::NotFound { path: path.to_owned() });
        }
        Deck::read_from(&Disk, path)
    }

    /// The same from other files than those of the disk.
    ///
    /// # Errors
    /// As [`Deck::read`].
    pub fn read_from(files: &dyn Files, path: &Path) -> Result<Deck, Error> {
        reader::read(files, path)
    }
}
