//! Every refusal says what is wrong, where, what was expected, and what to do.

mod shared;

use std::path::{Path, PathBuf};

use d3plot::{Error, Family, FileType, Layers, LooksLike, roots};

use shared::{Copy, testdata};

/// The error of opening `path`, its words with the folder taken out, and its remedy.
fn refusal(path: &Path) -> (Error, String, String) {
    let error = Family::open(path).expect_err("a refusal");
    let folder = if path.is_dir() { path } else { path.parent().unwrap() };
    let words = error.to_string().replace(&format!("{}/", folder.display()), "");
    let remedy = error.remedy().unwrap_or_default();
    (error, words, remedy)
}

fn file_of(bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("d3plot");
    std::fs::write(&path, bytes).unwrap();
    (folder, path)
}

#[test]
fn nothing_there() {
    let (error, words, _) = refusal(&testdata().join("no-such-file"));
    assert!(matches!(error, Error::NotFound { .. }));
    assert!(words.ends_with("no-such-file: no such file or folder"));
}

#[test]
fn folders_without_a_family_and_with_several() {
    let folder = tempfile::tempdir().unwrap();
    let (error, ..) = refusal(folder.path());
    assert!(matches!(error, Error::NoFamily { .. }), "{error}");

    let copy = Copy::of("s12_node_deletion");
    std::fs::copy(copy.root(), copy.path("other.ptf")).unwrap();
    let (error, words, remedy) = refusal(copy.folder());
    assert!(matches!(error, Error::SeveralFamilies { .. }));
    assert!(words.contains("2 d3plot families in this folder (d3plot, other.ptf), one was expected"), "{words}");
    assert!(remedy.starts_with("name one of the root files"));
}

#[test]
fn a_d3part_beside_a_d3plot_does_not_make_a_folder_ambiguous() {
    let copy = Copy::of("s12_node_deletion");
    let root = copy.read("d3plot");
    copy.poke(&[(11, 5)]);
    std::fs::rename(copy.root(), copy.path("d3part")).unwrap();
    copy.write("d3plot", &root);
    assert_eq!(Family::open(copy.folder()).unwrap().root(), copy.root());
    assert_eq!(Family::open(&copy.path("d3part")).unwrap().header().file_type, FileType::D3part);
}

#[test]
fn a_folder_whose_only_d3plot_is_broken_says_why() {
    let (folder, _) = file_of(b"");
    assert!(matches!(refusal(folder.path()).0, Error::Empty { .. }));
    std::fs::write(folder.path().join("d3plot"), [0x1f, 0x8b, 8, 0]).unwrap();
    assert!(matches!(refusal(folder.path()).0, Error::NotD3plot { looks: LooksLike::Gzip, .. }));
}

