//! *INCLUDE and its kin: which files, and what happens to what they hold.

use crate::cards::{Block, Frame};
use crate::error::Error;
use crate::row::{TENS, decode};

/// What an include block asks for.
pub(crate) enum Include {
    /// More folders to search.
    Paths { folders: Vec<String>, relative: bool },
    /// Files to read, each with the line that names it.
    Files { names: Vec<(String, u64)>, change: Option<Change> },
    /// Something whose file is not a plain deck.
    NotFollowed,
}

/// What *INCLUDE_TRANSFORM does.
#[derive(Debug, Clone)]
pub(crate) struct Change {
    /// What it adds, and the factor of lengths.
    pub(crate) own: Frame,
    /// Id of the transformation; 0 for none.
    pub(crate) transformation: u64,
}

impl Change {
    /// The frame inside the include.
    pub(crate) fn inside(&self, outside: &Frame) -> Frame {
        let (add, own) = (i64::saturating_add, &self.own);
        Frame {
            node: add(outside.node, own.node),
            element: add(outside.element, own.element),
            part: add(outside.part, own.part),
            material: add(outside.material, own.material),
            set: add(outside.set, own.set),
            define: add(outside.define, own.define),
            other: add(outside.other, own.other),
            length: outside.length * own.length,
            prefix: join(&outside.prefix, &own.prefix),
            suffix: join(&own.suffix, &outside.suffix),
        }
    }
}

fn join(first: &str, second: &str) -> String {
    match (first, second) {
        ("", only) | (only, "") => only.to_owned(),
        _ => format!("{first}.{second}"),
    }
}

impl Include {
    /// Reads an include block; `None` for those that bring no mesh (stamped results, trimming, …).
    ///
    /// # Errors
    /// What is wrong with a card.
    pub(crate) fn of(block: &Block<'_>) -> Result<Option<Include>, Error> {
        Ok(Some(match block.words[1..] {
            [] => Include::Files { names: names(block, usize::MAX).0, change: None },
            ["PATH"] | ["PATH", "RELATIVE"] => {
                let folders = names(block, usize::MAX).0.into_iter().map(|(name, _)| name).collect();
                Include::Paths { folders, relative: block.has("RELATIVE") }
            }
            ["TRANSFORM"] => {
                let (names, next) = names(block, 1);
                let change = change(block, next)?;
                Include::Files { names, change: Some(change) }
            }
            ["TRANSFORM", "BINARY"] | ["BINARY" | "NASTRAN" | "UNITCELL", ..] | ["AUTO", "OFFSET", ..] => {
                Include::NotFollowed
            }
            _ => return Ok(None),
        }))
    }
}

/// At most `most` names, each of which may go on on the next card after ` +`; and the index of the card behind them.
fn names(block: &Block<'_>, most: usize) -> (Vec<(String, u64)>, usize) {
    let mut names: Vec<(String, u64)> = Vec::new();
    let mut at = 0;
    while at < block.cards.len() && names.len() < most {
        let card = block.cards[at];
        at += 1;
        let mut name = card.text.trim_ascii().to_vec();
        while let Some(head) = name.strip_suffix(b" +") {
            let Some(next) = block.cards.get(at) else { break };
            name = [head.trim_ascii_end(), next.text.trim_ascii()].concat();
            at += 1;
        }
        if !name.is_empty() {
            names.push((decode(&name), card.line));
        }
    }
    (names, at)
}

/// The four cards behind the name; those that are left out change nothing.
fn change(block: &Block<'_>, first: usize) -> Result<Change, Error> {
    let (mut own, mut transformation) = (Frame::default(), 0);
    let row = |index: usize| block.cards.get(first + index).map(|card| card.row(TENS, block.at));
    if let Some(row) = row(0) {
        own.node = row.integer(0, "IDNOFF")?;
        own.element = row.integer(1, "IDEOFF")?;
        own.part = row.integer(2, "IDPOFF")?;
        own.material = row.integer(3, "IDMOFF")?;
        own.set = row.integer(4, "IDSOFF")?;
        own.define = row.integer(6, "IDDOFF")?;
    }
    if let Some(row) = row(1) {
        own.other = row.integer(0, "IDROFF")?;
        own.prefix = row.text(2);
        own.suffix = row.text(3);
    }
    if let Some(row) = row(2) {
        // FCTTEM, a text, stands behind; a blank factor is one.
        let length = row.real(2, "FCTLEN")?;
        own.length = if length == 0.0 { 1.0 } else { length };
    }
    if let Some(row) = row(3) {
        transformation = match row.id(0, "TRANID")? {
            0 => 0,
            _ => row.moved(0, "TRANID", block.frame.define)?,
        };
    }
    Ok(Change { own, transformation })
}
