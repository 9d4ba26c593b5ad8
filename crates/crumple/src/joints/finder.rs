//! The search: tied contacts first, then elements that weld, which stand on what contacts tie, then all other joints.

use std::collections::{BTreeMap, HashMap};

use keyword_deck::{Deck, Face, Holds, Resolver, Surface, SurfaceKind};
use mesh_spectrum::Tie;

use super::Source;
use super::closest::{self, Closest, Foot, foot};
use super::groups::{self, Groups};
use crate::reference::Reference;

/// A place on the surface: means of vertices.
#[derive(Debug, Clone, PartialEq)]
enum Anchor {
    Vertex(u32),
    /// Weights, and a triangle near.
    Point(Vec<(u32, f64)>, u32),
}

/// What is gathered on the way.
pub(super) struct Finder<'a> {
    deck: &'a Deck,
    reference: &'a Reference,
    pub(super) resolver: Resolver<'a>,
    vertex_of_node: HashMap<u64, u32>,
    /// Where the deck has each node that no vertex is.
    position_of_node: HashMap<u64, [f64; 3]>,
    triangles_of_face: HashMap<[u64; 4], Vec<u32>>,
    /// Mean thickness of the shells at each vertex, length unit.
    thickness: Vec<f64>,
    groups: Groups,
    /// Where ties hold nodes that are no vertices.
    anchors: HashMap<u64, Anchor>,
    pub(super) ties: Vec<Tie>,
    pub(super) sources: BTreeMap<String, Source>,
    pub(super) notes: Vec<String>,
}

impl<'a> Finder<'a> {
    pub(super) fn new(deck: &'a Deck, reference: &'a Reference) -> Self {
        let resolver = Resolver::new(deck);
        let vertex_of_node: HashMap<u64, u32> = reference.node_ids.iter().copied().zip(0..).collect();
        let (mut sum, mut count) = (vec![0.0; reference.vertices()], vec![0.0; reference.vertices()]);
        for (at, shell) in deck.shells.iter().enumerate() {
            let thickness = resolver.shell_thickness(at);
            for vertex in shell.nodes.iter().filter_map(|node| vertex_of_node.get(node)) {
                sum[*vertex as usize] += thickness;
                count[*vertex as usize] += 1.0;
            }
        }
        let thickness = sum.iter().zip(&count).map(|(sum, count)| sum / f64::max(*count, 1.0)).collect();
        let nodes = deck.node_ids.iter().copied().zip(deck.coordinates.iter().copied());
        Self {
            deck,
            reference,
            resolver,
            position_of_node: nodes.filter(|(id, _)| !vertex_of_node.contains_key(id)).collect(),
            triangles_of_face: reference.triangles_of_face(),
            vertex_of_node,
            thickness,
            groups: Groups::of(&reference.mesh),
            anchors: HashMap::new(),
            ties: Vec::new(),
            sources: BTreeMap::new(),
            notes: Vec::new(),
        }
    }

    fn position(&self, node: u64) -> Option<[f64; 3]> {
        match self.vertex_of_node.get(&node) {
            Some(&vertex) => Some(self.reference.mesh.vertices()[vertex as usize]),
            None => self.position_of_node.get(&node).copied(),
        }
    }

    /// The mesh's triangles of some faces, with the faces' reach.
    fn triangles(&self, faces: &[Face], reach: impl Fn(&Face) -> f64) -> HashMap<u32, f64> {
        let mut found = HashMap::new();
        for face in faces {
            for &triangle in self.triangles_of_face.get(&crate::reference::face_key(face.nodes)).into_iter().flatten() {
                found.insert(triangle, reach(face));
            }
        }
        found
    }

