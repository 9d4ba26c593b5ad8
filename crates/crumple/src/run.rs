//! A run: one simulation, as its solver wrote it, behind one face whatever the format.
//!
//! With [`crate::bundle`], which finds result files, this is the only module that knows which readers there are. The rest of the method sees node ids, shell faces,
//! times and positions.

mod convert;
mod ranges;
mod units;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use keyword_deck::Deck;
use serde::Serialize;

pub use convert::{ConvertOptions, Converted};
pub use units::Units;

use crate::Error;
use crate::deck::{self, Surface};
use crate::field::{Field, Layer, Quantity};

/// An opened result file. Opening reads headers and geometry; states are read when asked for.
pub struct Run {
    id: String,
    path: PathBuf,
    node_ids: Vec<u64>,
    source: Source,
    /// Titles and welds: the deck itself, or one that belongs to the result file.
    deck: Option<Arc<Deck>>,
}

enum Source {
    D3plot(Box<d3plot::Family>),
    /// A mesh without states.
    Deck {
        deck: Arc<Deck>,
        surface: Surface,
    },
}

/// A field as a result file holds it.
#[derive(Debug, Clone, PartialEq)]
pub enum FieldValues {
    /// Of the nodes, nodes × 3; scalars have zeros in the second and third place.
    Nodes(Vec<[f64; 3]>),
    /// Of the shells, in the order of [`Run::faces`]. NaN for rigid shells, which have no words.
    Shells(Vec<f64>),
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
    /// Opens the result file at `path` (a root file, or a folder that holds exactly one family) or the keyword deck there,
    /// under the given id. A deck is a run without states: a mesh, and the titles of parts.
    ///
    /// # Errors
    /// [`Error::Read`] if it is no readable result file, [`Error::Deck`] if it is no readable deck.
    pub fn open(id: impl Into<String>, path: &Path) -> Result<Self, Error> {
        Self::open_mapped(id, path, false)
    }

    /// As [`Run::open`]; with `map` the files are mapped into memory. Safe only where no process cuts or changes them
    /// while the run is open: a mapped file that becomes shorter ends the program by a signal.
    ///
    /// # Errors
    /// As [`Run::open`].
    pub fn open_mapped(id: impl Into<String>, path: &Path, map: bool) -> Result<Self, Error> {
        if deck::is_deck(path) {
            let deck = Arc::new(deck::read(path)?);
            let source = Source::Deck { deck: Arc::clone(&deck), surface: Surface::of(&deck) };
            let node_ids = deck.node_ids.clone();
            return Ok(Self { id: id.into(), path: path.to_owned(), node_ids, source, deck: Some(deck) });
        }
        let family = d3plot::Family::open_with(path, d3plot::ReadOptions { map })?;
        let node_ids = (0..family.header().nodes).map(|node| family.geometry().node_id(node)).collect();
        let path = family.root().to_owned();
        Ok(Self { id: id.into(), path, node_ids, source: Source::D3plot(Box::new(family)), deck: None })
    }

    /// The same run with the titles and welds of a deck.
    #[must_use]
    pub fn with_deck(mut self, deck: Arc<Deck>) -> Self {
        self.deck = Some(deck);
        self
    }

    /// The deck that it is, or that belongs to it.
    pub fn deck(&self) -> Option<&Deck> {
        self.deck.as_deref()
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
        match &self.source {
            Source::D3plot(family) => {
                family.members().iter().map(|member| (member.path.clone(), member.bytes)).collect()
            }
            Source::Deck { deck, .. } => {
                let length = |path: &Path| std::fs::metadata(path).map_or(0, |metadata| metadata.len());
                deck.files.iter().map(|file| (file.path.clone(), length(&file.path))).collect()
            }
        }
    }

    /// Times of the whole states, in the model's time unit (ms in crash work).
    pub fn times(&self) -> &[f64] {
        match &self.source {
            Source::D3plot(family) => family.times(),
            Source::Deck { .. } => &[],
        }
    }

