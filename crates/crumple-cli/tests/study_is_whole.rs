//! A study is whole at every moment: repeated, halved, by two at once, killed, without space, damaged.

#[macro_use]
mod world;

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use world::spoil::Spoilt;
use world::{DOZEN, Own, STRANGER, example_run, folder, number, rows, snapshot, texts};

/// A study with a basis and no runs, and a copy of the dozen beside it.
struct Empty {
    folder: tempfile::TempDir,
}

impl Empty {
    fn new() -> Self {
        static MADE: std::sync::OnceLock<PathBuf> = std::sync::OnceLock::new();
        let made = MADE.get_or_init(|| {
            let study = world::own_folder("empty").join("study");
            crumple!["init", &study, "--reference", example_run("run_001"), "-K", "40"].done();
            study
        });
        let empty = Self { folder: folder() };
        world::copy(made, &empty.study());
        empty
    }

    fn study(&self) -> PathBuf {
        self.folder.path().join("study")
    }

    fn around(&self) -> &Path {
        self.folder.path()
    }
}

/// The dozen, where every test of this file finds it at the same place.
fn bundle() -> &'static Path {
    static MADE: std::sync::OnceLock<PathBuf> = std::sync::OnceLock::new();
    MADE.get_or_init(|| world::copy_runs(DOZEN, &world::own_folder("bundle")))
}

fn add<'a>(study: &Path, runs: impl IntoIterator<Item = &'a str>) -> Command {
    let mut command = world::program();
    command.arg("add").arg(study).arg("--json").args(runs.into_iter().map(|run| bundle().join(run)));
    command
}

fn checked(study: &Path) -> Value {
    crumple!["check", study, "--json"].done().json()
}

/// Expects a whole study of these runs with nothing in it that does not belong there.
#[track_caller]
fn assert_whole(study: &Path, runs: usize) {
    let checkup = checked(study);
    assert_eq!((&checkup["whole"], &checkup["runs"]), (&true.into(), &runs.into()), "{checkup}");
    assert_eq!(rows(&checkup["notes"]).len(), 0, "{checkup}");
    assert_no_temporary_files(study);
}

#[track_caller]
fn assert_no_temporary_files(folder: &Path) {
    let left: Vec<_> = snapshot(folder).into_keys().filter(|name| name.to_string_lossy().contains("tmp")).collect();
    assert!(left.is_empty(), "{left:?}");
}

fn search(study: &Path) -> Value {
    crumple!["describe", study, "run_007", "--name", "target"].done();
    crumple!["search", study, "target", "--states", "all", "--top", "1000", "--json"].done().json()
}

/// The answer of a study to which the dozen was added at once.
fn expected() -> &'static Value {
    static MADE: std::sync::OnceLock<Value> = std::sync::OnceLock::new();
    MADE.get_or_init(|| {
        let empty = Empty::new();
        world::finish(add(&empty.study(), DOZEN)).done();
        search(&empty.study())
    })
}

#[test]
fn add_twice_is_add_once() {
    let empty = Empty::new();
    let first = world::finish(add(&empty.study(), DOZEN)).done().json();
    assert_eq!(texts(&first["added"]), DOZEN);
    let before = snapshot(&empty.study());
    let second = world::finish(add(&empty.study(), DOZEN)).done().json();
    assert_eq!((texts(&second["unchanged"]), rows(&second["added"]).len()), (DOZEN.to_vec(), 0));
    world::assert_same(&before, &snapshot(&empty.study()), "after the same add again");
}

#[test]
fn two_halves_are_the_whole() {
    let empty = Empty::new();
    world::finish(add(&empty.study(), DOZEN[6..].iter().copied())).done();
    world::finish(add(&empty.study(), DOZEN[..6].iter().copied())).done();
    assert_eq!(search(&empty.study()), *expected());
    assert_whole(&empty.study(), DOZEN.len());
}

#[test]
fn two_processes_lose_nothing() {
    for round in 0..6 {
        let empty = Empty::new();
        // Different runs of each, some of both, in turns.
        let halves: [Vec<&str>; 2] = [DOZEN[..8].to_vec(), DOZEN[4 + round % 3..].to_vec()];
        let writers: Vec<Child> =
            halves.iter().map(|half| quietly(add(&empty.study(), half.iter().copied()))).collect();
        while_running(writers, |_| {
            assert_eq!(checked(&empty.study())["whole"], true, "while others write");
        });
        world::finish(add(&empty.study(), DOZEN)).done();
        assert_eq!(search(&empty.study()), *expected(), "round {round}");
        assert_whole(&empty.study(), DOZEN.len());
    }
}

