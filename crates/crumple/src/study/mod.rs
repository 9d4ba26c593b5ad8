//! The study on disk: a folder that other tools open, and that is whole at every moment.
//!
//! ```text
//! study/
//!   study.toml              what was asked: reference, parts, K, join, units
//!   manifest.json           what is in it: files with checksums, a record a run; replaced by rename, last
//!   mesh.vtu                the reference mesh
//!   basis.safetensors       eigenvalues, eigenvectors, mass, baseline
//!   joints.json             what the deck's welds and ties hold; only when joined by a deck
//!   coefficients/*.parquet  immutable parts, named by content
//!   runs.parquet            one row a run: the manifest's records as a table, renewed after the manifest
//!   modes.parquet           the last answer of `modes`
//!   descriptors/*.json      descriptors
//! ```
//!
//! A part becomes part of the study when the manifest that names it replaces the old one; a crash before that leaves
//! litter, which the next writer clears once no other writer is alive. Writers take turns at the manifest by a lock
//! and merge what they find there, so two processes that add at once lose nothing.

mod add;
mod basis_file;
mod check;
mod coefficients;
mod joints_file;
mod loaded;
mod manifest;
mod mesh_file;
mod staged;
pub(crate) mod store;
mod tables;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use mesh_spectrum::Watch;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub use add::{AddOptions, Added};
pub use check::{Checkup, check};
pub(crate) use coefficients::triples;
pub use coefficients::{Coefficients, Function, Need, Stored, column_name};
pub(crate) use joints_file::ties_of;
pub use loaded::Loaded;
pub use manifest::{FileRecord, LAYOUT, Manifest, RunRecord};
pub use mesh_file::write_shape;
pub(crate) use tables::{Column, add_inputs, metadata_of, run_columns, write_columns};

use staged::StagedFolder;

use crate::Error;
use crate::basis::{Basis, BasisOptions};
use crate::error::io;
use crate::field::Field;
use crate::joints::{Join, Joints, joints};
use crate::reference::Reference;
use crate::run::Run;

const SETTINGS: &str = "study.toml";
/// Lock that serialises changes of the manifest.
const LOCK: &str = ".lock";
/// Lock that writers share while they have parts which no manifest names yet.
const WRITERS: &str = ".writers";
/// Folder of the descriptors.
pub(crate) const DESCRIPTORS: &str = "descriptors";

/// What was asked for when the study was made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Id of the reference run.
    pub reference: String,
    /// Path of its root file.
    pub reference_path: PathBuf,
    /// Labels of the parts whose shells make the surface.
    pub parts: Vec<String>,
    /// Eigenpairs asked for.
    pub eigenpairs: usize,
    /// How separate sheets were joined: a distance, or `deck`; absent when components stay apart.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub join: Option<Join>,
    /// The deck that gave titles and welds, where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub deck: Option<PathBuf>,
    /// Quantities of the result files that are projected beside the shape.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fields: Vec<Field>,
    /// The operator: `cotan` (`cotangent` in older studies), `tufted` or `polygon`.
    pub operator: String,
    /// The mass matrix: `lumped`, `consistent` or `identity`.
    pub mass: String,
    /// Unit of lengths: a label, nothing is converted.
    pub length_unit: String,
    /// Unit of times: a label, nothing is converted.
    pub time_unit: String,
}

/// Which rows of the coefficients are wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rows<'a> {
    /// The last state of every run.
    Last,
    /// Every state of every run.
    All,
    /// Every state of one run.
    Run(&'a str),
}

/// An opened study.
#[derive(Debug, Clone)]
pub struct Study {
    folder: PathBuf,
    settings: Settings,
    manifest: Manifest,
}

