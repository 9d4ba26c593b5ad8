//! Whatever is given: a deck, or one clear error; never a panic.

use std::path::{Path, PathBuf};

use keyword_deck::{Deck, Error, Memory};
use proptest::prelude::*;

fn read(bytes: &[u8]) -> Result<Deck, Error> {
    // An include of the deck's own makes the walk through files part of every test.
    let other = b"*NODE\n       9             1.0             1.0             1.0\n*INCLUDE\na.k\n".to_vec();
    let files = Memory([(PathBuf::from("a.k"), bytes.to_vec()), (PathBuf::from("other.k"), other)].into());
    Deck::read_from(&files, Path::new("a.k"))
}

fn words(bytes: &[u8]) -> String {
    let error = read(bytes).unwrap_err();
    assert!(error.remedy().is_none_or(|remedy| !remedy.is_empty()));
    error.to_string()
}

#[test]
fn what_is_no_deck_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    assert!(matches!(Deck::read(folder.path()), Err(Error::Folder { .. })));
    assert!(matches!(Deck::read(&folder.path().join("none.k")), Err(Error::NotFound { .. })));
    assert!(matches!(read(b""), Err(Error::Empty { .. })));
    assert!(words(b"Dear all,\n* please read\n* this\n").contains("'Dear all,' is there"));
    assert!(words(b"*Important* notes\n").contains("'*Important* notes' is there"));
    assert!(words(b"$ comments\n\n\n").contains("not a keyword deck"));
    assert!(words(b"\x7fELF\x02\x01\x00\x00\n*NODE\n").contains("not a keyword deck"));
    assert!(words(&[0x1f, 0x8b, 8, 0, 0]).contains("gzip"));
    assert!(words(&[0xff, 0xfe, b'*', 0]).contains("UTF-16"));
    assert!(words(&vec![b'x'; 2 << 20]).contains("not a keyword deck"));
    assert!(words(&[&b"*NODE\n"[..], &vec![b'1'; 2 << 20]].concat()).contains("no deck has such lines"));
}

#[test]
fn circles_of_includes_are_one_error() {
    assert_eq!(words(b"*KEYWORD\n*INCLUDE\na.k\n"), "a.k:3: *INCLUDE of a.k, which is being read already: a.k → a.k");
    assert_eq!(
        words(b"*KEYWORD\n*INCLUDE\nother.k\n"),
        "other.k:4: *INCLUDE of a.k, which is being read already: a.k → other.k → a.k"
    );
    // No circle, but far too many: each level includes the next one ten times.
    let level = |next: usize| format!("*INCLUDE\n{}", format!("level{next}.k\n").repeat(10)).into_bytes();
    let files = Memory((0..30).map(|at| (PathBuf::from(format!("level{at}.k")), level(at + 1))).collect());
    let error = Deck::read_from(&files, Path::new("level0.k")).unwrap_err();
    assert!(matches!(error, Error::TooManyIncludes { .. }), "{error}");
}

#[test]
fn cards_of_the_mesh_that_are_wrong_are_named() {
    assert_eq!(
        words(b"*NODE\n       1             nan             0.0             0.0\n"),
        "a.k:2: *NODE, X: a finite number was expected, 'nan' is there"
    );
    assert!(words(b"*NODE\n       1,1e999,0,0\n").contains("'1e999' is there"));
    assert!(words(b"*NODE\n      -1             1.0             0.0             0.0\n").contains("from 0"));
    assert!(
        words(b"*ELEMENT_SHELL\n       1       1       1       2    here       4\n")
            .contains("a.k:2: *ELEMENT_SHELL, N:")
    );
    assert!(
        words(b"*ELEMENT_SOLID\n       1       1\n*END\n").contains("the card with the solid's nodes was expected")
    );
    assert!(
        words(b"*ELEMENT_SHELL_THICKNESS\n       1       1       1       2       3       4\n").contains("thicknesses")
    );
    let missing = read(b"*ELEMENT_SHELL\n       5       1       1       2       3       4\n").unwrap();
    assert_eq!(missing.warnings[0].kind(), "nodes-missing");
    let twice = read(b"*NODE\n       1             1.0             0.0             0.0\n       1             2.0             0.0             0.0\n").unwrap();
    assert_eq!((twice.coordinates.len(), twice.warnings[0].kind()), (1, "defined-twice"));
    // What the mesh does not need costs itself and a warning.
    let set = read(b"*SET_NODE_LIST\n         x\n*PART\nlid\n       bad\n*SECTION_SHELL\n         1\n").unwrap();
    let kinds: Vec<&str> = set.warnings.iter().map(|warning| warning.kind()).collect();
    assert_eq!(kinds, ["bad-card"; 3]);
}

