//! What a deck's welds and ties hold of the surface, as constraints for its operator: vertices that follow others.
//!
//! Spot welds, rivets and rigid bodies couple the vertices they hold. A tied contact couples each vertex of its one side
//! to the point below it inside a face of the other. A weld that is a beam or a solid of its own, tied to both sheets,
//! couples the points where it stands: the nearest vertex of the first sheet follows the point of the second sheet below
//! it, so the weld moves by less than half an edge and no sheet is sheared against the other.
//!
//! How far a tie reaches is the solver's rule (manual, general remarks on tied contacts): 0.6 of both thicknesses
//! together, or a twentieth of the face's diagonal (the triangle's longest side) if that is more; with negative SAST or SBST their amounts
//! take the place of the thicknesses and nothing else counts.

mod closest;
mod finder;
mod groups;

use std::collections::{BTreeMap, HashMap};
use std::path::PathBuf;

use keyword_deck::Deck;
use mesh_spectrum::Tie;
use serde::{Deserialize, Serialize};

use crate::reference::Reference;
use finder::Finder;

/// How separate sheets become one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Join {
    /// Mutually nearest vertices of different components at most this far apart, in the length unit.
    Distance(f64),
    /// What the deck says.
    Deck(DeckWord),
}

/// The word `deck`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum DeckWord {
    /// The only one.
    #[default]
    Deck,
}

impl Join {
    /// By the deck.
    pub const DECK: Join = Join::Deck(DeckWord::Deck);

    /// The distance, if that is how.
    pub fn distance(self) -> Option<f64> {
        match self {
            Join::Distance(distance) => Some(distance),
            Join::Deck(_) => None,
        }
    }
}

/// What a deck holds of a surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Joints {
    /// The deck's main file.
    pub deck: PathBuf,
    /// Vertices that follow others, by the user ids of their nodes.
    pub ties: Vec<NodeTie>,
    /// What each keyword brought.
    pub sources: BTreeMap<String, Source>,
    /// What could not be followed, in words.
    pub notes: Vec<String>,
}

/// A node that follows others, with their weights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NodeTie {
    /// User id of the node that follows.
    pub node: u64,
    /// User ids of the nodes it follows, each with its weight.
    pub to: Vec<(u64, f64)>,
}

/// What a keyword brought.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Source {
    /// How many of it the deck has: welds, contacts, or elements that weld.
    pub defined: usize,
    /// How many of them hold something of the surface.
    pub used: usize,
    /// How many ties they are.
    pub ties: usize,
    /// Nodes of a tied contact that have no face of the other side within reach.
    pub out_of_reach: usize,
}

impl Joints {
    /// The ties by vertices of the mesh.
    ///
    /// # Errors
    /// The first node that is not on the mesh.
    pub fn on_vertices(&self, reference: &Reference) -> Result<Vec<Tie>, u64> {
        let vertex_of_node: HashMap<u64, u32> = reference.node_ids.iter().copied().zip(0..).collect();
        let vertex = |node: u64| vertex_of_node.get(&node).copied().ok_or(node);
        let weights = |to: &[(u64, f64)]| -> Result<Vec<(u32, f64)>, u64> {
            to.iter().map(|&(node, weight)| Ok((vertex(node)?, weight))).collect()
        };
        self.ties.iter().map(|tie| Ok(Tie { vertex: vertex(tie.node)?, to: weights(&tie.to)? })).collect()
    }
}

/// Finds what the deck holds of the surface.
pub fn joints(deck: &Deck, reference: &Reference) -> Joints {
    let mut finder = Finder::new(deck, reference);
    finder.tied_contacts();
    finder.weld_elements();
    finder.connections();
    let Finder { ties, sources, resolver, mut notes, .. } = finder;
    notes.extend(resolver.unresolved.iter().map(ToString::to_string));
    let node = |vertex: u32| reference.node_ids[vertex as usize];
    Joints {
        deck: deck.path().to_owned(),
        ties: ties
            .into_iter()
            .map(|tie| NodeTie {
                node: node(tie.vertex),
                to: tie.to.into_iter().map(|(vertex, weight)| (node(vertex), weight)).collect(),
            })
            .collect(),
        sources,
        notes,
    }
}
