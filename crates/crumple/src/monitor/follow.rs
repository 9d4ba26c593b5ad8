//! Watching a result file that a solver is writing.
//!
//! The files of the family are looked at again and again; when they have changed the family is opened anew, and every
//! whole state that was not there before is handed on. The newest state is handed on only when another one has begun
//! behind it or when nothing has changed between two looks: a state whose last bytes are still in the solver's buffer is
//! not there yet.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use mesh_spectrum::Watch;

use crate::Error;
use crate::error::io;
use crate::run::Run;

/// How to watch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Follow {
    /// Pause between two looks.
    pub every: Duration,
    /// Longest time without a new state.
    pub timeout: Duration,
}

impl Default for Follow {
    fn default() -> Self {
        Self { every: Duration::from_secs(5), timeout: Duration::from_secs(3600) }
    }
}

/// Name, length and last change of each file beside the root.
type Files = Vec<(PathBuf, u64, Option<SystemTime>)>;

/// Hands on each whole state of the family at `path` (a root file or its folder, which need not exist yet) until
/// `on_state` breaks.
///
/// # Errors
/// [`Error::Silent`] if no new state came for as long as the timeout; [`Error::Restarted`] if states disappear;
/// [`Error::Stopped`]; whatever `on_state` returns.
pub fn follow<T>(
    path: &Path,
    options: Follow,
    watch: &dyn Watch,
    mut on_state: impl FnMut(&Run, usize) -> Result<ControlFlow<T>, Error>,
) -> Result<T, Error> {
    let (mut seen, mut last_time) = (0, None);
    let mut before: Option<Files> = None;
    let mut open: Option<Run> = None;
    let mut reason = None;
    let mut quiet_since = Instant::now();
    loop {
        // Of a folder only the family counts, once it is known: other files there change all the time.
        let now = files(open.as_ref().map_or(path, Run::path))?;
        let settled = before.as_ref() == Some(&now);
        if !settled {
            // A root that is not whole yet is no family; what was wrong is told if it stays so.
            match Run::open(path.display().to_string(), path) {
                Ok(run) => (open, reason) = (Some(run), None),
                Err(error) if now.is_empty() => reason = (path.exists()).then_some(error),
                Err(error) => (open, reason) = (None, Some(error)),
            }
        }
        if let Some(run) = &open {
            let states = run.times().len();
            if states < seen {
                return Err(Error::Restarted { run: path.to_owned(), before: seen, now: states });
            }
            let ready = if settled { states } else { states.saturating_sub(1).max(seen) };
            while seen < ready {
                let state = seen;
                if watch.stopped() {
                    return Err(Error::Stopped);
                }
                last_time = run.times().get(state).copied();
                if let ControlFlow::Break(answer) = on_state(run, state)? {
                    return Ok(answer);
                }
                (seen, quiet_since) = (state + 1, Instant::now());
            }
        }
        before = Some(now);
        if quiet_since.elapsed() >= options.timeout {
            let reason = reason.map_or_else(String::new, |error| format!(": {error}"));
            return Err(Error::Silent {
                run: path.to_owned(),
                seconds: options.timeout.as_secs_f64(),
                seen,
                last_time,
                reason,
            });
        }
        pause(options.every.min(options.timeout.saturating_sub(quiet_since.elapsed())), watch)?;
    }
}

/// Sleeps in slices, so that Ctrl-C does not wait for the end of a long pause.
fn pause(length: Duration, watch: &dyn Watch) -> Result<(), Error> {
    let end = Instant::now() + length;
    loop {
        if watch.stopped() {
            return Err(Error::Stopped);
        }
        let left = end.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Ok(());
        }
        std::thread::sleep(left.min(Duration::from_millis(100)));
    }
}

/// The files that may belong to the family: those in the folder, or those whose names begin with the root's.
fn files(path: &Path) -> Result<Files, Error> {
    let (folder, root) = if path.is_dir() {
        (path.to_owned(), String::new())
    } else {
        let root = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        (super::run_folder(path), root)
    };
    let entries = match std::fs::read_dir(&folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Files::new()),
        Err(error) => return Err(io("look into", &folder)(error)),
    };
    let mut files = Files::new();
    for entry in entries.flatten() {
        let belongs = entry.file_name().to_string_lossy().starts_with(&root);
        // A file may go between the listing and the look at it.
        let Ok(facts) = std::fs::metadata(entry.path()) else { continue };
        if belongs && facts.is_file() {
            files.push((entry.path(), facts.len(), facts.modified().ok()));
        }
    }
    files.sort();
    Ok(files)
}