/// A deck with a bit of everything.
const SAMPLE: &str = "*KEYWORD\n*PARAMETER\nR t            1.5\n*PARAMETER_EXPRESSION\nR u       t*2\n*PART\nlid\n         1         1         1\n*SECTION_SHELL\n         1         2\n        &t\n*NODE\n       1             0.0             0.0              &u\n       2             1.0             0.0             0.0\n       3,0,1,<&t+1>\n*ELEMENT_SHELL_THICKNESS\n       1       1       1       2       3       3\n             1.0             1.0             1.0             1.0\n*ELEMENT_SOLID\n       2       1\n       1       2       3       3       3       3       3       3\n*SET_NODE_LIST_GENERATE\n         1\n         1         3\n*CONSTRAINED_NODAL_RIGID_BODY\n         1         0         1\n*CONTACT_TIED_NODES_TO_SURFACE_ID\n         1tie\n         1         1         4         3\n*DEFINE_TRANSFORMATION\n         1\nROTATE           0.0       0.0       1.0       0.0       0.0       0.0      90.0\n*INCLUDE_TRANSFORM\ngone.k\n         1\n\n\n         1\n*SET_NODE_GENERAL\n         2\nPART               1\n*END\n";

#[test]
fn a_deck_cut_or_spoilt_at_any_byte_gives_an_answer() {
    let whole = SAMPLE.as_bytes();
    assert!(read(whole).is_ok());
    for end in 0..whole.len() {
        let _ = read(&whole[..end]);
    }
    for at in 0..whole.len() {
        for byte in [b' ', b'9', b'-', b'*', b'&', b'<', b',', b'\n', b'\r', b'$', 0, 0xff] {
            let mut spoilt = whole.to_vec();
            spoilt[at] = byte;
            let _ = read(&spoilt).map(|deck| {
                let mut resolver = keyword_deck::Resolver::new(&deck);
                deck.ties.iter().flat_map(|tie| tie.surfaces).for_each(|surface| {
                    let _ = (resolver.nodes(surface), resolver.faces(surface));
                });
            });
        }
    }
}

#[test]
fn the_corpus_of_the_fuzz_target_gives_answers() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus/deck");
    let mut seen = 0;
    for entry in std::fs::read_dir(corpus).unwrap() {
        let bytes = std::fs::read(entry.unwrap().path()).unwrap();
        let names = ('a'..='h').map(|name| PathBuf::from(format!("{name}.k")));
        let files = names.zip(bytes.split(|byte| *byte == 1)).map(|(name, file)| (name, file.to_vec())).collect();
        let _ = Deck::read_from(&Memory(files), Path::new("a.k"));
        seen += 1;
    }
    assert!(seen >= 4);
}

fn line() -> impl Strategy<Value = String> {
    prop_oneof![
        "[*](NODE|ELEMENT_(SHELL|SOLID|BEAM|TSHELL|SPH)(_(THICKNESS|COMPOSITE|OFFSET|ORTHO|H20|PID|LONG)){0,2}|PART(_INERTIA|_COMPOSITE)?|SECTION_(SHELL|BEAM|TSHELL)(_TITLE)?|SET_(NODE|SEGMENT|PART|SHELL)(_LIST|_GENERAL|_ADD|_COLUMN|_GENERATE){0,2}(_TITLE)?|MAT_SPOTWELD|CONSTRAINED_(SPOTWELD|NODE_SET|NODAL_RIGID_BODY|RIVET)(_ID|_TITLE)?|CONTACT_TIED(_ID|_MPP)?|INCLUDE(_TRANSFORM|_PATH)?|PARAMETER(_EXPRESSION|_LOCAL|_DUPLICATION)?|DEFINE_TRANSFORMATION|TITLE|KEYWORD LONG=Y|KEYWORD I10=Y|END)[+%-]?",
        "([ ]{0,9}[0-9]{1,9}){0,10}",
        "([ ]{0,9}-?[0-9]{1,5}[.][0-9]{0,3}([eEdD]?[+-][0-9]{1,3})?){0,6}",
        "([&<]?[a-z0-9+*/(),.-]{0,8}>?,?){0,8}",
        "(PART|ALL|NODE|TRANSL|ROTATE|SCALE|MIRROR|POINT|R a|I b|C c)[ ]{0,8}[0-9. ]{0,40}",
        "\\PC{0,40}",
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_bytes(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
        let _ = read(&bytes);
        let _ = read(&[&b"*KEYWORD\n"[..], &bytes].concat());
    }

    #[test]
    fn any_soup_of_keywords_and_cards(lines in prop::collection::vec(line(), 0..60), end in "\r?\n") {
        let text = format!("*KEYWORD{end}{}", lines.join(&end));
        if let Ok(deck) = read(text.as_bytes()) {
            prop_assert_eq!(deck.node_ids.len(), deck.coordinates.len());
            prop_assert!(deck.coordinates.iter().flatten().all(|x| !x.is_nan()));
            let mut resolver = keyword_deck::Resolver::new(&deck);
            for set in &deck.sets {
                let _ = resolver.ids(set.kind, set.id);
            }
            for tie in &deck.ties {
                let _ = (resolver.nodes(tie.surfaces[0]), resolver.faces(tie.surfaces[1]));
            }
            // The same deck however its lines end.
            let other = if end == "\n" { "\r" } else { "\n" };
            let again = read(format!("*KEYWORD{other}{}", lines.join(other)).as_bytes()).unwrap();
            prop_assert_eq!(deck.shells, again.shells);
            prop_assert_eq!(deck.skipped, again.skipped);
        }
    }
}
