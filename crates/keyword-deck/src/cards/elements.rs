//! *NODE and *ELEMENT_…, card by card, with the suffix cards that an element brings.

use super::Frame;
use crate::deck::{Beam, Deck, Shell, ShellCards, Solid};
use crate::error::Error;
use crate::row::{At, Card, EIGHTS, Row, SIXTEENS, TENS};

/// *NODE: NID, X, Y, Z, TC, RC.
pub(crate) fn node(card: Card<'_>, at: &At<'_>, frame: &Frame, deck: &mut Deck) -> Result<(), Error> {
    let row = card.row(&[8, 16, 16, 16], at);
    let id = row.moved(0, "NID", frame.node)?;
    let position = [row.real(1, "X")?, row.real(2, "Y")?, row.real(3, "Z")?];
    deck.node_ids.push(id);
    deck.coordinates.push(position);
    Ok(())
}

/// Of what kind the elements of a block are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Shell,
    Solid,
    ThickShell,
    Beam,
    Counted,
}

/// A card that is still to come for the element at hand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Next {
    /// Ten node ids of a solid, the first ones.
    Nodes,
    /// THIC1…THIC4 and an angle.
    Thickness,
    Offset,
    /// Read past.
    Other,
}

/// A block of elements.
#[derive(Debug, Clone)]
pub(crate) struct Elements {
    kind: Kind,
    /// Cards that every element brings after its first.
    extra: Vec<Next>,
    /// Plies follow until a card that is an element's again.
    composite: bool,
    long_plies: bool,
    /// Cards after the eid–pid card with node ids; 0: found out card by card.
    node_cards: usize,
    /// A tetrahedron or pentahedron of higher order: so many corners.
    corners: usize,
    /// Thickness cards: one more for elements with nodes on their edges.
    thickness: bool,
    /// Cards to come, the next one last.
    to_come: Vec<Next>,
    name: String,
}

impl Elements {
    /// How to read `*ELEMENT_…`; `None` for those that are no mesh of ours (splines, sources, pulleys).
    pub(crate) fn of(words: &[&str]) -> Option<Elements> {
        let (kind, options) = match words {
            ["ELEMENT", kind, options @ ..] => (*kind, options),
            _ => return None,
        };
        let has = |word: &str| options.contains(&word);
        let mut extra = Vec::new();
        let add = |extra: &mut Vec<Next>, next: Next, count: usize| extra.extend(std::iter::repeat_n(next, count));
        let known: &[&str];
        let (mut node_cards, mut corners, mut thickness) = (0, 8, false);
        let which = match kind {
            "SHELL" => {
                known = &["THICKNESS", "BETA", "MCID", "OFFSET", "DOF", "COMPOSITE", "LONG", "SHL4", "TO", "SHL8"];
                thickness = has("THICKNESS") || has("BETA") || has("MCID");
                add(&mut extra, Next::Thickness, usize::from(thickness));
                add(&mut extra, Next::Offset, usize::from(has("OFFSET")));
                add(&mut extra, Next::Other, usize::from(has("DOF")));
                Kind::Shell
            }
            "SOLID" => {
                known = &[
                    "ORTHO",
                    "DOF",
                    "TET4TOTET10",
                    "T4TOT10",
                    "T4TOT15",
                    "H20",
                    "H27",
                    "H64",
                    "H8TOH20",
                    "H8TOH27",
                    "H8TOH64",
                    "P21",
                    "P40",
                    "P6TOP21",
                    "T15",
                    "T20",
                    "FORMAT2",
                ];
                for (option, cards, count) in [
                    ("H20", 2, 8),
                    ("H27", 3, 8),
                    ("H64", 7, 8),
                    ("P21", 3, 6),
                    ("P40", 4, 6),
                    ("T15", 2, 4),
                    ("T20", 2, 4),
                ] {
                    if has(option) {
                        (node_cards, corners) = (cards, count);
                    }
                }
                add(&mut extra, Next::Other, 2 * usize::from(has("ORTHO")) + usize::from(has("DOF")));
                Kind::Solid
            }
            "TSHELL" => {
                known = &["BETA", "COMPOSITE"];
                add(&mut extra, Next::Other, usize::from(has("BETA")));
                Kind::ThickShell
            }
            "BEAM" => {
                known =
                    &["THICKNESS", "SCALAR", "SCALR", "SECTION", "PID", "OFFSET", "ORIENTATION", "WARPAGE", "ELBOW"];
                add(&mut extra, Next::Other, options.len());
                Kind::Beam
            }
            _ => {
                known = options;
                Kind::Counted
            }
        };
        if !options.iter().all(|option| known.contains(option)) {
            return None;
        }
        Some(Elements {
            kind: which,
            extra,
            composite: has("COMPOSITE") && kind != "SOLID",
            long_plies: has("LONG"),
            node_cards,
            corners,
            thickness,
            to_come: Vec::new(),
            name: kind.to_owned(),
        })
    }

