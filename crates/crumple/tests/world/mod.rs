//! A small world for the laws: shell models, deformations of them, and the d3plot families that a solver would have
//! written, so that every test starts where a user starts, with files.
//!
//! [`Model`] is a mesh of shells with user ids and parts; [`Family`] writes it with its states; [`World`] is a folder of
//! runs and studies that is gone when the test is.
//!
//! A family here is the smallest that a reader accepts: its states hold the nodes' positions and nothing else.
#![allow(dead_code, unreachable_pub, reason = "each test file uses its own part of the world")]

use std::path::{Path, PathBuf};

use crumple::basis::BasisOptions;
use crumple::bundle::{self, Found};
use crumple::descriptor::{DescribeOptions, Described, Select, Threshold, describe};
use crumple::run::Run;
use crumple::select::Kind;
use crumple::study::{AddOptions, Added, Loaded, Study};
use crumple::target::Named;
use d3plot::{Content, Geometry, Part, Precision, Shell, WriteOptions, Writer};
use proptest::test_runner::{Config, RngSeed};

pub type Point = [f64; 3];

// ---- models -------------------------------------------------------------------------------------------------------

/// Shells over nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// Undeformed positions, in mm.
    pub nodes: Vec<Point>,
    /// User ids of the nodes.
    pub node_ids: Vec<u32>,
    /// Four nodes each (a triangle repeats its third), and the index of the part.
    pub shells: Vec<([u32; 4], usize)>,
    /// User id and title of each part.
    pub parts: Vec<(u32, String)>,
}

impl Model {
    /// A sheet of `nx` × `ny` quads over the unit square, placed in space by `place(u, v)`.
    pub fn sheet(nx: u32, ny: u32, place: impl Fn(f64, f64) -> Point) -> Self {
        let at = |i: u32, j: u32| place(f64::from(i) / f64::from(nx), f64::from(j) / f64::from(ny));
        let nodes: Vec<Point> = (0..=ny).flat_map(|j| (0..=nx).map(move |i| (i, j))).map(|(i, j)| at(i, j)).collect();
        let node = |i: u32, j: u32| j * (nx + 1) + i;
        let quad = |i, j| ([node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)], 0);
        Self {
            node_ids: (1..=nodes.len() as u32).collect(),
            nodes,
            shells: (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j))).map(|(i, j)| quad(i, j)).collect(),
            parts: vec![(1, "SHEET".into())],
        }
    }

    /// A flat plate of `nx` × `ny` quads, `length` × `width` mm, in the plane z = 0.
    pub fn plate(nx: u32, ny: u32, length: f64, width: f64) -> Self {
        Self::sheet(nx, ny, |u, v| [length * u, width * v, 0.0])
    }

    /// The plate of most tests: 9 × 4 quads, 50 nodes, sides that give no equal eigenvalues.
    pub fn strip() -> Self {
        Self::plate(9, 4, 90.0, 37.0)
    }

    /// A closed tube along x.
    pub fn tube(around: u32, along: u32, radius: f64, length: f64) -> Self {
        let mut tube = Self::sheet(around, along, |u, v| {
            let angle = 2.0 * std::f64::consts::PI * u;
            [length * v, radius * angle.cos(), radius * angle.sin()]
        });
        // The last column of nodes is the first.
        let row = around + 1;
        for node in tube.shells.iter_mut().flat_map(|(nodes, _)| nodes) {
            if *node % row == around {
                *node -= around;
            }
        }
        tube
    }

    /// A channel beam along x: web in the middle, flanges bent by a right angle along straight edges.
    pub fn beam(along: u32, across: u32, length: f64, width: f64, height: f64) -> Self {
        Self::sheet(along, 3 * across, |u, v| {
            let (y, z) = match 3.0 * v {
                s if s < 1.0 => (0.0, height * (1.0 - s)),
                s if s <= 2.0 => (width * (s - 1.0), 0.0),
                s => (width, height * (s - 2.0)),
            };
            [length * u, y, z]
        })
    }

    /// This model and another beside it, nodes and parts of the other numbered on.
    pub fn and(mut self, other: Self) -> Self {
        let (nodes, parts) = (self.nodes.len() as u32, self.parts.len());
        let last_id = self.node_ids.iter().copied().max().unwrap_or(0);
        let last_part = self.parts.iter().map(|part| part.0).max().unwrap_or(0);
        self.nodes.extend(other.nodes);
        self.node_ids.extend(other.node_ids.iter().map(|id| id + last_id));
        self.shells.extend(other.shells.iter().map(|(face, part)| (face.map(|node| node + nodes), part + parts)));
        self.parts.extend(other.parts.into_iter().map(|(id, title)| (id + last_part, title)));
        self
    }

    /// Every quad as two triangles, split from its first to its third node.
    pub fn triangulated(mut self) -> Self {
        let halves = |&([a, b, c, d], part): &([u32; 4], usize)| [([a, b, c, c], part), ([a, c, d, d], part)];
        self.shells = self.shells.iter().flat_map(halves).collect();
        self
    }

    /// All nodes moved by a map of space.
    pub fn moved(mut self, map: impl Fn(Point) -> Point) -> Self {
        self.nodes.iter_mut().for_each(|node| *node = map(*node));
        self
    }

    /// Nodes and shells stored in another order; ids stay with their nodes. `stride` must have no common factor with
    /// the number of nodes or shells.
    pub fn reordered(&self, stride: usize) -> Self {
        let (nodes, shells) = (self.nodes.len(), self.shells.len());
        let from = |place: usize, count: usize| (place * stride + 1) % count;
        let mut place_of_node = vec![0; nodes];
        (0..nodes).for_each(|place| place_of_node[from(place, nodes)] = place as u32);
        Self {
            nodes: (0..nodes).map(|place| self.nodes[from(place, nodes)]).collect(),
            node_ids: (0..nodes).map(|place| self.node_ids[from(place, nodes)]).collect(),
            shells: (0..shells)
                .map(|place| self.shells[from(place, shells)])
                .map(|(face, part)| (face.map(|node| place_of_node[node as usize]), part))
                .collect(),
            parts: self.parts.clone(),
        }
    }

    /// The family of this model deformed by `deformation(t, position)`, t from 0 to 1 over `states` states.
    pub fn family(&self, states: usize, deformation: impl Fn(f64, Point) -> Point) -> Family {
        let share = |state: usize| if states > 1 { state as f64 / (states - 1) as f64 } else { 1.0 };
        self.family_of((0..states).map(|state| {
            let nodes = self.nodes.iter().map(|&node| deformation(share(state), node)).collect();
            (10.0 * share(state), nodes)
        }))
    }

    /// The family of this model with these times and positions.
    pub fn family_of(&self, states: impl IntoIterator<Item = (f64, Vec<Point>)>) -> Family {
        Family { model: self.clone(), states: states.into_iter().collect(), double: false, states_a_member: 3 }
    }
}

