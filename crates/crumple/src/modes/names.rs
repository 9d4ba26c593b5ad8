//! Names that the user gives to modes, kept from one call to the next.
//!
//! A name belongs to the runs that were in the mode when it was named. After another call it goes to the mode that has
//! more than half of those runs and consists of them by more than half, runs that came later not counted; there is at most
//! one. Where there is none the name rests, and returns when such a mode does: it never moves to another group in silence.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::Modes;
use crate::Error;

/// A name, and what it was given to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Named {
    /// The name.
    pub name: String,
    /// Runs of the mode when it was named, sorted.
    pub members: Vec<String>,
    /// All runs that had been grouped then, sorted: others came later and say nothing.
    pub known: Vec<String>,
}

impl Modes {
    /// Gives a mode a name, in place of the one it has; an empty name gives it back its number.
    ///
    /// # Errors
    /// [`Error::UnknownMode`], [`Error::Value`] for a name that another mode has or that cannot be one.
    pub fn rename(&mut self, mode: &str, name: &str) -> Result<(), Error> {
        let at = self.modes.iter().position(|other| other.name == mode);
        let Some(at) = at else { return self.mode(mode).map(|_| ()) };
        let name = name.trim();
        let number = numbered(at);
        if !name.is_empty() && name != number {
            self.may_be_called(name, at)?;
        }
        let new = if name.is_empty() { number.clone() } else { name.to_owned() };
        self.names.retain(|kept| kept.name != mode && kept.name != new);
        if new != number {
            let mut known: Vec<String> = self.runs.iter().map(|run| run.run.clone()).collect();
            known.sort();
            self.names.push(Named { name: new.clone(), members: self.modes[at].members.clone(), known });
            self.names.sort_by(|a, b| a.name.cmp(&b.name));
        }
        self.call(at, &new);
        Ok(())
    }

    fn may_be_called(&self, name: &str, at: usize) -> Result<(), Error> {
        let is_number = name.strip_prefix("mode-").is_some_and(|rest| rest.parse::<usize>().is_ok());
        let wrong = if is_number {
            Some("another name than a number that modes get by themselves".to_owned())
        } else if name.starts_with('.') || name.contains(['/', '\\', '\0', '=']) || name == NONE {
            Some(format!("a name that can be a file name, without '=', and not '{NONE}'"))
        } else if self.modes.iter().enumerate().any(|(other, mode)| other != at && mode.name == name) {
            Some("a name that no other mode has".to_owned())
        } else {
            None
        };
        wrong.map_or(Ok(()), |expected| Err(Error::Value { name: "--name", value: name.to_owned(), expected }))
    }

    fn call(&mut self, at: usize, name: &str) {
        let before = std::mem::replace(&mut self.modes[at].name, name.to_owned());
        for run in self.runs.iter_mut().filter(|run| run.mode.as_deref() == Some(&before)) {
            run.mode = Some(name.to_owned());
        }
        for mode in self.partings.iter_mut().flat_map(|parting| &mut parting.modes).filter(|mode| **mode == before) {
            *mode = name.to_owned();
        }
    }

    /// Takes over names that were given before; what became of each that has no mode now goes to the notes.
    pub(super) fn keep(&mut self, names: Vec<Named>) {
        let shared = |named: &Named, at: usize| shared(named, &self.modes[at].members);
        let fits = |named: usize| (0..self.modes.len()).find_map(|at| Some((shared(&names[named], at)?, named, at)));
        let mut fits: Vec<(usize, usize, usize)> = (0..names.len()).filter_map(fits).collect();
        // Of two names for one mode that with more of its runs stays, then the first by name.
        fits.sort_by_key(|&(shared, named, _)| (std::cmp::Reverse(shared), named));
        let mut of_mode: Vec<Option<usize>> = vec![None; self.modes.len()];
        for (_, named, at) in fits {
            of_mode[at].get_or_insert(named);
        }
        for (at, named) in of_mode.iter().enumerate() {
            if let Some(named) = named {
                self.call(at, &names[*named].name);
            }
        }
        for (_, named) in names.iter().enumerate().filter(|(at, _)| !of_mode.contains(&Some(*at))) {
            self.notes.push(self.what_became_of(named));
        }
        self.names = names;
    }

    fn what_became_of(&self, named: &Named) -> String {
        let went = |mode: &super::Mode| {
            let here = mode.members.iter().filter(|run| named.members.binary_search(run).is_ok()).count();
            (here > 0).then(|| format!("{here} in {}", mode.name))
        };
        let went: Vec<String> = self.modes.iter().filter_map(went).collect();
        format!(
            "no mode is '{}' now; of its {} runs: {}",
            named.name,
            named.members.len(),
            if went.is_empty() { "none in any mode".to_owned() } else { went.join(", ") }
        )
    }
}

/// What tables say for a run without a mode.
pub const NONE: &str = "none";

/// The name of a mode that has got none: the largest is `mode-1`.
pub(super) fn numbered(at: usize) -> String {
    format!("mode-{}", at + 1)
}

/// Runs that a name and a mode share, where that is most of both.
fn shared(named: &Named, members: &[String]) -> Option<usize> {
    let before: BTreeSet<&String> = named.members.iter().collect();
    let now: BTreeSet<&String> = members.iter().filter(|run| named.known.binary_search(run).is_ok()).collect();
    let shared = before.intersection(&now).count();
    (2 * shared > before.len() && 2 * shared > now.len()).then_some(shared)
}
