//! The command line as a person uses it, on real runs: from a bundle to modes, descriptors, answers and files.

#[macro_use]
mod world;

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::Value;
use world::{DOZEN, STATES, STRANGER, dozen, example, example_run, folder, found_runs, number, rows, texts};

/// A copy of the dozen's study in which a test may save descriptors.
fn own_study(place: &Path) -> std::path::PathBuf {
    let study = place.join("study");
    world::copy(&dozen().study, &study);
    study
}

/// The name of a descriptor that `analyze` made, and the run it is of.
fn first_mode() -> (&'static str, &'static str) {
    let mode = &dozen().analyzed["modes"]["modes"][0];
    (mode["name"].as_str().unwrap(), mode["medoid"].as_str().unwrap())
}

#[test]
fn analyze_does_all_of_it() {
    let made = dozen();
    let told = &made.analyzed;
    assert_eq!(told["study"], made.study.to_str().unwrap());
    assert_eq!(told["report"], made.study.join("report.html").to_str().unwrap());
    assert!(made.study.join("report.html").is_file());
    for stage in ["find", "init", "add", "modes", "describe", "report"] {
        assert!(number(&told["seconds"][stage]) >= 0.0, "{stage}");
    }
    assert_eq!(texts(&told["add"]["added"]), DOZEN);
    let modes = rows(&told["modes"]["modes"]);
    assert!((2..=8).contains(&modes.len()));
    let described: Vec<&str> =
        rows(&told["descriptors"]).iter().map(|descriptor| descriptor["descriptor"].as_str().unwrap()).collect();
    let names: Vec<&str> = modes.iter().map(|mode| mode["name"].as_str().unwrap()).collect();
    assert_eq!(described, names, "one descriptor a mode");
    for (mode, descriptor) in modes.iter().zip(rows(&told["descriptors"])) {
        assert_eq!(mode["medoid"], descriptor["run"]);
        assert!(made.study.join("descriptors").join(format!("{}.json", mode["name"].as_str().unwrap())).is_file());
    }
    // The mesh of the example, as its documentation describes it.
    let init = &told["init"];
    assert_eq!((&init["vertices"], &init["triangles"], &init["components"]), (&1862.into(), &3456.into(), &2.into()));
    assert!((number(&init["area"]) - 138_240.0).abs() < 0.1, "{}", init["area"]);
    assert_eq!((&init["eigenpairs"], &init["complete"]), (&500.into(), &true.into()));
}

#[test]
fn the_whole_example_is_analyzed_with_its_sheets_joined() {
    let place = folder();
    let (runs, study) = (example().join("runs"), place.path().join("study"));
    let inputs = example().join("inputs.csv");
    let told = crumple!["analyze", &runs, "--params", &inputs, "--join", "2.5", "-o", &study, "--json"].done().json();
    assert_eq!(texts(&told["add"]["added"]).len(), 100);
    assert_eq!(told["init"]["null_space"], 1);
    assert!(number(&told["init"]["joined_pairs"]) > 0.0);
    let members: BTreeSet<&str> =
        rows(&told["modes"]["modes"]).iter().flat_map(|mode| texts(&mode["members"])).collect();
    assert_eq!(members.len(), 100, "every run is in one mode");
    let checked = crumple!["check", &study, "--json"].done().json();
    assert_eq!((&checked["whole"], &checked["runs"]), (&true.into(), &100.into()));
    // Once more: nothing is new, and nothing is lost.
    let again = crumple!["analyze", &runs, "-o", &study, "--join", "2.5", "--json"].done().json();
    assert_eq!(texts(&again["add"]["unchanged"]).len(), 100);
    assert_eq!(rows(&again["add"]["added"]).len(), 0);
    assert_eq!(again["modes"], told["modes"]);
}

