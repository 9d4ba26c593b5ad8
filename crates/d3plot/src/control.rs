//! The control block: every count checked before it is believed, every flag taken apart.
//!
//! A count passes only if files of this size can hold it; from here on the other rooms may multiply counts freely
//! (in checked arithmetic) but never allocate by them.

use std::path::Path;

use crate::detect::{CONTROL_WORDS, FEMZIP, FileType, detect, type_number, wrong_type};
use crate::error::{Error, LooksLike};
use crate::members::Stream;
use crate::words::{ByteOrder, Precision, Words, decode_text, trim_end};

/// Parts beyond a few are believed only where the files have this many words for each: a part has a title of 72 bytes,
/// three numbers, and elements.
const WORDS_OF_A_PART: u64 = 64;
const FEW_PARTS: u64 = 2048;

/// What NCFDV1 holds when several solvers wrote into one file.
const MULTI_SOLVER: i64 = 67_108_864;

/// The words of the control block, as they are needed: counts are checked, flags are taken apart.
#[derive(Debug, Clone, Default)]
pub(crate) struct Control {
    pub(crate) words: Words,
    pub(crate) title: Vec<u8>,
    pub(crate) run_time: i64,
    pub(crate) file_type: FileType,
    /// INUM < 0: fields chosen by `*DATABASE_EXTENT_BINARY_COMP`, not all of them told by the other words.
    pub(crate) reduced: bool,
    /// INUM > 1000: user numbers have 8 bytes whatever the word.
    pub(crate) wide_numbers: bool,
    pub(crate) release: String,
    pub(crate) ndim: i64,
    pub(crate) nodes: u64,
    pub(crate) globals: u64,
    /// Ones digit of IT, and whether there is a mass scaling word a node.
    pub(crate) temperature: i64,
    pub(crate) mass_scaling: bool,
    pub(crate) iu: i64,
    pub(crate) velocity: bool,
    pub(crate) acceleration: bool,
    pub(crate) solids: u64,
    /// NEL8 < 0: two more nodes a solid in a list of their own.
    pub(crate) ten_node_solids: bool,
    pub(crate) nv3d: u64,
    pub(crate) beams: u64,
    pub(crate) nv1d: u64,
    pub(crate) shells: u64,
    pub(crate) nv2d: u64,
    pub(crate) thick_shells: u64,
    pub(crate) nv3dt: u64,
    pub(crate) neiph: u64,
    pub(crate) neips: u64,
    /// NUMDS < 0: the layers are 4 in-plane points each.
    pub(crate) in_plane_points: bool,
    pub(crate) layers: u64,
    pub(crate) mdlopt: u8,
    pub(crate) sph: u64,
    pub(crate) narbs: u64,
    /// Airbags of particles, and the version of their sections.
    pub(crate) airbags: u64,
    pub(crate) airbag_version: i64,
    /// IOSHL 1 and 2 for shells and for solids: stress, plastic strain.
    pub(crate) shell_stress: bool,
    pub(crate) shell_strain: bool,
    pub(crate) solid_stress: bool,
    pub(crate) solid_strain: bool,
    /// IOSHL 3 and 4: force resultants (8 words), thickness with two further words and internal energy (4 words).
    pub(crate) shell_resultants: bool,
    pub(crate) shell_thickness: bool,
    pub(crate) fluid_parts: u64,
    pub(crate) adapted: u64,
    pub(crate) parts: u64,
    /// More parts than this the files cannot hold.
    pub(crate) most_parts: u64,
    /// Parts of solids, beams, shells, SPH, thick shells.
    pub(crate) parts_of_kind: [u64; 5],
    pub(crate) idtdt: i64,
    pub(crate) extra: u64,
    pub(crate) nel48: u64,
    pub(crate) nel20: u64,
    pub(crate) nt3d: u64,
    pub(crate) nel27: u64,
    pub(crate) neipb: u64,
    pub(crate) nel21p: u64,
    pub(crate) nel15t: u64,
    pub(crate) nel20t: u64,
    pub(crate) nel40p: u64,
    pub(crate) nel64: u64,
    pub(crate) quadratic: bool,
    pub(crate) cubic: bool,
    pub(crate) penetration: u64,
    pub(crate) contact_energy: bool,
    pub(crate) kinetic_energy: bool,
}

