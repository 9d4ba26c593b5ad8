//! A run: one simulation, as its solver wrote it, behind one face whatever the format.
//!
//! With [`crate::bundle`], which finds result files, this is the only module that knows which readers there are. The rest of the method sees node ids, shell faces,
//! times and positions.

mod convert;
mod ranges;
mod units;

use std::path::{Path, PathBuf};

use serde::Serialize;

pub use convert::{ConvertOptions, Converted};
pub use units::Units;

use crate::Error;

/// An opened result file. Opening reads headers and geometry; states are read when asked for.
pub struct Run {
    id: String,
    path: PathBuf,
    node_ids: Vec<u64>,
    source: Source,
}

enum Source {
    D3plot(Box<d3plot::Family>),
}

/// What a result file holds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Info {
    /// Format of the file.
    pub format: String,
    /// Title of the run.
    pub title: String,
    /// Word size: `single` or `double`.
    pub precision: &'static str,
    /// Byte order: `little` or `big`.
    pub byte_order: &'static str,
    /// Release of the solver, as far as the file tells.
    pub release: String,
    /// The solver: LS-DYNA and its release, or that the file does not tell.
    pub solver: String,
    /// Units, guessed, with the reason.
    pub units: Units,
    /// Number of nodes.
    pub nodes: usize,
    /// Elements by kind.
    pub elements: Elements,
    /// Parts, those without elements too.
    pub parts: Vec<PartInfo>,
    /// Number of whole states.
    pub states: usize,
    /// Their times.
    pub times: Vec<f64>,
    /// The files of the family.
    pub members: Vec<MemberInfo>,
    /// Fields that the states carry.
    pub fields: Vec<String>,
    /// What the reader noticed.
    pub warnings: Vec<WarningInfo>,
}

/// Elements by kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Elements {
    /// Solids.
    pub solids: usize,
    /// Thick shells.
    pub thick_shells: usize,
    /// Beams.
    pub beams: usize,
    /// Shells.
    pub shells: usize,
    /// SPH particles.
    pub sph: usize,
}

/// A part and its elements by kind.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct PartInfo {
    /// The user's part id.
    pub id: u64,
    /// Its title.
    pub title: String,
    /// Number of its material model (20 is rigid); `None` where the file does not tell, as most do not.
    pub material: Option<u64>,
    /// Its elements.
    #[serde(flatten)]
    pub elements: Elements,
}

/// A file of a family.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct MemberInfo {
    /// Its path.
    pub path: PathBuf,
    /// Its length.
    pub bytes: u64,
    /// Whole states that begin in it.
    pub states: usize,
}

/// Something that the reader noticed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct WarningInfo {
    /// A word that scripts can rely on.
    pub kind: &'static str,
    /// The whole sentence.
    pub message: String,
}

/// A part that has shells.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// The user's part id.
    pub id: u64,
    /// Its title, without trailing blanks; may be empty.
    pub title: String,
    /// Number of shells.
    pub shells: usize,
}

impl Part {
    /// Id and title as a person reads them: `1 HAT`.
    pub fn label(&self) -> String {
        format!("{} {}", self.id, self.title).trim_end().to_owned()
    }
}

impl Run {
    /// Opens the result file at `path` (a root file, or a folder that holds exactly one family) under the given id.
    ///
    /// # Errors
    /// [`Error::Read`] if it is no readable result file.
    pub fn open(id: impl Into<String>, path: &Path) -> Result<Self, Error> {
        Self::open_mapped(id, path, false)
    }

    /// As [`Run::open`]; with `map` the files are mapped into memory. Safe only where no process cuts or changes them
    /// while the run is open: a mapped file that becomes shorter ends the program by a signal.
    ///
    /// # Errors
    /// As [`Run::open`].
    pub fn open_mapped(id: impl Into<String>, path: &Path, map: bool) -> Result<Self, Error> {
        let family = d3plot::Family::open_with(path, d3plot::ReadOptions { map })?;
        let node_ids = (0..family.header().nodes).map(|node| family.geometry().node_id(node)).collect();
        Ok(Self { id: id.into(), path: family.root().to_owned(), node_ids, source: Source::D3plot(Box::new(family)) })
    }

    /// The run's id.
    pub fn id(&self) -> &str {
        &self.id
    }