    /// Takes the next card of the block.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(crate) fn card(&mut self, card: Card<'_>, at: &At<'_>, frame: &Frame, deck: &mut Deck) -> Result<(), Error> {
        if let Some(next) = self.to_come.pop() {
            return self.suffix(next, card, at, frame, deck);
        }
        if card.is_blank() {
            return Ok(());
        }
        if self.kind == Kind::Counted {
            *deck.other_elements.entry(self.name.clone()).or_default() += 1;
            return Ok(());
        }
        let row = card.row(EIGHTS, at);
        if self.composite && self.has_element(deck) && is_ply(&row) {
            return self.plies(card, at, frame, deck);
        }
        self.to_come.extend(self.extra.iter().rev());
        let (id, part) = (row.moved(0, "EID", frame.element)?, row.moved(1, "PID", frame.part)?);
        let node = |index: usize| row.moved(index + 2, "N", frame.node);
        match self.kind {
            Kind::Shell => {
                let mut nodes = [node(0)?, node(1)?, node(2)?, node(3)?];
                if nodes[3] == 0 {
                    nodes[3] = nodes[2];
                }
                deck.shells.push(Shell { id, part, nodes });
                if self.thickness && (4..8).any(|index| node(index).is_ok_and(|node| node != 0)) {
                    let after = self.to_come.len() - 1;
                    self.to_come.insert(after, Next::Other);
                }
            }
            Kind::Beam => deck.beams.push(Beam { id, part, nodes: [node(0)?, node(1)?] }),
            Kind::Solid if self.node_cards > 0 || row.filled() <= 2 => {
                let rest = self.node_cards.max(1) - 1;
                self.to_come.extend(std::iter::repeat_n(Next::Other, rest));
                self.to_come.push(Next::Nodes);
                deck.solids.push(Solid { id, part, nodes: [0; 8] });
            }
            Kind::Solid | Kind::ThickShell => {
                let mut nodes = [0; 8];
                for (index, corner) in nodes.iter_mut().enumerate() {
                    *corner = node(index)?;
                }
                let all = if self.kind == Kind::Solid { &mut deck.solids } else { &mut deck.thick_shells };
                all.push(Solid { id, part, nodes: whole(nodes) });
            }
            Kind::Counted => {}
        }
        Ok(())
    }

    fn has_element(&self, deck: &Deck) -> bool {
        match self.kind {
            Kind::ThickShell => !deck.thick_shells.is_empty(),
            _ => !deck.shells.is_empty(),
        }
    }

    fn suffix(&mut self, next: Next, card: Card<'_>, at: &At<'_>, frame: &Frame, deck: &mut Deck) -> Result<(), Error> {
        match next {
            Next::Nodes => {
                let row = card.row(EIGHTS, at);
                let mut ten = [0; 10];
                for (index, node) in ten.iter_mut().enumerate() {
                    *node = row.moved(index, "N", frame.node)?;
                }
                let mut nodes: [u64; 8] = std::array::from_fn(|index| ten[index]);
                // Ten nodes make a tetrahedron with nodes on its edges.
                let corners = if self.node_cards == 0 && ten[8] != 0 && ten[9] != 0 { 4 } else { self.corners };
                (corners..8).for_each(|index| nodes[index] = nodes[corners - 1]);
                if let Some(solid) = deck.solids.last_mut() {
                    solid.nodes = whole(nodes);
                }
            }
            Next::Thickness => {
                let row = card.row(SIXTEENS, at);
                let mut thickness = [0.0; 4];
                for (corner, value) in thickness.iter_mut().enumerate() {
                    *value = row.real(corner, "THIC")? * frame.length;
                }
                let given = thickness != [0.0; 4];
                if given && let Some(cards) = cards_of(deck) {
                    cards.thickness = Some(thickness);
                }
            }
            Next::Offset => {
                let offset = card.row(SIXTEENS, at).real(0, "OFFSET")? * frame.length;
                if let Some(cards) = cards_of(deck) {
                    cards.offset = Some(offset);
                }
            }
            Next::Other => {}
        }
        Ok(())
    }

    fn plies(&self, card: Card<'_>, at: &At<'_>, frame: &Frame, deck: &mut Deck) -> Result<(), Error> {
        if self.kind != Kind::Shell {
            return Ok(());
        }
        let row = card.row(TENS, at);
        for first in if self.long_plies { &[0][..] } else { &[0, 4] } {
            let (material, thickness) = (row.moved(*first, "MID", frame.material)?, row.real(first + 1, "THICK")?);
            if (material != 0 || thickness != 0.0)
                && let Some(cards) = cards_of(deck)
            {
                cards.plies.push((material, thickness * frame.length));
            }
        }
        Ok(())
    }

    /// The block is over.
    ///
    /// # Errors
    /// [`Error::CardMissing`] if an element has not all its cards.
    pub(crate) fn end(&self, at: &At<'_>, line: u64) -> Result<(), Error> {
        match self.to_come.last() {
            Some(Next::Nodes) => Err(at.card_missing(line, "the card with the solid's nodes")),
            Some(Next::Thickness) => Err(at.card_missing(line, "the card with the shell's thicknesses")),
            // What is read past is not missed.
            Some(Next::Offset | Next::Other) | None => Ok(()),
        }
    }
}

/// A tetrahedron or a wedge that leaves its last corners blank repeats the last one it has.
fn whole(mut nodes: [u64; 8]) -> [u64; 8] {
    for corner in 1..8 {
        if nodes[corner] == 0 {
            nodes[corner] = nodes[corner - 1];
        }
    }
    nodes
}

/// The suffix cards of the last shell.
fn cards_of(deck: &mut Deck) -> Option<&mut ShellCards> {
    let shell = deck.shells.len().checked_sub(1)?;
    if deck.shell_cards.last().is_none_or(|cards| cards.shell != shell) {
        deck.shell_cards.push(ShellCards { shell, thickness: None, offset: None, plies: Vec::new() });
    }
    deck.shell_cards.last_mut()
}

/// Whether a card in a block of composites is one of plies: it has a real number in it, or too few ids for an element.
fn is_ply(row: &Row<'_>) -> bool {
    (0..10).any(|index| row.bytes(index).iter().any(|byte| matches!(byte, b'.' | b'e' | b'E'))) || row.filled() < 5
}
