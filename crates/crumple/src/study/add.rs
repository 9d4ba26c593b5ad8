//! Adding runs to a study: project them on all cores, write parts, then the manifest.

use std::collections::BTreeMap;
use std::sync::Mutex;

use rayon::prelude::*;

use super::store::Lock;
use super::{Error, FileRecord, LOCK, Manifest, RunRecord, Study, WRITERS, absolute, coefficients, tables};
use crate::bundle::Found;
use crate::inputs::Table;
use crate::project::{Projected, Projector, Spent};
use crate::run::Run;
use mesh_spectrum::Watch;

/// How to add.
#[derive(Debug, Clone, Copy, Default)]
pub struct AddOptions<'a> {
    /// A run whose id is there with another content takes its place. Default: that is an error.
    pub replace: bool,
    /// Runs that cannot be used are left out and reported, and every part is committed as soon as it is written, so
    /// that a process that is killed loses little. Default: all runs are projected before any is committed, and nothing
    /// is added when one of them is bad.
    pub skip_bad: bool,
    /// A table of inputs or responses, kept per run.
    pub params: Option<&'a Table>,
}

/// What an add did.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Added {
    /// Ids of the runs that are new.
    pub added: Vec<String>,
    /// Ids of the runs that took the place of others.
    pub replaced: Vec<String>,
    /// Ids of the runs that were there already.
    pub unchanged: Vec<String>,
    /// Runs left out, with the reason.
    pub skipped: Vec<(String, String)>,
    /// What the user should know.
    pub notes: Vec<String>,
    /// Time of all threads that projecting took.
    pub spent: Spent,
}

/// Runs projected before a part is written; bounds memory.
const PART_RUNS: usize = 64;

impl Study {
    /// Projects every state of these runs and adds them. Safe to repeat, to kill, and to run several at once.
    ///
    /// Nothing is added when one of the runs is bad, unless `skip_bad`. When the caller stops it, the runs that are
    /// finished are kept.
    ///
    /// # Errors
    /// The run's own error when there is one run, [`Error::BadRuns`] when there are several; [`Error::RunChanged`],
    /// [`Error::NoMatch`] for a table that fits no run, [`Error::Stopped`], [`Error::Io`].
    pub fn add(&mut self, found: &[Found], options: AddOptions<'_>, watch: &dyn Watch) -> Result<Added, Error> {
        self.clear_litter()?;
        let writers = self.writing()?;
        let outcome = self.project_and_commit(found, options, watch);
        drop(writers);
        // Parts that the commit did not take up: a refused run, or one that was here already. What cannot be cleared
        // now, the next add clears.
        let _ = self.clear_litter();
        outcome
    }

    fn project_and_commit(
        &mut self,
        found: &[Found],
        options: AddOptions<'_>,
        watch: &dyn Watch,
    ) -> Result<Added, Error> {
        let mut result = Added::default();
        let inputs = self.inputs_of(found, options.params, &mut result.notes)?;
        let here: Vec<bool> = found.par_iter().map(|run| self.is_here(run)).collect();
        let (unchanged, todo): (Vec<_>, Vec<_>) = found.iter().zip(here).partition(|(_, here)| *here);
        result.unchanged = unchanged.iter().map(|(run, _)| run.id.clone()).collect();
        let todo: Vec<&Found> = todo.into_iter().map(|(run, _)| run).collect();
        let mut waiting = BTreeMap::new();
        if todo.is_empty() {
            self.commit(waiting, &inputs, options.replace, &mut result)?;
            return Ok(result);
        }
        let (reference, basis) = (self.reference()?, self.basis()?);
        let fields = self.settings.fields.clone();
        let projector = Projector::new(&reference, &basis, &fields);
        let work = Work { projector, total: todo.len(), done: Mutex::new(0), watch };
        for batch in todo.chunks(PART_RUNS) {
            let written = self.write_batch(&work, batch, &options)?;
            result.skipped.extend(written.failures);
            result.spent += written.spent;
            waiting.extend(written.records);
            if written.stopped {
                // What is finished is kept, also beside a bad run: that one is found again when the add is repeated.
                self.commit(waiting, &inputs, options.replace, &mut result)?;
                return Err(Error::Stopped);
            }
            if options.skip_bad {
                self.commit(std::mem::take(&mut waiting), &inputs, options.replace, &mut result)?;
            }
        }
        if !result.skipped.is_empty() && !options.skip_bad {
            return Err(Error::BadRuns { failures: result.skipped, total: todo.len() });
        }
        self.commit(waiting, &inputs, options.replace, &mut result)?;
        Ok(result)
    }