impl Control {
    /// Reads and checks the control block at the start of the stream.
    pub(crate) fn read(stream: &Stream) -> Result<Control, Error> {
        let root = &stream.members()[0];
        let path = root.path.as_path();
        if root.bytes == 0 {
            return Err(Error::Empty { path: path.to_owned() });
        }
        let head = stream.read(0, root.bytes.min(CONTROL_WORDS * 8))?;
        let Some(words) = detect(&head, root.bytes) else {
            return Err(Error::NotD3plot { path: path.to_owned(), looks: LooksLike::of(&head) });
        };
        let size = words.size();
        let mut ints: Vec<i64> = words.ints(&head).take(CONTROL_WORDS as usize).collect();
        if ints[51] == FEMZIP {
            return Err(Error::Femzip { path: path.to_owned() });
        }
        let Some(file_type) = FileType::of(type_number(ints[11])) else {
            return Err(wrong_type(path, words, ints[11]));
        };

        let most = i64::try_from(stream.total() / size).unwrap_or(i64::MAX).saturating_add(64);
        let extra = Checked { path, size, ints: &ints, most }.count("EXTRA", 57)?;
        let block = extra.saturating_add(CONTROL_WORDS).saturating_mul(size);
        if block > root.bytes {
            let (section, left) = ("control block", root.bytes);
            return Err(Error::Truncated { path: path.to_owned(), section, offset: 0, need: block, left });
        }
        ints = words.ints(&stream.read(0, block)?).collect();
        let word = Checked { path, size, ints: &ints, most };

        let ndim = word.within("NDIM", 15, 2, 9)?;
        if ndim == 3 {
            return Err(word.unsupported("packed connectivity (NDIM = 3, the layout of before 1990)"));
        }
        let npefg = word.int(54);
        if !(0..10_000_000).contains(&npefg) {
            return Err(word.unsupported(&format!("discrete elements beside airbag particles (NPEFG = {npefg})")));
        }
        if word.int(48) == MULTI_SOLVER {
            return Err(word.unsupported(&format!("data of several solvers (NCFDV1 = {MULTI_SOLVER})")));
        }
        let it = word.within("IT", 19, 0, 99)?;
        if it % 10 > 3 {
            return Err(word.wrong("IT", 19, "a ones digit from 0 to 3"));
        }
        let iu = word.within("IU", 20, 0, 2)?;
        let maxint = word.within("MAXINT", 36, -10000 - most.min(1 << 40), most)?;
        let (mdlopt, layers) = match maxint {
            0.. => (0, maxint),
            // by the manual −10000 is MDLOPT 1 with 10000 layers; MDLOPT 2 with no layers is what writers mean by it
            -9999..0 => (1, -maxint),
            _ => (2, -maxint - 10000),
        };
        let nel8 = word.within("NEL8", 23, -most, most)?;
        let penout = word.within("PENOUT", 78, 0, 2)?;
        let parts_of_kind = [24, 29, 32, 38, 41].map(|at| word.int(at).clamp(0, most).unsigned_abs());
        let parts = match word.count("NMMAT", 51)? {
            // files of before this word: every kind of element has its own count
            0 => parts_of_kind.iter().fold(0_u64, |sum, of| sum.saturating_add(*of)).min(most.unsigned_abs()),
            count => count,
        };
        // a part needs a title and a number in the file; no more than the file can have are believed
        let most_parts = (most.unsigned_abs() / WORDS_OF_A_PART).max(FEW_PARTS);
        if parts > most_parts {
            return Err(word.wrong("NMMAT", 51, &format!("0 to {most_parts}, for files of this size,")));
        }
        let written = |at: usize, by: &[i64]| by.contains(&word.int(at));
        let release = trim_end(&head[13 * size as usize..13 * size as usize + 4]);
        Ok(Control {
            words,
            title: trim_end(&head[..10 * size as usize]).to_owned(),
            run_time: word.int(10),
            file_type,
            reduced: word.int(11) < 0,
            wide_numbers: word.int(11) > 1000 || word.int(11) < -1000,
            release: decode_text(release),
            ndim,
            nodes: word.within("NUMNP", 16, 1, most.min(u32::MAX.into()))?.unsigned_abs(),
            globals: word.words_each("NGLBV", 18)?,
            temperature: it % 10,
            mass_scaling: it / 10 == 1,
            iu,
            velocity: word.int(21) != 0,
            acceleration: word.int(22) != 0,
            solids: nel8.unsigned_abs(),
            ten_node_solids: nel8 < 0,
            nv3d: word.words_each("NV3D", 27)?,
            beams: word.count("NEL2", 28)?,
            nv1d: word.words_each("NV1D", 30)?,
            shells: word.count("NEL4", 31)?,
            nv2d: word.words_each("NV2D", 33)?,
            thick_shells: word.count("NELT", 40)?,
            nv3dt: word.words_each("NV3DT", 42)?,
            neiph: word.words_each("NEIPH", 34)?,
            neips: word.words_each("NEIPS", 35)?,
            in_plane_points: word.int(25) < 0,
            layers: layers.unsigned_abs(),
            mdlopt,
            sph: word.count("NMSPH", 37)?,
            narbs: word.count("NARBS", 39)?,
            airbags: (npefg % 1000).unsigned_abs(),
            airbag_version: npefg / 1000,
            shell_stress: written(43, &[1000]),
            shell_strain: written(44, &[1000]),
            solid_stress: written(43, &[999, 1000]),
            solid_strain: written(44, &[999, 1000]),
            shell_resultants: written(45, &[1000]),
            shell_thickness: written(46, &[1000]),
            fluid_parts: word.count("IALEMAT", 47)?,
            adapted: word.count("NADAPT", 50)?,
            parts,
            most_parts,
            parts_of_kind,
            idtdt: word.within("IDTDT", 56, 0, i32::MAX.into())?,
            extra,
            nel48: word.count("NEL48", 55)?,
            nel20: word.count("NEL20", 64)?,
            nt3d: word.words_each("NT3D", 65)?,
            nel27: word.count("NEL27", 66)?,
            neipb: word.words_each("NEIPB", 67)?,
            nel21p: word.count("NEL21P", 68)?,
            nel15t: word.count("NEL15T", 69)?,
            nel20t: word.count("NEL20T", 71)?,
            nel40p: word.count("NEL40P", 72)?,
            nel64: word.count("NEL64", 73)?,
            quadratic: word.int(74) > 0,
            cubic: word.int(75) > 0,
            penetration: [0, 3, 6][penout as usize],
            contact_energy: word.int(79) > 0,
            kinetic_energy: word.int(81) > 0,
        })
    }