#[test]
fn modes_group_every_run_once() {
    let place = folder();
    let study = own_study(place.path());
    let found = crumple!["modes", &study, "--count", "3", "--seed", "1", "--json"].done().json();
    let modes = rows(&found["modes"]);
    assert_eq!(modes.len(), 3);
    let mut members: Vec<&str> = Vec::new();
    for mode in modes {
        assert!(mode["name"].is_string());
        assert!(texts(&mode["members"]).contains(&mode["medoid"].as_str().unwrap()), "the medoid is a member");
        assert!((-1.0..=1.0).contains(&number(&mode["silhouette"])));
        members.extend(texts(&mode["members"]));
    }
    members.sort_unstable();
    assert_eq!(members, DOZEN);
    let sizes: Vec<usize> = modes.iter().map(|mode| rows(&mode["members"]).len()).collect();
    assert!(sizes.is_sorted_by(|a, b| a >= b), "the largest mode first: {sizes:?}");
    assert!(texts(&found["outliers"]).iter().all(|run| DOZEN.contains(run)));
    let words = crumple!["modes", &study, "--count", "3", "--seed", "1"].done().stdout;
    assert!(modes.iter().all(|mode| words.contains(mode["medoid"].as_str().unwrap())), "{words}");
}

/// What every descriptor must say, whatever it is of.
#[track_caller]
fn assert_descriptor(told: &Value, run: &str, state: usize) {
    assert_eq!((&told["run"], &told["state"]), (&run.into(), &state.into()));
    let eigenvectors: Vec<f64> = rows(&told["eigenvectors"]).iter().map(number).collect();
    assert!(
        eigenvectors.is_sorted_by(|a, b| a < b) && eigenvectors[0] >= 1.0 && *eigenvectors.last().unwrap() <= 500.0
    );
    assert_eq!(number(&told["size"]) as usize, eigenvectors.len());
    assert_eq!(told["numbers"], 3 * eigenvectors.len());
    assert_eq!(told["threshold"]["rule"], "std:1");
    assert!(number(&told["threshold"]["value"]) > 0.0);
    let errors = &told["errors"];
    assert!(0.0 < number(&errors["rms"]) && number(&errors["rms"]) <= number(&errors["max"]), "{errors}");
    let relative = number(&errors["relative"]);
    assert!(0.0 < relative && relative < 1.0, "a fraction: {relative}");
    let rivals: Vec<&str> = rows(&told["rivals"]).iter().map(|rival| rival["method"].as_str().unwrap()).collect();
    assert_eq!(rivals, ["first M", "first 500", "PCA"]);
    // Best of all M-subsets or not: all 500 eigenvectors of the same kind cannot be worse than some of them.
    assert!(number(&told["rivals"][1]["rms"]) <= number(&errors["rms"]));
}

#[test]
fn describe_names_a_run_a_state_or_a_mode() {
    let place = folder();
    let study = own_study(place.path());
    let by_run = crumple!["describe", &study, "run_007", "--json"].done().json();
    assert_descriptor(&by_run, "run_007", STATES - 1);
    assert_eq!(by_run["descriptor"], "run_007");
    assert!(study.join("descriptors/run_007.json").is_file());
    // Without @STATE it is the last one.
    let last = format!("run_007@{}", STATES - 1);
    for named in ["run_007@last", last.as_str()] {
        let told = crumple!["describe", &study, named, "--name", "again", "--json"].done().json();
        assert_eq!((&told["eigenvectors"], &told["errors"]), (&by_run["eigenvectors"], &by_run["errors"]));
    }
    let early = crumple!["describe", &study, "run_007@1", "--json"].done().json();
    assert_descriptor(&early, "run_007", 1);
    assert!(number(&early["time"]) < number(&by_run["time"]));
    let (mode, medoid) = first_mode();
    let by_mode = crumple!["describe", &study, "--mode", mode, "--json"].done().json();
    assert_descriptor(&by_mode, medoid, STATES - 1);
    assert_eq!((&by_mode["mode"], &by_mode["descriptor"]), (&mode.into(), &mode.into()));
    // The undeformed state has no displacement to be relative to.
    let still = crumple!["describe", &study, "run_007@0", "--json"].done().json();
    assert_eq!(still["errors"]["relative"], Value::Null);
}

