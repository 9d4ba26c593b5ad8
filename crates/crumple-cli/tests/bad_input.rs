//! Whatever is given to it, the program refuses with one message that helps, and leaves the study as it was.

#[macro_use]
mod world;

use std::path::{Path, PathBuf};

use serde_json::Value;
use world::spoil::{Spoilt, no_d3plot, noise};
use world::{DOZEN, Own, STATES, STRANGER, assert_same, copy, example_run, number, rows, testdata, texts};

/// Every command that takes a study, as words after the program's name; `RUN` stands for a run of the example.
fn commands_on<'a>(study: &'a Path, place: &'a Path) -> Vec<(&'static str, Vec<PathBuf>)> {
    let words = |words: &[&str]| -> Vec<PathBuf> {
        let fill = |word: &&str| match *word {
            "STUDY" => study.to_owned(),
            "RUN" => example_run(STRANGER),
            word if word.starts_with("OUT") => place.join(word),
            word => PathBuf::from(word),
        };
        words.iter().map(fill).collect()
    };
    vec![
        ("add", words(&["add", "STUDY", "RUN"])),
        ("modes", words(&["modes", "STUDY"])),
        ("describe", words(&["describe", "STUDY", "run_007"])),
        ("search", words(&["search", "STUDY", "target"])),
        ("verify", words(&["verify", "STUDY", "target", "run_007"])),
        ("distance", words(&["distance", "STUDY", "target", "run_007"])),
        ("features", words(&["features", "STUDY", "target"])),
        ("monitor", words(&["monitor", "STUDY", "target", "RUN", "--every", "0.02", "--tolerance", "0.1"])),
        ("reconstruct", words(&["reconstruct", "STUDY", "run_007", "-o", "OUT.stl"])),
        ("export", words(&["export", "STUDY", "-o", "OUT"])),
        ("compare", words(&["compare", "STUDY"])),
        ("report", words(&["report", "STUDY", "-o", "OUT.html"])),
        ("check", words(&["check", "STUDY"])),
    ]
}

fn ask(words: &[PathBuf]) -> world::Outcome {
    let mut command = world::program();
    command.args(words);
    world::finish(command)
}

/// Does something that must be refused, and expects that nothing changed.
#[track_caller]
fn untouched<T>(own: &Own, act: impl FnOnce() -> T) -> T {
    let before = world::snapshot(own.around());
    let result = act();
    assert_same(&before, &world::snapshot(own.around()), "after a refusal");
    result
}

#[test]
fn no_such_study() {
    let own = Own::new();
    let missing = own.beside("no such study");
    for (command, words) in commands_on(&missing, own.around()) {
        let outcome = untouched(&own, || ask(&words)).refused(&["no such study"]);
        assert!(outcome.stderr.contains("hint: "), "{command}: {}", outcome.stderr);
        assert!(!outcome.stderr.contains("a run is"), "{command}: it is the study that is missing: {}", outcome.stderr);
    }
}

#[test]
fn a_folder_that_is_no_study() {
    let own = Own::new();
    let folder = own.beside("photos");
    std::fs::create_dir(&folder).unwrap();
    std::fs::write(folder.join("holiday.jpg"), noise(100)).unwrap();
    for (_, words) in commands_on(&folder, own.around()) {
        untouched(&own, || ask(&words)).refused(&["photos", "not a study"]).hints("crumple init");
    }
    let file = own.beside("a file");
    std::fs::write(&file, "text").unwrap();
    for (_, words) in commands_on(&file, own.around()) {
        untouched(&own, || ask(&words)).refused(&["a file", "not a study"]);
    }
}

#[test]
fn a_study_of_another_layout() {
    let own = Own::new();
    let path = own.study().join("manifest.json");
    let mut manifest: Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    manifest["layout"] = 999.into();
    std::fs::write(&path, manifest.to_string()).unwrap();
    for (_, words) in commands_on(&own.study(), own.around()) {
        untouched(&own, || ask(&words)).refused(&["study", "layout 999", "layout 2"]).hints("version");
    }
}

