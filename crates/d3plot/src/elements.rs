//! The mesh as arrays: what a caller gets of the geometry. Nodes and parts count from 0.

/// A shell of four nodes, or three.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shell {
    /// Nodes in order around the shell, from 0; a triangle when `nodes[3] == nodes[2]`.
    pub nodes: [u32; 4],
    /// Index into [`Family::parts`](crate::Family::parts).
    pub part: u32,
}

impl Shell {
    /// Whether it has three corners.
    pub fn is_triangle(&self) -> bool {
        self.nodes[3] == self.nodes[2]
    }
}

/// A solid, or a thick shell, of up to eight nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Solid {
    /// Nodes, from 0. Fewer than eight corners repeat nodes: a wedge is 0 1 2 3 4 4 5 5, a tetrahedron 0 1 2 3 3 3 3 3.
    pub nodes: [u32; 8],
    /// Index into [`Family::parts`](crate::Family::parts).
    pub part: u32,
}

/// A beam.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Beam {
    /// Its two ends, from 0.
    pub nodes: [u32; 2],
    /// The node that orients its cross section, from 0; `None` where the file has none (spot welds, springs).
    pub orientation: Option<u32>,
    /// Index into [`Family::parts`](crate::Family::parts).
    pub part: u32,
}

/// An SPH particle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Particle {
    /// Its node, from 0.
    pub node: u32,
    /// Index into [`Family::parts`](crate::Family::parts).
    pub part: u32,
}

/// The mesh of a family before the first state. Nodes and parts count from 0; user numbers are the ones of the deck.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct Geometry {
    /// N × 3, initial positions in the model's length unit (z = 0 in plane models).
    pub coordinates: Vec<[f64; 3]>,
    /// N user numbers; empty where the file has none, which stands for 1, 2, 3 … (so do the other lists of numbers).
    pub node_ids: Vec<u64>,
    /// Shells, rigid ones too.
    pub shells: Vec<Shell>,
    /// User numbers of the shells.
    pub shell_ids: Vec<u64>,
    /// One flag a shell: true for shells of rigid parts, which have no words in the states. Empty if there are none.
    pub rigid_shells: Vec<bool>,
    /// Solids.
    pub solids: Vec<Solid>,
    /// User numbers of the solids.
    pub solid_ids: Vec<u64>,
    /// Thick shells.
    pub thick_shells: Vec<Solid>,
    /// User numbers of the thick shells.
    pub thick_shell_ids: Vec<u64>,
    /// Beams.
    pub beams: Vec<Beam>,
    /// User numbers of the beams.
    pub beam_ids: Vec<u64>,
    /// SPH particles.
    pub sph: Vec<Particle>,
}

impl Geometry {
    /// User number of the node at `index`: its place from 1 where the file has no numbers.
    pub fn node_id(&self, index: usize) -> u64 {
        self.node_ids.get(index).copied().unwrap_or(index as u64 + 1)
    }
}
