//! Writing a family: geometry first, then state by state, each of them readable as soon as it is written.
//!
//! The layout of a state is computed by the same function as for reading. What the format leaves open is written as
//! LS-DYNA writes it: the end mark stands behind the last state and is overwritten by the next one; a member that has no
//! room for a state is padded to whole blocks, and the state starts the next member; what is longer than a member runs on.

mod content;
mod control;
mod copy;
mod geometry;
mod members;
mod state;

use std::path::Path;

pub use content::{Content, DeletionTable, Positions, Stored, Thermal, WordsEach};
pub use copy::{Copied, Keep};
pub use state::StateWriter;

use crate::control::Control;
use crate::elements::Geometry;
use crate::error::Error;
use crate::geometry::END_MARK;
use crate::parts::Part;
use crate::quantity::{Quantity, quantities};
use crate::state::{Layout, Variant};
use crate::words::{ByteOrder, Precision, Words};
use geometry::encode_geometry;
use members::Members;

/// Words of a block, to which members are padded.
const BLOCK: u64 = 512;

/// How a family is stored.
#[derive(Debug, Clone, PartialEq)]
pub struct WriteOptions {
    /// Title of the run; the file keeps 72 bytes of it.
    pub title: String,
    /// Word size.
    pub precision: Precision,
    /// Byte order.
    pub byte_order: ByteOrder,
    /// The most bytes of a file, rounded down to whole blocks of 512 words: geometry and states that are longer run on
    /// into the next one, which few programs read. `None` for the solver's default, 7 × 512 × 512 words, or as many as the
    /// geometry or one state needs: nothing runs on then.
    pub member_bytes: Option<u64>,
    /// The most states of a file; `None` for as many as fit.
    pub member_states: Option<usize>,
    /// Begin the states in the root, behind the geometry, where `false` begins them in the first member.
    pub states_in_root: bool,
    /// When the run started, in seconds since 1970.
    pub run_time: i64,
    /// The solver's release, four characters.
    pub release: String,
}

impl Default for WriteOptions {
    fn default() -> WriteOptions {
        WriteOptions {
            title: String::new(),
            precision: Precision::Single,
            byte_order: ByteOrder::Little,
            member_bytes: None,
            member_states: None,
            states_in_root: false,
            run_time: 0,
            release: "R910".to_owned(),
        }
    }
}

/// A family that is being written. The geometry is there as soon as [`Writer::create`] returns; each state as soon as
/// [`StateWriter::write`] does: a reader that opens the family in between finds whole states and an end mark. Dropping the
/// writer leaves such a family; [`Writer::finish`] also pads the last file and waits for the disk.
///
/// ```
/// use d3plot::{Content, Family, Geometry, Part, Shell, Stored, WriteOptions, Writer};
///
/// // two quads and a triangle, a part each
/// let mut geometry = Geometry::default();
/// geometry.coordinates = (0..8).map(|k| [f64::from(k % 4) * 10.0, f64::from(k / 4) * 10.0, 0.0]).collect();
/// geometry.shells = vec![
///     Shell { nodes: [0, 1, 5, 4], part: 0 },
///     Shell { nodes: [1, 2, 6, 5], part: 0 },
///     Shell { nodes: [2, 3, 6, 6], part: 1 },
/// ];
/// let parts = [Part::new(10, "WEB"), Part::new(20, "FLANGE")];
///
/// # let folder = tempfile::tempdir()?;
/// let root = folder.path().join("d3plot");
/// let content = Content { plastic_strain: Stored::All, layers: 3, ..Content::default() };
/// let mut writer = Writer::create(&root, &geometry, &parts, &content, &WriteOptions::default())?;
/// for step in 0..3 {
///     let pushed: Vec<[f64; 3]> = geometry.coordinates.iter().map(|[x, y, z]| [*x, *y, z - f64::from(step)]).collect();
///     let mut state = writer.state(f64::from(step));
///     state.coordinates(&pushed)?;
///     state.set("shell_plastic_strain", &[0.01 * f64::from(step); 9])?; // shells × layers
///     state.write()?;
/// }
/// writer.finish()?;
///
/// let family = Family::open(&root)?;
/// assert_eq!(family.times(), [0.0, 1.0, 2.0]);
/// assert_eq!(family.parts()[1].title, "FLANGE");
/// assert_eq!(family.coordinates(2)?.unwrap()[7], [30.0, 10.0, -2.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Writer {
    members: Members,
    control: Control,
    layout: Layout,
    quantities: Vec<Quantity>,
    rigid: Vec<bool>,
    /// Where the nodes start.
    start: Vec<[f64; 3]>,
    /// The bytes of a state of which nothing has been set.
    blank: Vec<u8>,
    options: WriteOptions,
    states: usize,
    states_in_member: usize,
}