#[test]
fn many_processes_lose_nothing() {
    let empty = Empty::new();
    let writers: Vec<Child> = DOZEN.iter().map(|run| quietly(add(&empty.study(), [*run]))).collect();
    while_running(writers, |_| {});
    assert_eq!(checked(&empty.study())["runs"], DOZEN.len());
    assert_eq!(search(&empty.study()), *expected());
}

fn quietly(mut command: Command) -> Child {
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

/// Does something until all of these processes have ended well.
fn while_running(mut processes: Vec<Child>, mut act: impl FnMut(usize)) {
    let mut count = 0;
    while processes.iter_mut().any(|process| process.try_wait().unwrap().is_none()) {
        act(count);
        count += 1;
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(processes.iter_mut().all(|process| process.wait().unwrap().success()));
}

/// Starts a command again and again, and kills it a little later each time, from its start to beyond its end.
fn kill_at_every_moment(moments: u32, mut start: impl FnMut() -> Command, mut look: impl FnMut()) {
    let begin = Instant::now();
    world::finish(start()).done();
    let whole = begin.elapsed();
    look();
    for moment in 0..moments {
        let mut process = quietly(start());
        std::thread::sleep(whole * moment / (moments - moments / 8));
        process.kill().unwrap();
        process.wait().unwrap();
        look();
    }
}

#[test]
fn a_killed_add_leaves_a_whole_study() {
    // The study lives on: what one killed process left is what the next one meets. Every process has work to do,
    // because the run that it replaces is another one each time.
    let empty = Empty::new();
    world::finish(add(&empty.study(), DOZEN)).done();
    let others = [moved(empty.around(), "a", 1.0), moved(empty.around(), "b", 2.0)];
    let mut turn = 0;
    let start = || {
        turn += 1;
        let mut command = world::program();
        command.arg("add").arg(empty.study()).arg(&others[turn % 2]).args(["--replace", "--json"]);
        command
    };
    kill_at_every_moment(40, start, || {
        let checkup = checked(&empty.study());
        assert_eq!((&checkup["whole"], &checkup["runs"]), (&true.into(), &DOZEN.len().into()), "{checkup}");
    });
    let mut last = add(&empty.study(), DOZEN);
    last.arg("--replace");
    world::finish(last).done();
    assert_eq!(search(&empty.study()), *expected());
    assert_whole(&empty.study(), DOZEN.len());
}

#[test]
fn a_killed_first_add_is_completed_by_the_next() {
    let mut empty = Empty::new();
    let study = std::cell::RefCell::new(empty.study());
    let mut folders = Vec::new();
    let start = || {
        folders.push(std::mem::replace(&mut empty, Empty::new()));
        *study.borrow_mut() = empty.study();
        add(&empty.study(), DOZEN)
    };
    kill_at_every_moment(16, start, || {
        let study = study.borrow();
        assert_eq!(checked(&study)["whole"], true);
        world::finish(add(&study, DOZEN)).done();
        assert_eq!(search(&study), *expected());
        assert_whole(&study, DOZEN.len());
    });
}

/// A bundle of all of the dozen, one node moved in each last state.
fn moved(place: &Path, name: &str, x: f32) -> PathBuf {
    let bundle = place.join(name);
    for run in DOZEN {
        let files = std::fs::read_dir(example_run(run)).unwrap().count() - 1;
        Spoilt::copy_of(run, &bundle.join(run)).move_node(&format!("d3plot{files:02}"), 100, x);
    }
    bundle
}

#[test]
fn a_killed_analyze_is_completed_by_the_next() {
    let place = folder();
    let analyze = |study: &Path| {
        let mut command = world::program();
        command.arg("analyze").arg(bundle()).arg("-o").arg(study).args(["-K", "40", "--json"]);
        command
    };
    let number = std::cell::Cell::new(0);
    let study = || place.path().join(number.get().to_string()).join("study");
    let start = || {
        number.set(number.get() + 1);
        std::fs::create_dir(study().parent().unwrap()).unwrap();
        analyze(&study())
    };
    kill_at_every_moment(16, start, || {
        if study().exists() {
            assert_eq!(checked(&study())["whole"], true);
        }
        world::finish(analyze(&study())).done();
        assert_eq!(search(&study()), *expected());
        assert_whole(&study(), DOZEN.len());
        assert_no_temporary_files(study().parent().unwrap());
    });
}

/// Interrupts an add of all hundred runs after a while, as Ctrl-C does.
#[cfg(unix)]
fn interrupted_after(study: &Path, while_: Duration) -> world::Outcome {
    let mut add = world::program();
    add.arg("add").arg(study).arg(world::example().join("runs")).args(["--threads", "1"]);
    let process = add.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(while_);
    Command::new("kill").args(["-INT", &process.id().to_string()]).status().unwrap();
    world::Outcome::of(process.wait_with_output().unwrap(), "add, interrupted".into())
}

#[cfg(unix)]
#[test]
fn an_interrupted_add_keeps_what_is_finished() {
    // Too early and the program has not begun, too late and it is done: one of these is in between.
    for milliseconds in [20, 40, 80, 160, 320, 640] {
        let empty = Empty::new();
        let outcome = interrupted_after(&empty.study(), Duration::from_millis(milliseconds));
        let kept = number(&checked(&empty.study())["runs"]);
        if outcome.code == Some(130) {
            assert!(outcome.stderr.starts_with("error: interrupted"), "{}", outcome.stderr);
            assert_eq!(outcome.stdout, "");
            assert!(kept < 100.0, "{kept}");
            crumple!["add", empty.study(), world::example().join("runs")].done();
            assert_whole(&empty.study(), 100);
            return;
        }
        assert!(matches!(outcome.code, None | Some(0)), "{outcome:?}");
    }
    panic!("no interruption was noticed");
}

#[test]
fn a_run_with_another_content_is_an_error_or_takes_its_place() {
    let own = Own::new();
    let changed = own.beside("run_007");
    world::copy(&example_run(STRANGER), &changed);
    let before = own.snapshot();
    crumple!["add", own.study(), &changed].refused(&["run_007"]).hints("--replace");
    world::assert_same(&before, &own.snapshot(), "after a refused add");

    let told = crumple!["add", own.study(), &changed, "--replace", "--json"].done().json();
    assert_eq!((texts(&told["replaced"]), rows(&told["added"]).len()), (vec!["run_007"], 0));
    assert_eq!(checked(&own.study())["runs"], DOZEN.len());
    // It counts with its new content: as far from anything as the run whose content it has.
    let distance = |run: &str| crumple!["distance", own.study(), "target", run].done().stdout;
    let inside = distance("run_007");
    assert_eq!(inside, distance(example_run(STRANGER).to_str().unwrap()));
    assert_ne!(inside, distance(example_run("run_007").to_str().unwrap()));
    crumple!["describe", own.study(), "run_007", "--name", "after"].done();
    let found = crumple!["search", own.study(), "after", "--json"].done().json();
    assert_eq!(world::found_runs(&found)[0], "run_007");
    assert_eq!(rows(&found["results"]).len(), DOZEN.len());
}

#[test]
fn the_same_run_at_another_place_is_unchanged() {
    let own = Own::new();
    let elsewhere = own.beside("elsewhere/run_007");
    world::copy(&example_run("run_007"), &elsewhere);
    let told = crumple!["add", own.study(), &elsewhere, "--json"].done().json();
    assert_eq!(texts(&told["unchanged"]), ["run_007"]);
    crumple!["describe", own.study(), "run_007"].done();
    assert_whole(&own.study(), DOZEN.len());
}

#[test]
fn a_target_that_cannot_be_written_is_refused() {
    let own = Own::new();
    let file = own.beside("a file");
    std::fs::write(&file, "in the way").unwrap();
    let before = snapshot(own.around());
    let below = file.join("below");
    let page = below.with_extension("html");
    let named = file.to_str().unwrap();
    crumple!["init", &file, "--reference", example_run("run_001"), "-K", "12"].refused(&[named]);
    crumple!["init", &below, "--reference", example_run("run_001"), "-K", "12"].refused(&[named]);
    crumple!["analyze", bundle(), "-o", &file, "-K", "12"].refused(&[named]);
    crumple!["analyze", bundle(), "-o", &below, "-K", "12"].refused(&[named]);
    crumple!["export", own.study(), "-o", &file].refused(&[named]);
    crumple!["export", own.study(), "-o", &below].refused(&[named]);
    crumple!["report", own.study(), "-o", &page].refused(&[named]);
    crumple!["reconstruct", own.study(), "run_007", "-o", file.join("shape.stl")].refused(&[named]);
    crumple!["add", &file, example_run("run_001")].refused(&[named]);
    world::assert_same(&before, &snapshot(own.around()), "after refused writes");

    // A page or a shape cannot take the place of a folder.
    let folder = own.beside("folder.html");
    std::fs::create_dir(&folder).unwrap();
    crumple!["report", own.study(), "-o", &folder].refused(&["folder.html"]);
    let folder = own.beside("folder.vtu");
    std::fs::create_dir(&folder).unwrap();
    crumple!["reconstruct", own.study(), "run_007", "-o", &folder].refused(&["folder.vtu"]);
    assert_no_temporary_files(own.around());
}

#[cfg(target_os = "linux")]
#[test]
fn a_device_without_space_is_refused() {
    let own = Own::new();
    let before = own.snapshot();
    crumple!["report", own.study(), "-o", "/dev/full"].refused(&["/dev/full"]).hints("space");
    world::assert_same(&before, &own.snapshot(), "after a report that found no space");
}

/// Runs the program with files limited to `blocks` of 512 bytes: writing beyond fails as it does on a full disk, with
/// another error number (EFBIG).
#[cfg(unix)]
fn without_space(blocks: u32, arguments: &[&std::ffi::OsStr]) -> world::Outcome {
    let mut command = Command::new("sh");
    command.arg("-c").arg(format!(r#"trap "" XFSZ; ulimit -f {blocks}; exec "$0" "$@""#));
    command.arg(env!("CARGO_BIN_EXE_crumple")).args(arguments);
    world::finish(command)
}

/// Tries with ever more space; every failure must leave everything as it was. Returns how often it failed.
#[cfg(unix)]
fn with_ever_more_space(own: &Own, arguments: &[&str]) -> usize {
    let before = snapshot(own.around());
    let arguments: Vec<&std::ffi::OsStr> = arguments.iter().map(std::ffi::OsStr::new).collect();
    for (failures, exponent) in (0..20).enumerate() {
        let outcome = without_space(1 << exponent, &arguments);
        if outcome.code == Some(0) {
            return failures;
        }
        outcome.refused(&["cannot"]);
        world::assert_same(&before, &snapshot(own.around()), &format!("{arguments:?} with {} blocks", 1 << exponent));
    }
    panic!("{arguments:?} fails with any space");
}

#[cfg(unix)]
#[test]
fn without_space_the_study_is_as_it_was() {
    for (arguments, least) in [
        (&["add", "STUDY", "STRANGER"][..], 3),
        (&["modes", "STUDY", "--count", "4"], 1),
        (&["describe", "STUDY", "run_001"], 1),
        (&["report", "STUDY", "-o", "AROUND/page.html"], 3),
        (&["reconstruct", "STUDY", "run_001", "-o", "AROUND/shape.vtu"], 3),
        (&["reconstruct", "STUDY", "run_001", "-o", "AROUND/shape.obj"], 3),
        (&["init", "AROUND/new", "--reference", "STRANGER", "-K", "12"], 3),
    ] {
        let own = Own::new();
        let names = [
            ("STUDY", own.study().to_str().unwrap().to_owned()),
            ("AROUND", own.around().to_str().unwrap().to_owned()),
            ("STRANGER", example_run(STRANGER).to_str().unwrap().to_owned()),
        ];
        let fill = |word: &str| names.iter().fold(word.to_owned(), |word, (name, value)| word.replace(name, value));
        let arguments: Vec<String> = arguments.iter().map(|word| fill(word)).collect();
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let failures = with_ever_more_space(&own, &arguments);
        assert!(failures >= least, "{arguments:?} failed {failures} times only: the limit is not felt");
        assert_no_temporary_files(own.around());
    }
}

#[test]
fn check_names_what_is_damaged() {
    let part = |study: &Path| {
        let parts = std::fs::read_dir(study.join("coefficients")).unwrap().map(|entry| entry.unwrap().path());
        parts.filter(|path| path.extension().is_some_and(|extension| extension == "parquet")).min().unwrap()
    };
    let flip = |path: &Path| {
        let mut bytes = std::fs::read(path).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 0xff;
        std::fs::write(path, bytes).unwrap();
    };
    let cut = |path: &Path| {
        let bytes = std::fs::read(path).unwrap();
        std::fs::write(path, &bytes[..bytes.len() - 100]).unwrap();
    };
    let lose = |path: &Path| std::fs::remove_file(path).unwrap();
    for harm in ["flipped byte", "cut", "lost"] {
        for file in ["basis.safetensors", "mesh.vtu", "study.toml", "coefficients"] {
            let own = Own::new();
            let path = if file == "coefficients" { part(&own.study()) } else { own.study().join(file) };
            match harm {
                "flipped byte" => flip(&path),
                "cut" => cut(&path),
                _ => lose(&path),
            }
            let name = path.file_name().unwrap().to_str().unwrap();
            let outcome = crumple!["check", own.study(), "--json"].ends_with_code(1);
            let checkup = outcome.json();
            assert_eq!(checkup["whole"], false);
            assert!(
                texts(&checkup["problems"]).iter().any(|problem| problem.contains(name)),
                "{harm}, {file}: {checkup}"
            );
            let words = crumple!["check", own.study()].ends_with_code(1).stdout;
            assert!(words.contains("NOT whole") && words.contains(name), "{words}");
            if harm != "flipped byte" {
                // What is gone cannot be asked; the answer is a message, not a guess.
                crumple!["search", own.study(), "target"].refused(&[name]);
            }
        }
    }
}

#[test]
fn a_damaged_manifest_is_named() {
    for content in ["", "{", "[]", "{}", r#"{"layout": 2}"#, "\u{fffd}\0\0"] {
        let own = Own::new();
        std::fs::write(own.study().join("manifest.json"), content).unwrap();
        let checkup = crumple!["check", own.study(), "--json"].ends_with_code(1).json();
        assert!(texts(&checkup["problems"])[0].contains("manifest.json"), "{checkup}");
        let before = own.snapshot();
        crumple!["search", own.study(), "target"].refused(&["manifest.json"]).hints("crumple check");
        crumple!["add", own.study(), example_run(STRANGER)].refused(&["manifest.json"]);
        world::assert_same(&before, &own.snapshot(), "a damaged study is left alone");
    }
    let own = Own::new();
    let path = own.study().join("manifest.json");
    let mut bytes = std::fs::read(&path).unwrap();
    bytes[40] = 0xff; // not UTF-8
    std::fs::write(&path, bytes).unwrap();
    crumple!["check", own.study(), "--json"].ends_with_code(1);
    // A manifest that names a file with another checksum.
    let own = Own::new();
    let path = own.study().join("manifest.json");
    let mut manifest: Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    manifest["files"]["mesh.vtu"]["blake3"] = "0".repeat(64).into();
    std::fs::write(&path, manifest.to_string()).unwrap();
    let checkup = crumple!["check", own.study(), "--json"].ends_with_code(1).json();
    assert!(texts(&checkup["problems"])[0].starts_with("mesh.vtu"), "{checkup}");
}

#[test]
fn litter_is_noted_and_cleared() {
    let own = Own::new();
    std::fs::write(own.study().join("coefficients/0123456789abcdef.parquet"), "of a killed process").unwrap();
    let checkup = checked(&own.study());
    assert_eq!(checkup["whole"], true, "litter is harmless");
    assert!(texts(&checkup["notes"])[0].contains("0123456789abcdef"), "{checkup}");
    crumple!["add", own.study(), example_run(STRANGER)].done();
    assert_whole(&own.study(), DOZEN.len() + 1);
}

#[test]
fn temporary_files_of_a_killed_process_are_cleared() {
    // As the program names them while it writes.
    let own = Own::new();
    for name in [".manifest.json", ".runs.parquet", ".modes.parquet", "coefficients/.part", "descriptors/.target.json"]
    {
        std::fs::write(own.study().join(format!("{name}.tmp-0123456789abcdef")), "half").unwrap();
    }
    assert_eq!(checked(&own.study())["whole"], true, "harmless");
    crumple!["add", own.study(), example_run(STRANGER)].done();
    assert_whole(&own.study(), DOZEN.len() + 1);
}
