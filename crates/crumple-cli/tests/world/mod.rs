//! The world of the tests: the program, the example bundle, studies that are made once, runs that a test may spoil.
//!
//! Every test program includes this module; none uses all of it.
#![allow(dead_code, unused_macros, unreachable_pub)]

pub mod spoil;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

use serde_json::Value;
use tempfile::TempDir;

/// A dozen runs of the example, of all three deformation modes; the three queries of its documentation among them.
pub const DOZEN: [&str; 12] = [
    "run_001", "run_002", "run_003", "run_007", "run_010", "run_020", "run_033", "run_042", "run_055", "run_065",
    "run_074", "run_099",
];

/// A run of the example that is not among the dozen.
pub const STRANGER: &str = "run_050";

/// States of each run of the example.
pub const STATES: usize = 4;

/// The root of the repository.
pub fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap()
}

/// The example that comes with the repository.
pub fn example() -> PathBuf {
    repository().join("examples/hat-section")
}

/// A run of the example.
pub fn example_run(id: &str) -> PathBuf {
    example().join("runs").join(id)
}

/// Families that come with the reader.
pub fn testdata(family: &str) -> PathBuf {
    repository().join("crates/d3plot/testdata").join(family)
}

/// The program, to which arguments can be given.
pub fn program() -> Command {
    Command::new(env!("CARGO_BIN_EXE_crumple"))
}

/// What a command said.
#[derive(Debug)]
pub struct Outcome {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
    words: String,
}

/// Runs a command to its end.
pub fn finish(mut command: Command) -> Outcome {
    let words = format!("{command:?}");
    let output = command.output().unwrap_or_else(|error| panic!("{words}: {error}"));
    Outcome::of(output, words)
}

/// `crumple!["search", &study, "mode-1"]`: runs the program with these arguments.
#[macro_export]
macro_rules! crumple {
    ($($argument:expr),* $(,)?) => {{
        let mut command = $crate::world::program();
        $(command.arg($argument);)*
        $crate::world::finish(command)
    }};
}

impl Outcome {
    pub fn of(output: Output, words: String) -> Self {
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("what the program prints is UTF-8");
        Self { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr), words }
    }

    /// Expects exit code 0.
    #[track_caller]
    pub fn done(self) -> Self {
        self.ends_with_code(0)
    }

    #[track_caller]
    pub fn ends_with_code(self, code: i32) -> Self {
        assert_eq!(self.code, Some(code), "{}\nstdout: {}\nstderr: {}", self.words, self.stdout, self.stderr);
        self
    }

    /// The result as JSON.
    #[track_caller]
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.stdout)
            .unwrap_or_else(|error| panic!("{}: no JSON ({error}): {}\n{}", self.words, self.stdout, self.stderr))
    }

    /// Expects a refusal as the house promises it: exit code 2, nothing on standard output, on standard error one
    /// message that starts with `error: ` and names every one of `names`, at most one hint, no panic.
    #[track_caller]
    pub fn refused(self, names: &[&str]) -> Self {
        let told = format!("{}\nstdout: {}\nstderr: {}", self.words, self.stdout, self.stderr);
        assert_eq!(self.code, Some(2), "{told}");
        assert_eq!(self.stdout, "", "{told}");
        assert!(self.stderr.starts_with("error: "), "{told}");
        let lines = |start: &str| self.stderr.lines().filter(|line| line.trim_start().starts_with(start)).count();
        assert_eq!(lines("error:"), 1, "one message, not a stack of them\n{told}");
        assert!(lines("hint:") <= 1, "one hint at most\n{told}");
        assert!(!self.stderr.contains("panicked") && !self.stderr.contains("internal:"), "{told}");
        for name in names {
            assert!(self.stderr.contains(name), "expected '{name}' in the message\n{told}");
        }
        self
    }

    /// Expects a hint that says `what`.
    #[track_caller]
    pub fn hints(self, what: &str) -> Self {
        let hint = self.stderr.lines().find_map(|line| line.strip_prefix("hint: ")).unwrap_or_default();
        assert!(hint.contains(what), "expected a hint with '{what}': {}", self.stderr);
        self
    }
}

/// A folder to write to, removed at the end of the test.
pub fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

/// Copies a folder with everything below it.
pub fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &target);
        } else {
            std::fs::copy(entry.path(), target).unwrap();
        }
    }
}

/// Copies runs of the example into a folder.
pub fn copy_runs<'a>(runs: impl IntoIterator<Item = &'a str>, to: &Path) -> PathBuf {
    runs.into_iter().for_each(|run| copy(&example_run(run), &to.join(run)));
    to.to_owned()
}

/// Everything in a folder: the path of each file and its content; folders have none.
pub type Snapshot = BTreeMap<PathBuf, Option<Vec<u8>>>;

/// Takes a picture of a folder, to compare with later.
pub fn snapshot(folder: &Path) -> Snapshot {
    fn visit(top: &Path, folder: &Path, into: &mut Snapshot) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.strip_prefix(top).unwrap().to_owned();
            if path.is_dir() {
                into.insert(name, None);
                visit(top, &path, into);
            } else {
                into.insert(name, Some(std::fs::read(&path).unwrap()));
            }
        }
    }
    let mut snapshot = Snapshot::new();
    visit(folder, folder, &mut snapshot);
    snapshot
}

