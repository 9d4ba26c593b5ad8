//! What holds parts together: *CONSTRAINED_SPOTWELD and its like, and tied contacts.

use super::Block;
use crate::deck::{Connection, Deck, Holds, Surface, SurfaceKind, Tie, place};
use crate::error::Error;
use crate::row::TENS;

/// The constraints that join sheets.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Constraint {
    Spotweld,
    Rivet,
    NodeSet,
    RigidBody,
    WeldSpot,
    Weld,
    TiedNodes,
    InterpolationSpotweld,
    Spr2,
}

fn constraint(words: &[&str]) -> Option<Constraint> {
    Some(match words.get(1..)? {
        ["SPOTWELD", ..] => Constraint::Spotweld,
        ["RIVET", ..] => Constraint::Rivet,
        ["NODE", "SET", ..] => Constraint::NodeSet,
        ["NODAL", "RIGID", "BODY", ..] | ["NODAL", "RIGIDBODY", ..] => Constraint::RigidBody,
        ["GENERALIZED", "WELD", "SPOT", ..] => Constraint::WeldSpot,
        ["GENERALIZED", "WELD", ..] => Constraint::Weld,
        ["TIED", "NODES", ..] => Constraint::TiedNodes,
        ["INTERPOLATION", "SPOTWELD", ..] => Constraint::InterpolationSpotweld,
        ["SPR2", ..] => Constraint::Spr2,
        _ => return None,
    })
}

pub(crate) fn is_constraint(words: &[&str]) -> bool {
    constraint(words).is_some()
}

pub(crate) fn constrained(block: &Block<'_>, deck: &mut Deck) -> Result<bool, Error> {
    let Some(constraint) = constraint(&block.words) else { return Ok(false) };
    let frame = block.frame;
    let mut at = 0;
    while !block.ends_at(at) {
        let mut id = 0;
        if block.has("TITLE") && constraint == Constraint::RigidBody {
            at += 1;
        } else if block.has("ID") {
            id = block.row(at, TENS, "the id's card")?.id(0, "ID")?;
            at += 1;
        }
        let row = block.row(at, TENS, "the card of what is held")?;
        at += 1;
        let set = |index: usize| row.moved(index, "NSID", frame.set);
        let holds = match constraint {
            Constraint::Spotweld | Constraint::Rivet => {
                at += usize::from(block.has("FILTERED"));
                Holds::Nodes([row.moved(0, "N1", frame.node)?, row.moved(1, "N2", frame.node)?])
            }
            Constraint::NodeSet => Holds::NodeSet(set(0)?),
            Constraint::RigidBody => {
                id = row.moved(0, "PID", frame.part)?;
                at += usize::from(block.has("SPC"));
                if block.has("INERTIA") {
                    let local = block.row(at, TENS, "the inertia's card (XC, …, IRCS)")?.integer(4, "IRCS")? == 1;
                    at += 3 + usize::from(local);
                }
                at += usize::from(block.has("OVERRIDE"));
                // Without a set the one with the body's own id is meant.
                Holds::NodeSet(match set(2)? {
                    0 => row.moved(0, "PID", frame.set)?,
                    set => set,
                })
            }
            Constraint::WeldSpot => {
                at += 1;
                Holds::NodeSet(set(0)?)
            }
            Constraint::Weld => {
                at = block.cards.len();
                Holds::NodeSet(set(0)?)
            }
            Constraint::TiedNodes => Holds::CoincidentNodes(set(0)?),
            Constraint::InterpolationSpotweld | Constraint::Spr2 => {
                at = block.cards.len();
                let parts = [row.moved(0, "PID1", frame.part)?, row.moved(1, "PID2", frame.part)?];
                Holds::SheetsAt { parts, set: set(2)? }
            }
        };
        let place = place(block.file(), row.line);
        deck.connections.push(Connection { keyword: block.keyword.to_owned(), id, holds, place });
    }
    Ok(true)
}

/// Whether a contact ties: TIED in its name, a spot weld, or glue that may break (TIEBREAK).
pub(crate) fn is_tie(words: &[&str]) -> bool {
    words[1..].iter().any(|word| matches!(*word, "TIED" | "SPOTWELD" | "TIEBREAK")) && words.get(1) != Some(&"2D")
}

pub(crate) fn contact(block: &Block<'_>, deck: &mut Deck) -> Result<(), Error> {
    let frame = block.frame;
    let mut at = 0;
    let (mut id, mut title) = (0, String::new());
    if block.has("ID") || block.has("TITLE") {
        let row = block.row(0, &[10, 70], "the contact's id and title")?;
        id = row.id(0, "CID")?;
        title = frame.title(row.text(1));
        at += 1;
    }
    if block.has("MPP") {
        at += 1;
        // A second card starts with an ampersand.
        at += usize::from(block.card(at, "the contact's card")?.text.starts_with(b"&"));
    }
    let row = block.row(at, TENS, "the contact's card (SURFA, SURFB, …)")?;
    let surface = |side: usize, name: &'static str| -> Result<Surface, Error> {
        let kind = match row.integer(side + 2, "SURFTYP")? {
            0 => SurfaceKind::Segments,
            1 => SurfaceKind::Shells,
            2 => SurfaceKind::Parts,
            3 => SurfaceKind::Part,
            4 => SurfaceKind::Nodes,
            5 => SurfaceKind::All,
            6 => SurfaceKind::AllBut,
            other => SurfaceKind::Other(other),
        };
        let offset = if kind == SurfaceKind::Part { frame.part } else { frame.set };
        Ok(Surface { kind, id: row.moved(side, name, offset)? })
    };
    let surfaces = [surface(0, "SURFA")?, surface(1, "SURFB")?];
    // The third card is often left out or blank.
    let third = block.cards.get(at + 2).map(|card| card.row(TENS, block.at));
    let thickness = |index: usize, name: &'static str| -> Result<f64, Error> {
        Ok(third.as_ref().map_or(Ok(0.0), |row| row.real(index, name))? * frame.length)
    };
    deck.ties.push(Tie {
        keyword: block.keyword.to_owned(),
        id,
        title,
        surfaces,
        thickness: [thickness(2, "SAST")?, thickness(3, "SBST")?],
        place: place(block.file(), row.line),
    });
    Ok(())
}