#[test]
fn every_threshold_rule_selects() {
    let place = folder();
    let study = own_study(place.path());
    let size = |rule: &str| {
        let told =
            crumple!["describe", &study, "run_007", "--name", "rule", "--threshold", rule, "--json"].done().json();
        assert_eq!(told["threshold"]["rule"], rule);
        (number(&told["size"]) as usize, number(&told["errors"]["rms"]))
    };
    assert_eq!(size("top:14").0, 14);
    let (loose, strict) = (size("std:2").0, size("std:0.5").0);
    assert!(loose < strict, "a higher threshold keeps fewer: {loose} and {strict}");
    assert!(size("energy:0.9").0 <= size("energy:0.999").0);
    assert!(size("mean:1").0 >= size("mean:4").0);
    assert!(size("value:5000").0 >= 1);
    let (_, rms) = size("error:8");
    assert!(rms <= 8.0 * (1.0 + 1e-6), "asked for 8 mm, got {rms}"); // f32 of the stored eigenvectors
    let difference = crumple!["describe", &study, "run_007", "--select", "difference", "--json"].done().json();
    assert_eq!(difference["select"], "difference");
}

#[test]
fn search_ranks_runs_and_states() {
    let (mode, medoid) = first_mode();
    let study = &dozen().study;
    let all = crumple!["search", study, mode, "--json"].done().json();
    let similarity: Vec<f64> = rows(&all["results"]).iter().map(|hit| number(&hit["similarity"])).collect();
    assert!(similarity.is_sorted_by(|a, b| a >= b), "best first");
    assert!(similarity.iter().all(|similarity| (-1.0..=1.0).contains(similarity)));
    assert_eq!(found_runs(&all).iter().collect::<BTreeSet<_>>().len(), DOZEN.len(), "one result a run");
    assert_eq!(found_runs(&all)[0], medoid, "the query stays in the list, and is most like itself");
    assert!((similarity[0] - 1.0).abs() < 1e-6); // coefficients are stored in f32
    for hit in rows(&all["results"]) {
        assert_eq!(hit["state"], STATES - 1);
        assert!(number(&hit["time"]) > 0.0);
    }
    let three = crumple!["search", study, mode, "--top", "3", "--json"].done().json();
    assert_eq!(rows(&three["results"]), &rows(&all["results"])[..3]);

    // Twenty by default: the dozen have 48 states.
    let states = crumple!["search", study, mode, "--states", "all", "--json"].done().json();
    assert_eq!(rows(&states["results"]).len(), 20);
    let every = crumple!["search", study, mode, "--states", "all", "--top", "1000", "--json"].done().json();
    assert_eq!(rows(&every["results"]).len(), STATES * DOZEN.len());
    let named: BTreeSet<_> =
        rows(&every["results"]).iter().map(|hit| (hit["run"].to_string(), hit["state"].to_string())).collect();
    assert_eq!(named.len(), STATES * DOZEN.len(), "every state once");
    assert_eq!((&every["results"][0]["run"], &every["results"][0]["state"]), (&medoid.into(), &(STATES - 1).into()));

    // A descriptor may also be named by the path of its file, and the table shows what the JSON says.
    let path = study.join("descriptors").join(format!("{mode}.json"));
    assert_eq!(crumple!["search", study, &path, "--json"].done().json(), all);
    let words = crumple!["search", study, mode].done().stdout;
    let order: Vec<usize> = found_runs(&all).iter().map(|run| words.find(run).unwrap()).collect();
    assert!(order.is_sorted(), "{words}");
}