impl Study {
    /// Makes a study: reference mesh, operator, eigenbasis. `fields` are what will be projected of each run beside its
    /// shape; the reference run must carry them. The folder appears when everything is in it.
    ///
    /// # Errors
    /// [`Error::StudyExists`] if there is anything at `folder`, and everything that [`Reference::of_run`] and
    /// [`Basis::compute`] return.
    pub fn create(
        folder: &Path,
        run: &Run,
        parts: &[String],
        fields: &[Field],
        options: &BasisOptions,
        watch: &dyn Watch,
    ) -> Result<Self, Error> {
        // A name is needed to stage beside it: `.` has none.
        let folder = &if folder.exists() { absolute(folder) } else { folder.to_owned() };
        if folder.exists() && !is_empty_folder(folder) {
            let what = if folder.join(manifest::FILE).exists() {
                "a study is here already"
            } else {
                "something is here already"
            };
            return Err(Error::StudyExists { folder: folder.to_owned(), what: what.into() });
        }
        // Can it be written at all? Better asked before the eigenbasis than after.
        drop(StagedFolder::beside(folder)?);
        let reference = Reference::of_run(run, parts)?;
        if !run.times().is_empty() {
            fields.iter().try_for_each(|field| run.field(*field, 0).map(drop))?;
        }
        let joints = joints_of(run, &reference, options)?;
        let ties = joints.as_ref().map_or(Ok(Vec::new()), |joints| joints_file::ties(joints, &reference, run.id()))?;
        let mut basis = Basis::compute(&reference, &ties, options, watch)?;
        let staged = StagedFolder::beside(folder)?;
        let settings = Settings {
            reference: run.id().to_owned(),
            reference_path: absolute(run.path()),
            parts: reference.parts.clone(),
            eigenpairs: options.eigenpairs,
            join: options.join,
            fields: fields.to_vec(),
            deck: run.deck().map(|deck| absolute(deck.path())),
            operator: options.kind.to_string(),
            mass: options.mass.to_string(),
            length_unit: "mm".into(),
            time_unit: "ms".into(),
        };
        let text = toml::to_string_pretty(&settings).map_err(|error| Error::Internal(error.to_string()))?;
        store::write_bytes(&staged.path.join(SETTINGS), text.as_bytes())?;
        mesh_file::write(&reference, &staged.path.join(mesh_file::FILE))?;
        basis_file::write(&basis, &staged.path.join(basis_file::FILE))?;
        let mut names = vec![SETTINGS, mesh_file::FILE, basis_file::FILE];
        if let Some(joints) = &joints {
            joints_file::write(joints, &staged.path.join(joints_file::FILE))?;
            names.push(joints_file::FILE);
        }
        for name in [coefficients::FOLDER, DESCRIPTORS] {
            let path = staged.path.join(name);
            std::fs::create_dir(&path).map_err(io("make the folder", &path))?;
        }
        let files = names
            .into_iter()
            .map(|name| Ok((name.to_owned(), FileRecord::of(&staged.path.join(name))?)))
            .collect::<Result<std::collections::BTreeMap<_, _>, Error>>()?;
        basis.id = files[basis_file::FILE].blake3[..16].to_owned();
        let manifest = Manifest {
            layout: LAYOUT,
            crumple: env!("CARGO_PKG_VERSION").into(),
            eigenpairs: basis.eigenpairs(),
            vertices: basis.vertices(),
            basis: basis.id,
            files,
            inputs: Vec::new(),
            runs: Default::default(),
        };
        manifest.write(&staged.path)?;
        tables::write_runs(&staged.path, &manifest)?;
        staged.rename_to(folder)?;
        Ok(Self { folder: folder.to_owned(), settings, manifest })
    }

