//! Any bytes as a deck and its includes: byte 1 ends a file; the files are `a.k`, `b.k`, `c.k`, ….
//!
//! `cargo +nightly fuzz run deck -- -max_len=4096 -rss_limit_mb=512 -timeout=10`
#![no_main]

use std::path::{Path, PathBuf};

use keyword_deck::{Deck, Memory, Resolver};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let names = ('a'..='h').map(|name| PathBuf::from(format!("{name}.k")));
    let files = Memory(names.zip(bytes.split(|byte| *byte == 1)).map(|(name, file)| (name, file.to_vec())).collect());
    let Ok(deck) = Deck::read_from(&files, Path::new("a.k")) else { return };
    assert_eq!(deck.node_ids.len(), deck.coordinates.len());
    let mut resolver = Resolver::new(&deck);
    for set in &deck.sets {
        resolver.ids(set.kind, set.id);
    }
    for surface in deck.ties.iter().flat_map(|tie| tie.surfaces) {
        resolver.nodes(surface);
        resolver.faces(surface);
    }
    for part in deck.part_table() {
        resolver.material(part.id);
        resolver.formulation(part.id);
    }
    for shell in 0..deck.shells.len() {
        resolver.shell_thickness(shell);
    }
    let _ = deck.warnings.iter().map(ToString::to_string).collect::<String>();
});