#[test]
fn every_measure_finds_the_query_first() {
    let (mode, medoid) = first_mode();
    for options in [
        &["--centred"][..],
        &["--weight", "frequency"],
        &["--weight", "spread"],
        &["--metric", "euclidean"],
        &["--metric", "mahalanobis"],
        &["--centred", "--weight", "spread", "--metric", "cosine"],
    ] {
        let mut command = world::program();
        command.arg("search").arg(&dozen().study).arg(mode).arg("--json").args(options);
        let found = world::finish(command).done().json();
        assert_eq!(found_runs(&found)[0], medoid, "{options:?}");
        assert!((number(&found["results"][0]["similarity"]) - 1.0).abs() < 1e-4, "{options:?}"); // f32 against a spread
        let similarity: Vec<f64> = rows(&found["results"]).iter().map(|hit| number(&hit["similarity"])).collect();
        assert!(similarity.is_sorted_by(|a, b| a >= b), "{options:?}");
    }
}

#[test]
fn verify_says_pass_or_fail_per_run() {
    let (mode, _) = first_mode();
    let study = &dozen().study;
    let found = crumple!["search", study, mode, "--json"].done().json();
    let (best, worst) = (&found["results"][1], &found["results"][DOZEN.len() - 1]);
    let between = (number(&best["similarity"]) + number(&worst["similarity"])) / 2.0;
    let (best_run, worst_run) = (best["run"].as_str().unwrap(), worst["run"].as_str().unwrap());
    let threshold = between.to_string();

    let told = crumple!["verify", study, mode, best_run, worst_run, "--threshold", &threshold, "--json"];
    let told = told.ends_with_code(1).json();
    let results = rows(&told["results"]);
    assert_eq!((&results[0]["run"], &results[0]["pass"]), (&best_run.into(), &true.into()));
    assert_eq!((&results[1]["run"], &results[1]["pass"]), (&worst_run.into(), &false.into()));
    for (result, hit) in results.iter().zip([best, worst]) {
        assert_eq!(result["similarity"], hit["similarity"], "as search says");
    }
    crumple!["verify", study, mode, best_run, "--threshold", &threshold].done();
    crumple!["verify", study, mode, best_run, worst_run, "--threshold", "-1"].done();

    // A similarity of exactly S passes.
    let exact = worst["similarity"].to_string();
    crumple!["verify", study, mode, worst_run, "--threshold", &exact].done();
}

#[test]
fn a_new_run_is_judged_by_its_path_and_not_added() {
    let (mode, _) = first_mode();
    let place = folder();
    let study = own_study(place.path());
    let before = world::snapshot(&study);
    let outside = example_run(STRANGER);
    let told =
        crumple!["verify", &study, mode, &outside, outside.join("d3plot"), "--threshold", "-1", "--json"].done().json();
    assert!(rows(&told["results"]).iter().all(|result| result["run"] == STRANGER));
    let similarity = number(&told["results"][0]["similarity"]);
    let distance: f64 = crumple!["distance", &study, mode, &outside].done().stdout.trim().parse().unwrap();
    assert!((distance - (1.0 - similarity)).abs() < 1e-12);
    world::assert_same(&before, &world::snapshot(&study), "verify and distance only read");

    // After it was added it is as alike as before.
    crumple!["add", &study, &outside].done();
    let inside = crumple!["verify", &study, mode, STRANGER, "--threshold", "-1", "--json"].done().json();
    assert_eq!(inside["results"][0]["similarity"], told["results"][0]["similarity"]);
}

