//! Cards of the keywords that are read, one file a family. Elements and nodes come card by card, since a block of them
//! may be as long as the file; all other blocks are collected first.

pub(crate) mod connections;
pub(crate) mod elements;
pub(crate) mod parts;
pub(crate) mod sections;
pub(crate) mod sets;
pub(crate) mod small;

use std::path::Path;
use std::sync::Arc;

use crate::deck::Deck;
use crate::error::Error;
use crate::row::{At, Card, Format, Row};

/// What an *INCLUDE_TRANSFORM adds to ids and titles and does to lengths, all levels together.
#[derive(Debug, Clone)]
pub(crate) struct Frame {
    pub(crate) node: i64,
    pub(crate) element: i64,
    pub(crate) part: i64,
    pub(crate) material: i64,
    pub(crate) set: i64,
    pub(crate) define: i64,
    /// Of sections and all that has no offset of its own.
    pub(crate) other: i64,
    /// Factor of lengths.
    pub(crate) length: f64,
    pub(crate) prefix: String,
    pub(crate) suffix: String,
}

impl Default for Frame {
    fn default() -> Self {
        Self {
            node: 0,
            element: 0,
            part: 0,
            material: 0,
            set: 0,
            define: 0,
            other: 0,
            length: 1.0,
            prefix: String::new(),
            suffix: String::new(),
        }
    }
}

impl Frame {
    /// A title with prefix and suffix, which the solver sets off by dots.
    pub(crate) fn title(&self, title: String) -> String {
        let mut whole = title;
        if !self.prefix.is_empty() {
            whole = format!("{}.{whole}", self.prefix);
        }
        if !self.suffix.is_empty() {
            whole = format!("{whole}.{}", self.suffix);
        }
        whole
    }
}

impl Row<'_> {
    /// A field as an id with its offset; 0 (none) has no offset.
    ///
    /// # Errors
    /// As [`Row::id`].
    pub(crate) fn moved(&self, index: usize, name: &'static str, offset: i64) -> Result<u64, Error> {
        let id = self.id(index, name)?;
        if id == 0 || offset == 0 {
            return Ok(id);
        }
        id.checked_add_signed(offset)
            .ok_or_else(|| self.wrong(index, name, "an id that stays positive with its offset"))
    }
}

/// A block that was collected: its cards, and what its keyword says.
pub(crate) struct Block<'a> {
    /// The keyword in upper case, options included.
    pub(crate) keyword: &'a str,
    /// Words of the keyword between underscores.
    pub(crate) words: Vec<&'a str>,
    pub(crate) cards: &'a [Card<'a>],
    pub(crate) at: &'a At<'a>,
    pub(crate) frame: &'a Frame,
    /// Line of the keyword.
    pub(crate) line: u64,
}

impl<'a> Block<'a> {
    pub(crate) fn has(&self, word: &str) -> bool {
        self.words.contains(&word)
    }

    pub(crate) fn file(&self) -> &'a Arc<Path> {
        self.at.file
    }

    /// The card at an index.
    ///
    /// # Errors
    /// [`Error::CardMissing`].
    pub(crate) fn card(&self, index: usize, what: &'static str) -> Result<Card<'a>, Error> {
        let missing = || self.at.card_missing(self.cards.last().map_or(self.line, |card| card.line), what);
        self.cards.get(index).copied().ok_or_else(missing)
    }

    pub(crate) fn row(&self, index: usize, widths: &[u8], what: &'static str) -> Result<Row<'a>, Error> {
        Ok(self.card(index, what)?.row(widths, self.at))
    }

    /// Whether nothing but blank cards is left from this index on.
    pub(crate) fn ends_at(&self, index: usize) -> bool {
        self.cards.get(index..).is_none_or(|rest| rest.iter().all(Card::is_blank))
    }
}

/// Reads a collected block into the deck. `false`: this keyword is not one that is read.
///
/// # Errors
/// What is wrong with a card.
pub(crate) fn read(block: &Block<'_>, deck: &mut Deck) -> Result<bool, Error> {
    match block.words[..] {
        ["TITLE", ..] => small::title(block, deck),
        ["PART", ..] => return parts::read(block, deck),
        ["SECTION", ..] => sections::section(block, deck)?,
        ["MAT", ..] => sections::material(block, deck)?,
        ["SET", ..] => return sets::read(block, deck),
        ["CONSTRAINED", ..] => return connections::constrained(block, deck),
        ["CONTACT", ..] => connections::contact(block, deck)?,
        _ => return Ok(false),
    }
    Ok(true)
}

/// Whether blocks of this keyword are worth collecting.
pub(crate) fn is_read(words: &[&str]) -> bool {
    match words {
        ["TITLE" | "SECTION" | "MAT" | "PARAMETER" | "INCLUDE", ..] => true,
        ["PART", ..] => parts::is_read(words),
        ["SET", ..] => sets::kind(words).is_some(),
        ["DEFINE", "TRANSFORMATION", ..] => true,
        ["CONSTRAINED", ..] => connections::is_constraint(words),
        ["CONTACT", ..] => connections::is_tie(words),
        _ => false,
    }
}

/// The format of a block: its suffix, or that of its file.
pub(crate) fn format_of(suffix: Option<char>, file: Format) -> Format {
    match suffix {
        Some('+') => Format::Long,
        Some('%') => Format::I10,
        Some('-') => Format::Standard,
        _ => file,
    }
}