#[test]
fn other_files_are_told_by_what_they_look_like() {
    let lsda: &[u8] = &[8, 8, 8, 1, 1, 1, 0, 0, 11, 0, 0, 0, 0, 0, 0, 0];
    let noise: Vec<u8> = (0..4096_u32).map(|k| (k.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    let cases: [(&[u8], LooksLike); 9] = [
        (b"\x1f\x8b\x08\0\0\0\0\0", LooksLike::Gzip),
        (b"PK\x03\x04\x14\0\0\0", LooksLike::Zip),
        (lsda, LooksLike::Lsda),
        (b"$# made by a pre-processor\n*KEYWORD\n*TITLE\nbeam\n", LooksLike::Deck),
        (b" Livermore Software Technology Corporation\n LS-DYNA, A Program for ...\n", LooksLike::Listing),
        (b"time,energy\n0,1\n1,2\n", LooksLike::Text),
        (&[0; 4096], LooksLike::Zeros),
        (&noise, LooksLike::Unknown),
        (&noise[..100], LooksLike::TooShort),
    ];
    for (bytes, expected) in cases {
        let (_folder, path) = file_of(bytes);
        let (error, words, remedy) = refusal(&path);
        assert!(matches!(error, Error::NotD3plot { looks, .. } if looks == expected), "{expected:?}: {error}");
        assert!(words.starts_with("d3plot: not a d3plot: "), "{words}");
        assert!(!remedy.is_empty());
    }
}

#[test]
fn an_empty_file() {
    let (_folder, path) = file_of(b"");
    let (error, words, _) = refusal(&path);
    assert!(matches!(error, Error::Empty { .. }));
    assert_eq!(words, "d3plot: the file is empty, a d3plot root of at least 256 bytes was expected");
}

#[test]
fn a_state_file_names_its_root() {
    let (error, words, remedy) = refusal(&testdata().join("s04_gaps_in_numbers/d3plot100"));
    assert!(matches!(error, Error::NotRoot { .. }));
    assert_eq!(words, "d3plot100: a state file of the family d3plot, not its root");
    assert!(remedy.ends_with("s04_gaps_in_numbers/d3plot"));
}

#[test]
fn femzip_by_name() {
    let (error, words, remedy) = refusal(&testdata().join("lasso_femzip/d3plot.fz"));
    assert!(matches!(error, Error::Femzip { .. }));
    assert_eq!(words, "d3plot.fz: FEMZIP-compressed, only the closed FEMZIP library can read it");
    assert_eq!(remedy, "expand it with FEMZIP first");
}

#[test]
fn other_databases_by_number_and_name() {
    let copy = Copy::of("s12_node_deletion");
    for (number, name) in [(4, "intfor"), (3, "d3thdt"), (1024, "d3rms"), (77, "unknown")] {
        copy.poke(&[(11, number)]);
        let (error, words, _) = refusal(&copy.root());
        assert!(matches!(error, Error::FileType { .. }), "{error}");
        let number = number % 1000;
        assert!(words.starts_with(&format!("d3plot: file type {number} ({name}) at byte 44, d3plot (1)")), "{words}");
    }
}

#[test]
fn unsupported_content_by_name() {
    for (word, value, told) in
        [(15, 3, "NDIM = 3"), (54, 10_001_001, "NPEFG = 10001001"), (48, 67_108_864, "NCFDV1 = 67108864")]
    {
        let copy = Copy::of("s12_node_deletion");
        copy.poke(&[(word, value)]);
        let (error, words, _) = refusal(&copy.root());
        assert!(matches!(error, Error::Unsupported { .. }));
        assert!(words.contains(told), "{words}");
    }
}

#[test]
fn a_cut_geometry_names_the_section_and_the_bytes() {
    let (error, words, remedy) = refusal(&testdata().join("s13_cut_in_geometry/d3plot"));
    // behind 64 words of control block and 42 nodes of 3 stand the 30 shells of 5; the file has 300 words
    assert!(matches!(error, Error::Truncated { section: "shells", .. }), "{error:?}");
    assert_eq!(words, "d3plot: shells at byte 760: 600 bytes expected, 440 left in the file");
    assert_eq!(remedy, "no state can be read without it; copy the file again");
}

#[test]
fn counts_that_no_file_of_this_size_can_hold() {
    for (word, name) in
        [(16, "NUMNP"), (31, "NEL4"), (39, "NARBS"), (28, "NEL2"), (40, "NELT"), (37, "NMSPH"), (57, "EXTRA")]
    {
        for value in [-5, 1_000_000_000] {
            let copy = Copy::of("s12_node_deletion");
            copy.poke(&[(word, value)]);
            let (error, words, _) = refusal(&copy.root());
            assert!(matches!(error, Error::Count { .. }), "{error}");
            assert!(words.contains(&format!("{name} = {value} at byte {}", word * 4)), "{words}");
        }
    }
}

#[test]
fn reduced_output_is_refused_where_the_end_marks_contradict() {
    let copy = Copy::of("x02_reduced_output");
    let family = Family::open(&copy.root()).unwrap();
    assert_eq!(family.times().len(), 2);
    // one word less in each shell than the states have: the second time is not where it should be
    copy.poke(&[(33, copy.word(33) - 1)]);
    let (error, words, _) = refusal(&copy.root());
    assert!(matches!(error, Error::Unsupported { .. }), "{error}");
    assert!(words.contains("reduced output (INUM < 0)"), "{words}");
}

#[test]
fn connectivity_beyond_the_nodes_names_the_element() {
    let copy = Copy::of("s12_node_deletion");
    let nodes = Family::open(&copy.root()).unwrap().header().nodes;
    // the second node of shell 3
    copy.poke(&[(64 + 3 * nodes + 3 * 5 + 1, nodes as i32 + 1)]);
    let (error, words, _) = refusal(&copy.root());
    assert!(matches!(error, Error::Geometry { section: "shells", .. }), "{error}");
    assert!(words.contains("for element 3 (counted from 0) found, nodes from 1 to 28"), "{words}");
}

#[test]
fn states_and_layers_that_are_not_there() {
    let family = Family::open(&testdata().join("s11_gbk_garbage")).unwrap();
    let states = family.times().len();
    let error = family.coordinates(states).unwrap_err();
    assert!(matches!(error, Error::NoSuchState { .. }));
    assert_eq!(error.remedy().unwrap(), format!("ask for a state from 0 to {}", states - 1));
    // two layers: which is which the format does not say
    let error = family.shell_plastic_strain(0, Layers::Outer).unwrap_err();
    assert!(matches!(error, Error::Layer { layers: 2, .. }));
    assert!(family.shell_plastic_strain(0, Layers::Max).unwrap().is_some());
}

#[test]
fn roots_are_found_by_content_and_broken_d3plots_are_named() {
    let copy = Copy::of("x08_adaptive");
    let root = copy.read("d3plot");
    copy.write("a strange name", &root);
    copy.write("run.d3plot", b"");
    copy.write("copy.ptf", b"*KEYWORD\n*END\n");
    copy.write("notes.txt", b"just text");
    std::fs::copy(testdata().join("lasso_femzip/d3plot.fz"), copy.path("zipped")).unwrap();
    let found = roots(copy.folder()).unwrap();
    let names = |paths: Vec<&Path>| -> Vec<String> {
        paths.iter().map(|path| path.file_name().unwrap().to_str().unwrap().to_owned()).collect()
    };
    assert_eq!(names(found.families.iter().map(|root| root.path.as_path()).collect()), ["a strange name", "d3plot"]);
    assert_eq!(names(found.levels.iter().map(|root| root.path.as_path()).collect()), ["d3plotaa"]);
    assert_eq!(found.families[1].title, "synthetic family");
    assert_eq!(
        names(found.refused.iter().map(|refused| refused.path.as_path()).collect()),
        ["copy.ptf", "run.d3plot", "zipped"]
    );
    assert!(matches!(found.refused[0].error, Error::NotD3plot { looks: LooksLike::Deck, .. }));
    assert!(matches!(found.refused[1].error, Error::Empty { .. }));
    assert!(matches!(found.refused[2].error, Error::Femzip { .. }));
    assert!(matches!(roots(&copy.path("nowhere")), Err(Error::NotFound { .. })));
}
