//! *SET_NODE, _SEGMENT, _PART, _SHELL, _SOLID, _TSHELL, _BEAM with LIST, COLUMN, GENERATE, GENERAL, ADD, INTERSECT.

use super::{Block, Frame};
use crate::deck::Deck;
use crate::error::Error;
use crate::row::{Row, TENS};
use crate::set::{Clause, Set, SetKind};

/// How a set is written.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Form {
    List,
    Column,
    Generate,
    Increment,
    General,
    Add,
    AddAdvanced,
    Intersect,
}

/// Of what this keyword's sets are; `None` if they are not read.
pub(crate) fn kind(words: &[&str]) -> Option<SetKind> {
    form(words)?;
    SetKind::of(words.get(1)?)
}

fn form(words: &[&str]) -> Option<Form> {
    let rest: Vec<&str> = words
        .get(2..)?
        .iter()
        .copied()
        .filter(|word| !matches!(*word, "TITLE" | "COLLECT" | "LIST" | "SMOOTH"))
        .collect();
    Some(match rest[..] {
        [] => Form::List,
        ["COLUMN"] => Form::Column,
        ["GENERATE"] => Form::Generate,
        ["GENERATE", "INCREMENT"] => Form::Increment,
        ["GENERAL"] => Form::General,
        ["ADD"] => Form::Add,
        ["ADD", "ADVANCED"] => Form::AddAdvanced,
        ["INTERSECT"] => Form::Intersect,
        _ => return None,
    })
}

pub(crate) fn read(block: &Block<'_>, deck: &mut Deck) -> Result<bool, Error> {
    let Some((kind, form)) = kind(&block.words).zip(form(&block.words)) else { return Ok(false) };
    let frame = block.frame;
    let titled = usize::from(block.has("TITLE"));
    let title = if titled == 1 { frame.title(block.card(0, "a set's title")?.title()) } else { String::new() };
    let head = block.row(titled, TENS, "the set's id (SID)")?;
    let id = head.moved(0, "SID", frame.set)?;
    let mut clauses = Vec::new();
    let mut ids = Vec::new();
    let mut segments = Vec::new();
    let offset = offset_of(kind, frame);
    for card in block.cards.iter().skip(titled + 1).filter(|card| !card.is_blank()) {
        let row = card.row(TENS, block.at);
        match form {
            Form::List if kind == SetKind::Segments => segments.push(segment(&row, 0, frame)?),
            Form::List => push_ids(&row, 0, offset, &mut ids)?,
            Form::Column => ids.push(row.moved(0, "ID", offset)?),
            Form::Generate => {
                for pair in 0..4 {
                    let (first, last) =
                        (row.moved(2 * pair, "BBEG", offset)?, row.moved(2 * pair + 1, "BEND", offset)?);
                    if first != 0 {
                        clauses.push(Clause::Range { first, last: last.max(first), step: 1 });
                    }
                }
            }
            Form::Increment => {
                let (first, last) = (row.moved(0, "BBEG", offset)?, row.moved(1, "BEND", offset)?);
                clauses.push(Clause::Range { first, last, step: row.id(2, "INCR")?.max(1) });
            }
            Form::General => clauses.push(option(&row, kind, frame)?),
            Form::Add | Form::Intersect => push_ids(&row, 0, frame.set, &mut ids)?,
            Form::AddAdvanced => {
                for pair in 0..4 {
                    let set = row.moved(2 * pair, "SID", frame.set)?;
                    let word = match row.integer(2 * pair + 1, "TYPE")? {
                        1 => "SET_NODE",
                        2 => "SET_SHELL",
                        3 => "SET_BEAM",
                        4 => "SET_SOLID",
                        5 => "SET_SEGMENT",
                        7 => "SET_TSHELL",
                        _ => "SET_OTHER",
                    };
                    if set != 0 {
                        clauses.push(Clause::Option { word: word.to_owned(), ids: vec![set] });
                    }
                }
            }
        }
    }
    if !segments.is_empty() {
        clauses.push(Clause::Segments(segments));
    }
    if !ids.is_empty() {
        clauses.push(match form {
            Form::Add => Clause::Union(ids),
            Form::Intersect => Clause::Intersection(ids),
            _ => Clause::Ids(ids),
        });
    }
    let same = |set: &&mut Set| set.kind == kind && set.id == id;
    match deck.sets.iter_mut().rev().find(same).filter(|_| block.has("COLLECT")) {
        Some(set) => set.clauses.extend(clauses),
        None => deck.sets.push(Set { kind, id, title, clauses }),
    }
    Ok(true)
}

fn offset_of(kind: SetKind, frame: &Frame) -> i64 {
    match kind {
        SetKind::Nodes | SetKind::Segments => frame.node,
        SetKind::Parts => frame.part,
        _ => frame.element,
    }
}

/// The ids of a card from a field on; 0 and blank are none.
fn push_ids(row: &Row<'_>, from: usize, offset: i64, ids: &mut Vec<u64>) -> Result<(), Error> {
    for at in from..8 {
        let id = row.moved(at, "ID", offset)?;
        if id != 0 {
            ids.push(id);
        }
    }
    Ok(())
}

fn segment(row: &Row<'_>, from: usize, frame: &Frame) -> Result<[u64; 4], Error> {
    let mut nodes = [0; 4];
    for (corner, node) in nodes.iter_mut().enumerate() {
        *node = row.moved(from + corner, "N", frame.node)?;
    }
    Ok(nodes)
}

/// A line of GENERAL: an option and up to seven ids.
fn option(row: &Row<'_>, kind: SetKind, frame: &Frame) -> Result<Clause, Error> {
    let word = row.text(0).to_ascii_uppercase();
    if kind == SetKind::Segments && word == "SEG" {
        return Ok(Clause::Segments(vec![segment(row, 1, frame)?]));
    }
    let offset = match word.trim_start_matches('D') {
        "PART" => frame.part,
        "NODE" | "SEG" => frame.node,
        "ELEM" | "SHELL" | "SOLID" | "BEAM" => frame.element,
        word if word.starts_with("SET_") => frame.set,
        _ => 0,
    };
    let mut ids = Vec::new();
    // Boxes and other options may have numbers that are no ids: those lines are kept by name.
    if push_ids(row, 1, offset, &mut ids).is_err() {
        ids.clear();
    }
    Ok(Clause::Option { word, ids })
}
