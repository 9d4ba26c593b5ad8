//! What an optimiser, a meta-model and a watchdog use: `features` and `monitor`, as they are typed.

#[macro_use]
mod world;

use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::Duration;

use world::{DOZEN, Own, STATES, STRANGER, dozen, example, example_run, finish, number, program, rows, texts};

/// The runs of the dozen by likeness to a run, itself first.
fn by_likeness(study: &Path, run: &str) -> Vec<(String, f64)> {
    let found = crumple!["search", study, run, "--top", "12", "--json"].done().json();
    let hit = |hit: &serde_json::Value| (hit["run"].as_str().unwrap().to_owned(), number(&hit["distance"]));
    rows(&found["results"]).iter().map(hit).collect()
}

/// Copies a run of the example as its solver would write it: root, then states in pieces, slowly.
fn write_slowly(run: &str, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(example_run(run)).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    for from in files {
        use std::io::Write;
        let bytes = std::fs::read(&from).unwrap();
        let mut file = std::fs::File::create(to.join(from.file_name().unwrap())).unwrap();
        for piece in bytes.chunks(10_007) {
            file.write_all(piece).unwrap();
            std::thread::sleep(Duration::from_millis(15));
        }
    }
}

/// `monitor` beside a solver that starts to write when it has begun to wait.
fn monitored(study: &Path, target: &str, run: &str, job: &Path, more: &[&str]) -> world::Outcome {
    let mut command = program();
    command.arg("monitor").arg(study).arg(target).arg(job);
    command.args(["--every", "0.05", "--timeout", "60"]).args(more);
    command.stdin(Stdio::null());
    std::thread::scope(|scope| {
        scope.spawn(|| write_slowly(run, job));
        finish(command)
    })
}

#[test]
fn a_run_that_leaves_the_path_is_told_and_stopped() {
    let (study, own) = (&dozen().study, world::folder());
    let order = by_likeness(study, "run_007");
    let ((near, small), (far, large)) = (&order[1], &order[order.len() - 1]);
    let tolerance = format!("{}", (small + large) / 2.0);
    let job = |name: &str| own.path().join(name);

    let kept = monitored(study, "run_007", near, &job("near"), &["--tolerance", &tolerance]).done();
    assert_eq!(kept.stdout.lines().count(), STATES + 1, "a line a state, and the end: {}", kept.stdout);
    assert!(kept.stdout.ends_with("on the path of 'run_007' to its end\n"), "{}", kept.stdout);
    assert!(kept.stdout.contains("too early to tell"), "the undeformed state says nothing: {}", kept.stdout);

    let more =
        ["--tolerance", &tolerance, "--states", "1", "--stop", "--stop-command", "echo $CRUMPLE_STATE > stopped"];
    let mut told = program();
    told.current_dir(own.path()).arg("monitor").arg(study).args(["run_007"]).arg(job("far"));
    told.args(["--every", "0.05", "--timeout", "60", "--json"]).args(more);
    let told = std::thread::scope(|scope| {
        scope.spawn(|| write_slowly(far, &job("far")));
        finish(told)
    });
    let facts = told.ends_with_code(1).json();
    assert_eq!(facts["diverged"], true);
    assert_eq!(std::fs::read_to_string(job("far").join("d3kil")).unwrap(), "sw1\n");
    let last = rows(&facts["states"]).last().unwrap();
    assert_eq!(last["verdict"], "diverged");
    assert_eq!(std::fs::read_to_string(own.path().join("stopped")).unwrap().trim(), last["state"].to_string());
    assert_eq!(rows(&facts["stop"]).len(), 2, "{facts}");

    // Without --stop nothing is written beside a solver's files.
    monitored(study, "run_007", far, &job("left"), &["--tolerance", &tolerance, "--states", "1"]).ends_with_code(1);
    assert!(!job("left").join("d3kil").exists());
}

