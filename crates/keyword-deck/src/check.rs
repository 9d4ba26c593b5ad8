//! What is looked at once the whole deck is there: ids defined twice, nodes that are nowhere.

use std::collections::HashSet;

use crate::deck::Deck;
use crate::warning::Warning;

pub(crate) fn look_over(deck: &mut Deck) {
    drop_second_nodes(deck);
    let mut seen = HashSet::with_capacity(deck.parts.len());
    let before = deck.parts.len();
    let mut first = 0;
    deck.parts.retain(|part| {
        let new = seen.insert(part.id);
        if !new && first == 0 {
            first = part.id;
        }
        new
    });
    if before > deck.parts.len() {
        deck.warnings.push(Warning::Twice { what: "part", id: first, count: before - deck.parts.len() });
    }
    missing_nodes(deck);
}

/// A node that is defined again at the same place is no matter; elsewhere it is. The first definition stays.
fn drop_second_nodes(deck: &mut Deck) {
    if deck.node_ids.is_sorted_by(|a, b| a < b) {
        return;
    }
    let mut seen = HashSet::with_capacity(deck.node_ids.len());
    let keep: Vec<bool> = deck.node_ids.iter().map(|&id| seen.insert(id)).collect();
    let count = keep.iter().filter(|keep| !**keep).count();
    if count == 0 {
        return;
    }
    let first = deck.node_ids.iter().zip(&keep).find(|(_, keep)| !**keep).map_or(0, |(id, _)| *id);
    let mut flags = keep.iter();
    deck.node_ids.retain(|_| flags.next().copied().unwrap_or(true));
    let mut flags = keep.iter();
    deck.coordinates.retain(|_| flags.next().copied().unwrap_or(true));
    deck.warnings.push(Warning::Twice { what: "node", id: first, count });
}

fn missing_nodes(deck: &mut Deck) {
    let defined = Ids::of(&deck.node_ids);
    let missing = |node: &u64| *node != 0 && !defined.has(*node);
    let shells = deck.shells.iter().map(|shell| (shell.id, &shell.nodes[..]));
    let solids = deck.solids.iter().chain(&deck.thick_shells).map(|solid| (solid.id, &solid.nodes[..]));
    let beams = deck.beams.iter().map(|beam| (beam.id, &beam.nodes[..]));
    let mut elements = 0;
    let mut example = None;
    for (id, nodes) in shells.chain(solids).chain(beams) {
        if let Some(node) = nodes.iter().copied().find(missing) {
            elements += 1;
            example.get_or_insert((id, node));
        }
    }
    if let Some((element, node)) = example {
        deck.warnings.push(Warning::NodesMissing { elements, element, node });
    }
}

/// Which ids there are: a bit each where they lie close, a sorted list where they do not.
enum Ids {
    Bits { first: u64, bits: Vec<u64> },
    Sorted(Vec<u64>),
}

impl Ids {
    fn of(ids: &[u64]) -> Ids {
        let (Some(&first), Some(&last)) = (ids.iter().min(), ids.iter().max()) else { return Ids::Sorted(Vec::new()) };
        // As a bit each they take no more memory than as words.
        if (last - first) / 64 <= ids.len() as u64 {
            let mut bits = vec![0; ((last - first) / 64 + 1) as usize];
            ids.iter().for_each(|id| bits[((id - first) / 64) as usize] |= 1 << ((id - first) % 64));
            return Ids::Bits { first, bits };
        }
        let mut sorted = ids.to_vec();
        sorted.sort_unstable();
        Ids::Sorted(sorted)
    }

    fn has(&self, id: u64) -> bool {
        match self {
            Ids::Bits { first, bits } => id
                .checked_sub(*first)
                .is_some_and(|at| bits.get((at / 64) as usize).is_some_and(|word| word >> (at % 64) & 1 == 1)),
            Ids::Sorted(sorted) => sorted.binary_search(&id).is_ok(),
        }
    }
}