#[test]
fn distance_is_one_number() {
    let (mode, medoid) = first_mode();
    let study = &dozen().study;
    for options in [&[][..], &["--centred"], &["--weight", "frequency"], &["--metric", "mahalanobis"]] {
        let ask = |what: &str, rest: &[&str]| {
            let mut command = world::program();
            command.arg(what).arg(study).arg(mode).args(rest).args(options);
            world::finish(command).done()
        };
        for hit in rows(&ask("search", &["--json"]).json()["results"]) {
            let words = ask("distance", &[hit["run"].as_str().unwrap()]).stdout;
            let distance: f64 = words.trim().parse().unwrap_or_else(|_| panic!("more than a number: {words}"));
            assert!((distance - (1.0 - number(&hit["similarity"]))).abs() < 1e-12, "{options:?}");
        }
    }
    let euclidean = |run: &str| -> f64 {
        crumple!["distance", study, mode, run, "--metric", "euclidean"].done().stdout.trim().parse().unwrap()
    };
    assert!(euclidean(medoid) < 1e-3, "to itself, up to f32 of lengths of some 100 mm");
    let other = DOZEN.iter().find(|run| **run != medoid).unwrap();
    assert!((1.0..500.0).contains(&euclidean(other)), "millimetres: {}", euclidean(other));
    let json = crumple!["distance", study, mode, other, "--json"].done().json();
    assert!((number(&json["distance"]) + number(&json["similarity"]) - 1.0).abs() < 1e-12);
}

#[test]
fn a_run_has_one_id_however_it_is_named() {
    let place = folder();
    let bundle = world::copy_runs(["run_007"], &place.path().join("runs"));
    let ways = [bundle.clone(), bundle.join("run_007"), bundle.join("run_007/d3plot")];
    for (way, number) in ways.iter().zip(1..) {
        let study = place.path().join(format!("study-{number}"));
        crumple!["init", &study, "--reference", &ways[1], "-K", "12"].done();
        let added = crumple!["add", &study, way, "--json"].done().json();
        assert_eq!(texts(&added["added"]), ["run_007"], "{}", way.display());
        // The same file under another name is the same run.
        let mut again = world::program();
        again.arg("add").arg(&study).args(&ways).arg("--json");
        let again = world::finish(again).done().json();
        assert_eq!((rows(&again["added"]).len(), texts(&again["unchanged"])), (0, vec!["run_007"]));
    }
    // Deeper folders keep the path below the one that was given.
    let deep = folder();
    world::copy_runs(["run_001", "run_002"], &deep.path().join("lot/a"));
    world::copy_runs(["run_003"], &deep.path().join("lot/b"));
    let study = deep.path().join("study");
    let found = crumple!["analyze", deep.path().join("lot"), "-K", "12", "-o", &study, "--json"].done().json();
    assert_eq!(texts(&found["add"]["added"]), ["a/run_001", "a/run_002", "b/run_003"]);
}

#[test]
fn a_run_of_the_study_named_by_its_path_is_the_same_run() {
    let place = folder();
    let study = own_study(place.path());
    let by_id = crumple!["describe", &study, "run_007", "--json"].done().json();
    let by_path = crumple!["describe", &study, dozen().runs.join("run_007"), "--json"].done().json();
    for key in ["run", "state", "eigenvectors", "errors", "threshold", "descriptor"] {
        assert_eq!(by_id[key], by_path[key], "{key}");
    }
}