    /// Opens a study: reads its manifest and settings, nothing else.
    ///
    /// # Errors
    /// [`Error::NotAStudy`], [`Error::OtherLayout`], [`Error::Damaged`].
    pub fn open(folder: &Path) -> Result<Self, Error> {
        let manifest = Manifest::read(folder)?;
        let path = folder.join(SETTINGS);
        let text = std::fs::read_to_string(&path).map_err(io("read", &path))?;
        let settings = toml::from_str(&text).map_err(|error| Error::Damaged { path, what: error.to_string() })?;
        Ok(Self { folder: folder.to_owned(), settings, manifest })
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// What was asked for.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// What is in it.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Whether the study is what these wishes would make: the same surface, parts, fields, eigenpairs, operator and join.
    ///
    /// # Errors
    /// Those of [`Reference::of_run`] and [`Study::reference`].
    pub fn is_for(&self, run: &Run, parts: &[String], fields: &[Field], options: &BasisOptions) -> Result<bool, Error> {
        let reference = Reference::of_run(run, parts)?;
        let same_mesh = || -> Result<bool, Error> {
            let here = self.reference()?;
            Ok(here.node_ids == reference.node_ids
                && here.mesh.triangles() == reference.mesh.triangles()
                && here.mesh.vertices() == reference.mesh.vertices())
        };
        Ok(self.settings.eigenpairs == options.eigenpairs
            && self.settings.join == options.join
            && self.settings.operator.parse() == Ok(options.kind)
            && self.settings.mass.parse() == Ok(options.mass)
            && self.settings.fields == fields
            && self.settings.parts == reference.parts
            && same_mesh()?
            && joints_of(run, &reference, options)?.map(|joints| joints.ties)
                == self.joints()?.map(|joints| joints.ties))
    }

    /// What the deck's welds and ties hold, in a study that was joined by a deck.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Damaged`].
    pub fn joints(&self) -> Result<Option<Joints>, Error> {
        if self.settings.join != Some(Join::DECK) {
            return Ok(None);
        }
        joints_file::read(&self.folder.join(joints_file::FILE)).map(Some)
    }

    /// The reference mesh.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Damaged`].
    pub fn reference(&self) -> Result<Reference, Error> {
        mesh_file::read(&self.folder.join(mesh_file::FILE), self.settings.parts.clone())
    }

    /// The eigenbasis.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Damaged`].
    pub fn basis(&self) -> Result<Basis, Error> {
        basis_file::read(&self.folder.join(basis_file::FILE), &self.manifest.basis)
    }

    /// Coefficients δ of the named eigenvectors (counted from 1; all K when `None`). Only their columns are read.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Damaged`].
    pub fn coefficients(&self, eigenvectors: Option<&[usize]>, rows: Rows<'_>) -> Result<Coefficients, Error> {
        self.coefficients_of(Function::Displacement, eigenvectors, rows)
    }

    /// The same for the function named.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Damaged`].
    pub fn coefficients_of(
        &self,
        function: Function,
        eigenvectors: Option<&[usize]>,
        rows: Rows<'_>,
    ) -> Result<Coefficients, Error> {
        let all: Vec<usize>;
        let eigenvectors = match eigenvectors {
            Some(eigenvectors) => eigenvectors,
            None => {
                all = (1..=self.manifest.eigenpairs).collect();
                &all
            }
        };
        let empty = || Coefficients { function, eigenvectors: eigenvectors.to_vec(), ..Default::default() };
        let wanted = |id: &str| !matches!(rows, Rows::Run(run) if run != id);
        let runs = || self.manifest.runs.iter().filter(|(id, _)| wanted(id));
        let parts: BTreeSet<&str> = runs().map(|(_, run)| run.part.as_str()).collect();
        let read = |part: &&str| {
            // A run that was replaced has rows in an old part too; only the part that the manifest names counts.
            let keep = |run: &str, state: u32| {
                let last = |times: &[f64]| rows != Rows::Last || state as usize + 1 == times.len();
                wanted(run)
                    && self.manifest.runs.get(run).is_some_and(|record| record.part == *part && last(&record.times))
            };
            let path = self.folder.join(part);
            let file = std::fs::File::open(&path).map_err(io("read", &path))?;
            let mut found = empty();
            let wanted = coefficients::Wanted { basis: &self.manifest.basis, last: rows == Rows::Last, keep: &keep };
            coefficients::read_part(file, &path, &wanted, &mut found)?;
            Ok(found)
        };
        let found: Vec<Coefficients> = match parts.iter().collect::<Vec<_>>().into_par_iter().map(read).collect() {
            Err(Error::Io { source, .. }) if source.kind() == std::io::ErrorKind::NotFound && self.is_behind()? => {
                // Another process has replaced runs since this study was opened, and cleared their old part.
                let mut now = self.clone();
                now.refresh()?;
                return now.coefficients_of(function, Some(eigenvectors), rows);
            }
            other => other?,
        };
        let mut result = empty();
        found.into_iter().for_each(|part| result.append(part));
        let expected: usize = runs().map(|(_, run)| if rows == Rows::Last { 1 } else { run.times.len() }).sum();
        if result.rows() != expected {
            let what = format!("{} states found in its parts, the manifest says {expected}", result.rows());
            return Err(Error::Damaged { path: self.folder.join(coefficients::FOLDER), what });
        }
        Ok(result.sorted())
    }

    /// Held by whoever writes into the study: as long as somebody does, nobody clears what looks like litter.
    pub(crate) fn writing(&self) -> Result<store::Lock, Error> {
        store::Lock::shared(&self.folder.join(coefficients::FOLDER).join(WRITERS))
    }

    /// Whether the manifest on disk is another one than this study was opened with.
    fn is_behind(&self) -> Result<bool, Error> {
        Ok(Manifest::read(&self.folder)? != self.manifest)
    }

    /// The record of a run of the study.
    ///
    /// # Errors
    /// [`Error::UnknownRun`] with ids that look like it.
    pub fn record(&self, run: &str) -> Result<&RunRecord, Error> {
        self.manifest.runs.get(run).ok_or_else(|| {
            let needle: String = run.chars().filter(char::is_ascii_digit).collect();
            let like = |id: &&String| id.contains(run) || (!needle.is_empty() && id.contains(&needle));
            Error::UnknownRun {
                asked: run.to_owned(),
                near: self.manifest.runs.keys().filter(like).take(5).cloned().collect(),
            }
        })
    }

    /// Runs that end well before the others (at less than nine tenths of the median last time), with that time: they are
    /// grouped and ranked by the state they reached.
    pub fn ends_early(&self) -> Vec<(&str, f64)> {
        let last = |run: &RunRecord| run.times.last().copied().unwrap_or(0.0);
        let mut times: Vec<f64> = self.manifest.runs.values().map(last).collect();
        times.sort_by(f64::total_cmp);
        let median = times.get(times.len() / 2).copied().unwrap_or(0.0);
        let runs = self.manifest.runs.iter().map(|(id, run)| (id.as_str(), last(run)));
        runs.filter(|(_, time)| *time < 0.9 * median).collect()
    }

    /// Takes up what another process, or this one, has committed since.
    ///
    /// # Errors
    /// As [`Study::open`].
    pub fn refresh(&mut self) -> Result<(), Error> {
        self.manifest = Manifest::read(&self.folder)?;
        Ok(())
    }
}

/// What the run's deck holds of the surface, where joining by it was asked for.
fn joints_of(run: &Run, reference: &Reference, options: &BasisOptions) -> Result<Option<Joints>, Error> {
    if options.join != Some(Join::DECK) {
        return Ok(None);
    }
    let deck = run.deck().ok_or_else(|| Error::NoDeck { run: run.id().to_owned() })?;
    let there: std::collections::HashSet<u64> = deck.node_ids.iter().copied().collect();
    if let Some(missing) = reference.node_ids.iter().find(|id| !there.contains(id)) {
        let what = format!("node {missing} of the surface is not in it ({} nodes there)", deck.node_ids.len());
        return Err(Error::OtherDeck { deck: deck.path().to_owned(), what });
    }
    let mut found = joints(deck, reference);
    found.deck = absolute(&found.deck);
    Ok(Some(found))
}

pub(crate) fn absolute(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}

fn is_empty_folder(path: &Path) -> bool {
    std::fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_none())
}
