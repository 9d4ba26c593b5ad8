//! The rules of the house: who may know whom, what every file starts with, what a library never does, and help that
//! is true.

#[macro_use]
mod world;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use cargo_metadata::{DependencyKind, MetadataCommand};
use serde_json::Value;
use world::{Own, folder, repository};

/// Who may know whom, and nobody else.
const MAY_USE: &[(&str, &[&str])] = &[
    ("d3plot", &[]),
    ("keyword-deck", &[]),
    ("mesh-files", &[]),
    ("mesh-spectrum", &[]),
    ("crumple", &["d3plot", "keyword-deck", "mesh-files", "mesh-spectrum"]),
    ("crumple-cli", &["crumple"]),
    ("structures", &[]),
    ("evolution", &["crumple"]),
];

/// The stages of crates/crumple/src in the order of the flow: each may use those before it.
const STAGES: &[&str] = &[
    "error",
    "vector",
    "field",
    "deck",
    "run",
    "bundle",
    "inputs",
    "reference",
    "surface",
    "joints",
    "basis",
    "select",
    "rotation",
    "strain",
    "project",
    "study",
    "eigen",
    "target",
    "isometry",
    "modes",
    "reconstruct",
    "rivals",
    "descriptor",
    "features",
    "transfer",
    "similarity",
    "calibrate",
    "classify",
    "explain",
    "monitor",
    "compare",
    "export",
    "feature_table",
    "report",
];

#[test]
fn dependence_runs_one_way() {
    let ours = |name: &str| MAY_USE.iter().find(|(ours, _)| *ours == name).map(|(_, uses)| *uses);
    let metadata = MetadataCommand::new().manifest_path(repository().join("Cargo.toml")).no_deps().exec().unwrap();
    assert_eq!(metadata.packages.len(), MAY_USE.len());
    for package in metadata.packages {
        let allowed = ours(&package.name).expect("a new crate: give it its place in MAY_USE");
        for used in package.dependencies.iter().filter(|used| ours(&used.name).is_some()) {
            // Tests and examples of mesh-spectrum start from files; the library never sees one.
            let in_tests = used.kind == DependencyKind::Development && used.name == "mesh-files";
            assert!(
                in_tests || allowed.contains(&used.name.as_str()),
                "{} must not know {}: pass a value instead",
                package.name,
                used.name
            );
        }
        let kinds = |kind| package.dependencies.iter().filter(move |used| used.kind == kind);
        assert_eq!(kinds(DependencyKind::Build).count(), 0, "{}: a build script is not needed", package.name);
    }
}

/// All Rust files below a folder.
fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    files.sort();
    files
}

/// A file without its comments and without the tests at its end.
fn code(path: &Path) -> String {
    let text = std::fs::read_to_string(path).unwrap();
    let text = text.split("#[cfg(test)]").next().unwrap();
    text.lines().filter(|line| !line.trim_start().starts_with("//")).map(|line| line.to_owned() + "\n").collect()
}

#[test]
fn stages_only_use_earlier_ones() {
    let source = repository().join("crates/crumple/src");
    let place = |stage: &str| STAGES.iter().position(|name| *name == stage);
    let mut wrong = Vec::new();
    for path in rust_files(&source) {
        let name = path.strip_prefix(&source).unwrap();
        let stage = name.components().next().unwrap().as_os_str().to_str().unwrap().trim_end_matches(".rs");
        if stage == "lib" {
            continue;
        }
        let here = place(stage).unwrap_or_else(|| panic!("{stage} is new: give it its place in STAGES"));
        for used in code(&path).split("crate::").skip(1) {
            let used: String = used.chars().take_while(|c| c.is_ascii_lowercase() || *c == '_').collect();
            if place(&used).is_some_and(|there| there > here) {
                wrong.push(format!("{} uses {used}, which comes after {stage}", name.display()));
            }
        }
    }
    wrong.dedup();
    assert!(wrong.is_empty(), "nothing flows back:\n{}", wrong.join("\n"));
}