#[test]
fn reconstruct_writes_what_others_open() {
    let (mode, _) = first_mode();
    let place = folder();
    let study = &dozen().study;
    let reconstruct = |name: &str, how: &[&str]| {
        let path = place.path().join(name);
        let mut command = world::program();
        command.arg("reconstruct").arg(study).arg("run_007").arg("-o").arg(&path).arg("--json").args(how);
        (world::finish(command).done().json(), std::fs::read(&path).unwrap())
    };
    let (all, vtu) = reconstruct("all.vtu", &[]);
    assert_eq!((&all["size"], &all["run"], &all["state"]), (&500.into(), &"run_007".into(), &(STATES - 1).into()));
    let head = String::from_utf8_lossy(&vtu[..2000.min(vtu.len())]).into_owned();
    assert!(head.contains("<VTKFile") && head.contains("UnstructuredGrid"), "{head}");
    for array in ["displacement", "error"] {
        assert!(String::from_utf8_lossy(&vtu).contains(&format!("Name=\"{array}\"")), "{array}");
    }

    let (by_descriptor, obj) = reconstruct("descriptor.obj", &["--descriptor", mode]);
    let obj = String::from_utf8(obj).unwrap();
    let lines = |start: &str| obj.lines().filter(|line| line.starts_with(start)).count();
    assert_eq!((lines("v "), lines("f ")), (1862, 3456));
    let corners = obj.lines().filter(|line| line.starts_with("f ")).flat_map(|line| line.split(' ').skip(1));
    assert!(corners.map(|corner| corner.parse::<usize>().unwrap()).all(|corner| (1..=1862).contains(&corner)));

    let (first, stl) = reconstruct("first.stl", &["--first", "14"]);
    let triangles = u32::from_le_bytes(stl[80..84].try_into().unwrap()) as usize;
    assert_eq!((triangles, stl.len()), (3456, 84 + 50 * 3456));
    let (pca, _) = reconstruct("pca.stl", &["--pca", "3"]);
    assert_eq!((&first["size"], &pca["size"]), (&14.into(), &3.into()));
    for told in [&by_descriptor, &first, &pca] {
        assert!(
            number(&told["errors"]["rms"]) > number(&all["errors"]["rms"]) && number(&told["errors"]["rms"]) < 100.0
        );
    }
}

#[test]
fn export_writes_arrays_and_tables() {
    let (mode, _) = first_mode();
    let place = folder();
    let study = &dozen().study;
    let csv = place.path().join("csv");
    let told = crumple!["export", study, "-o", &csv, "--json"].done().json();
    let files = texts(&told["files"]);
    for name in [
        "eigenvalues.npy",
        "eigenvectors.npy",
        "mass.npy",
        "baseline.npy",
        "vertices.npy",
        "triangles.npy",
        "node_ids.npy",
        "coefficients.npy",
        "coefficients.csv",
        "runs.csv",
        "modes.csv",
    ] {
        assert!(csv.join(name).is_file() && files.iter().any(|file| file.ends_with(name)), "{name}");
    }
    let array = std::fs::read(csv.join("coefficients.npy")).unwrap();
    assert!(array.starts_with(b"\x93NUMPY"));
    assert!(String::from_utf8_lossy(&array[..128]).replace(' ', "").contains("(48,500,3"), "states × K × 3");
    let runs = std::fs::read_to_string(csv.join("runs.csv")).unwrap();
    let column = runs.lines().next().unwrap().split(',').position(|name| name == "thickness_mm").unwrap();
    let row = runs.lines().find(|line| line.starts_with("run_001,")).unwrap();
    assert_eq!(row.split(',').nth(column), Some("4.14"), "as in inputs.csv");

    let few = place.path().join("few");
    crumple!["export", study, "-o", &few, "--format", "parquet", "--descriptor", mode, "--last"].done();
    let size = dozen().analyzed["descriptors"][0]["size"].to_string();
    let array = std::fs::read(few.join("coefficients.npy")).unwrap();
    assert!(String::from_utf8_lossy(&array[..128]).replace(' ', "").contains(&format!("(12,{size},3")));
    for name in ["coefficients.parquet", "runs.parquet", "modes.parquet"] {
        let bytes = std::fs::read(few.join(name)).unwrap();
        assert!(bytes.starts_with(b"PAR1") && bytes.ends_with(b"PAR1"), "{name}");
    }
}

#[test]
fn compare_judges_only_with_labels() {
    let study = &dozen().study;
    let labels = example().join("labels.csv");
    let judged = crumple!["compare", study, "--labels", &labels, "--json"].done().json();
    for row in rows(&judged["rows"]) {
        assert!(row["query"].is_string() && row["method"].is_string() && number(&row["size"]) >= 1.0);
        assert!(number(&row["rms"]) > 0.0, "{row}");
        for quality in ["precision_at_9", "average_precision"] {
            assert!((0.0..=1.0).contains(&number(&row[quality])), "{row}");
        }
    }
    let plain = crumple!["compare", study, "--json"].done().json();
    assert!(
        rows(&plain["rows"]).iter().all(|row| row["precision_at_9"].is_null() && row["average_precision"].is_null())
    );
    let queries: BTreeSet<&str> = rows(&plain["rows"]).iter().map(|row| row["query"].as_str().unwrap()).collect();
    let medoids: BTreeSet<&str> =
        rows(&dozen().analyzed["modes"]["modes"]).iter().map(|mode| mode["medoid"].as_str().unwrap()).collect();
    assert_eq!(queries, medoids);
}