    pub(super) fn tied_contacts(&mut self) {
        let deck = self.deck;
        for tie in &deck.ties {
            let source = self.sources.entry(tie.keyword.clone()).or_default();
            source.defined += 1;
            let before = (self.ties.len(), self.anchors.len());
            let nodes = self.resolver.nodes(tie.surfaces[0]);
            let mut faces = self.resolver.faces(tie.surfaces[1]);
            // Contacts with one side: everything in it is tied to everything else.
            if faces.is_empty() && tie.surfaces[1] == (Surface { kind: SurfaceKind::Segments, id: 0 }) {
                faces = self.resolver.faces(tie.surfaces[0]);
            }
            let [of_nodes, of_faces] = tie.thickness;
            let given = of_nodes < 0.0 || of_faces < 0.0;
            let own = |value: f64, thickness: f64| if value == 0.0 { thickness } else { value.abs() };
            let thickness_of =
                |face: &Face| own(of_faces, face.shell.map_or(0.0, |shell| self.resolver.shell_thickness(shell)));
            let thickness_of_triangle = self.triangles(&faces, thickness_of);
            let triangles: Vec<u32> = {
                let mut all: Vec<u32> = thickness_of_triangle.keys().copied().collect();
                all.sort_unstable();
                all
            };
            if triangles.is_empty() {
                self.notes
                    .push(format!("{}: *{}: no face of its second side is on the surface", tie.place, tie.keyword));
                continue;
            }
            let mesh = &self.reference.mesh;
            let closest = Closest::new(mesh, &triangles);
            let twentieth = |triangle: u32| if given { 0.0 } else { 0.05 * self.longest_side(triangle) };
            let most_thickness = thickness_of_triangle.values().copied().fold(0.0, f64::max);
            let most_diagonal = triangles.iter().map(|&triangle| twentieth(triangle)).fold(0.0, f64::max);
            let (mut found, mut out_of_reach) = (Vec::new(), 0);
            for node in nodes {
                let Some(position) = self.position(node) else { continue };
                let vertex = self.vertex_of_node.get(&node).copied();
                let thickness = own(of_nodes, vertex.map_or(0.0, |vertex| self.thickness[vertex as usize]));
                let radius = (0.6 * (thickness + most_thickness)).max(most_diagonal);
                let other = |triangle: u32| vertex.is_none_or(|v| !mesh.triangles()[triangle as usize].contains(&v));
                let reached = closest.find(position, radius, other).filter(|foot| {
                    let reach =
                        (0.6 * (thickness + thickness_of_triangle[&foot.triangle])).max(twentieth(foot.triangle));
                    foot.distance <= reach && foot.outside <= 0.05 * self.longest_side(foot.triangle)
                });
                match reached {
                    Some(foot) => found.push((node, vertex, foot)),
                    None => out_of_reach += usize::from(vertex.is_some()),
                }
            }
            for (node, vertex, foot) in found {
                let point = self.point(&foot);
                match vertex {
                    Some(vertex) => self.couple(Anchor::Vertex(vertex), point),
                    None => {
                        self.anchors.entry(node).or_insert(point);
                    }
                }
            }
            let after = (self.ties.len(), self.anchors.len());
            if let Some(source) = self.sources.get_mut(&tie.keyword) {
                source.used += usize::from(after != before);
                source.ties += after.0 - before.0;
                source.out_of_reach += out_of_reach;
            }
        }
    }

    fn longest_side(&self, triangle: u32) -> f64 {
        let mesh = &self.reference.mesh;
        let p = mesh.triangles()[triangle as usize].map(|vertex| mesh.vertices()[vertex as usize]);
        closest::distance(p[0], p[1]).max(closest::distance(p[1], p[2])).max(closest::distance(p[2], p[0]))
    }

    fn point(&self, foot: &Foot) -> Anchor {
        let corners = self.reference.mesh.triangles()[foot.triangle as usize];
        let weights = corners.into_iter().zip(foot.weights).filter(|(_, weight)| *weight > 1e-6);
        Anchor::Point(weights.collect(), foot.triangle)
    }