impl Writer {
    /// Creates the root file and writes the geometry. `parts` are in internal order: elements name them by index. User
    /// numbers of nodes and elements are those of `geometry`, or 1, 2, 3 … where its lists are empty. With a material
    /// number on every part the file lists them, and shells of rigid parts (20) have no words in the states.
    ///
    /// # Errors
    /// [`Error::Exists`] if the root or a member of it is there, [`Error::Content`] for a geometry or content that the format
    /// cannot hold, [`Error::Io`].
    pub fn create(
        root: &Path,
        geometry: &Geometry,
        parts: &[Part],
        content: &Content,
        options: &WriteOptions,
    ) -> Result<Writer, Error> {
        let unfit = |what: String| Error::Content { path: root.to_owned(), what };
        geometry::check(geometry, parts).map_err(unfit)?;
        let words = Words { precision: options.precision, order: options.byte_order };
        let mut control = content.control(words, geometry).map_err(unfit)?;
        control.title = options.title.as_bytes().to_vec();
        control.release.clone_from(&options.release);
        control.run_time = options.run_time;
        let encoded = encode_geometry(&mut control, geometry, parts, &content.sph_flags);
        let layout = Variant::by_the_manual(&control, &encoded.reading)
            .layout(&control, &encoded.reading)
            .filter(|layout| usize::try_from(layout.words * words.size()).is_ok())
            .ok_or_else(|| unfit("a state of more bytes than can be counted".to_owned()))?;

        let block = BLOCK * words.size();
        let whole = |bytes: u64| bytes.saturating_add(words.size()).next_multiple_of(block); // with an end mark
        let solvers_default = 7 * 512 * block;
        let (geometry_bytes, state_bytes) = (encoded.bytes.len() as u64, layout.words * words.size());
        let default = solvers_default.max(whole(geometry_bytes)).max(whole(state_bytes));
        let mut members = Members::create(root, options.member_bytes.unwrap_or(default), block)?;
        members.put(&encoded.bytes)?;
        let mut writer = Writer {
            members,
            quantities: quantities(&control),
            blank: Vec::new(),
            rigid: encoded.reading.geometry.rigid_shells.clone(),
            start: geometry.coordinates.clone(),
            control,
            layout,
            options: options.clone(),
            states: 0,
            states_in_member: 0,
        };
        writer.blank = writer.blank_state(geometry);
        if !options.states_in_root {
            writer.members.pad()?;
        }
        Ok(writer)
    }

    /// Starts a state at `time`, which must not be earlier than the last one. What is not set on it is as it was at the
    /// start: nodes where they were, nothing deleted, zeros elsewhere.
    pub fn state(&mut self, time: f64) -> StateWriter<'_> {
        StateWriter::new(self, time)
    }

    /// States written so far.
    pub fn states(&self) -> usize {
        self.states
    }

    /// Words a row of a table has, if the states hold it.
    fn columns(&self, table: &str) -> Option<usize> {
        self.layout.field(table).map(|field| field.columns as usize)
    }

    /// Words of a state.
    pub fn words_per_state(&self) -> u64 {
        self.layout.words
    }

    /// Waits until everything written so far is on the disk. A reader of this machine sees it without.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn flush(&mut self) -> Result<(), Error> {
        self.members.sync()
    }

    /// Pads the last file to whole blocks, as the solver does when it ends, and waits for the disk.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn finish(mut self) -> Result<(), Error> {
        self.members.pad()?;
        self.members.sync()
    }

    /// Puts a state behind the last one, or into the next member where it does not fit.
    fn put_state(&mut self, bytes: &[u8]) -> Result<(), Error> {
        let first = self.states == 0 && !self.options.states_in_root;
        let full = self.options.member_states.is_some_and(|most| self.states_in_member >= most.max(1));
        if first || full || bytes.len() as u64 > self.members.left() && !self.members.is_fresh() {
            self.members.begin_next()?;
            self.states_in_member = 0;
        }
        let member = self.members.number();
        self.members.put(bytes)?;
        self.states_in_member = if self.members.number() == member { self.states_in_member + 1 } else { 1 };
        self.states += 1;
        let mut mark = Vec::new();
        self.control.words.push_floats(&mut mark, [END_MARK]);
        self.members.mark(&mark)
    }

    /// A state in which nothing has happened.
    fn blank_state(&self, geometry: &Geometry) -> Vec<u8> {
        let words = self.control.words;
        let mut bytes = vec![0; (self.layout.words * words.size()) as usize];
        let mut fill = |table: &str, values: &mut dyn Iterator<Item = f64>| {
            if let Some(field) = self.layout.field(table) {
                let at = (field.offset * words.size()) as usize;
                for (word, value) in bytes[at..].chunks_exact_mut(words.size() as usize).zip(values) {
                    words.put_float(word, value);
                }
            }
        };
        let space = self.control.dimensions() as usize;
        fill("coordinates", &mut geometry.coordinates.iter().flat_map(|point| point.iter().take(space).copied()));
        fill("node_deletion", &mut geometry.coordinates.iter().map(|_| 1.0));
        let number = |part: u32| f64::from(part) + 1.0;
        let solids = geometry.solids.iter().chain(&geometry.thick_shells).map(|solid| number(solid.part));
        let shells = geometry.shells.iter().map(|shell| number(shell.part));
        let beams = geometry.beams.iter().map(|beam| number(beam.part));
        fill("element_deletion", &mut solids.chain(shells).chain(beams));
        if let Some(columns) = self.layout.field("sph").map(|field| field.columns as usize) {
            let row = |part: u32| std::iter::once(number(part)).chain(std::iter::repeat_n(0.0, columns - 1));
            fill("sph", &mut geometry.sph.iter().flat_map(|particle| row(particle.part)));
        }
        bytes
    }
}
