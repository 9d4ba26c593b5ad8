//! Every kind of bad result file and deck, to `info`, `convert` and `analyze` each: one clear error, or a typed warning and
//! the rest read.

#[macro_use]
mod world;

use std::path::{Path, PathBuf};

use world::spoil::{Spoilt, no_d3plot, noise};
use world::{folder, rows, testdata};

/// All three commands on a run, refused with these words; nothing is written.
#[track_caller]
fn refused_by_all(run: &Path, says: &[&str]) {
    let place = folder();
    crumple!["info", run, "--json"].refused(says);
    crumple!["convert", run, "-o", place.path().join("out/d3plot")].refused(says);
    crumple!["analyze", run, "-o", place.path().join("study")].refused(says);
    crumple!["init", place.path().join("study"), "--reference", run].refused(says);
    assert!(!place.path().join("out/d3plot").exists() && !place.path().join("study").exists());
}

#[test]
fn what_is_no_result_file_is_refused_by_name() {
    let place = folder();
    let file = |name: &str, bytes: &[u8]| no_d3plot(&place.path().join(name), bytes).join("d3plot");
    refused_by_all(&file("empty", b""), &["d3plot", "empty"]);
    refused_by_all(&file("letter", &b"Dear colleague,\nthe run is on the other server.\n".repeat(100)), &["text"]);
    refused_by_all(&file("noise", &noise(50_000)), &["not a d3plot"]);
    refused_by_all(&file("gzip", &[&[0x1f, 0x8b, 8, 0][..], &noise(5000)].concat()), &["gzip"]);
    refused_by_all(&testdata("lasso_femzip").join("d3plot.fz"), &["FEMZIP"]);
    refused_by_all(&place.path().join("nowhere"), &["nowhere"]);
    let folder = place.path().join("folder");
    std::fs::create_dir(&folder).unwrap();
    refused_by_all(&folder, &["folder"]);
    // a state file alone, or the folder of a family whose root is gone
    std::fs::copy(testdata("s01_shells_latin1").join("d3plot01"), folder.join("d3plot01")).unwrap();
    refused_by_all(&folder, &["folder"]);
}

#[test]
fn headers_that_no_such_file_can_have_are_refused_by_the_word() {
    let place = folder();
    let poked = |name: &str, word: usize, value: i32| -> PathBuf {
        Spoilt::copy_of("run_001", &place.path().join(name)).poke(word, value).folder().to_owned()
    };
    refused_by_all(&poked("many_nodes", 16, 100_000_000), &["NUMNP = 100000000 at byte 64"]);
    refused_by_all(&poked("more_nodes", 16, 20_000), &["node coordinates", "bytes expected", "left"]);
    refused_by_all(&poked("negative_nodes", 16, -5), &["NUMNP = -5 at byte 64"]);
    refused_by_all(&poked("negative_shells", 31, -5), &["NEL4 = -5 at byte 124"]);
    refused_by_all(&poked("many_numbers", 39, 1 << 30), &["NARBS = 1073741824"]);
    refused_by_all(&poked("negative_globals", 18, -1), &["NGLBV = -1"]);
    refused_by_all(&poked("packed", 15, 3), &["NDIM = 3"]);
    refused_by_all(&poked("other_file", 11, 4), &["file type 4 (intfor)"]);
}

#[test]
fn rigid_bodies_that_cannot_be_rebuilt_are_refused_by_name() {
    let place = folder();
    let family = place.path().join("family");
    world::copy(&testdata("x03_rigid_nodes"), &family);
    // the last of the nine words of the second body's rotation, in the last state
    let path = family.join("d3plot01");
    let mut bytes = std::fs::read(&path).unwrap();
    let at = 4 * (3 * 905 - 24 + 11);
    bytes[at..at + 4].copy_from_slice(&7.5_f32.to_le_bytes());
    std::fs::write(&path, bytes).unwrap();
    refused_by_all(&family, &["rigid bodies left out of the states (NDIM = 8)"]);
}

