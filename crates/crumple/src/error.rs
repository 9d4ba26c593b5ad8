//! What can go wrong, one variant a cause.
//!
//! `Display` says what is wrong, where, and what was expected; [`Error::remedy`] says what to do, so that the
//! command line can print it as a hint and a program can do without.

mod remedy;

use std::path::{Path, PathBuf};

/// Every failure of this crate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A result file could not be read.
    #[error("{0}")]
    Read(#[from] d3plot::Error),
    /// A keyword deck could not be read.
    #[error("{0}")]
    Deck(#[from] keyword_deck::Error),
    /// Joining by a deck was asked for, and there is none.
    #[error("--join deck: {run} is no keyword deck, and none was given")]
    NoDeck {
        /// The reference run.
        run: String,
    },
    /// A deck of another model than the surface.
    #[error("{}: the deck does not belong to this surface: {what}", deck.display())]
    OtherDeck {
        /// The deck.
        deck: PathBuf,
        /// What differs.
        what: String,
    },
    /// A file whose name says that it is a run and whose content does not.
    #[error("{what}")]
    Refused {
        /// What is wrong, with the file's path.
        what: String,
        /// What to do about it.
        remedy: Option<String>,
    },
    /// A path that does not exist.
    #[error("{}: no such file or folder", .0.display())]
    NoSuchPath(PathBuf),
    /// A folder without any run.
    #[error("{}: no result file found in this folder or below it ({files} other files seen)", folder.display())]
    NoRuns {
        /// The folder that was searched.
        folder: PathBuf,
        /// Files in it that are no result files.
        files: usize,
    },
    /// Some of the runs cannot be used; all of them are listed.
    #[error("{} of {total} runs cannot be used:{}", failures.len(), list_failures(failures))]
    BadRuns {
        /// Run id and reason.
        failures: Vec<(String, String)>,
        /// Number of runs looked at.
        total: usize,
    },
    /// Two runs would have the same id.
    #[error("two runs have the id '{id}': {} and {}", first.display(), second.display())]
    SameId {
        /// The id both would get.
        id: String,
        /// Path of the first.
        first: PathBuf,
        /// Path of the second.
        second: PathBuf,
    },
    /// A run without shells, so without a surface.
    #[error("{run}: no shell elements with an area, so there is no surface to describe ({found})")]
    NoSurface {
        /// The run.
        run: String,
        /// What it has instead.
        found: String,
    },
    /// A part that the run does not have.
    #[error("{run}: no part '{asked}' with shells; parts with shells: {available}")]
    UnknownPart {
        /// The run.
        run: String,
        /// What was asked for.
        asked: String,
        /// Parts that are there.
        available: String,
    },
    /// A run on another mesh than the study's.
    #[error("{run}: the run does not have the study's mesh: {what}")]
    OtherMesh {
        /// The run.
        run: String,
        /// The first difference.
        what: String,
    },
    /// Coordinates that are NaN or infinite.
    #[error(
        "{run}, state {state} (time {time}): {count} of {vertices} vertices have a coordinate that is not a number; the first is node {node}"
    )]
    NotFinite {
        /// The run.
        run: String,
        /// State, counted from 0.
        state: usize,
        /// Its time.
        time: f64,
        /// Number of such vertices.
        count: usize,
        /// Vertices of the mesh.
        vertices: usize,
        /// User id of the first such node.
        node: u64,
    },
    /// Coordinates so large that their coefficients cannot be stored.
    #[error("{run}, state {state} (time {time}): coordinates too large to be a shape of this part")]
    TooLarge {
        /// The run.
        run: String,
        /// State, counted from 0.
        state: usize,
        /// Its time.
        time: f64,
    },
    /// A run without coordinates in its states.
    #[error("{run}: its states hold no coordinates")]
    NoCoordinates {
        /// The run.
        run: String,
    },
    /// A run whose states do not carry a field.
    #[error("{run}: its states hold no {field} (they hold {available})")]
    NoField {
        /// The run.
        run: String,
        /// What was asked for.
        field: String,
        /// What the states hold.
        available: String,
    },
    /// A field with values that are no numbers on the surface.
    #[error("{run}, state {state} (time {time}): {field} is not a number somewhere on the surface")]
    FieldNotFinite {
        /// The run.
        run: String,
        /// The field.
        field: String,
        /// State, counted from 0.
        state: usize,
        /// Its time.
        time: f64,
    },
    /// A field that the study does not keep.
    #[error("the study keeps no field '{asked}'; it keeps {available}")]
    UnknownField {
        /// What was asked for.
        asked: String,
        /// What there is.
        available: String,
    },
    /// A run without any whole state.
    #[error("{run}: no whole state{reason}")]
    NoStates {
        /// The run.
        run: String,
        /// What the reader noticed, after a colon, or nothing.
        reason: String,
    },
    /// The surface of the reference run is not a usable mesh.
    #[error("{run}: {source}")]
    Mesh {
        /// The reference run.
        run: String,
        /// What is wrong with it.
        source: mesh_spectrum::MeshError,
    },
    /// A mesh file that cannot be read.
    #[error("{0}")]
    MeshFile(mesh_files::Error),
    /// A mesh file that holds no usable mesh.
    #[error("{}: {source}", path.display())]
    BadMesh {
        /// The file.
        path: PathBuf,
        /// What is wrong with the mesh.
        source: mesh_spectrum::MeshError,
    },
    /// Joining the components failed.
    #[error("join: {0}")]
    Join(#[from] mesh_spectrum::JoinError),
    /// The operator could not be built.
    #[error("operator: {0}")]
    Operator(mesh_spectrum::OperatorError),
    /// The eigenpairs could not be found.
    #[error("eigenbasis: {0}")]
    Eigen(mesh_spectrum::EigenError),
    /// The caller asked to stop.
    #[error("interrupted")]
    Stopped,
    /// A folder that is no study.
    #[error("{}: not a study: {what}", folder.display())]
    NotAStudy {
        /// The folder.
        folder: PathBuf,
        /// What is missing.
        what: String,
    },
    /// `init` on something that exists and is not the same study.
    #[error("{}: {what}", folder.display())]
    StudyExists {
        /// The folder.
        folder: PathBuf,
        /// What is there.
        what: String,
    },
    /// A study written by another version of the layout.
    #[error("{}: the study has layout {found}, this program reads layout {expected}", folder.display())]
    OtherLayout {
        /// The folder.
        folder: PathBuf,
        /// Layout in the manifest.
        found: u64,
        /// Layout this program writes.
        expected: u64,
    },
    /// A file of a study is not what the manifest says.
    #[error("{}: {what}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
    },
    /// Reading or writing failed.
    #[error("{}: cannot {action}: {source}", path.display())]
    Io {
        /// What was tried.
        action: &'static str,
        /// Where.
        path: PathBuf,
        /// The system's answer.
        source: std::io::Error,
    },
    /// A run that is neither in the study nor a file.
    #[error("no run '{asked}': the study has no run with this id and there is no such file{}", near_runs(near))]
    UnknownRun {
        /// What was asked for.
        asked: String,
        /// Ids that look like it.
        near: Vec<String>,
    },
    /// A state that the run does not have.
    #[error("{run} has {states} states, @0 to @{}; there is no @{state}", states.saturating_sub(1))]
    UnknownState {
        /// The run.
        run: String,
        /// What was asked for.
        state: String,
        /// Number of states it has.
        states: usize,
    },
    /// A run of the study whose content is not what was added.
    #[error("{run}: its result file differs from what the study holds under this id")]
    RunChanged {
        /// The run.
        run: String,
    },
    /// A study too small for what was asked.
    #[error("{what} needs at least {needed} runs; there are {have}")]
    TooFewRuns {
        /// What was asked for.
        what: &'static str,
        /// Number needed.
        needed: usize,
        /// Number there.
        have: usize,
    },
    /// A mode that is not there.
    #[error("no mode '{asked}'; modes: {available}")]
    UnknownMode {
        /// What was asked for.
        asked: String,
        /// Names of the modes there are.
        available: String,
    },
    /// No modes have been computed yet.
    #[error("the study has no modes yet")]
    NoModes,
    /// A descriptor that is not there.
    #[error("no descriptor '{asked}'; descriptors of this study: {available}")]
    UnknownDescriptor {
        /// What was asked for.
        asked: String,
        /// Names of the descriptors there are.
        available: String,
    },
    /// A descriptor made with another eigenbasis.
    #[error("descriptor '{name}' belongs to another eigenbasis ({found}) than this study's ({expected})")]
    OtherBasis {
        /// The descriptor.
        name: String,
        /// Its basis.
        found: String,
        /// The study's basis.
        expected: String,
    },
    /// A descriptor file that cannot be used.
    #[error("{}: not a usable descriptor: {what}", path.display())]
    BadDescriptor {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
    },
    /// A rule for the threshold that cannot be understood or applied.
    #[error("threshold '{rule}': {what}")]
    Threshold {
        /// As it was written.
        rule: String,
        /// What is wrong.
        what: String,
    },
    /// A value on the command line or in a call that makes no sense.
    #[error("{name} = {value}: expected {expected}")]
    Value {
        /// The option's name.
        name: &'static str,
        /// What was given.
        value: String,
        /// What was expected.
        expected: String,
    },
    /// A run that is followed and writes nothing new.
    #[error("{}: no new state for {seconds} s; {}{reason}", run.display(), seen_so_far(*seen, *last_time))]
    Silent {
        /// The run.
        run: PathBuf,
        /// How long nothing came.
        seconds: f64,
        /// States that came.
        seen: usize,
        /// Time of the last of them.
        last_time: Option<f64>,
        /// Why what is there cannot be read, after a colon, or nothing.
        reason: String,
    },
    /// A run that is followed and lost states.
    #[error("{}: it had {before} states and has {now} now: the run was started anew", run.display())]
    Restarted {
        /// The run.
        run: PathBuf,
        /// States it had.
        before: usize,
        /// States it has.
        now: usize,
    },
    /// A table of inputs or labels that cannot be read.
    #[error("{}: {what}", path.display())]
    Table {
        /// The table.
        path: PathBuf,
        /// What is wrong, with the line where there is one.
        what: String,
    },
    /// A table none of whose rows belongs to a run.
    #[error("{}: no row belongs to a run: the first column '{column}' has {keys}, the runs are {runs}", path.display())]
    NoMatch {
        /// The table.
        path: PathBuf,
        /// Name of its key column.
        column: String,
        /// Some of its keys.
        keys: String,
        /// Some of the runs.
        runs: String,
    },
    /// A broken law inside this program.
    #[error("internal: {0}")]
    Internal(String),
}