    /// User ids of the nodes.
    pub fn node_ids(&self) -> &[u64] {
        &self.node_ids
    }

    /// Undeformed node positions, nodes × 3, in the model's length unit.
    pub fn undeformed(&self) -> &[[f64; 3]] {
        match &self.source {
            Source::D3plot(family) => &family.geometry().coordinates,
            Source::Deck { deck, .. } => &deck.coordinates,
        }
    }

    /// Shell faces: four node indices each (a triangle repeats its third), and the index of the part.
    pub fn faces(&self) -> impl Iterator<Item = ([u32; 4], u32)> + '_ {
        let (shells, faces) = match &self.source {
            Source::D3plot(family) => (&family.geometry().shells[..], &[][..]),
            Source::Deck { surface, .. } => (&[][..], &surface.faces[..]),
        };
        shells.iter().map(|shell| (shell.nodes, shell.part)).chain(faces.iter().copied())
    }

    /// All parts, in the order that [`Run::faces`] counts them; those without shells too. Titles are the deck's where it
    /// has one.
    pub fn parts(&self) -> Vec<Part> {
        let mut parts: Vec<Part> = match &self.source {
            Source::D3plot(family) => {
                let part = |part: &d3plot::Part| Part {
                    id: part.id,
                    title: part.title.trim().to_owned(),
                    shells: part.shells,
                };
                family.parts().iter().map(part).collect()
            }
            Source::Deck { deck, .. } => {
                let part =
                    |part: keyword_deck::PartRow| Part { id: part.id, title: part.title, shells: part.elements.shells };
                deck.part_table().into_iter().map(part).collect()
            }
        };
        if let Some(deck) = &self.deck {
            let titles: std::collections::HashMap<u64, &str> =
                deck.parts.iter().map(|part| (part.id, part.title.as_str())).collect();
            for part in &mut parts {
                if let Some(title) = titles.get(&part.id).filter(|title| !title.is_empty()) {
                    (*title).clone_into(&mut part.title);
                }
            }
        }
        parts
    }

    /// What the file holds, for `crumple info`; `None` for a deck, of which [`deck::info`] tells more.
    pub fn info(&self) -> Option<Info> {
        let Source::D3plot(family) = &self.source else { return None };
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
        Some(Info {
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
        })
    }

    /// What else the run holds, in words, for messages about what is missing.
    pub fn contents(&self) -> String {
        let [nodes, solids, thick_shells, beams, shells] = match &self.source {
            Source::D3plot(family) => {
                let header = family.header();
                [header.nodes, header.solids, header.thick_shells, header.beams, header.shells]
            }
            Source::Deck { deck, .. } => {
                [deck.node_ids.len(), deck.solids.len(), deck.thick_shells.len(), deck.beams.len(), deck.shells.len()]
            }
        };
        format!("{nodes} nodes, {solids} solids, {thick_shells} thick shells, {beams} beams, {shells} shells")
    }

    /// What the reader noticed: cut states, gaps, broken titles.
    pub fn warnings(&self) -> Vec<String> {
        match &self.source {
            Source::D3plot(family) => family.warnings().iter().map(ToString::to_string).collect(),
            Source::Deck { deck, .. } => deck.warnings.iter().map(ToString::to_string).collect(),
        }
    }

    /// Positions of all nodes in one state, nodes × 3, in the model's length unit.
    ///
    /// # Errors
    /// [`Error::Read`] if the file cannot be read there, [`Error::NoCoordinates`] if its states hold none.
    pub fn positions(&self, state: usize) -> Result<Vec<[f64; 3]>, Error> {
        let none = || Error::NoCoordinates { run: self.id.clone() };
        match &self.source {
            Source::D3plot(family) => family.coordinates(state)?.ok_or_else(none),
            Source::Deck { .. } => Err(none()),
        }
    }

    /// Which shells are deleted in one state, in the order of [`Run::faces`]; `None` where the file does not tell.
    ///
    /// # Errors
    /// [`Error::Read`] if the file cannot be read there.
    pub fn deleted_shells(&self, state: usize) -> Result<Option<Vec<bool>>, Error> {
        match &self.source {
            Source::D3plot(family) => Ok(family.deleted_shells(state)?),
            Source::Deck { .. } => Ok(None),
        }
    }

    /// A field in one state.
    ///
    /// # Errors
    /// [`Error::NoField`] if the states do not hold it, [`Error::Read`] if the file cannot be read there.
    pub fn field(&self, field: Field, state: usize) -> Result<FieldValues, Error> {
        let missing = |available: String| Error::NoField { run: self.id.clone(), field: field.to_string(), available };
        let Source::D3plot(family) = &self.source else { return Err(missing("nothing: it is a deck".into())) };
        let layers = match field.layer {
            Layer::Max => d3plot::Layers::Max,
            Layer::Min => d3plot::Layers::Min,
            Layer::Mean => d3plot::Layers::Mean,
            Layer::Inner => d3plot::Layers::Inner,
            Layer::Outer => d3plot::Layers::Outer,
        };
        let values = match field.quantity {
            Quantity::PlasticStrain => family.shell_plastic_strain(state, layers)?.map(FieldValues::Shells),
            Quantity::VonMises => family.values(state, "shell_stress")?.map(|stress| {
                FieldValues::Shells(stress.rows().map(|points| von_mises(points, field.layer)).collect())
            }),
            Quantity::Thickness => family.values(state, "shell_thickness")?.map(first_column),
            Quantity::InternalEnergy => family.values(state, "shell_internal_energy")?.map(first_column),
            Quantity::Temperature => family
                .temperature(state)?
                .map(|values| FieldValues::Nodes(values.into_iter().map(|x| [x, 0.0, 0.0]).collect())),
            Quantity::Velocity => family.velocity(state)?.map(FieldValues::Nodes),
            Quantity::Acceleration => family.acceleration(state)?.map(FieldValues::Nodes),
        };
        values.ok_or_else(|| missing(family.fields().iter().map(|field| field.name).collect::<Vec<_>>().join(", ")))
    }
}