#[test]
fn members_of_two_runs_are_told() {
    let place = folder();
    let mixed = Spoilt::copy_of("run_001", &place.path().join("mixed"));
    // a member of a longer run that was here before: its time does not go on
    std::fs::copy(mixed.folder().join("d3plot01"), mixed.folder().join("d3plot09")).unwrap();
    let whole = crumple!["info", world::example_run("run_001"), "--json"].done().json();
    let told = crumple!["info", mixed.folder(), "--json"].done().json();
    let kinds: Vec<&str> = rows(&told["warnings"]).iter().map(|warning| warning["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["missing-members", "unread-tail"]);
    assert_eq!(told["times"], whole["times"]);
    let root = place.path().join("out/d3plot");
    let outcome = crumple!["convert", mixed.folder(), "-o", &root].done();
    assert!(outcome.stderr.contains("neither a later time nor an end mark"), "{}", outcome.stderr);
    assert_eq!(crumple!["info", &root, "--json"].done().json()["times"], whole["times"]);
    // another root among the members is no member
    std::fs::copy(mixed.folder().join("d3plot"), mixed.folder().join("d3plot09")).unwrap();
    crumple!["info", mixed.folder()]
        .refused(&["2 d3plot families in this folder (d3plot, d3plot09)"])
        .hints("name one");
    let told = crumple!["info", mixed.folder().join("d3plot"), "--json"].done().json();
    assert_eq!((&told["warnings"][0]["kind"], &told["times"]), (&"another-root".into(), &whole["times"]));
}

#[test]
fn words_that_are_no_numbers_are_counted_and_never_taken_for_ranges() {
    let place = folder();
    for (name, value) in [("nan", f32::NAN), ("infinite", f32::INFINITY), ("minus", f32::NEG_INFINITY)] {
        let spoilt = Spoilt::copy_of("run_001", &place.path().join(name)).move_node("d3plot01", 0, value);
        let told = crumple!["info", spoilt.folder(), "--ranges", "--json"].done().json();
        let first = &told["first_state"]["coordinates"];
        assert_eq!(first["not_finite"], 1, "{first}");
        assert!(["min", "max", "sum"].iter().all(|key| first[key][0].is_number()), "{first}");
        assert!(told["last_state"]["coordinates"]["not_finite"].is_null(), "none is not counted");
        // a copy keeps the word, an analysis refuses it by state and node
        let root = place.path().join(format!("{name}-out/d3plot"));
        crumple!["convert", spoilt.folder(), "-o", &root].done();
        let copied = crumple!["info", &root, "--ranges", "--json"].done().json();
        assert_eq!(copied["first_state"], told["first_state"]);
        let study = place.path().join("study");
        let [second, third] = ["run_002", "run_003"].map(world::example_run);
        crumple!["analyze", spoilt.folder(), second, third, "-o", &study].refused(&[name, "state 0", "node 1001"]);
    }
}

#[test]
fn a_run_that_is_still_being_written_gives_its_whole_states() {
    let place = folder();
    let growing = Spoilt::copy_of("run_001", &place.path().join("growing")).cut("d3plot01", 3 * 29_000);
    let told = crumple!["info", growing.folder(), "--json"].done().json();
    let warning = &rows(&told["warnings"])[0];
    assert_eq!(warning["kind"], "cut-state");
    assert!(warning["message"].as_str().unwrap().contains("words are missing"), "{warning}");
    let root = place.path().join("out/d3plot");
    assert_eq!(crumple!["convert", growing.folder(), "-o", &root, "--json"].done().json()["states"], told["states"]);
    assert_eq!(rows(&crumple!["info", &root, "--json"].done().json()["warnings"]).len(), 0);
}

#[test]
fn a_deck_that_includes_itself_is_refused_with_the_circle() {
    let place = folder();
    let deck = place.path().join("a.k");
    std::fs::write(&deck, "*KEYWORD\n*INCLUDE\nb.k\n*END\n").unwrap();
    std::fs::write(place.path().join("b.k"), "*KEYWORD\n*INCLUDE\na.k\n*END\n").unwrap();
    let says = ["b.k:3", "*INCLUDE of", "which is being read already"];
    crumple!["info", &deck].refused(&says);
    crumple!["init", place.path().join("study"), "--reference", &deck].refused(&says);
    crumple!["convert", &deck, "-o", place.path().join("out/d3plot")].refused(&says);
    let run = world::example_run("run_001");
    crumple!["init", place.path().join("study"), "--reference", run, "--deck", &deck].refused(&says);
}