    /// Projects a batch of runs and writes a part for it; no manifest refers to the part yet. The error of a single run
    /// is returned as it is, those of several are gathered.
    fn write_batch(&self, work: &Work<'_>, batch: &[&Found], options: &AddOptions<'_>) -> Result<Written, Error> {
        let mut written = Written::default();
        let (mut projected, mut runs) = (Vec::new(), Vec::new());
        for (run, outcome) in work.project_all(batch) {
            match outcome.and_then(|(stamp, states)| self.not_changed(states, options).map(|states| (stamp, states))) {
                Ok((stamp, states)) => {
                    written.spent += states.spent;
                    projected.push(states);
                    runs.push((run, stamp));
                }
                Err(Error::Stopped) => written.stopped = true,
                Err(error) if work.total == 1 && !options.skip_bad => return Err(error),
                Err(error) => written.failures.push((run.id.clone(), error.to_string())),
            }
        }
        if !projected.is_empty() {
            let part = coefficients::write_part(&self.folder, &self.manifest.basis, &projected)?;
            let records = projected.into_iter().zip(runs);
            let record = |(states, (run, stamp)): (Projected, (&Found, String))| {
                (run.id.clone(), record(states, run, stamp, &part))
            };
            written.records.extend(records.map(record));
        }
        Ok(written)
    }

    /// The run, unless the study holds another content under its id that must not be replaced.
    fn not_changed(&self, states: Projected, options: &AddOptions<'_>) -> Result<Projected, Error> {
        let there = self.manifest.runs.get(&states.run);
        if options.replace || there.is_none_or(|record| record.content == states.content) {
            return Ok(states);
        }
        Err(Error::RunChanged { run: states.run })
    }

    /// Removes what a killed writer left, if no writer is alive that could own it.
    fn clear_litter(&mut self) -> Result<(), Error> {
        let path = self.folder.join(coefficients::FOLDER).join(WRITERS);
        if let Some(_alone) = Lock::try_exclusive(&path)? {
            self.refresh()?;
            for part in coefficients::litter(&self.folder, &self.manifest)? {
                std::fs::remove_file(&part).map_err(crate::error::io("remove", &part))?;
            }
        }
        Ok(())
    }

    fn is_here(&self, run: &Found) -> bool {
        let same = |record: &RunRecord| {
            let now = Run::open(&run.id, &run.path).map(|run| stamp(&run));
            record.path == absolute(&run.path) && now.is_ok_and(|now| now == record.stamp)
        };
        self.manifest.runs.get(&run.id).is_some_and(same)
    }

    /// Input values by run id.
    fn inputs_of(&self, found: &[Found], table: Option<&Table>, notes: &mut Vec<String>) -> Result<Inputs, Error> {
        let Some(table) = table else { return Ok(Inputs::default()) };
        let ids: Vec<&str> = found.iter().map(|run| run.id.as_str()).collect();
        let joined = table.join(&ids)?;
        notes.extend(joined.notes);
        let row = |row: Option<usize>| {
            let values = row.map(|row| &table.rows[row].1);
            table
                .columns
                .iter()
                .zip(values.into_iter().flatten())
                .map(|(column, value)| (column.clone(), value.clone()))
                .collect()
        };
        let by_run = ids.iter().zip(joined.row_of_run).map(|(id, found)| ((*id).to_owned(), row(found))).collect();
        Ok(Inputs { columns: table.columns.clone(), by_run })
    }