#[test]
fn the_tolerance_comes_from_the_mode() {
    let study = &dozen().study;
    let modes = rows(&dozen().analyzed["modes"]["modes"]);
    let largest =
        modes.iter().find(|mode| texts(&mode["members"]).len() > 3).expect("twelve runs in two to five modes");
    let name = largest["name"].as_str().unwrap();
    let members = texts(&largest["members"]);
    let medoid = largest["medoid"].as_str().unwrap();
    let member = members.iter().find(|run| **run != medoid).unwrap();
    let outcome = crumple!["monitor", study, name, example_run(member), "--every", "0.02", "--json"];
    let facts = outcome.json();
    assert_eq!(facts["calibration"]["mode"], name);
    assert_eq!(number(&facts["calibration"]["members"]) as usize, members.len() - 1);
    let told = crumple!["monitor", study, name, example_run(medoid), "--every", "0.02"].done();
    assert!(told.stderr.contains("quantile"), "where the floor comes from is told: {}", told.stderr);
}

#[test]
fn monitor_refuses_what_it_cannot_follow() {
    let own = Own::new();
    let (study, run) = (own.study(), example_run(STRANGER));
    let refused = |words: &[&str], names: &[&str]| {
        let mut command = program();
        command.arg("monitor").arg(&study).args(words).args(["--every", "0.02"]);
        finish(command).refused(names)
    };
    let (run, empty) = (run.to_str().unwrap(), own.beside("empty"));
    std::fs::create_dir(&empty).unwrap();
    let empty = empty.to_str().unwrap();
    refused(
        &["target", empty, "--timeout", "0.2", "--tolerance", "0.1"],
        &["empty", "no new state for 0.2 s", "none came"],
    )
    .hints("--timeout");
    let nowhere = own.beside("nowhere/d3plot");
    refused(
        &["target", nowhere.to_str().unwrap(), "--timeout", "0.2", "--tolerance", "0.1"],
        &["nowhere", "none came"],
    );
    refused(&["target", run, "--tolerance", "3"], &["--tolerance", "from 0 to 2"]);
    refused(&["target", run, "--tolerance", "-1"], &["--tolerance", "from 0 to 2"]);
    refused(&["target", run, "--tolerance", "0.1", "--from", "2"], &["--from"]);
    refused(&["target", run, "--tolerance", "0.1", "--timeout", "0"], &["--timeout", "above 0"]);
    refused(&["target", run, "--tolerance", "0.1", "--align", "mood"], &["--align", "intrusion"]);
    refused(&["nobody", run], &["nobody"]);
    refused(&["run_007@0", run, "--tolerance", "0.1"], &["run_007@0", "deformed"]);
    refused(&["run_007@9", run, "--tolerance", "0.1"], &["run_007", "no @9"]);
    let other = world::testdata("s01_shells_latin1");
    refused(&["target", other.to_str().unwrap(), "--tolerance", "0.1"], &["mesh", "node"]).hints("mesh");
    // A descriptor of a run that the study does not have has no path.
    refused(&[run, run, "--tolerance", "0.1"], &[STRANGER]);
    let none = own.beside("bare");
    crumple!["init", &none, "--reference", run, "-K", "20"].done();
    crumple!["monitor", &none, run, run, "--tolerance", "0.1"].refused(&[STRANGER]);
    let failing = ["--tolerance", "0", "--states", "1", "--stop-command", "exit 7"];
    let mut command = program();
    command.arg("monitor").arg(&study).args(["target", run, "--every", "0.02", "--quiet", "--json"]).args(failing);
    finish(command).refused(&["--stop-command", "exit 7", "left the path"]);
}