#[test]
fn no_such_file() {
    let own = Own::new();
    let study = own.study();
    let missing = own.beside("nowhere");
    untouched(&own, || {
        crumple!["info", &missing].refused(&["nowhere", "no such file"]).hints("spelling");
        crumple!["init", own.beside("new"), "--reference", &missing].refused(&["nowhere", "no such file"]);
        crumple!["add", &study, &missing].refused(&["nowhere", "no such file"]).hints("spelling");
        crumple!["add", &study, example_run(STRANGER), &missing].refused(&["nowhere", "no such file"]);
        crumple!["analyze", &missing, "-o", own.beside("new")].refused(&["nowhere", "no such file"]);
        crumple!["verify", &study, "target", &missing].refused(&["nowhere", "no such file"]);
        crumple!["distance", &study, "target", &missing].refused(&["nowhere", "no such file"]);
        crumple!["describe", &study, &missing].refused(&["nowhere", "no such file"]);
        crumple!["reconstruct", &study, &missing, "-o", own.beside("shape.stl")].refused(&["nowhere"]);
        crumple!["add", &study, example_run(STRANGER), "--params", &missing].refused(&["nowhere", "table"]);
        crumple!["compare", &study, "--labels", &missing].refused(&["nowhere", "table"]);
        crumple!["analyze", example_run(STRANGER), "--params", &missing, "-o", own.beside("new")].refused(&["nowhere"]);
    });
}

#[test]
fn an_empty_folder() {
    let own = Own::new();
    let empty = own.beside("empty");
    std::fs::create_dir(&empty).unwrap();
    untouched(&own, || {
        crumple!["info", &empty].refused(&["empty"]).hints("folder");
        crumple!["add", own.study(), &empty].refused(&["empty", "no result file"]).hints("folder");
        crumple!["analyze", &empty, "-o", own.beside("new")].refused(&["empty", "no result file"]);
        crumple!["init", own.beside("new"), "--reference", &empty].refused(&["empty", "no result file"]);
        crumple!["verify", own.study(), "target", &empty].refused(&["empty", "no result file"]);
    });
}

#[test]
fn files_that_are_no_d3plot() {
    let own = Own::new();
    let files = [
        ("a letter", b"Dear colleague,\nthe run is on the other server.\n".repeat(100), "text"),
        ("nothing", Vec::new(), "empty"),
        ("noise", noise(50_000), "not a d3plot"),
        ("zeros", vec![0; 50_000], "not a d3plot"),
        ("a picture", [b"\x89PNG\r\n\x1a\n".to_vec(), noise(10_000)].concat(), "not a d3plot"),
        ("a few bytes", vec![1, 2, 3], "d3plot"),
    ];
    for (name, bytes, says) in files {
        let folder = no_d3plot(&own.beside(name), &bytes);
        let file = folder.join("d3plot");
        untouched(&own, || {
            crumple!["info", &file].refused(&[name, says]);
            crumple!["info", &folder].refused(&[name, says]);
            crumple!["init", own.beside("new"), "--reference", &file].refused(&[name, says]);
            crumple!["init", own.beside("new"), "--reference", &folder].refused(&[name, says]);
            crumple!["analyze", &folder, "-o", own.beside("new")].refused(&[name, says]);
            crumple!["add", own.study(), &file].refused(&[name, says]);
            let told = crumple!["add", own.study(), &folder].refused(&[name, says]);
            assert_eq!(
                told.stderr.lines().next().unwrap().matches("/d3plot:").count(),
                1,
                "once is enough: {}",
                told.stderr
            );
            crumple!["verify", own.study(), "target", &file].refused(&[name, says]);
            crumple!["distance", own.study(), "target", &folder].refused(&[name, says]);
            crumple!["describe", own.study(), &file].refused(&[name, says]);
        });
    }
}

#[test]
fn a_part_that_is_not_there() {
    let own = Own::new();
    let run = example_run("run_007");
    untouched(&own, || {
        for part in ["BONNET", "17", "hat ", ""] {
            let outcome = crumple!["init", own.beside("new"), "--reference", &run, "--part", part];
            if part == "hat " {
                outcome.done(); // blanks and case do not matter
                std::fs::remove_dir_all(own.beside("new")).unwrap();
                continue;
            }
            outcome
                .refused(&["run_007", &format!("'{part}'"), "'1 HAT'", "'2 BASE_PLATE'", "'3 HAT_NOTCH'"])
                .hints("--part");
        }
        crumple!["analyze", &run, "--part", "BONNET", "-o", own.beside("new")].refused(&["BONNET", "'1 HAT'"]);
    });
}

