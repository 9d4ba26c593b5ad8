//! What a deck holds, as plain data: lengths in the deck's unit, ids as the user gave them, offsets of includes applied.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::error::Place;
use crate::set::Set;
use crate::warning::Warning;

/// A keyword deck with all its includes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Deck {
    /// *TITLE, of the first file that has one.
    pub title: String,
    /// The files read, in the order in which they were opened; one that was included twice is there twice.
    pub files: Vec<DeckFile>,
    /// User ids of the nodes, in the order of the deck.
    pub node_ids: Vec<u64>,
    /// Their positions, nodes × 3, transformations of includes applied.
    pub coordinates: Vec<[f64; 3]>,
    /// Shells.
    pub shells: Vec<Shell>,
    /// What the suffix cards of shells say, in rising order of the shell.
    pub shell_cards: Vec<ShellCards>,
    /// Solids.
    pub solids: Vec<Solid>,
    /// Thick shells.
    pub thick_shells: Vec<Solid>,
    /// Beams.
    pub beams: Vec<Beam>,
    /// Elements that are counted only, by kind: SPH, MASS, DISCRETE, ….
    pub other_elements: BTreeMap<String, usize>,
    /// Parts, in the order of the deck.
    pub parts: Vec<Part>,
    /// Sections.
    pub sections: Vec<Section>,
    /// Materials: id and keyword, not their values.
    pub materials: Vec<Material>,
    /// Sets of nodes, segments, parts and elements.
    pub sets: Vec<Set>,
    /// Welds, rivets, rigid bodies and tied nodes.
    pub connections: Vec<Connection>,
    /// Tied contacts.
    pub ties: Vec<Tie>,
    /// How many parameters it defines.
    pub parameters: usize,
    /// Keywords that were read past, with what was in them.
    pub skipped: BTreeMap<String, Skipped>,
    /// What the user should know.
    pub warnings: Vec<Warning>,
}

/// A file of a deck.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeckFile {
    /// Its path.
    pub path: PathBuf,
    /// Its lines.
    pub lines: u64,
    /// How deep it is included; 0 for the main file.
    pub depth: usize,
}

/// Blocks that were read past.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Skipped {
    /// How many blocks.
    pub blocks: u64,
    /// How many cards in all of them.
    pub cards: u64,
}

/// A shell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shell {
    /// Its id.
    pub id: u64,
    /// Its part's id.
    pub part: u64,
    /// Ids of its corner nodes in order around it; a triangle repeats its third. 0 where the card has none.
    pub nodes: [u64; 4],
}

/// What the suffix cards of a shell say (THICKNESS, BETA, MCID, OFFSET, COMPOSITE).
#[derive(Debug, Clone, PartialEq)]
pub struct ShellCards {
    /// Index of the shell.
    pub shell: usize,
    /// Thickness at the corners, length unit; 0 means that the section's counts.
    pub thickness: Option<[f64; 4]>,
    /// Distance of the mid surface from the plane of the nodes, length unit.
    pub offset: Option<f64>,
    /// Plies of a composite: material and thickness, length unit, from below.
    pub plies: Vec<(u64, f64)>,
}

/// A solid or thick shell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Solid {
    /// Its id.
    pub id: u64,
    /// Its part's id.
    pub part: u64,
    /// Ids of its corner nodes; a tetrahedron repeats its fourth, other shapes repeat as the deck does.
    pub nodes: [u64; 8],
}

/// A beam.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Beam {
    /// Its id.
    pub id: u64,
    /// Its part's id.
    pub part: u64,
    /// Ids of its two ends; 0 where the card has none.
    pub nodes: [u64; 2],
}

/// A part.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Its id.
    pub id: u64,
    /// Its title, without blanks around it; may be empty.
    pub title: String,
    /// Id of its section; 0 for a composite part.
    pub section: u64,
    /// Id of its material; 0 for a composite part.
    pub material: u64,
    /// Thickness of a composite part (*PART_COMPOSITE), the sum of its plies, length unit.
    pub thickness: Option<f64>,
    /// The keyword, with its options: `PART`, `PART_INERTIA`, ….
    pub keyword: String,
}

/// A section.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    /// Its id.
    pub id: u64,
    /// Its title, if it has one.
    pub title: String,
    /// Of what: `SHELL`, `SOLID`, `BEAM`, `TSHELL`, ….
    pub kind: String,
    /// Element formulation (ELFORM).
    pub formulation: i64,
    /// Thickness at the corners of a shell, or the outer diameters of a beam (TS1, TS2 and 0, 0), length unit.
    pub thickness: Option<[f64; 4]>,
}

/// A material.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Material {
    /// Its id.
    pub id: u64,
    /// Its keyword without options: `MAT_SPOTWELD`, `MAT_024`, ….
    pub keyword: String,
    /// Its title, if it has one.
    pub title: String,
}