#[test]
fn the_crate_page_names_every_stage() {
    let lib = std::fs::read_to_string(repository().join("crates/crumple/src/lib.rs")).unwrap();
    for stage in STAGES.iter().filter(|stage| !["error", "vector"].contains(stage)) {
        // `mod@` tells the module from a primitive type of the same name.
        let named = lib.contains(&format!("[`{stage}`]")) || lib.contains(&format!("[`mod@{stage}`]"));
        assert!(named, "{stage} is not in the table");
    }
}

#[test]
fn every_file_says_what_it_is_for() {
    for path in rust_files(&repository().join("crates")) {
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.starts_with("//! "), "{}: starts without a `//!` line", path.display());
    }
}

#[test]
fn libraries_print_nothing_and_end_nothing() {
    for library in ["d3plot", "keyword-deck", "mesh-files", "mesh-spectrum", "crumple"] {
        for path in rust_files(&repository().join("crates").join(library).join("src")) {
            let code = code(&path);
            for word in ["println!", "eprintln!", "print!(", "dbg!", "todo!", "unimplemented!", "process::exit"] {
                assert!(!code.contains(word), "{}: {word} in a library", path.display());
            }
        }
    }
}

/// The commands that `crumple --help` lists.
fn commands() -> Vec<String> {
    let help = crumple!["--help"].done().stdout;
    let list = help.split("Commands:").nth(1).unwrap().split("Options:").next().unwrap();
    let name = |line: &str| {
        let line = line.strip_prefix("  ")?;
        (!line.starts_with(' ')).then(|| line.split(' ').next().unwrap().to_owned())
    };
    list.lines().filter_map(name).filter(|name| name != "help").collect()
}

/// The lines of a help text that are examples, as they are printed.
fn example_lines(help: &str) -> Vec<String> {
    let lines = help.lines().skip_while(|line| !line.starts_with("Example") && !line.starts_with("Start here")).skip(1);
    lines.take_while(|line| line.starts_with("  ")).map(|line| line.trim().to_owned()).collect()
}

/// The examples of a help text, lines that were wrapped put together.
fn examples(help: &str) -> Vec<Vec<String>> {
    let mut examples: Vec<Vec<String>> = Vec::new();
    for line in example_lines(help) {
        let words = line.split_whitespace().filter(|word| *word != "\\").map(str::to_owned);
        match examples.last_mut() {
            Some(last) if !line.starts_with("crumple ") => last.extend(words),
            _ => examples.push(words.collect()),
        }
    }
    examples
}

#[test]
fn every_command_is_there() {
    let expected = [
        "analyze",
        "info",
        "eigen",
        "init",
        "add",
        "modes",
        "describe",
        "search",
        "verify",
        "classify",
        "explain",
        "isometry",
        "distance",
        "features",
        "monitor",
        "reconstruct",
        "export",
        "convert",
        "compare",
        "report",
        "check",
    ];
    assert_eq!(commands(), expected);
}

#[test]
fn help_has_an_example_that_can_be_copied() {
    for command in commands().iter().map(String::as_str).chain([""]) {
        let mut program = world::program();
        program.args(Some(command).filter(|command| !command.is_empty())).arg("--help");
        let help = world::finish(program).done().stdout;
        let lines = example_lines(&help);
        assert!(!lines.is_empty(), "{command}: no example\n{help}");
        let mut continued = false;
        for line in &lines {
            assert!(continued || line.starts_with("crumple "), "{command}: a line that is no command: {line}");
            assert!(command.is_empty() || continued || line.starts_with(&format!("crumple {command} ")), "{line}");
            continued = line.ends_with('\\');
        }
    }
}

