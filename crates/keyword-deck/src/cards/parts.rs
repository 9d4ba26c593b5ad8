//! *PART with its options: a title card, a data card, and the cards of the options in the manual's order.

use super::Block;
use crate::deck::{Deck, Part};
use crate::error::Error;
use crate::row::TENS;
use crate::warning::Warning;

/// Options of *PART whose cards start with a title card.
const OPTIONS: &[&str] = &[
    "INERTIA",
    "REPOSITION",
    "CONTACT",
    "PRINT",
    "ATTACHMENT",
    "NODES",
    "FIELD",
    "AVERAGED",
    "COMPOSITE",
    "LONG",
    "TSHELL",
];

/// Keywords that move or copy elements of parts; what they do is not followed.
const CHANGES: &[&str] = &["MOVE", "DUPLICATE", "STACKED"];

pub(crate) fn is_read(words: &[&str]) -> bool {
    words[1..].iter().all(|word| OPTIONS.contains(word)) || words.get(1).is_some_and(|word| CHANGES.contains(word))
}

pub(crate) fn read(block: &Block<'_>, deck: &mut Deck) -> Result<bool, Error> {
    if block.words.get(1).is_some_and(|word| CHANGES.contains(word)) {
        deck.warnings.push(Warning::NotFollowed {
            place: block.at.place(block.line),
            keyword: block.keyword.to_owned(),
            what: "the mesh read here is the one before it",
        });
        return Ok(false);
    }
    let mut at = 0;
    while !block.ends_at(at) {
        // A title may be blank; a lone line behind the last part is no part.
        if at > 0 && block.ends_at(at + 1) {
            break;
        }
        at = one(block, at, deck)?;
    }
    Ok(true)
}

/// Reads the part whose title is at `at`; gives back where the next one's is.
fn one(block: &Block<'_>, mut at: usize, deck: &mut Deck) -> Result<usize, Error> {
    let frame = block.frame;
    let title = frame.title(block.card(at, "a part's title")?.title());
    let row = block.row(at + 1, TENS, "a part's card (PID, SECID, MID, …)")?;
    let id = row.moved(0, "PID", frame.part)?;
    at += 2;
    let composite = block.has("COMPOSITE");
    let mut part = Part { id, title, section: 0, material: 0, thickness: None, keyword: block.keyword.to_owned() };
    if !composite {
        part.section = row.moved(1, "SECID", frame.other)?;
        part.material = row.moved(2, "MID", frame.material)?;
    }
    if block.has("INERTIA") {
        let local = block.row(at, TENS, "the inertia's card (XC, …, IRCS)")?.integer(4, "IRCS")? == 1;
        at += 3 + usize::from(local);
    }
    at += ["REPOSITION", "CONTACT", "PRINT", "ATTACHMENT", "FIELD"].iter().filter(|word| block.has(word)).count();
    if composite {
        let mut thickness = 0.0;
        for card in block.cards[at.min(block.cards.len())..].iter().filter(|card| !card.is_blank()) {
            let row = card.row(TENS, block.at);
            thickness += row.real(1, "THICK1")?;
            if !block.has("LONG") {
                thickness += row.real(5, "THICK2")?;
            }
        }
        part.thickness = (!block.has("TSHELL")).then_some(thickness * frame.length);
        at = block.cards.len();
    }
    if id == 0 {
        return Err(row.wrong(0, "PID", "a part's id, from 1"));
    }
    deck.parts.push(part);
    Ok(at)
}