    /// Words a node in the blocks of coordinates, velocities and accelerations.
    pub(crate) fn dimensions(&self) -> u64 {
        if self.ndim == 2 { 2 } else { 3 }
    }

    pub(crate) fn material_section(&self) -> bool {
        matches!(self.ndim, 5 | 7)
    }

    pub(crate) fn road(&self) -> bool {
        matches!(self.ndim, 6 | 7 | 9)
    }

    pub(crate) fn rigid_bodies(&self) -> bool {
        matches!(self.ndim, 8 | 9)
    }
}

/// The words of the control block behind a check of their range.
struct Checked<'a> {
    path: &'a Path,
    size: u64,
    ints: &'a [i64],
    /// No count can be larger than the words of all files together.
    most: i64,
}

impl Checked<'_> {
    /// A word; 0 if it lies behind the control block of this file.
    fn int(&self, at: usize) -> i64 {
        self.ints.get(at).copied().unwrap_or(0)
    }

    fn within(&self, name: &'static str, at: usize, least: i64, most: i64) -> Result<i64, Error> {
        let value = self.int(at);
        if (least..=most).contains(&value) {
            return Ok(value);
        }
        let files = if most >= self.most { " (all words of the files)" } else { "" };
        Err(self.wrong(name, at, &format!("{least} to {most}{files}")))
    }

    /// A number of things in the file.
    fn count(&self, name: &'static str, at: usize) -> Result<u64, Error> {
        Ok(self.within(name, at, 0, self.most)?.unsigned_abs())
    }

    /// A number of words a thing: it may be filled where there are no such things, so the files say nothing about it.
    fn words_each(&self, name: &'static str, at: usize) -> Result<u64, Error> {
        Ok(self.within(name, at, 0, i32::MAX.into())?.unsigned_abs())
    }

    fn wrong(&self, name: &'static str, at: usize, expected: &str) -> Error {
        let (path, offset) = (self.path.to_owned(), at as u64 * self.size);
        Error::Count { path, name, value: self.int(at), offset, expected: expected.to_owned() }
    }

    fn unsupported(&self, what: &str) -> Error {
        Error::Unsupported { path: self.path.to_owned(), what: what.to_owned() }
    }
}

/// What the control block says about a family.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Header {
    /// Title of the run: the long one (72 characters) if the file has it, else the 40 or 80 of the control block.
    pub title: String,
    /// Word size.
    pub precision: Precision,
    /// Byte order.
    pub byte_order: ByteOrder,
    /// Which database this is.
    pub file_type: FileType,
    /// The solver's release, four characters such as `R713`; writers other than LS-DYNA put anything here.
    pub release: String,
    /// When the run started, in seconds since 1970, as the file says.
    pub run_time: i64,
    /// Nodes.
    pub nodes: usize,
    /// Solids.
    pub solids: usize,
    /// Thick shells.
    pub thick_shells: usize,
    /// Beams.
    pub beams: usize,
    /// Shells, rigid ones too.
    pub shells: usize,
    /// Shells of rigid parts that have no words in the states.
    pub rigid_shells: usize,
    /// SPH particles.
    pub sph: usize,
    /// Parts that the control block counts, those without elements too.
    pub parts: usize,
    /// Points through the thickness of a shell that the states hold (MAXINT), without sign and deletion flag.
    pub layers: usize,
    /// Words a state has, its time included.
    pub words_per_state: u64,
}
