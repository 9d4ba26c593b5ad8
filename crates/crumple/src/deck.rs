//! Keyword decks: a mesh without states, the titles of parts, and what holds parts together.
//!
//! With [`crate::run`] this is where the reader of decks is known.

use std::collections::{BTreeMap, HashMap};
use std::io::Read;
use std::path::{Path, PathBuf};

use keyword_deck::{Deck, SetKind, Skipped};
use serde::Serialize;

use crate::Error;

/// Endings of the names of decks.
const ENDINGS: &[&str] = &["k", "key", "dyn"];

/// Whether a file is a deck: by the ending of its name, or because its first line with something in it is a keyword.
pub fn is_deck(path: &Path) -> bool {
    let named = path
        .extension()
        .and_then(|ending| ending.to_str())
        .is_some_and(|ending| ENDINGS.iter().any(|known| ending.eq_ignore_ascii_case(known)));
    path.is_file() && (named || starts_with_a_keyword(path))
}

fn starts_with_a_keyword(path: &Path) -> bool {
    let mut head = Vec::new();
    let read = std::fs::File::open(path).and_then(|file| file.take(1 << 12).read_to_end(&mut head));
    let empty = |line: &&[u8]| !line.starts_with(b"$") && !line.trim_ascii().is_empty();
    read.is_ok()
        && head.split(|byte| matches!(byte, b'\n' | b'\r')).find(empty).is_some_and(|line| {
            line.first() == Some(&b'*')
                && ["KEYWORD", "NODE", "ELEMENT_", "PART", "INCLUDE", "PARAMETER", "TITLE", "SET_", "SECTION_"]
                    .iter()
                    .any(|word| {
                        line[1..].get(..word.len()).is_some_and(|name| name.eq_ignore_ascii_case(word.as_bytes()))
                    })
        })
}

/// Reads a deck with its includes.
///
/// # Errors
/// [`Error::Deck`].
pub fn read(path: &Path) -> Result<Deck, Error> {
    Ok(Deck::read(path)?)
}

/// The shells of a deck as faces of node indices.
#[derive(Debug, Clone, Default)]
pub(crate) struct Surface {
    /// Four node indices each (a triangle repeats its third), and the index of the part in [`Deck::part_table`].
    pub(crate) faces: Vec<([u32; 4], u32)>,
    /// Shells that name nodes which the deck does not define.
    pub(crate) left_out: usize,
}

impl Surface {
    pub(crate) fn of(deck: &Deck) -> Self {
        let node_of_id: HashMap<u64, u32> = deck.node_ids.iter().copied().zip(0..).collect();
        let part_of_id: HashMap<u64, u32> = deck.part_table().iter().map(|part| part.id).zip(0..).collect();
        let mut surface = Self::default();
        for shell in &deck.shells {
            let nodes = shell.nodes.map(|id| node_of_id.get(&id).copied());
            match (nodes, part_of_id.get(&shell.part)) {
                ([Some(a), Some(b), Some(c), Some(d)], Some(&part)) => surface.faces.push(([a, b, c, d], part)),
                _ => surface.left_out += 1,
            }
        }
        surface
    }
}

/// What a deck holds, for `crumple info`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DeckInfo {
    /// `keyword deck`.
    pub format: &'static str,
    /// Its title.
    pub title: String,
    /// Number of nodes.
    pub nodes: usize,
    /// Elements by kind.
    pub elements: BTreeMap<String, usize>,
    /// Parts, those without elements too.
    pub parts: Vec<DeckPart>,
    /// Sections by kind.
    pub sections: BTreeMap<String, usize>,
    /// Number of materials.
    pub materials: usize,
    /// Sets by kind.
    pub sets: BTreeMap<&'static str, usize>,
    /// Welds, rivets and rigid bodies by keyword.
    pub connections: BTreeMap<String, usize>,
    /// Tied contacts by keyword.
    pub ties: BTreeMap<String, usize>,
    /// Number of parameters.
    pub parameters: usize,
    /// The files, includes as often as they are included.
    pub files: Vec<DeckFileInfo>,
    /// Keywords that are not read.
    pub skipped: BTreeMap<String, SkippedInfo>,
    /// What the reader noticed.
    pub warnings: Vec<DeckWarning>,
}

/// A part of a deck.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DeckPart {
    /// Its id.
    pub id: u64,
    /// Its title.
    pub title: String,
    /// Shells.
    pub shells: usize,
    /// Solids.
    pub solids: usize,
    /// Thick shells.
    pub thick_shells: usize,
    /// Beams.
    pub beams: usize,
    /// Thickness of its shells, or diameter of its beams, by its section, length unit.
    pub thickness: Option<f64>,
    /// Keyword of its material.
    pub material: Option<String>,
}

/// A file of a deck.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct DeckFileInfo {
    /// Its path.
    pub path: PathBuf,
    /// Its lines.
    pub lines: u64,
    /// How deep it is included.
    pub depth: usize,
}

/// Something that the reader noticed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct DeckWarning {
    /// A word that scripts can rely on.
    pub kind: &'static str,
    /// The whole sentence.
    pub message: String,
}

/// Blocks that were read past.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct SkippedInfo {
    /// How many.
    pub blocks: u64,
    /// Cards in them.
    pub cards: u64,
}

/// What a deck holds.
pub fn info(deck: &Deck) -> DeckInfo {
    let resolver = keyword_deck::Resolver::new(deck);
    let part = |part: keyword_deck::PartRow| DeckPart {
        thickness: resolver.part_thickness(part.id),
        material: resolver.material(part.id).map(str::to_owned),
        id: part.id,
        title: part.title,
        shells: part.elements.shells,
        solids: part.elements.solids,
        thick_shells: part.elements.thick_shells,
        beams: part.elements.beams,
    };
    let mut elements: BTreeMap<String, usize> = [
        ("shells", deck.shells.len()),
        ("solids", deck.solids.len()),
        ("thick_shells", deck.thick_shells.len()),
        ("beams", deck.beams.len()),
        ("sph", 0),
    ]
    .map(|(kind, count)| (kind.to_owned(), count))
    .into();
    elements.extend(deck.other_elements.iter().map(|(kind, &count)| (kind.to_ascii_lowercase(), count)));
    DeckInfo {
        format: "keyword deck",
        title: deck.title.clone(),
        nodes: deck.node_ids.len(),
        elements,
        parts: deck.part_table().into_iter().map(part).collect(),
        sections: counts(deck.sections.iter().map(|section| section.kind.clone())),
        materials: deck.materials.len(),
        sets: counts(deck.sets.iter().map(|set| SetKind::name(set.kind))),
        connections: counts(deck.connections.iter().map(|connection| connection.keyword.clone())),
        ties: counts(deck.ties.iter().map(|tie| tie.keyword.clone())),
        parameters: deck.parameters,
        files: deck
            .files
            .iter()
            .map(|file| DeckFileInfo { path: file.path.clone(), lines: file.lines, depth: file.depth })
            .collect(),
        skipped: deck
            .skipped
            .iter()
            .map(|(keyword, &Skipped { blocks, cards })| (keyword.clone(), SkippedInfo { blocks, cards }))
            .collect(),
        warnings: deck
            .warnings
            .iter()
            .map(|warning| DeckWarning { kind: warning.kind(), message: warning.to_string() })
            .collect(),
    }
}

fn counts<T: Ord>(names: impl Iterator<Item = T>) -> BTreeMap<T, usize> {
    let mut counts = BTreeMap::new();
    names.for_each(|name| *counts.entry(name).or_default() += 1);
    counts
}
