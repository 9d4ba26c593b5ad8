//! Is the study whole: every file there, with the content that the manifest says, and nothing contradictory.

use std::path::Path;

use super::store::Lock;
use super::{Error, FileRecord, LOCK, Loaded, Manifest, Rows, Study, coefficients, joints_file, tables};

/// What a check found.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Checkup {
    /// Whether every answer of the study can be trusted.
    pub whole: bool,
    /// What is wrong; empty when whole.
    pub problems: Vec<String>,
    /// What is harmless but worth knowing: litter of a killed process, a derived table that is behind.
    pub notes: Vec<String>,
    /// Files looked at.
    pub files: usize,
    /// Runs in the study.
    pub runs: usize,
}

/// Reads the whole study and compares it with its manifest.
///
/// # Errors
/// [`Error::NotAStudy`], [`Error::OtherLayout`]; damage is no error here but an answer.
pub fn check(folder: &Path) -> Result<Checkup, Error> {
    let mut problems = Vec::new();
    let mut notes = Vec::new();
    // Is it a study at all? Asked before a lock file is made in it.
    let before = Manifest::read(folder);
    if let Err(Error::NotAStudy { .. } | Error::OtherLayout { .. }) = before {
        before?;
    }
    // With the lock, no writer replaces the manifest meanwhile. A study that cannot be written is read without.
    let _lock = Lock::exclusive(&folder.join(LOCK)).ok();
    let manifest = match Manifest::read(folder) {
        Err(Error::Damaged { path, what }) => {
            let problems = vec![format!("{}: {what}", path.display())];
            return Ok(Checkup { whole: false, problems, notes, files: 1, runs: 0 });
        }
        other => other?,
    };
    for (name, expected) in &manifest.files {
        match FileRecord::of(&folder.join(name)) {
            Ok(found) if found == *expected => {}
            Ok(found) if found.bytes != expected.bytes => {
                problems.push(format!("{name}: {} bytes, the manifest says {}", found.bytes, expected.bytes))
            }
            Ok(_) => problems.push(format!("{name}: its content is not what the manifest says")),
            Err(error) => problems.push(format!("{name}: {error}")),
        }
    }
    if problems.is_empty() {
        problems.extend(contradictions(folder, &manifest));
    }
    let litter = coefficients::litter(folder, &manifest).unwrap_or_default();
    notes.extend(litter.iter().map(|path| {
        let name = path.strip_prefix(folder).unwrap_or(path).display();
        format!("{name}: left by a process that was stopped; the next add clears it")
    }));
    match tables::read_strings(&folder.join("runs.parquet"), "run") {
        Ok(runs) if runs.iter().eq(manifest.runs.keys()) => {}
        Ok(_) => notes.push("runs.parquet is behind the manifest; the next add renews it".into()),
        Err(error) => notes.push(format!("{error}; the next add renews it")),
    }
    Ok(Checkup {
        whole: problems.is_empty(),
        problems,
        notes,
        files: manifest.files.len() + 1,
        runs: manifest.runs.len(),
    })
}

fn contradictions(folder: &Path, manifest: &Manifest) -> Vec<String> {
    let attempt = || -> Result<Vec<String>, Error> {
        let mut problems = Vec::new();
        let loaded = Loaded::of(Study::open(folder)?)?;
        problems.extend(join_not_held(&loaded)?);
        let rows = loaded.study.coefficients(Some(&[1]), Rows::All)?;
        let mut states = std::collections::BTreeMap::<&str, usize>::new();
        for run in &rows.runs {
            *states.entry(run).or_default() += 1;
        }
        for (id, run) in &manifest.runs {
            let found = states.get(id.as_str()).copied().unwrap_or(0);
            if found != run.times.len() {
                problems.push(format!("{id}: {found} states in {}, the manifest says {}", run.part, run.times.len()));
            }
        }
        Ok(problems)
    };
    attempt().unwrap_or_else(|error| vec![error.to_string()])
}

/// Whether the basis is that of the surface joined as the settings say: every vertex that follows others has the mean of
/// their values in every eigenvector.
fn join_not_held(loaded: &Loaded) -> Result<Option<String>, Error> {
    let Loaded { study, basis, .. } = loaded;
    if study.settings().join != basis.facts.join {
        return Ok(Some("study.toml and the basis say different things about the join".into()));
    }
    if study.settings().join.is_none() {
        return Ok(None);
    }
    let ties = joints_file::ties_of(loaded)?;
    if ties.len() != basis.facts.joined_pairs {
        return Ok(Some(format!(
            "{} vertices are joined, the basis was made with {}",
            ties.len(),
            basis.facts.joined_pairs
        )));
    }
    // A tie of a vertex that others hold already says nothing; the basis was made without it.
    let mut broken: Vec<bool> = vec![false; ties.len()];
    for phi in basis.eigenvectors.chunks_exact(basis.vertices()) {
        let most = phi.iter().fold(0.0f32, |most, x| most.max(x.abs()));
        for (tie, broken) in ties.iter().zip(&mut broken) {
            let mean: f64 = tie.to.iter().map(|&(vertex, weight)| weight * f64::from(phi[vertex as usize])).sum();
            // Eigenvectors are stored in single precision, and weights below 1e-6 are dropped.
            *broken |= (f64::from(phi[tie.vertex as usize]) - mean).abs() > 1e-5 * f64::from(most);
        }
    }
    let count = broken.iter().filter(|broken| **broken).count();
    Ok((count > basis.facts.idle_ties).then(|| {
        format!(
            "{count} of {} ties are not held by the eigenvectors, {} are known to say nothing",
            ties.len(),
            basis.facts.idle_ties
        )
    }))
}
