//! Sets and surfaces as the ids and faces that they mean: unions, ranges and options carried out.

use std::collections::{BTreeSet, HashMap, HashSet};

use crate::deck::{Deck, Surface, SurfaceKind};
use crate::set::{Clause, Set, SetKind};

/// A face of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Face {
    /// Ids of its corner nodes; a triangle repeats its third.
    pub nodes: [u64; 4],
    /// Its shell, as an index; `None` for a segment that is no shell's.
    pub shell: Option<usize>,
}

/// Why a set has fewer members than the deck means.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Unresolved {
    /// The set is not defined.
    NoSet {
        /// Of what.
        kind: SetKind,
        /// Its id.
        id: u64,
    },
    /// Sets name each other in a circle.
    Circle {
        /// Of what.
        kind: SetKind,
        /// The set where it closes.
        id: u64,
    },
    /// An option of GENERAL or a kind of surface that is not followed.
    Option {
        /// Of what the set is.
        kind: SetKind,
        /// The set.
        id: u64,
        /// The option.
        word: String,
    },
    /// A kind of surface that is not followed.
    SurfaceKind(i64),
}

impl std::fmt::Display for Unresolved {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NoSet { kind, id } => write!(f, "*SET_{} {id} is not defined", kind.name()),
            Self::Circle { kind, id } => write!(f, "*SET_{} {id} contains itself", kind.name()),
            Self::Option { kind, id, word } => {
                write!(f, "*SET_{} {id}: its option {word} is not followed", kind.name())
            }
            Self::SurfaceKind(number) => write!(f, "surfaces of type {number} are not followed"),
        }
    }
}

/// Carries out the sets of a deck.
pub struct Resolver<'a> {
    deck: &'a Deck,
    sets: HashMap<(SetKind, u64), &'a Set>,
    /// Shells by their corner nodes in rising order: which shell a segment is.
    shell_of_face: HashMap<[u64; 4], usize>,
    thickness_of_section: HashMap<u64, f64>,
    section_of_part: HashMap<u64, u64>,
    thickness_of_part: HashMap<u64, f64>,
    /// Index in `deck.shell_cards` of each shell that has suffix cards.
    cards_of_shell: HashMap<usize, usize>,
    /// What could not be carried out.
    pub unresolved: BTreeSet<Unresolved>,
}

impl<'a> Resolver<'a> {
    /// Prepares a deck's tables.
    pub fn new(deck: &'a Deck) -> Self {
        let mut sets = HashMap::new();
        for set in &deck.sets {
            sets.entry((set.kind, set.id)).or_insert(set);
        }
        let mean = |values: [f64; 4]| values.iter().sum::<f64>() / 4.0;
        let mut resolver = Self {
            deck,
            sets,
            shell_of_face: deck.shells.iter().enumerate().map(|(at, shell)| (key(shell.nodes), at)).collect(),
            thickness_of_section: HashMap::new(),
            section_of_part: deck.parts.iter().map(|part| (part.id, part.section)).collect(),
            thickness_of_part: HashMap::new(),
            cards_of_shell: deck.shell_cards.iter().enumerate().map(|(at, cards)| (cards.shell, at)).collect(),
            unresolved: BTreeSet::new(),
        };
        for section in &deck.sections {
            let thickness = match (&*section.kind, section.thickness) {
                ("SHELL", Some(values)) => mean(values),
                ("BEAM", Some(values)) => values[0].max(values[1]),
                _ => continue,
            };
            resolver.thickness_of_section.entry(section.id).or_insert(thickness);
        }
        for part in &deck.parts {
            let section = resolver.thickness_of_section.get(&part.section).copied();
            if let Some(thickness) = part.thickness.or(section) {
                resolver.thickness_of_part.entry(part.id).or_insert(thickness);
            }
        }
        resolver
    }