/// Expects that two pictures are the same, and says which file differs.
#[track_caller]
pub fn assert_same(before: &Snapshot, after: &Snapshot, when: &str) {
    let missing: Vec<_> = before.keys().filter(|name| !after.contains_key(*name)).collect();
    let fresh: Vec<_> = after.keys().filter(|name| !before.contains_key(*name)).collect();
    let changed: Vec<_> = before.iter().filter(|(name, was)| after.get(*name).is_some_and(|is| is != *was)).collect();
    let changed: Vec<_> = changed.into_iter().map(|(name, _)| name).collect();
    assert!(
        missing.is_empty() && fresh.is_empty() && changed.is_empty(),
        "{when}: missing {missing:?}, new {fresh:?}, changed {changed:?}"
    );
}

/// A study that was made once for all tests of a program. To be read only.
pub struct Made {
    /// The study.
    pub study: PathBuf,
    /// The runs in it.
    pub runs: PathBuf,
    /// What `analyze --json` said.
    pub analyzed: Value,
}

/// The dozen, analyzed as a person does it, with the inputs of the example.
pub fn dozen() -> &'static Made {
    static MADE: OnceLock<Made> = OnceLock::new();
    MADE.get_or_init(|| {
        let place = own_folder("dozen");
        let runs = copy_runs(DOZEN, &place.join("runs"));
        let study = place.join("study");
        let outcome =
            crumple!["analyze", &runs, "--params", example().join("inputs.csv"), "-o", &study, "--json"].done();
        Made { study, runs, analyzed: outcome.json() }
    })
}

/// A study of all hundred runs, without modes; `join` as on the command line.
pub fn hundred(join: Option<&str>) -> PathBuf {
    let study = own_folder(&format!("hundred-{}", join.unwrap_or("apart"))).join("study");
    let mut init = program();
    init.arg("init").arg(&study).arg("--reference").arg(example_run("run_001"));
    if let Some(join) = join {
        init.args(["--join", join]);
    }
    finish(init).done();
    crumple!["add", &study, example().join("runs")].done();
    study
}

/// A small study of the dozen that a test may change: 40 eigenpairs, modes, one descriptor `target`, no report.
pub struct Own {
    folder: TempDir,
}

impl Own {
    pub fn new() -> Self {
        static MADE: OnceLock<PathBuf> = OnceLock::new();
        let made = MADE.get_or_init(|| {
            let place = own_folder("small");
            let runs = copy_runs(DOZEN, &place.join("runs"));
            let study = place.join("study");
            crumple!["init", &study, "--reference", runs.join("run_001"), "-K", "40"].done();
            crumple!["add", &study, &runs].done();
            crumple!["modes", &study, "--count", "3"].done();
            crumple!["describe", &study, "run_007", "--name", "target"].done();
            crumple!["check", &study].done();
            study
        });
        let own = Self { folder: folder() };
        copy(made, &own.study());
        own
    }

    /// The study.
    pub fn study(&self) -> PathBuf {
        self.folder.path().join("study")
    }

    /// The folder around the study.
    pub fn around(&self) -> &Path {
        self.folder.path()
    }

    /// A file or folder beside the study.
    pub fn beside(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn snapshot(&self) -> Snapshot {
        snapshot(&self.study())
    }
}

/// A folder of this test program below the target folder, emptied. What is in it lives until the next time.
pub fn own_folder(name: &str) -> PathBuf {
    let place = Path::new(env!("CARGO_TARGET_TMPDIR")).join(env!("CARGO_CRATE_NAME")).join(name);
    if place.exists() {
        std::fs::remove_dir_all(&place).unwrap();
    }
    std::fs::create_dir_all(&place).unwrap();
    place
}

/// The texts of a JSON array.
#[track_caller]
pub fn texts(value: &Value) -> Vec<&str> {
    value.as_array().unwrap_or_else(|| panic!("no array: {value}")).iter().map(|text| text.as_str().unwrap()).collect()
}

/// The rows of a JSON array.
#[track_caller]
pub fn rows(value: &Value) -> &[Value] {
    value.as_array().unwrap_or_else(|| panic!("no array: {value}"))
}

/// A JSON number.
#[track_caller]
pub fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("no number: {value}"))
}

/// The runs of search results, best first.
#[track_caller]
pub fn found_runs(search: &Value) -> Vec<&str> {
    rows(&search["results"]).iter().map(|hit| hit["run"].as_str().unwrap()).collect()
}

/// A tool that a test needs and that may not be here: a word about it, or a failure where nothing may be skipped.
pub fn skipped(what: &str) {
    assert!(
        std::env::var_os("CRUMPLE_TESTS_MUST_RUN").is_none(),
        "{what}, and CRUMPLE_TESTS_MUST_RUN says that every test must run"
    );
    println!("skipped: {what}");
}