fn first_column(table: d3plot::Table) -> FieldValues {
    FieldValues::Shells(table.rows().map(|row| row[0]).collect())
}

/// Von Mises stress of one layer of a shell, or over its layers. `points`: (xx, yy, zz, xy, yz, zx) of each layer; three
/// layers are mid, inner, outer, as LS-DYNA writes them.
fn von_mises(points: &[f64], layer: Layer) -> f64 {
    let of = |&[xx, yy, zz, xy, yz, zx]: &[f64; 6]| {
        let normal = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
        (normal / 2.0 + 3.0 * (xy * xy + yz * yz + zx * zx)).sqrt()
    };
    let each: Vec<f64> = points.as_chunks().0.iter().map(of).collect();
    match layer {
        Layer::Max => each.iter().copied().fold(f64::NAN, f64::max),
        Layer::Min => each.iter().copied().fold(f64::NAN, f64::min),
        Layer::Mean => each.iter().sum::<f64>() / each.len() as f64,
        Layer::Inner => each.get(1).copied().unwrap_or(f64::NAN),
        Layer::Outer => each.get(2).copied().unwrap_or(f64::NAN),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn von_mises_of_tension_and_of_shear() {
        let points = [300.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 100.0, 0.0, 0.0, 5.0, 5.0, 5.0, 0.0, 0.0, 0.0];
        assert_eq!(von_mises(&points, Layer::Max), 300.0);
        assert_eq!(von_mises(&points, Layer::Inner), 3_f64.sqrt() * 100.0);
        assert_eq!((von_mises(&points, Layer::Outer), von_mises(&points, Layer::Min)), (0.0, 0.0));
        assert!(von_mises(&points[..6], Layer::Outer).is_nan(), "one layer has no outer one");
    }
}