fn list_failures(failures: &[(String, String)]) -> String {
    const SHOWN: usize = 20;
    let mut text: String = failures.iter().take(SHOWN).map(|(id, why)| format!("\n  {}", with_name(id, why))).collect();
    if failures.len() > SHOWN {
        text += &format!("\n  … and {} more", failures.len() - SHOWN);
    }
    text
}

/// The reason, with the run's id before it unless it begins with it.
fn with_name(id: &str, why: &str) -> String {
    if why.starts_with(id) { why.to_owned() } else { format!("{id}: {why}") }
}

fn seen_so_far(states: usize, last: Option<f64>) -> String {
    match (states, last) {
        (0, _) | (_, None) => "none came at all".to_owned(),
        (states, Some(time)) => format!("{states} came, the last at time {}", time as f32),
    }
}

fn near_runs(near: &[String]) -> String {
    if near.is_empty() { String::new() } else { format!("; runs with a like name: {}", near.join(", ")) }
}

/// Wraps the system's answer with what was tried and where.
pub(crate) fn io<'a>(action: &'static str, path: &'a Path) -> impl FnOnce(std::io::Error) -> Error + 'a {
    move |source| Error::Io { action, path: path.to_owned(), source }
}

impl From<mesh_spectrum::OperatorError> for Error {
    fn from(error: mesh_spectrum::OperatorError) -> Self {
        match error {
            mesh_spectrum::OperatorError::Join(error) => Self::Join(error),
            other => Self::Operator(other),
        }
    }
}

impl From<mesh_spectrum::EigenError> for Error {
    fn from(error: mesh_spectrum::EigenError) -> Self {
        match error {
            mesh_spectrum::EigenError::Stopped => Self::Stopped,
            other => Self::Eigen(other),
        }
    }
}