    /// Merges new records into the manifest as it is on disk now, and replaces it.
    fn commit(
        &mut self,
        records: BTreeMap<String, RunRecord>,
        inputs: &Inputs,
        replace: bool,
        result: &mut Added,
    ) -> Result<(), Error> {
        let _lock = Lock::exclusive(&self.folder.join(LOCK))?;
        let before = Manifest::read(&self.folder)?;
        let mut manifest = before.clone();
        for (id, mut record) in records {
            match manifest.runs.get_mut(&id) {
                Some(there) if there.content == record.content => {
                    // The same content from another place or with a newer date: its coefficients stay, its whereabouts change.
                    there.path = record.path;
                    there.stamp = record.stamp;
                    result.unchanged.push(id);
                }
                Some(_) if !replace => return Err(Error::RunChanged { run: id }),
                Some(there) => {
                    record.inputs = std::mem::take(&mut there.inputs);
                    *there = record;
                    result.replaced.push(id);
                }
                None => {
                    manifest.runs.insert(id.clone(), record);
                    result.added.push(id);
                }
            }
        }
        for column in &inputs.columns {
            if !manifest.inputs.contains(column) {
                manifest.inputs.push(column.clone());
            }
        }
        for (id, values) in &inputs.by_run {
            if let Some(record) = manifest.runs.get_mut(id) {
                record.inputs.extend(values.clone());
            }
        }
        let used: std::collections::BTreeSet<String> = manifest.runs.values().map(|run| run.part.clone()).collect();
        manifest.files.retain(|name, _| !name.starts_with(coefficients::FOLDER) || used.contains(name));
        for part in used {
            if let std::collections::btree_map::Entry::Vacant(entry) = manifest.files.entry(part) {
                let file = FileRecord::of(&self.folder.join(entry.key()))?;
                entry.insert(file);
            }
        }
        manifest.crumple = env!("CARGO_PKG_VERSION").into();
        result.unchanged.sort();
        if manifest != before {
            manifest.write(&self.folder)?;
        }
        tables::write_runs(&self.folder, &manifest)?;
        self.manifest = manifest;
        Ok(())
    }
}

#[derive(Default)]
struct Inputs {
    columns: Vec<String>,
    by_run: BTreeMap<String, BTreeMap<String, String>>,
}

/// Runs that are projected and on disk, but in no manifest.
#[derive(Default)]
struct Written {
    records: BTreeMap<String, RunRecord>,
    failures: Vec<(String, String)>,
    stopped: bool,
    spent: Spent,
}

/// A projected run, and the stamp that its files had before they were read.
type Stamped = (String, Projected);

/// What every projection of an add shares.
struct Work<'a> {
    projector: Projector<'a>,
    total: usize,
    done: Mutex<usize>,
    watch: &'a dyn Watch,
}

impl Work<'_> {
    fn project_all<'f>(&self, batch: &[&'f Found]) -> Vec<(&'f Found, Result<Stamped, Error>)> {
        batch.par_iter().map(|&run| (run, self.project_one(run))).collect()
    }

    /// The stamp is taken before the files are read: a run that grows meanwhile is looked at again next time.
    fn project_one(&self, run: &Found) -> Result<Stamped, Error> {
        if self.watch.stopped() {
            return Err(Error::Stopped);
        }
        let projected = match &run.fault {
            Some(fault) => Err(Error::Refused { what: fault.what.clone(), remedy: fault.remedy.clone() }),
            None => Run::open(&run.id, &run.path)
                .and_then(|opened| Ok((stamp(&opened), self.projector.project(&opened, self.watch)?))),
        };
        if let Ok(mut done) = self.done.lock() {
            *done += 1;
            self.watch.step("projecting runs", *done, self.total);
        }
        projected
    }
}

fn record(projected: Projected, run: &Found, stamp: String, part: &str) -> RunRecord {
    RunRecord {
        path: absolute(&run.path),
        stamp,
        content: projected.content,
        part: part.to_owned(),
        times: projected.states.iter().map(|state| state.time).collect(),
        last: projected.states.last().map(|state| state.measures).unwrap_or_default(),
        inputs: BTreeMap::new(),
        warnings: projected.warnings,
    }
}

/// Name, length and time of change of each file of a run, as one hash.
fn stamp(run: &Run) -> String {
    let mut hasher = blake3::Hasher::new();
    for (path, bytes) in run.files() {
        let changed = path.metadata().and_then(|metadata| metadata.modified()).unwrap_or(std::time::UNIX_EPOCH);
        let changed = changed.duration_since(std::time::UNIX_EPOCH).map_or(0, |since| since.as_nanos());
        hasher.update(path.file_name().unwrap_or_default().as_encoded_bytes());
        hasher.update(&bytes.to_le_bytes());
        hasher.update(&changed.to_le_bytes());
    }
    hasher.finalize().to_hex()[..16].to_owned()
}