/// Something that holds nodes together.
#[derive(Debug, Clone, PartialEq)]
pub struct Connection {
    /// Its keyword.
    pub keyword: String,
    /// Its id; 0 where it has none.
    pub id: u64,
    /// What it holds.
    pub holds: Holds,
    /// Where it is defined.
    pub place: Place,
}

/// What a connection holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Holds {
    /// Two nodes.
    Nodes([u64; 2]),
    /// All nodes of a set.
    NodeSet(u64),
    /// The nodes of a set that lie at one place.
    CoincidentNodes(u64),
    /// Two sheets, by part ids, at each node of a set.
    SheetsAt {
        /// The parts.
        parts: [u64; 2],
        /// The node set that marks the places.
        set: u64,
    },
}

/// A tied contact: nodes of the one surface are held by the faces of the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Tie {
    /// Its keyword.
    pub keyword: String,
    /// Its id; 0 where it has none.
    pub id: u64,
    /// Its title, if it has one.
    pub title: String,
    /// SURFA, whose nodes are held (the slave side of older manuals), and SURFB, whose faces hold.
    pub surfaces: [Surface; 2],
    /// SAST and SBST, length unit: contact thicknesses; negative ones alone decide how far is near.
    pub thickness: [f64; 2],
    /// Where it is defined.
    pub place: Place,
}

/// A side of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Surface {
    /// Of what the id is.
    pub kind: SurfaceKind,
    /// The id.
    pub id: u64,
}

/// SURFATYP and SURFBTYP.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SurfaceKind {
    /// 0: a segment set.
    Segments,
    /// 1: a shell set.
    Shells,
    /// 2: a part set.
    Parts,
    /// 3: a part.
    Part,
    /// 4: a node set.
    Nodes,
    /// 5: everything.
    All,
    /// 6: all parts but those of a part set.
    AllBut,
    /// Another one, by its number.
    Other(i64),
}

/// Elements by kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ElementCounts {
    /// Shells.
    pub shells: usize,
    /// Solids.
    pub solids: usize,
    /// Thick shells.
    pub thick_shells: usize,
    /// Beams.
    pub beams: usize,
}

/// A part of the table of all parts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PartRow {
    /// Its id.
    pub id: u64,
    /// Its title.
    pub title: String,
    /// Its elements.
    pub elements: ElementCounts,
}

impl Deck {
    /// All parts: those defined, in the order of the deck, then those that only elements name, by id.
    pub fn part_table(&self) -> Vec<PartRow> {
        let row = |id: u64, title: &str| PartRow { id, title: title.to_owned(), elements: ElementCounts::default() };
        let mut rows: Vec<PartRow> = self.parts.iter().map(|part| row(part.id, &part.title)).collect();
        let mut place: HashMap<u64, usize> = HashMap::new();
        rows.iter().enumerate().for_each(|(at, row)| {
            place.entry(row.id).or_insert(at);
        });
        let mut undefined: Vec<u64> = self.part_ids_of_elements().filter(|id| !place.contains_key(id)).collect();
        undefined.sort_unstable();
        undefined.dedup();
        for id in undefined {
            place.insert(id, rows.len());
            rows.push(row(id, ""));
        }
        let mut count = |part: u64, add: fn(&mut ElementCounts)| {
            if let Some(&at) = place.get(&part) {
                add(&mut rows[at].elements);
            }
        };
        self.shells.iter().for_each(|shell| count(shell.part, |counts| counts.shells += 1));
        self.solids.iter().for_each(|solid| count(solid.part, |counts| counts.solids += 1));
        self.thick_shells.iter().for_each(|shell| count(shell.part, |counts| counts.thick_shells += 1));
        self.beams.iter().for_each(|beam| count(beam.part, |counts| counts.beams += 1));
        rows
    }

    fn part_ids_of_elements(&self) -> impl Iterator<Item = u64> + '_ {
        let shells = self.shells.iter().map(|shell| shell.part);
        let solids = self.solids.iter().chain(&self.thick_shells).map(|solid| solid.part);
        shells.chain(solids).chain(self.beams.iter().map(|beam| beam.part))
    }

    /// The main file.
    pub fn path(&self) -> &Path {
        self.files.first().map_or(Path::new(""), |file| &file.path)
    }

    pub(crate) fn skip(&mut self, keyword: &str, cards: u64) {
        if !self.skipped.contains_key(keyword) {
            self.skipped.insert(keyword.to_owned(), Skipped::default());
        }
        if let Some(skipped) = self.skipped.get_mut(keyword) {
            skipped.blocks += 1;
            skipped.cards += cards;
        }
    }
}

pub(crate) fn place(file: &Arc<Path>, line: u64) -> Place {
    Place { file: file.clone(), line }
}