#[test]
fn features_are_a_row_a_run_under_stable_names() {
    let own = Own::new();
    let table = |more: &[&str]| {
        let mut command = program();
        command.arg("features").arg(own.study()).args(more);
        finish(command).done().stdout
    };
    let cells = |csv: &str| -> Vec<Vec<String>> {
        csv.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
    };
    let all = cells(&table(&["target"]));
    assert_eq!(all.len(), DOZEN.len() + 1);
    assert_eq!(all[0][..6], ["run", "state", "time", "similarity", "distance", "kind_1"]);
    let rotation = cells(&table(&[]));
    assert_eq!(rotation[0][..4], ["run", "state", "time", "kind_1"], "without a descriptor nothing is compared");
    // The same numbers as `distance`, and for a file as for the run of the study.
    for row in &all[1..] {
        let distance = crumple!["distance", own.study(), "target", &row[0]].done().stdout;
        assert_eq!(row[4].parse::<f64>().unwrap(), distance.trim().parse::<f64>().unwrap(), "{}", row[0]);
    }
    let file = cells(&table(&["target", example_run("run_042").to_str().unwrap()]));
    assert_eq!(file.len(), 2);
    assert_eq!(file[0], all[0]);
    let own_row = all.iter().find(|row| row[0] == "run_042").unwrap();
    assert_eq!(file[1][1..], own_row[1..]);
    assert_eq!(cells(&table(&["target", "--states", "all"])).len(), DOZEN.len() * STATES + 1);
    // The paper's kind: one number a component of each eigenvector of the descriptor.
    let paper = cells(&table(&["target", "--kind", "paper"]));
    let described = crumple!["info", own.study(), "--json"].done().json();
    assert!(paper[0].len() > 5 && (paper[0].len() - 5).is_multiple_of(3), "{:?} {described}", paper[0]);
    assert!(paper[0][5..].iter().all(|name| name.ends_with(['x', 'y', 'z'])), "{:?}", paper[0]);
}

#[test]
fn features_carry_the_inputs_into_files() {
    let (study, place) = (&dozen().study, world::folder());
    let header = crumple!["features", study].done().stdout.lines().next().unwrap().to_owned();
    let inputs = std::fs::read_to_string(example().join("inputs.csv")).unwrap();
    for input in inputs.lines().next().unwrap().split(',').skip(1) {
        assert!(header.ends_with(input) || header.contains(&format!(",{input},")), "{input} in {header}");
    }
    let path = |name: &str| -> PathBuf { place.path().join(name) };
    crumple!["features", study, "run_007", "-o", path("features.csv")].done();
    let printed = crumple!["features", study, "run_007"].done().stdout;
    assert_eq!(std::fs::read_to_string(path("features.csv")).unwrap().trim_end(), printed.trim_end());
    let facts = crumple!["features", study, "run_007", "-o", path("features.parquet"), "--json"].done().json();
    assert_eq!(number(&facts["rows"]) as usize, DOZEN.len());
    assert_eq!(std::fs::read(path("features.parquet")).unwrap()[..4], *b"PAR1");
    let facts = crumple!["features", study, "run_007", "--json"].done().json();
    let row = &rows(&facts["rows"])[0];
    assert_eq!(rows(&row["numbers"]).len(), texts(&facts["names"]).len());
    assert!(row["inputs"]["thickness_mm"].is_string(), "{row}");
}

#[test]
fn features_refuse_what_they_cannot_fill() {
    let own = Own::new();
    let study = own.study();
    let bare = own.beside("bare");
    crumple!["init", &bare, "--reference", example_run("run_001"), "-K", "20"].done();
    crumple!["features", &bare].refused(&["at least 1 runs"]).hints("add");
    crumple!["features", &study, "nobody"].refused(&["nobody"]);
    crumple!["features", &study, "--kind", "paper"].refused(&["--kind", "descriptor"]);
    crumple!["features", &study, "target", "run_007@9"].refused(&["run_007", "no @9"]);
    crumple!["features", &study, "target", own.beside("nowhere")].refused(&["nowhere"]);
    crumple!["features", &study, "target", "--states", "some"].refused(&["--states", "last or all"]);
    crumple!["features", &study, "-o", own.beside("features.xlsx")].refused(&["features.xlsx", ".csv or .parquet"]);
    crumple!["features", &study, "target", world::testdata("s01_shells_latin1")].refused(&["mesh"]);
    // A descriptor of another basis, by the path of its file.
    let foreign = study.join("descriptors/target.json");
    crumple!["features", &bare, &foreign].refused(&["target", "another eigenbasis"]);
    crumple!["monitor", &bare, &foreign, example_run(STRANGER)].refused(&["target", "another eigenbasis"]);
}
