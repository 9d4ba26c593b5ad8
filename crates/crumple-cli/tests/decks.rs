//! Keyword decks on the command line: what they hold, as the reference, beside a result file, and what is no deck.

#[macro_use]
mod world;

use std::path::PathBuf;

use world::{DOZEN, example, example_run, folder, number};

fn deck() -> PathBuf {
    example().join("decks/run_001.k")
}

#[test]
fn info_of_a_deck() {
    let told = crumple!["info", deck(), "--json"].done().json();
    assert_eq!(
        (&told["format"], &told["nodes"], &told["elements"]["shells"]),
        (&"keyword deck".into(), &1862.into(), &1728.into())
    );
    assert_eq!(told["connections"]["CONSTRAINED_NODAL_RIGID_BODY"], 44);
    assert_eq!((&told["parts"][2]["title"], &told["parts"][2]["shells"]), (&"HAT_NOTCH".into(), &16.into()));
    assert_eq!(told["parts"][0]["thickness"], 4.14);
    assert_eq!(told["skipped"]["CONTROL_TIMESTEP"]["blocks"], 1);
    let words = crumple!["info", deck()].done().stdout;
    for part in
        ["keyword deck, 1 files", "44 CONSTRAINED_NODAL_RIGID_BODY", "BASE_PLATE_NOTCH", "1 RIGIDWALL_PLANAR_MOVING"]
    {
        assert!(words.contains(part), "{part} in {words}");
    }
}

#[test]
fn a_deck_as_the_reference_and_beside_it_are_one_study() {
    let place = folder();
    let (own, beside) = (place.path().join("own"), place.path().join("beside"));
    let made = crumple!["init", &own, "--reference", deck(), "--join", "deck", "-K", "40", "--json"].done().json();
    assert_eq!((&made["join"], &made["null_space"], &made["joined_pairs"]), (&"deck".into(), &1.into(), &44.into()));
    assert_eq!(made["joints"]["sources"]["CONSTRAINED_NODAL_RIGID_BODY"]["used"], 44);
    let run = example_run("run_001");
    let same = crumple!["init", &beside, "--reference", &run, "--deck", deck(), "--join", "deck", "-K", "40", "--json"]
        .done()
        .json();
    assert_eq!((&made["parts"], &made["joined_pairs"]), (&same["parts"], &same["joined_pairs"]));
    let relative = number(&made["eigenvalue_max"]) / number(&same["eigenvalue_max"]) - 1.0;
    assert!(relative.abs() < 1e-6, "{relative}: the result file has its coordinates in single precision");
    for study in [&own, &beside] {
        crumple!["add", study, example_run("run_003"), example_run("run_007")].done();
        assert_eq!(crumple!["check", study, "--json"].done().json()["whole"], true);
        let told = crumple!["info", study].done().stdout;
        assert!(told.contains("joined by the deck's welds and ties"), "{told}");
    }
}

#[test]
fn analyze_by_welds_twice() {
    let place = folder();
    let study = place.path().join("study");
    let analyze = || {
        let mut command = world::program();
        command.arg("analyze").args(DOZEN.map(example_run)).args(["--join", "deck", "-K", "60", "-o"]).arg(&study);
        command
    };
    let mut first = analyze();
    first.arg("--deck").arg(deck());
    world::finish(first).done();
    // The study knows its deck.
    world::finish(analyze()).done();
    let page = std::fs::read_to_string(study.join("report.html")).unwrap();
    assert!(page.contains("joined to one piece by 44 ties of the deck"));
    let other = crumple!["analyze", example_run("run_001"), "--join", "2.5", "-K", "60", "-o", &study]
        .refused(&["another join"]);
    assert_eq!(other.code, Some(2));
}

#[test]
fn what_is_no_deck_is_refused_with_a_word() {
    let place = folder();
    let path = |name: &str| place.path().join(name);
    let noise: Vec<u8> = (0..5000u32).map(|at| (at.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    let files: [(&str, &[u8], &str); 7] = [
        ("empty.k", b"", "the file is empty"),
        ("text.k", b"Dear all,\nthe deck is in the attachment.\n", "not a keyword deck"),
        ("noise.k", &noise, "not a keyword deck"),
        ("self.k", b"*KEYWORD\n*INCLUDE\nself.k\n", "which is being read already"),
        ("number.k", b"*NODE\n       1             nan             0.0             0.0\n", "a finite number was expected, 'nan' is there"),
        ("packed.k", &[0x1f, 0x8b, 8, 0, 1, 2, 3], "compressed with gzip"),
        ("nowhere.k", b"*KEYWORD\n*PARAMETER\nR a             1.0\n*NODE\n       1              &b             0.0             0.0\n", "'&b' has no definition"),
    ];
    for (name, bytes, word) in files {
        std::fs::write(path(name), bytes).unwrap();
        for command in
            [vec!["info".into(), path(name)], vec!["init".into(), path("study"), "--reference".into(), path(name)]]
        {
            let mut program = world::program();
            program.args(&command);
            let outcome = world::finish(program).refused(&[word, name]);
            assert_eq!(outcome.code, Some(2));
        }
        assert!(!path("study").exists());
    }
    std::fs::create_dir(path("folder.k")).unwrap();
    crumple!["init", path("study"), "--reference", example_run("run_001"), "--deck", path("folder.k")]
        .refused(&["a folder, a keyword deck was expected"]);
    crumple!["init", path("study"), "--reference", example_run("run_001"), "--deck", path("none.k")]
        .refused(&["no such file"]);
    crumple!["init", path("study"), "--reference", example_run("run_001"), "--join", "deck"]
        .refused(&["is no keyword deck, and none was given", "--deck FILE"]);
    crumple!["init", path("study"), "--reference", example_run("run_001"), "--join", "welds"]
        .refused(&["the word deck"]);
    // A deck without a shell has no surface; a missing include is said, with the places searched.
    std::fs::write(path("missing.k"), "*KEYWORD\n*INCLUDE\nmesh/part.k\n*END\n").unwrap();
    let told = crumple!["info", path("missing.k")].done().stdout;
    assert!(told.contains("missing.k:3: the included file 'mesh/part.k' is not there; searched: "), "{told}");
    crumple!["init", path("study"), "--reference", path("missing.k")].refused(&["no shell elements"]);
}