/// Rotation about the axis (1, 2, 3) by `angle`, in radians: no plane of a model stays where it was.
pub fn rotation(angle: f64) -> impl Fn(Point) -> Point + Copy {
    let axis = [1.0, 2.0, 3.0].map(|x: f64| x / 14_f64.sqrt());
    let (sin, cos) = angle.sin_cos();
    move |p| {
        let along: f64 = (0..3).map(|c| axis[c] * p[c]).sum();
        let cross = [0, 1, 2].map(|c| axis[(c + 1) % 3] * p[(c + 2) % 3] - axis[(c + 2) % 3] * p[(c + 1) % 3]);
        std::array::from_fn(|c| cos * p[c] + sin * cross[c] + (1.0 - cos) * along * axis[c])
    }
}

/// Bends a plate in the plane z = 0 into a cylinder around y, so that x becomes the arc; `angle` is what `length` turns by.
pub fn bend(length: f64, angle: f64) -> impl Fn(Point) -> Point + Copy {
    move |[x, y, z]| {
        if angle == 0.0 {
            return [x, y, z];
        }
        let (radius, turn) = (length / angle, angle * x / length);
        [(radius - z) * turn.sin(), y, radius - (radius - z) * turn.cos()]
    }
}

// ---- files --------------------------------------------------------------------------------------------------------

/// A model and its states, ready to be written.
#[derive(Debug, Clone)]
pub struct Family {
    pub model: Model,
    /// Time and positions of each state.
    pub states: Vec<(f64, Vec<Point>)>,
    /// Words of 8 bytes instead of 4.
    pub double: bool,
    /// States in one file after the root; 0 puts them all into the root.
    pub states_a_member: usize,
}

impl Family {
    pub fn double(mut self) -> Self {
        self.double = true;
        self
    }

    pub fn states_a_member(mut self, states: usize) -> Self {
        self.states_a_member = states;
        self
    }