    /// Thickness of a shell by its index, length unit: of its own card, its plies, its part or its section; 0 if the
    /// deck does not say.
    pub fn shell_thickness(&self, shell: usize) -> f64 {
        let own = self.cards_of_shell.get(&shell).map(|&at| &self.deck.shell_cards[at]);
        let of_corners = own.and_then(|cards| cards.thickness).map(|values| values.iter().sum::<f64>() / 4.0);
        let of_plies = own.map(|cards| cards.plies.iter().map(|ply| ply.1).sum::<f64>()).filter(|sum| *sum > 0.0);
        let part = self.deck.shells.get(shell).map_or(0, |shell| shell.part);
        of_corners.filter(|t| *t > 0.0).or(of_plies).or_else(|| self.part_thickness(part)).unwrap_or(0.0)
    }

    /// Thickness of a part's shells, or the diameter of its beams, length unit.
    pub fn part_thickness(&self, part: u64) -> Option<f64> {
        self.thickness_of_part.get(&part).copied()
    }

    /// Formulation (ELFORM) of the section of a part; 0 if it has none.
    pub fn formulation(&self, part: u64) -> i64 {
        let section = self.section_of_part.get(&part).copied().unwrap_or(0);
        self.deck.sections.iter().find(|there| there.id == section).map_or(0, |section| section.formulation)
    }