    /// Beams and solids that weld: those of a spot weld's material or formulation.
    pub(super) fn weld_elements(&mut self) {
        let deck = self.deck;
        let mut known: HashMap<u64, bool> = HashMap::new();
        for beam in &deck.beams {
            if *known.entry(beam.part).or_insert_with(|| welds(&self.resolver, beam.part, &[9])) {
                let ends = beam.nodes.map(|node| self.anchor(&[node]));
                self.weld("ELEMENT_BEAM", ends);
            }
        }
        known.clear();
        for solid in &deck.solids {
            if *known.entry(solid.part).or_insert_with(|| welds(&self.resolver, solid.part, &[19, 20, 21, 22])) {
                // Opposite faces; the first pair is the one that the manual asks for.
                const PAIRS: [[[usize; 4]; 2]; 3] =
                    [[[0, 1, 2, 3], [4, 5, 6, 7]], [[0, 1, 5, 4], [3, 2, 6, 7]], [[0, 3, 7, 4], [1, 2, 6, 5]]];
                let ends = PAIRS
                    .map(|pair| pair.map(|face| self.anchor(&face.map(|corner| solid.nodes[corner]))))
                    .into_iter()
                    .find(|ends| ends.iter().all(Option::is_some));
                self.weld("ELEMENT_SOLID", ends.unwrap_or([None, None]));
            }
        }
    }

    fn weld(&mut self, keyword: &str, ends: [Option<Anchor>; 2]) {
        let before = self.ties.len();
        let held = if let [Some(a), Some(b)] = ends {
            self.couple(a, b);
            true
        } else {
            false
        };
        let ties = self.ties.len() - before;
        let source = self.sources.entry(format!("{keyword} (welds)")).or_default();
        source.defined += 1;
        source.used += usize::from(held);
        source.ties += ties;
        source.out_of_reach += usize::from(!held);
    }

    /// Where nodes of a weld stand: the mean of their places; `None` if one of them is held by nothing.
    fn anchor(&self, nodes: &[u64]) -> Option<Anchor> {
        let places: Vec<Anchor> = nodes
            .iter()
            .map(|node| match self.vertex_of_node.get(node) {
                Some(&vertex) => Some(Anchor::Vertex(vertex)),
                None => self.anchors.get(node).cloned(),
            })
            .collect::<Option<_>>()?;
        if let [only] = &places[..] {
            return Some(only.clone());
        }
        let mut mean: BTreeMap<u32, f64> = BTreeMap::new();
        let mut near = None;
        for place in &places {
            let share = 1.0 / places.len() as f64;
            match place {
                Anchor::Vertex(vertex) => *mean.entry(*vertex).or_default() += share,
                Anchor::Point(weights, triangle) => {
                    near = near.or(Some(*triangle));
                    weights.iter().for_each(|(vertex, weight)| *mean.entry(*vertex).or_default() += share * weight);
                }
            }
        }
        let triangle = near.or_else(|| self.groups.triangle_at(*mean.keys().next()?))?;
        Some(Anchor::Point(mean.into_iter().collect(), triangle))
    }

    fn couple(&mut self, a: Anchor, b: Anchor) {
        let (vertex, to) = match (a, b) {
            (Anchor::Vertex(a), Anchor::Vertex(b)) if a == b => return,
            (Anchor::Vertex(a), Anchor::Vertex(b)) => (a.max(b), vec![(a.min(b), 1.0)]),
            (Anchor::Vertex(vertex), Anchor::Point(to, _)) | (Anchor::Point(to, _), Anchor::Vertex(vertex)) => {
                (vertex, to)
            }
            (Anchor::Point(from, _), Anchor::Point(to, triangle)) => {
                let most = from.iter().fold((0, 0.0), |most, next| if next.1 > most.1 { *next } else { most });
                let vertex = most.0;
                if to.iter().any(|(there, _)| from.iter().any(|(here, _)| here == there)) {
                    return; // both on the same faces: nothing to hold
                }
                // The point of the other sheet below the vertex, not below the weld.
                let mesh = &self.reference.mesh;
                let near = self.groups.triangles_around(mesh, triangle);
                let position = mesh.vertices()[vertex as usize];
                let feet = near.into_iter().map(|triangle| foot(mesh, triangle, position));
                let best = feet.min_by(|a, b| a.distance.total_cmp(&b.distance).then(a.triangle.cmp(&b.triangle)));
                match best.map(|best| self.point(&best)) {
                    Some(Anchor::Point(below, _)) if below.iter().all(|(there, _)| *there != vertex) => (vertex, below),
                    _ => (vertex, to),
                }
            }
        };
        if to.iter().any(|(other, _)| *other == vertex) {
            return;
        }
        self.ties.push(Tie { vertex, to });
    }