#[test]
fn a_run_on_another_mesh() {
    let own = Own::new();
    let renumbered = Spoilt::copy_of(STRANGER, &own.beside("renumbered")).renumber(999_999);
    let other = testdata("s01_shells_latin1");
    let study = own.study();
    untouched(&own, || {
        for (run, names) in
            [(renumbered.folder(), ["renumbered", "node 1001"]), (&other, ["s01_shells_latin1", "node 1001"])]
        {
            crumple!["add", &study, run].refused(&names).hints("mesh");
            crumple!["verify", &study, "target", run].refused(&names).hints("mesh");
            crumple!["distance", &study, "target", run].refused(&names);
            crumple!["describe", &study, run].refused(&names);
            crumple!["reconstruct", &study, run, "-o", own.beside("shape.obj")].refused(&names);
        }
    });
}

#[test]
fn a_study_of_another_reference_is_not_taken_for_this_one() {
    let own = Own::new();
    let renumbered = Spoilt::copy_of("run_001", &own.beside("run_001")).renumber(999_999);
    untouched(&own, || {
        for arguments in
            [&["-K", "40"][..], &["-K", "41"], &["-K", "40", "--join", "2.5"], &["-K", "40", "--part", "HAT"]]
        {
            let mut command = world::program();
            let run_is_renumbered = arguments == ["-K", "40"];
            let run = if run_is_renumbered { renumbered.folder().to_owned() } else { example_run("run_001") };
            command.arg("analyze").arg(run).arg("-o").arg(own.study()).args(arguments);
            let refused = world::finish(command);
            if run_is_renumbered {
                // The study keeps its own reference; the run has another mesh.
                refused.refused(&["study's mesh", "node 1001"]).hints("study of its own");
            } else {
                refused.refused(&["study", "another"]).hints("another folder");
            }
        }
    });
}

#[test]
fn a_run_that_is_cut_short() {
    let own = Own::new();
    // Three states a file: the last file of run_002 is cut within its second state.
    let state = 29_000;
    let cut = Spoilt::copy_of("run_002", &own.beside("cut_in_state")).cut("d3plot02", state + state / 2);
    let added = crumple!["add", own.study(), cut.folder(), "--json"].done();
    let told = added.json();
    assert_eq!(texts(&told["added"]), ["cut_in_state"]);
    let warnings = rows(&told["warnings"]);
    assert!(
        warnings.iter().any(|warning| warning["run"] == "cut_in_state" && warning.to_string().contains("d3plot02")),
        "the cut is told with its file: {warnings:?}"
    );
    let info = crumple!["info", cut.folder(), "--json"].done().json();
    assert_eq!((info["states"].as_u64(), rows(&info["warnings"]).len()), (Some(STATES as u64 - 1), 1), "{info}");
    // Its last whole state is the last one.
    let last = crumple!["distance", own.study(), "target", "cut_in_state", "--json"].done().json();
    assert_eq!(last["state"], STATES - 2);
    crumple!["distance", own.study(), "target", "cut_in_state@3"].refused(&["cut_in_state", "3 states", "@3"]);

    // No whole state at all.
    let stateless = Spoilt::copy_of("run_001", &own.beside("no_state")).cut("d3plot01", 1000);
    // Cut within the geometry.
    let headless = Spoilt::copy_of("run_001", &own.beside("no_geometry")).cut("d3plot", 20_000);
    untouched(&own, || {
        crumple!["add", own.study(), stateless.folder()].refused(&["no_state", "no whole state"]).hints("copy");
        crumple!["verify", own.study(), "target", stateless.folder()].refused(&["no_state", "no whole state"]);
        for outcome in [
            crumple!["info", headless.folder()],
            crumple!["add", own.study(), headless.folder()],
            crumple!["init", own.beside("new"), "--reference", headless.folder()],
            crumple!["verify", own.study(), "target", headless.folder()],
        ] {
            outcome.refused(&["no_geometry", "d3plot", "byte", "expected"]).hints("copy");
        }
    });
}