#[test]
fn report_is_one_page() {
    let place = folder();
    let path = place.path().join("page.html");
    let told = crumple!["report", &dozen().study, "-o", &path, "--json"].done().json();
    let page = std::fs::read_to_string(&path).unwrap();
    assert_eq!(told["bytes"], page.len());
    assert!(page.trim_start().to_ascii_lowercase().starts_with("<!doctype html>"));
    assert!(DOZEN.iter().all(|run| page.contains(run)));
}

#[test]
fn check_and_info_say_what_is_there() {
    let checked = crumple!["check", &dozen().study, "--json"].done().json();
    assert_eq!((&checked["whole"], &checked["runs"]), (&true.into(), &DOZEN.len().into()));
    assert_eq!((rows(&checked["problems"]).len(), rows(&checked["notes"]).len()), (0, 0), "{checked}");
    assert!(crumple!["check", &dozen().study].done().stdout.starts_with("whole"));

    for run in [example_run("run_007"), example_run("run_007").join("d3plot")] {
        let info = crumple!["info", &run, "--json"].done().json();
        assert_eq!(
            (&info["format"], &info["nodes"], &info["states"]),
            (&"d3plot".into(), &1862.into(), &STATES.into())
        );
        assert_eq!(info["elements"]["shells"], 1728);
        assert_eq!(info["title"].as_str().unwrap().trim(), "hat section beam run 007 t=1.36 mm");
        let titles: Vec<&str> =
            rows(&info["parts"]).iter().map(|part| part["title"].as_str().unwrap().trim()).collect();
        assert_eq!(titles, ["HAT", "BASE_PLATE", "HAT_NOTCH"]);
        assert_eq!(rows(&info["warnings"]).len(), 0);
    }
}

#[test]
fn results_go_to_standard_output_and_words_to_standard_error() {
    let place = folder();
    let study = place.path().join("study");
    let made = crumple!["init", &study, "--reference", example_run("run_001"), "-K", "12", "--json"].done();
    assert_eq!(made.json()["join_advice"], 2.5);
    assert!(made.stderr.contains("note: ") && made.stderr.contains("--join 2.5"), "{}", made.stderr);
    let quiet = crumple!["add", &study, example_run("run_001"), "--quiet"].done();
    assert_eq!(quiet.stderr, "");
    assert!(!quiet.stdout.is_empty());
}

#[test]
fn inputs_join_by_id_or_by_number_and_say_what_is_left_over() {
    let place = folder();
    let study = place.path().join("study");
    crumple!["init", &study, "--reference", example_run("run_001"), "-K", "12"].done();
    let table = place.path().join("inputs.csv");
    std::fs::write(&table, "run;speed\n7;25,5\n1;13,5\n").unwrap();
    let mut command = world::program();
    command.arg("add").arg(&study).arg(&dozen().runs).arg("--params").arg(&table).arg("--json");
    let outcome = world::finish(command).done();
    let notes = texts(&outcome.json()["notes"]).join("\n");
    assert!(notes.contains("joined by the number") && notes.contains("10 of 12 runs have no row"), "{notes}");
    let exported = place.path().join("exported");
    crumple!["export", &study, "-o", &exported].done();
    let runs = std::fs::read_to_string(exported.join("runs.csv")).unwrap();
    assert!(runs.lines().any(|line| line.starts_with("run_007,") && line.contains("25,5")), "{runs}");
}