    /// Path of the root file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The files of the run with their lengths in bytes.
    pub fn files(&self) -> Vec<(PathBuf, u64)> {
        let Source::D3plot(family) = &self.source;
        family.members().iter().map(|member| (member.path.clone(), member.bytes)).collect()
    }

    /// Times of the whole states, in the model's time unit (ms in crash work).
    pub fn times(&self) -> &[f64] {
        let Source::D3plot(family) = &self.source;
        family.times()
    }

    /// User ids of the nodes.
    pub fn node_ids(&self) -> &[u64] {
        &self.node_ids
    }

    /// Undeformed node positions, nodes × 3, in the model's length unit.
    pub fn undeformed(&self) -> &[[f64; 3]] {
        let Source::D3plot(family) = &self.source;
        &family.geometry().coordinates
    }

    /// Shell faces: four node indices each (a triangle repeats its third), and the index of the part.
    pub fn faces(&self) -> impl Iterator<Item = ([u32; 4], u32)> + '_ {
        let Source::D3plot(family) = &self.source;
        family.geometry().shells.iter().map(|shell| (shell.nodes, shell.part))
    }

    /// All parts, in the order that [`Run::faces`] counts them; those without shells too.
    pub fn parts(&self) -> Vec<Part> {
        let Source::D3plot(family) = &self.source;
        family
            .parts()
            .iter()
            .map(|part| Part { id: part.id, title: part.title.trim().to_owned(), shells: part.shells })
            .collect()
    }

    /// What the file holds, for `crumple info`.
    pub fn info(&self) -> Info {
        let Source::D3plot(family) = &self.source;
        let header = family.header();
        let part = |part: &d3plot::Part| PartInfo {
            id: part.id,
            title: part.title.clone(),
            material: part.material,
            elements: Elements {
                solids: part.solids,
                thick_shells: part.thick_shells,
                beams: part.beams,
                shells: part.shells,
                sph: part.sph,
            },
        };
        Info {
            format: header.file_type.name().to_owned(),
            title: header.title.clone(),
            precision: match header.precision {
                d3plot::Precision::Single => "single",
                d3plot::Precision::Double => "double",
            },
            byte_order: match header.byte_order {
                d3plot::ByteOrder::Little => "little",
                d3plot::ByteOrder::Big => "big",
            },
            release: header.release.clone(),
            solver: solver(&header.release),
            units: self.units(),
            nodes: header.nodes,
            elements: Elements {
                solids: header.solids,
                thick_shells: header.thick_shells,
                beams: header.beams,
                shells: header.shells,
                sph: header.sph,
            },
            parts: family.parts().iter().map(part).collect(),
            states: family.times().len(),
            times: family.times().to_vec(),
            members: family
                .members()
                .iter()
                .map(|member| MemberInfo { path: member.path.clone(), bytes: member.bytes, states: member.states })
                .collect(),
            fields: family.fields().iter().map(|field| field.name.to_string()).collect(),
            warnings: family
                .warnings()
                .iter()
                .map(|warning| WarningInfo { kind: warning.kind(), message: warning.to_string() })
                .collect(),
        }
    }

    /// What else the run holds, in words, for messages about what is missing.
    pub fn contents(&self) -> String {
        let Source::D3plot(family) = &self.source;
        let header = family.header();
        format!(
            "{} nodes, {} solids, {} thick shells, {} beams, {} shells",
            header.nodes, header.solids, header.thick_shells, header.beams, header.shells
        )
    }

    /// What the reader noticed: cut states, gaps, broken titles.
    pub fn warnings(&self) -> Vec<String> {
        let Source::D3plot(family) = &self.source;
        family.warnings().iter().map(ToString::to_string).collect()
    }

    /// Positions of all nodes in one state, nodes × 3, in the model's length unit.
    ///
    /// # Errors
    /// [`Error::Read`] if the file cannot be read there, [`Error::NoCoordinates`] if its states hold none.
    pub fn positions(&self, state: usize) -> Result<Vec<[f64; 3]>, Error> {
        let Source::D3plot(family) = &self.source;
        family.coordinates(state)?.ok_or_else(|| Error::NoCoordinates { run: self.id.clone() })
    }
}

/// The solver by the word of its release: `R713`, ` R14`. Other writers put anything there.
fn solver(release: &str) -> String {
    let release = release.trim();
    match release.strip_prefix('R').filter(|number| number.starts_with(|c: char| c.is_ascii_digit())) {
        Some(_) => format!("LS-DYNA {release}"),
        None => "not told".to_owned(),
    }
}
