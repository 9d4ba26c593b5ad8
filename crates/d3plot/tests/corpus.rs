//! The corpus of the fuzz targets, by the targets themselves: no panic, and no more memory than is promised.

// the only test of this program: the targets count its memory
#[allow(unsafe_code, unreachable_pub)]
#[path = "../../../fuzz/src/lib.rs"]
mod fuzz;

use std::path::Path;

type Target = fn(&[u8]);

#[test]
fn the_corpus_of_the_fuzz_targets_gives_answers() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus");
    let targets: [(&str, Target); 4] =
        [("family", fuzz::family), ("header", fuzz::header), ("geometry", fuzz::geometry), ("state", fuzz::state)];
    for (name, target) in targets {
        let mut seen = 0;
        for entry in std::fs::read_dir(corpus.join(name)).unwrap() {
            target(&std::fs::read(entry.unwrap().path()).unwrap());
            seen += 1;
        }
        assert!(seen >= 10, "{name}: {seen}");
    }
}