    /// Writes `root`, `root01`, …; the folder is made where it is missing.
    pub fn write(&self, root: &Path) {
        std::fs::create_dir_all(root.parent().expect("a root lies in a folder")).unwrap();
        let Model { nodes, node_ids, shells, parts } = &self.model;
        let mut geometry = Geometry::default();
        geometry.coordinates.clone_from(nodes);
        geometry.node_ids = node_ids.iter().map(|&id| u64::from(id)).collect();
        geometry.shells = shells.iter().map(|&(nodes, part)| Shell { nodes, part: part as u32 }).collect();
        let parts: Vec<Part> = parts.iter().map(|(id, title)| Part::new(u64::from(*id), title)).collect();
        let options = WriteOptions {
            title: "a world for tests".into(),
            precision: if self.double { Precision::Double } else { Precision::Single },
            member_states: (self.states_a_member > 0).then_some(self.states_a_member),
            states_in_root: self.states_a_member == 0,
            ..WriteOptions::default()
        };
        let mut writer = Writer::create(root, &geometry, &parts, &Content::default(), &options).unwrap();
        for (time, nodes) in &self.states {
            let mut state = writer.state(*time);
            state.coordinates(nodes).unwrap();
            state.write().unwrap();
        }
        writer.finish().unwrap();
    }
}

// ---- runs and studies ---------------------------------------------------------------------------------------------

/// A folder with `runs/` and, where asked for, studies of them.
pub struct World {
    folder: tempfile::TempDir,
}

impl World {
    pub fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("runs")).unwrap();
        Self { folder }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The folder of all runs.
    pub fn runs(&self) -> PathBuf {
        self.path("runs")
    }

    /// The root file of a run.
    pub fn root(&self, id: &str) -> PathBuf {
        self.runs().join(id).join("d3plot")
    }

    /// Writes a run; what another family of this id left is removed.
    pub fn write(&self, id: &str, family: &Family) {
        let _ = std::fs::remove_dir_all(self.runs().join(id));
        family.write(&self.root(id));
    }

    pub fn found(&self) -> Vec<Found> {
        bundle::find(&[self.runs()]).unwrap()
    }

    pub fn open(&self, id: &str) -> Run {
        Run::open(id, &self.root(id)).unwrap()
    }

    /// A study of the mesh of one run, without runs.
    pub fn empty_study(&self, name: &str, reference: &str, eigenpairs: usize) -> Study {
        let options = BasisOptions { eigenpairs, ..Default::default() };
        Study::create(&self.path(name), &self.open(reference), &[], &[], &options, &()).unwrap()
    }

    /// A study of all runs, on the mesh of the first.
    pub fn study(&self, eigenpairs: usize) -> Loaded {
        let found = self.found();
        let mut study = self.empty_study("study", &found[0].id, eigenpairs);
        study.add(&found, AddOptions::default(), &()).unwrap();
        Loaded::of(study).unwrap()
    }

    /// Adds all runs of the folder.
    pub fn add(&self, study: &mut Study) -> Result<Added, crumple::Error> {
        study.add(&self.found(), AddOptions::default(), &())
    }
}

/// The descriptor of the last state of a run.
pub fn described(loaded: &Loaded, run: &str, select: Select, threshold: Threshold) -> Described {
    describe(
        loaded,
        &Named::parse(run),
        None,
        Some(run),
        &DescribeOptions { kind: Kind::Paper, select, threshold, ..Default::default() },
    )
    .unwrap()
}

// ---- numbers ------------------------------------------------------------------------------------------------------

/// All δ of a row of coefficients, K × 3.
pub fn triples(row: &[f32]) -> Vec<Point> {
    row.as_chunks::<3>().0.iter().map(|triple| triple.map(f64::from)).collect()
}

/// Σ m |a − b|².
pub fn square_distance(mass: &[f64], a: &[Point], b: &[Point]) -> f64 {
    a.iter().zip(b).zip(mass).map(|((a, b), m)| m * (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>()).sum()
}

/// M-weighted root mean square distance of two shapes.
pub fn rms(mass: &[f64], a: &[Point], b: &[Point]) -> f64 {
    (square_distance(mass, a, b) / mass.iter().sum::<f64>()).sqrt()
}

/// Σ x².
pub fn energy(triples: &[Point]) -> f64 {
    triples.iter().flatten().map(|x| x * x).sum()
}

/// Relative difference of two numbers.
pub fn relative(a: f64, b: f64) -> f64 {
    (a - b).abs() / a.abs().max(b.abs()).max(f64::MIN_POSITIVE)
}

/// The same random numbers in every run of the tests.
pub fn cases(cases: u32) -> Config {
    Config { cases, rng_seed: RngSeed::Fixed(20), failure_persistence: None, ..Config::default() }
}

/// Random-looking numbers in −1 … 1 that are the same on every machine (xorshift of Marsaglia 2003).
pub fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}