#[cfg(unix)]
#[test]
fn the_examples_of_the_help_work() {
    let place = folder();
    std::os::unix::fs::symlink(repository().join("examples"), place.path().join("examples")).unwrap();
    world::copy(&world::example_run(world::STRANGER), &place.path().join("new"));
    // `analyze` makes the study that the others ask; `init` wants none.
    let mut commands = commands();
    commands.retain(|command| command != "init");
    commands.push("init".into());
    for command in commands {
        let help = crumple![&command, "--help"].done().stdout;
        for example in examples(&help) {
            if command == "init" && example.iter().any(|word| word == "study") {
                let made = format!("made-{}", std::fs::read_dir(&place).unwrap().count());
                std::fs::rename(place.path().join("study"), place.path().join(made)).unwrap();
            }
            let mut program = world::program();
            program.args(&example[1..]).current_dir(&place);
            let outcome = world::finish(program);
            let no_is_an_answer = ["verify", "classify", "monitor"].contains(&command.as_str());
            let answers = if no_is_an_answer { &[0, 1][..] } else { &[0] };
            assert!(answers.contains(&outcome.code.unwrap()), "{example:?}: {}", outcome.stderr);
            assert!(!outcome.stdout.is_empty(), "{example:?} says nothing");
        }
    }
    for made in ["study", "exported", "study.html", "run_007-descriptor.vtu", "alike.vtu", "first-14.stl"] {
        assert!(place.path().join(made).exists(), "{made}");
    }
}

/// Options of a command with the default that its help states, where that is a word.
fn stated_defaults(help: &str) -> BTreeMap<String, String> {
    let options = help.split("Options:").nth(1).unwrap_or_default();
    let mut defaults = BTreeMap::new();
    let mut option = String::new();
    let mut text = String::new();
    for line in options.lines().chain(["  --end"]) {
        if line.trim_start().starts_with('-') {
            let stated = text.split("[default: ").nth(1).and_then(|rest| rest.split(']').next());
            if let Some(stated) = stated.filter(|stated| !stated.trim().contains(' ')) {
                defaults.insert(option.clone(), stated.trim().to_owned());
            }
            option = line.split_whitespace().find(|word| word.starts_with("--")).unwrap_or_default().to_owned();
            text.clear();
        }
        text += line.trim();
        text.push(' ');
    }
    defaults
}

#[test]
fn the_defaults_that_the_help_states_are_those_that_hold() {
    let own = Own::new();
    let study = own.study().to_str().unwrap().to_owned();
    let run = world::example_run("run_001").to_str().unwrap().to_owned();
    let cases: [(&str, Vec<&str>, &[&str]); 6] = [
        ("modes", vec![&study], &["--method", "--seed"]),
        ("describe", vec![&study, "run_007", "--name", "default"], &["--select", "--threshold"]),
        ("search", vec![&study, "target"], &["--metric", "--states", "--top", "--weight"]),
        ("verify", vec![&study, "target", "run_001", "run_007"], &["--metric", "--weight"]),
        ("distance", vec![&study, "target", "run_001"], &["--metric", "--weight"]),
        ("compare", vec![&study], &["--threshold"]),
    ];
    for (command, arguments, expected) in cases {
        let defaults = stated_defaults(&crumple![command, "--help"].done().stdout);
        let ask = |extra: &[&str]| -> (Option<i32>, Value) {
            let mut program = world::program();
            program.arg(command).args(&arguments).args(extra).arg("--json");
            let outcome = world::finish(program);
            (outcome.code, outcome.json())
        };
        let plain = ask(&[]);
        for option in expected {
            let value =
                defaults.get(*option).unwrap_or_else(|| panic!("{command} {option}: no default in {defaults:?}"));
            assert_eq!(ask(&[option, value]), plain, "{command} {option} {value}");
        }
    }
    let defaults = stated_defaults(&crumple!["init", "--help"].done().stdout);
    assert_eq!(defaults["--eigenpairs"], "500");
    let made = crumple!["init", own.beside("new"), "--reference", &run, "--json"].done().json();
    assert_eq!(made["eigenpairs"], 500);
}