#[test]
fn coordinates_that_are_no_numbers() {
    let own = Own::new();
    // run_001 holds all its states in d3plot01; run_005 one a file, so the third state is in d3plot03.
    let first = Spoilt::copy_of("run_001", &own.beside("broken_0")).break_coordinate("d3plot01", 0);
    let third = Spoilt::copy_of("run_005", &own.beside("broken_2")).break_coordinate("d3plot03", 1);
    untouched(&own, || {
        crumple!["add", own.study(), first.folder()].refused(&["broken_0", "state 0", "node 1001"]).hints("--skip-bad");
        crumple!["add", own.study(), third.folder()].refused(&["broken_2", "state 2", "node 1002"]);
        crumple!["verify", own.study(), "target", third.folder()].refused(&["broken_2", "state 2", "node 1002"]);
        crumple!["distance", own.study(), "target", first.folder()].refused(&["broken_0", "state 0"]);
    });
}

#[test]
fn bad_runs_among_good_ones() {
    let own = Own::new();
    let bundle = own.beside("bundle");
    copy(&example_run(STRANGER), &bundle.join(STRANGER));
    no_d3plot(&bundle.join("a_letter"), &b"Dear colleague ".repeat(50));
    Spoilt::copy_of("run_001", &bundle.join("broken")).break_coordinate("d3plot01", 0);
    Spoilt::copy_of("run_001", &bundle.join("cut")).cut("d3plot", 20_000);
    Spoilt::copy_of("run_001", &bundle.join("other_mesh")).renumber(999_999);
    let bad = ["a_letter", "broken", "cut", "other_mesh"];
    untouched(&own, || {
        let outcome = crumple!["add", own.study(), &bundle];
        outcome.refused(&[&bad[..], &["4 of 5", "node 1001", "text"]].concat()).hints("--skip-bad");
    });
    let told = crumple!["add", own.study(), &bundle, "--skip-bad", "--json"].done().json();
    assert_eq!(texts(&told["added"]), [STRANGER]);
    let skipped: Vec<&str> = rows(&told["skipped"]).iter().map(|skipped| skipped["run"].as_str().unwrap()).collect();
    assert_eq!(skipped, bad);
    assert!(rows(&told["skipped"]).iter().all(|skipped| !skipped["reason"].as_str().unwrap().is_empty()));
    let words = crumple!["add", own.study(), &bundle, "--skip-bad"].done().stderr;
    assert!(bad.iter().all(|run| words.contains(run)), "{words}");
    assert_eq!(number(&crumple!["check", own.study(), "--json"].done().json()["runs"]) as usize, DOZEN.len() + 1);

    // The whole way: the first run by name is bad, and another becomes the reference.
    copy(&example_run("run_020"), &bundle.join("run_020"));
    copy(&example_run("run_042"), &bundle.join("run_042"));
    let study = own.beside("new");
    let words = ["-o", study.to_str().unwrap(), "-K", "12", "--json"];
    let refused = world::finish({
        let mut command = world::program();
        command.arg("analyze").arg(&bundle).args(words);
        command
    });
    refused.refused(&["a_letter"]);
    let outcome = world::finish({
        let mut command = world::program();
        command.arg("analyze").arg(&bundle).args(words).arg("--skip-bad");
        command
    });
    let told = outcome.done().json();
    assert_eq!(texts(&told["add"]["added"]), ["run_020", "run_042", STRANGER]);
}

#[test]
fn two_runs_of_the_same_name() {
    let own = Own::new();
    let (first, second) = (own.beside("a/run_050"), own.beside("b/run_050"));
    copy(&example_run(STRANGER), &first);
    copy(&example_run("run_051"), &second);
    untouched(&own, || {
        let named = [first.to_str().unwrap(), second.to_str().unwrap(), "'run_050'"];
        crumple!["add", own.study(), &first, &second].refused(&named).hints("above both");
        crumple!["analyze", &first, &second, "-o", own.beside("new")].refused(&named);
    });
}