    pub(super) fn connections(&mut self) {
        for connection in &self.deck.connections {
            let before = self.ties.len();
            match connection.holds {
                Holds::Nodes(nodes) => {
                    if let [Some(a), Some(b)] = nodes.map(|node| self.anchor(&[node])) {
                        self.couple(a, b);
                    }
                }
                Holds::NodeSet(set) => self.group(set),
                Holds::CoincidentNodes(set) => self.coincident(set),
                Holds::SheetsAt { parts, set } => self.sheets(parts, set),
            }
            let ties = self.ties.len() - before;
            let source = self.sources.entry(connection.keyword.clone()).or_default();
            source.defined += 1;
            source.used += usize::from(ties > 0);
            source.ties += ties;
        }
    }

    fn vertices_of_set(&mut self, set: u64) -> Vec<u32> {
        let nodes = self.resolver.ids(keyword_deck::SetKind::Nodes, set);
        nodes.iter().filter_map(|node| self.vertex_of_node.get(node).copied()).collect()
    }

    fn group(&mut self, set: u64) {
        let vertices = self.vertices_of_set(set);
        match self.groups.pairs(&self.reference.mesh, &vertices) {
            Some(pairs) => pairs.into_iter().for_each(|(a, b)| self.couple(Anchor::Vertex(a), Anchor::Vertex(b))),
            None => self.notes.push(format!(
                "*SET_NODE {set} holds {} vertices as one rigid body, more than {}; left out",
                vertices.len(),
                groups::MOST
            )),
        }
    }

    fn coincident(&mut self, set: u64) {
        let mut first: HashMap<[u64; 3], u32> = HashMap::new();
        for vertex in self.vertices_of_set(set) {
            // Single precision: what a deck with eight digits means by one place.
            let place = self.reference.mesh.vertices()[vertex as usize].map(|x| u64::from((x as f32 + 0.0).to_bits()));
            let first = *first.entry(place).or_insert(vertex);
            self.couple(Anchor::Vertex(first), Anchor::Vertex(vertex));
        }
    }

    /// Couples two parts at each node of a set: the points of both that are nearest to it.
    fn sheets(&mut self, parts: [u64; 2], set: u64) {
        let nodes = self.resolver.ids(keyword_deck::SetKind::Nodes, set);
        let mesh = &self.reference.mesh;
        let sides = parts.map(|id| {
            let faces = self.resolver.faces(Surface { kind: SurfaceKind::Part, id });
            let mut triangles: Vec<u32> = self.triangles(&faces, |_| 0.0).into_keys().collect();
            triangles.sort_unstable();
            (Closest::new(mesh, &triangles), triangles.iter().map(|&t| self.longest_side(t)).fold(0.0, f64::max))
        });
        let mut found = Vec::new();
        for node in nodes {
            let Some(position) = self.position(node) else { continue };
            let feet = sides.each_ref().map(|(closest, reach)| closest.find(position, *reach, |_| true));
            if let [Some(a), Some(b)] = feet {
                found.push((self.point(&a), self.point(&b)));
            }
        }
        found.into_iter().for_each(|(a, b)| self.couple(a, b));
    }
}

/// Materials whose elements join others: spot welds, adhesives, cohesive layers.
const WELD_MATERIALS: &[&str] =
    &["SPOTWELD", "MAT_100", "COHESIVE", "ADHESIVE", "MAT_138", "MAT_169", "MAT_184", "MAT_185", "MAT_186", "MAT_240"];

/// Whether a part's elements weld: by its material, or by the formulation of its section.
fn welds(resolver: &Resolver<'_>, part: u64, formulations: &[i64]) -> bool {
    let by_material = resolver.material(part).is_some_and(|name| WELD_MATERIALS.iter().any(|word| name.contains(word)));
    by_material || formulations.contains(&resolver.formulation(part))
}