    /// Keyword of the material of a part.
    pub fn material(&self, part: u64) -> Option<&'a str> {
        let id = self.deck.parts.iter().find(|there| there.id == part)?.material;
        self.deck.materials.iter().find(|there| there.id == id).map(|material| &*material.keyword)
    }

    /// Members of a set of nodes, parts or elements: those that exist, in rising order, each once.
    pub fn ids(&mut self, kind: SetKind, id: u64) -> BTreeSet<u64> {
        let mut path = Vec::new();
        self.members(kind, id, &mut path)
    }

    fn members(&mut self, kind: SetKind, id: u64, path: &mut Vec<(SetKind, u64)>) -> BTreeSet<u64> {
        let mut found = BTreeSet::new();
        if path.contains(&(kind, id)) || path.len() > 100 {
            self.unresolved.insert(Unresolved::Circle { kind, id });
            return found;
        }
        let Some(set) = self.sets.get(&(kind, id)).copied() else {
            self.unresolved.insert(Unresolved::NoSet { kind, id });
            return found;
        };
        path.push((kind, id));
        for clause in &set.clauses {
            match clause {
                Clause::Ids(ids) => found.extend(ids),
                Clause::Range { first, last, step } => {
                    let inside = |id: &u64| (*first..=*last).contains(id) && (id - first).is_multiple_of(*step);
                    found.extend(self.all(kind).filter(inside));
                }
                Clause::Segments(segments) => found.extend(segments.iter().flatten().filter(|node| **node != 0)),
                Clause::Union(sets) => {
                    for &set in sets {
                        found.append(&mut self.members(kind, set, path));
                    }
                }
                Clause::Intersection(sets) => {
                    let mut shared: Option<BTreeSet<u64>> = None;
                    for &set in sets {
                        let members = self.members(kind, set, path);
                        shared = Some(match shared {
                            None => members,
                            Some(before) => before.intersection(&members).copied().collect(),
                        });
                    }
                    found.extend(shared.unwrap_or_default());
                }
                Clause::Option { word, ids } => self.option(kind, id, word, ids, &mut found, path),
            }
        }
        path.pop();
        found
    }

    fn option(
        &mut self,
        kind: SetKind,
        set: u64,
        word: &str,
        ids: &[u64],
        found: &mut BTreeSet<u64>,
        path: &mut Vec<(SetKind, u64)>,
    ) {
        let of: HashSet<u64> = ids.iter().copied().collect();
        let own = match kind {
            SetKind::Nodes | SetKind::Segments => "NODE",
            SetKind::Parts => "PART",
            _ => "ELEM",
        };
        match (kind, word) {
            (_, "ALL") => found.extend(self.all(kind)),
            (_, word) if word == own => found.extend(ids),
            (_, word) if word.strip_prefix('D') == Some(own) => found.retain(|id| !of.contains(id)),
            (SetKind::Nodes | SetKind::Segments, "PART") => found.extend(self.nodes_of_parts(&of)),
            (SetKind::Nodes, "DPART") => {
                let without: HashSet<u64> = self.nodes_of_parts(&of).into_iter().collect();
                found.retain(|id| !without.contains(id));
            }
            (SetKind::Shells | SetKind::Solids | SetKind::ThickShells | SetKind::Beams, "PART") => {
                found.extend(self.elements(kind).filter(|(_, part, _)| of.contains(part)).map(|(id, _, _)| id));
            }
            (SetKind::Nodes, word) if word.starts_with("SET_") => {
                let Some(other) = SetKind::of(word.trim_start_matches("SET_")) else {
                    self.unresolved.insert(Unresolved::Option { kind, id: set, word: word.to_owned() });
                    return;
                };
                for &id in ids {
                    let members = self.members(other, id, path);
                    match other {
                        SetKind::Nodes | SetKind::Segments => found.extend(members),
                        SetKind::Parts => found.extend(self.nodes_of_parts(&members.into_iter().collect())),
                        _ => {
                            let elements = self.elements(other).filter(|(id, ..)| members.contains(id));
                            found.extend(elements.flat_map(|(_, _, nodes)| nodes.iter().copied()));
                        }
                    }
                }
                found.remove(&0);
            }
            _ => {
                self.unresolved.insert(Unresolved::Option { kind, id: set, word: word.to_owned() });
            }
        }
    }

    /// All that could be a member.
    fn all(&self, kind: SetKind) -> Box<dyn Iterator<Item = u64> + 'a> {
        let deck = self.deck;
        match kind {
            SetKind::Nodes | SetKind::Segments => Box::new(deck.node_ids.iter().copied()),
            SetKind::Parts => Box::new(deck.part_table().into_iter().map(|part| part.id)),
            _ => Box::new(self.elements(kind).map(|(id, ..)| id)),
        }
    }

    /// Id, part and nodes of all elements of a kind.
    fn elements(&self, kind: SetKind) -> Box<dyn Iterator<Item = (u64, u64, &'a [u64])> + 'a> {
        let deck = self.deck;
        match kind {
            SetKind::Shells => Box::new(deck.shells.iter().map(|shell| (shell.id, shell.part, &shell.nodes[..]))),
            SetKind::Solids => Box::new(deck.solids.iter().map(|solid| (solid.id, solid.part, &solid.nodes[..]))),
            SetKind::ThickShells => {
                Box::new(deck.thick_shells.iter().map(|solid| (solid.id, solid.part, &solid.nodes[..])))
            }
            SetKind::Beams => Box::new(deck.beams.iter().map(|beam| (beam.id, beam.part, &beam.nodes[..]))),
            SetKind::Nodes | SetKind::Segments | SetKind::Parts => Box::new(std::iter::empty()),
        }
    }

    fn nodes_of_parts(&self, parts: &HashSet<u64>) -> Vec<u64> {
        let kinds = [SetKind::Shells, SetKind::Solids, SetKind::ThickShells, SetKind::Beams];
        let elements = kinds.into_iter().flat_map(|kind| self.elements(kind));
        elements.filter(|(_, part, _)| parts.contains(part)).flat_map(|(_, _, nodes)| nodes.iter().copied()).collect()
    }

    /// The nodes of a surface, in rising order.
    pub fn nodes(&mut self, surface: Surface) -> BTreeSet<u64> {
        let mut nodes: BTreeSet<u64> = match surface.kind {
            SurfaceKind::Nodes => self.ids(SetKind::Nodes, surface.id),
            SurfaceKind::Parts | SurfaceKind::Part | SurfaceKind::All | SurfaceKind::AllBut => {
                let parts = self.parts(surface);
                self.nodes_of_parts(&parts).into_iter().collect()
            }
            _ => self.faces(surface).iter().flat_map(|face| face.nodes).collect(),
        };
        nodes.remove(&0);
        nodes
    }

    /// The faces of a surface: segments, and shells.
    pub fn faces(&mut self, surface: Surface) -> Vec<Face> {
        let deck = self.deck;
        let face = |shell: usize| Face { nodes: deck.shells[shell].nodes, shell: Some(shell) };
        match surface.kind {
            SurfaceKind::Segments => {
                let mut path = Vec::new();
                let mut found = Vec::new();
                self.segments(surface.id, &mut path, &mut found);
                found
            }
            SurfaceKind::Shells => {
                let members = self.ids(SetKind::Shells, surface.id);
                let shells = deck.shells.iter().enumerate();
                shells.filter(|(_, shell)| members.contains(&shell.id)).map(|(at, _)| face(at)).collect()
            }
            SurfaceKind::Parts | SurfaceKind::Part | SurfaceKind::All | SurfaceKind::AllBut => {
                let parts = self.parts(surface);
                let shells = deck.shells.iter().enumerate();
                shells.filter(|(_, shell)| parts.contains(&shell.part)).map(|(at, _)| face(at)).collect()
            }
            // A node set has no faces.
            SurfaceKind::Nodes => Vec::new(),
            SurfaceKind::Other(number) => {
                self.unresolved.insert(Unresolved::SurfaceKind(number));
                Vec::new()
            }
        }
    }

    fn parts(&mut self, surface: Surface) -> HashSet<u64> {
        let all = |deck: &Deck| deck.part_table().into_iter().map(|part| part.id).collect::<HashSet<u64>>();
        match surface.kind {
            SurfaceKind::Part => HashSet::from([surface.id]),
            SurfaceKind::Parts => self.ids(SetKind::Parts, surface.id).into_iter().collect(),
            SurfaceKind::AllBut => {
                let but = self.ids(SetKind::Parts, surface.id);
                all(self.deck).into_iter().filter(|part| !but.contains(part)).collect()
            }
            _ => all(self.deck),
        }
    }

    fn segments(&mut self, id: u64, path: &mut Vec<u64>, found: &mut Vec<Face>) {
        let kind = SetKind::Segments;
        if path.contains(&id) || path.len() > 100 {
            self.unresolved.insert(Unresolved::Circle { kind, id });
            return;
        }
        let Some(set) = self.sets.get(&(kind, id)).copied() else {
            self.unresolved.insert(Unresolved::NoSet { kind, id });
            return;
        };
        path.push(id);
        for clause in &set.clauses {
            match clause {
                Clause::Segments(segments) => found.extend(segments.iter().map(|&[a, b, c, d]| {
                    let nodes = [a, b, c, if d == 0 { c } else { d }];
                    Face { nodes, shell: self.shell_of_face.get(&key(nodes)).copied() }
                })),
                Clause::Union(sets) => sets.iter().for_each(|&set| self.segments(set, path, found)),
                Clause::Option { word, ids } if matches!(&**word, "PART" | "PART_IO" | "SHELL" | "ALL") => {
                    let wanted: HashSet<u64> = ids.iter().copied().collect();
                    let chosen = |shell: &crate::deck::Shell| match &**word {
                        "ALL" => true,
                        "SHELL" => wanted.contains(&shell.id),
                        _ => wanted.contains(&shell.part),
                    };
                    let shells = self.deck.shells.iter().enumerate().filter(|(_, shell)| chosen(shell));
                    found.extend(shells.map(|(at, shell)| Face { nodes: shell.nodes, shell: Some(at) }));
                }
                Clause::Option { word, ids } if matches!(&**word, "SET_SHELL" | "SET_PART") => {
                    let kind = if word == "SET_SHELL" { SurfaceKind::Shells } else { SurfaceKind::Parts };
                    ids.iter().for_each(|&id| found.extend(self.faces(Surface { kind, id })));
                }
                Clause::Option { word, .. } => {
                    self.unresolved.insert(Unresolved::Option { kind, id, word: word.clone() });
                }
                Clause::Intersection(_) => {
                    self.unresolved.insert(Unresolved::Option { kind, id, word: "INTERSECT".into() });
                }
                Clause::Ids(_) | Clause::Range { .. } => {}
            }
        }
        path.pop();
    }
}

/// The same face whatever the order of its corners: different ids in rising order, the last one repeated.
fn key(nodes: [u64; 4]) -> [u64; 4] {
    let mut sorted = nodes;
    sorted.sort_unstable();
    let mut distinct = sorted.to_vec();
    distinct.dedup();
    std::array::from_fn(|at| distinct[at.min(distinct.len() - 1)])
}