#[test]
fn names_that_the_study_does_not_know() {
    let own = Own::new();
    let study = own.study();
    let out = own.beside("shape.stl");
    untouched(&own, || {
        for run in ["run_999", "RUN_007", "run_07", "7", "run_007@first", "run_007@-1", "@2", "run_007@"] {
            crumple!["describe", &study, run].refused(&[&format!("'{run}'")]).hints("lists the ids");
            crumple!["verify", &study, "target", "run_001", run].refused(&[&format!("'{run}'")]);
            crumple!["distance", &study, "target", run].refused(&[&format!("'{run}'")]);
            crumple!["reconstruct", &study, run, "-o", &out].refused(&[&format!("'{run}'")]);
        }
        crumple!["describe", &study, "run_07"].refused(&["no run 'run_07'"]);
        crumple!["describe", &study, "sun_007"].refused(&["run_007"]); // what it may have meant

        for state in ["4", "99", "18446744073709551615"] {
            let named = format!("run_007@{state}");
            let says = ["run_007", "4 states", "@0 to @3", &format!("@{state}")];
            crumple!["describe", &study, &named].refused(&says).hints("@last");
            crumple!["verify", &study, "target", &named].refused(&says);
            crumple!["distance", &study, "target", &named].refused(&says);
            crumple!["reconstruct", &study, &named, "-o", &out].refused(&says);
            let outside = format!("{}@{state}", example_run(STRANGER).display());
            crumple!["distance", &study, "target", &outside].refused(&["4 states", &format!("@{state}")]);
        }

        crumple!["describe", &study, "--mode", "mode-9"]
            .refused(&["'mode-9'", "mode-1, mode-2, mode-3"])
            .hints("crumple modes");
        for words in [&["search"][..], &["verify", "run_001"], &["distance", "run_001"]] {
            let mut command = world::program();
            command.arg(words[0]).arg(&study).arg("tarmac").args(&words[1..]);
            world::finish(command).refused(&["'tarmac'", "target"]).hints("crumple describe");
        }
        crumple!["export", &study, "-o", own.beside("out"), "--descriptor", "tarmac"].refused(&["'tarmac'", "target"]);
        crumple!["reconstruct", &study, "run_001", "--descriptor", "tarmac", "-o", &out]
            .refused(&["'tarmac'", "target"]);
    });

    // Before there are any.
    std::fs::remove_file(study.join("modes.parquet")).unwrap();
    std::fs::remove_dir_all(study.join("descriptors")).unwrap();
    untouched(&own, || {
        crumple!["describe", &study, "--mode", "mode-1"].refused(&["no modes yet"]).hints("crumple modes");
        crumple!["compare", &study].refused(&["no modes yet"]).hints("crumple modes");
        crumple!["search", &study, "target"].refused(&["'target'", "none yet"]).hints("crumple describe");
    });
}

#[test]
fn descriptors_that_do_not_belong_here() {
    let own = Own::new();
    let other = own.beside("other");
    crumple!["init", &other, "--reference", example_run("run_001"), "-K", "30"].done();
    crumple!["add", &other, example_run("run_001"), example_run("run_007")].done();
    crumple!["describe", &other, "run_007", "--name", "foreign"].done();
    let foreign = other.join("descriptors/foreign.json");
    let text = own.beside("text.json");
    std::fs::write(&text, "not JSON").unwrap();
    let lacking = own.beside("lacking.json");
    std::fs::write(&lacking, r#"{"name": "lacking"}"#).unwrap();
    let own_descriptor = own.study().join("descriptors/target.json");
    let own_text = std::fs::read_to_string(&own_descriptor).unwrap();
    let spoilt = |name: &str, spoil: &dyn Fn(&mut Value)| {
        let mut descriptor: Value = serde_json::from_str(&own_text).unwrap();
        spoil(&mut descriptor);
        let path = own.beside(name);
        std::fs::write(&path, descriptor.to_string()).unwrap();
        path
    };
    let beyond = spoilt("beyond.json", &|descriptor| descriptor["eigenvectors"][0] = 4000.into());
    let zero = spoilt("zero.json", &|descriptor| descriptor["eigenvectors"][0] = 0.into());
    let uneven = spoilt("uneven.json", &|descriptor| {
        descriptor["values"].as_array_mut().unwrap().pop();
    });
    let study = own.study();
    let out = own.beside("shape.obj");
    untouched(&own, || {
        for (path, says) in [
            (&foreign, "another eigenbasis"),
            (&text, "text.json"),
            (&lacking, "lacking.json"),
            (&beyond, "beyond.json"),
            (&zero, "zero.json"),
            (&uneven, "uneven.json"),
        ] {
            crumple!["search", &study, path].refused(&[says]);
            crumple!["verify", &study, path, "run_001"].refused(&[says]);
            crumple!["distance", &study, path, "run_001"].refused(&[says]);
            crumple!["reconstruct", &study, "run_001", "--descriptor", path, "-o", &out].refused(&[says]);
            crumple!["export", &study, "--descriptor", path, "-o", own.beside("out")].refused(&[says]);
        }
        crumple!["search", &study, &foreign].refused(&["'foreign'"]).hints("crumple describe");
    });
}

#[test]
fn tables_that_do_not_fit() {
    let own = Own::new();
    let study = own.study();
    let run = example_run(STRANGER);
    let cases = [
        ("strangers.csv", "run,t\nalpha,1\nbeta,2\n", &["no row belongs to a run", "alpha", "run_050"][..]),
        ("twice.csv", "run,t\nrun_050,1\nrun_050,2\n", &["line 3", "run_050", "line 2"]),
        ("ragged.csv", "run,t\nrun_050,1,2,3\n", &["line"]),
        ("keyless.csv", "run,t\n,1\n", &["line 2", "no run"]),
        ("narrow.csv", "run\nrun_050\n", &["only one column"]),
        ("headless.csv", "\n", &["headless.csv"]),
        ("empty.csv", "", &["empty.csv"]),
        ("rowless.csv", "run,t\n", &["no rows"]),
    ];
    for (name, text, says) in cases {
        let table = own.beside(name);
        std::fs::write(&table, text).unwrap();
        let says = [&[name], says].concat();
        untouched(&own, || {
            crumple!["add", &study, &run, "--params", &table].refused(&says).hints("first column");
            let new = own.beside("new");
            crumple!["analyze", &run, "--params", &table, "-o", &new, "-K", "12"].refused(&says).hints("first column");
            if name != "strangers.csv" {
                crumple!["compare", &study, "--labels", &table].refused(&[name]);
            }
        });
    }
    let folder = own.beside("folder.csv");
    std::fs::create_dir(&folder).unwrap();
    untouched(&own, || {
        crumple!["add", &study, &run, "--params", &folder].refused(&["folder.csv"]);
        crumple!["compare", &study, "--labels", &folder].refused(&["folder.csv"]);
    });
    let strangers = own.beside("strangers.csv");
    untouched(&own, || {
        crumple!["compare", &study, "--labels", &strangers].refused(&["strangers.csv", "alpha", "run_001"]);
    });
}

#[test]
fn rules_and_numbers_that_make_no_sense() {
    let own = Own::new();
    let study = own.study();
    let out = own.beside("shape.stl");
    untouched(&own, || {
        for rule in [
            "",
            "std",
            "std:",
            "std:one",
            "std:nan",
            "std:inf",
            "std:1e9",
            "median:1",
            "mean:0",
            "mean:-1",
            "value:-1",
            "value:1e12",
            "top:0",
            "top:1.5",
            "top:41",
            "top:-3",
            "energy:0",
            "energy:1.5",
            "error:0",
            "error:-1",
            "error:1e-9",
        ] {
            let named = format!("'{}'", rule.split(':').next().unwrap_or_default());
            let said = crumple!["describe", &study, "run_007", "--threshold", rule].refused(&["threshold '"]);
            let named_whole =
                said.stderr.contains(&format!("'{rule}'")) || said.stderr.contains(&named[..named.len() - 1]);
            assert!(named_whole, "{}", said.stderr);
            said.hints("std:C");
            crumple!["report", &study, "-o", own.beside("page.html"), "--threshold", rule].refused(&["threshold '"]);
            crumple!["compare", &study, "--threshold", rule].refused(&["threshold '"]);
        }
        for (words, says) in [
            (&["modes", "STUDY", "--count", "0"][..], "1 to"),
            (&["modes", "STUDY", "--count", "13"], "12"),
            (&["modes", "STUDY", "--count", "three"], "three"),
            (&["modes", "STUDY", "--count", "-1"], "-1"),
            (&["modes", "STUDY", "--method", "guess"], "kmeans"),
            (&["modes", "STUDY", "--seed", "x"], "--seed"),
            (&["modes", "STUDY", "--choose", "taste"], "silhouette or stability"),
            (
                &["modes", "STUDY", "--by", "colour"],
                "rotation, displacement (or paper), coordinates, a field such as plastic_strain",
            ),
            (&["modes", "STUDY", "--method", "hdbscan", "--count", "3"], "--smallest"),
            (&["modes", "STUDY", "--method", "hdbscan", "--smallest", "1"], "2 to the number of runs"),
            (&["modes", "STUDY", "--smallest", "3"], "--method hdbscan"),
            (&["modes", "STUDY", "--at", "0"], "a time above 0"),
            (&["modes", "STUDY", "--at", "1000"], "at most"),
            (&["modes", "STUDY", "--at", "soon"], "soon"),
            (&["modes", "STUDY", "--at-intrusion", "1.5"], "above 0 and at most 1"),
            (&["modes", "STUDY", "--states", "first"], "last or series"),
            (&["modes", "STUDY", "--align", "intrusion"], "--states series"),
            (&["modes", "STUDY", "--states", "series", "--align", "length"], "time or intrusion"),
            (&["modes", "STUDY", "--name", "crush"], "MODE=NAME"),
            (&["modes", "STUDY", "--name", "mode-99=crush"], "no mode 'mode-99'"),
            (&["modes", "STUDY", "--name", "mode-1=mode-9"], "another name than a number"),
            (&["modes", "STUDY", "--name", "mode-1=../outside"], "file name"),
            (&["describe", "STUDY", "run_007", "--select", "all"], "difference"),
            (&["describe", "STUDY", "run_007", "--name", "../outside"], "--name"),
            (&["describe", "STUDY", "run_007", "--name", ""], "--name"),
            (&["describe", "STUDY", "run_007", "--name", ".hidden"], "--name"),
            (&["describe", "STUDY"], "RUN"),
            (&["describe", "STUDY", "run_007", "--mode", "mode-1"], "--mode"),
            (&["search", "STUDY", "target", "--metric", "taxi"], "euclidean"),
            (&["search", "STUDY", "target", "--weight", "heavy"], "frequency"),
            (&["search", "STUDY", "target", "--states", "first"], "last or all"),
            (&["search", "STUDY", "target", "--top", "many"], "--top"),
            (&["verify", "STUDY", "target", "run_007", "--threshold", "1.5"], "-1 to 1"),
            (&["verify", "STUDY", "target", "run_007", "--threshold", "nan"], "-1 to 1"),
            (&["verify", "STUDY", "target", "run_007", "--threshold", "high"], "high"),
            (&["verify", "STUDY", "target"], "RUN"),
            (&["distance", "STUDY", "target"], "RUN"),
            (&["reconstruct", "STUDY", "run_007", "--first", "0", "-o", "OUT"], "1 to 40"),
            (&["reconstruct", "STUDY", "run_007", "--first", "41", "-o", "OUT"], "1 to 40"),
            (&["reconstruct", "STUDY", "run_007", "--pca", "0", "-o", "OUT"], "--pca"),
            (&["reconstruct", "STUDY", "run_007", "--first", "3", "--pca", "3", "-o", "OUT"], "--pca"),
            (&["reconstruct", "STUDY", "run_007", "-o", "shape.step"], ".vtu, .obj or .stl"),
            (&["reconstruct", "STUDY", "run_007", "-o", "shape"], ".vtu, .obj or .stl"),
            (&["export", "STUDY", "-o", "OUT", "--format", "xlsx"], "csv or parquet"),
            (&["init", "NEW", "--reference", "RUN", "-K", "0"], "at least one"),
            (&["init", "NEW", "--reference", "RUN", "-K", "half"], "half"),
            (&["init", "NEW", "--reference", "RUN", "--join", "0"], "positive"),
            (&["init", "NEW", "--reference", "RUN", "--join=-1"], "positive"),
            (&["init", "NEW", "--reference", "RUN", "--join", "-1"], "positive"),
            (&["init", "NEW", "--reference", "RUN", "--join", "nan"], "positive"),
            (&["init", "NEW", "--reference", "RUN", "--join", "inf"], "join"),
            (&["check", "STUDY", "--threads", "0"], "--threads"),
            (&["check"], "STUDY"),
            (&["knead", "STUDY"], "knead"),
        ] {
            let mut command = world::program();
            for word in words {
                match *word {
                    "STUDY" => command.arg(&study),
                    "NEW" => command.arg(own.beside("new")),
                    "RUN" => command.arg(example_run("run_001")),
                    "OUT" => command.arg(&out),
                    "shape" | "shape.step" => command.arg(own.beside(word)),
                    word => command.arg(word),
                };
            }
            world::finish(command).refused(&[says]);
        }
    });
}

#[test]
fn a_folder_that_holds_something_else_is_not_taken() {
    let own = Own::new();
    let folder = own.beside("photos");
    std::fs::create_dir(&folder).unwrap();
    std::fs::write(folder.join("holiday.jpg"), "sun").unwrap();
    untouched(&own, || {
        let run = example_run("run_001");
        crumple!["analyze", &run, "-o", &folder, "-K", "12"].refused(&["photos"]);
        crumple!["init", &folder, "--reference", &run, "-K", "12"]
            .refused(&["photos", "something is here"])
            .hints("another folder");
        crumple!["init", own.study(), "--reference", &run, "-K", "12"]
            .refused(&["study", "already"])
            .hints("another folder");
    });
    // An empty folder is as good as none.
    let empty = own.beside("empty");
    std::fs::create_dir(&empty).unwrap();
    crumple!["init", &empty, "--reference", example_run("run_001"), "-K", "12"].done();
}

#[test]
fn a_folder_of_several_runs_where_one_is_wanted() {
    let own = Own::new();
    let bundle = world::copy_runs(["run_001", "run_002"], &own.beside("bundle"));
    untouched(&own, || {
        crumple!["init", own.beside("new"), "--reference", &bundle].refused(&["bundle", "one run", "2"]);
        crumple!["verify", own.study(), "target", &bundle].refused(&["bundle", "one run", "2"]);
        crumple!["distance", own.study(), "target", &bundle].refused(&["bundle", "one run", "2"]);
        crumple!["describe", own.study(), &bundle].refused(&["bundle", "one run", "2"]);
        crumple!["info", &bundle].refused(&["bundle"]);
    });
}

#[test]
fn too_few_runs_for_what_is_asked() {
    let own = Own::new();
    let study = own.beside("new");
    crumple!["init", &study, "--reference", example_run("run_001"), "-K", "12"].done();
    untouched(&own, || {
        crumple!["modes", &study].refused(&["runs"]).hints("add more runs");
        crumple!["report", &study, "-o", own.beside("page.html")].refused(&["runs"]);
        crumple!["describe", &study, "run_001"].refused(&["no run 'run_001'"]);
    });
    crumple!["add", &study, example_run("run_001")].done();
    crumple!["describe", &study, "run_001"].done();
    untouched(&own, || {
        for option in [&["--centred"][..], &["--weight", "spread"], &["--metric", "mahalanobis"]] {
            let mut command = world::program();
            command.arg("search").arg(&study).arg("run_001").args(option);
            let needed = if option.contains(&"mahalanobis") { "at least 3 runs" } else { "at least 2 runs" };
            world::finish(command).refused(&[needed, "there are 1"]).hints("add more runs");
        }
    });
    crumple!["search", &study, "run_001"].done();
}

#[test]
fn a_run_whose_files_are_gone_or_changed() {
    let own = Own::new();
    let bundle = own.beside("bundle");
    copy(&example_run(STRANGER), &bundle.join(STRANGER));
    crumple!["add", own.study(), &bundle].done();
    // Coefficients are in the study; the shape itself is in the result file.
    Spoilt::copy_of(STRANGER, &own.beside("elsewhere"));
    std::fs::remove_dir_all(&bundle).unwrap();
    crumple!["distance", own.study(), "target", STRANGER].done();
    untouched(&own, || {
        crumple!["describe", own.study(), STRANGER].refused(&["bundle"]);
        crumple!["reconstruct", own.study(), STRANGER, "-o", own.beside("shape.stl")].refused(&["bundle"]);
    });
    // Another content under the same path is not taken for what was added.
    copy(&example_run("run_051"), &bundle.join(STRANGER));
    untouched(&own, || {
        crumple!["describe", own.study(), STRANGER].refused(&[STRANGER, "differs"]).hints("--replace");
    });
}
