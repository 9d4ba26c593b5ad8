//! Decks of others, with the counts that `count_deck.py` found in them.

use std::path::{Path, PathBuf};

use keyword_deck::{Deck, Warning};

fn folder() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/keyword");
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: ../shared is not there");
    None
}

/// The deck in the numbers of the counts; `follow`: with its includes.
fn counted(deck: &Deck) -> [usize; 8] {
    let triangles = deck.shells.iter().filter(|shell| shell.nodes[3] == 0 || shell.nodes[3] == shell.nodes[2]).count();
    let others = deck.other_elements.iter().filter(|(kind, _)| *kind != "SPH").map(|(_, count)| count).sum();
    [
        deck.node_ids.len(),
        deck.shells.len(),
        triangles,
        deck.solids.len(),
        deck.thick_shells.len(),
        deck.beams.len(),
        deck.other_elements.get("SPH").copied().unwrap_or(0),
        others,
    ]
}

#[test]
fn every_deck_counts_as_it_was_counted() {
    let Some(folder) = folder() else { return };
    let counts: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.join("counts.json")).unwrap()).unwrap();
    let mut seen = 0;
    for (name, expected) in counts.as_object().unwrap() {
        let with_includes = name.ends_with(" (with includes)");
        if !with_includes && counts.get(format!("{name} (with includes)")).is_some() {
            continue;
        }
        let path = folder.join(name.trim_end_matches(" (with includes)"));
        let deck = Deck::read(&path).unwrap_or_else(|error| panic!("{name}: {error}"));
        let keys = ["nodes", "shells", "shells_tri", "solids", "tshells", "beams", "sph", "others"];
        let expected_counts: Vec<usize> = keys.iter().map(|key| expected[key].as_u64().unwrap() as usize).collect();
        assert_eq!(counted(&deck)[..], expected_counts[..], "{name}: {keys:?}");
        let parts: Vec<u64> = deck.parts.iter().map(|part| part.id).collect();
        let expected_parts: Vec<u64> = serde_json::from_value(expected["part_ids"].clone()).unwrap();
        assert_eq!(parts, expected_parts, "{name}");
        let ends = |ids: &[u64]| (ids.iter().min().copied(), ids.iter().max().copied());
        let expected_ends = (expected["node_id_min"].as_u64(), expected["node_id_max"].as_u64());
        assert_eq!(ends(&deck.node_ids), expected_ends, "{name}");
        let missing: Vec<&str> = deck
            .warnings
            .iter()
            .filter_map(|warning| match warning {
                Warning::MissingInclude { name, .. } => Some(name.as_str()),
                _ => None,
            })
            .collect();
        let expected_missing: Vec<&str> =
            expected["missing_includes"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
        assert_eq!(missing, expected_missing, "{name}");
        // Every keyword of the deck is read, or skipped and counted.
        let keywords = expected["keywords"].as_object().unwrap();
        for (keyword, skipped) in &deck.skipped {
            assert_eq!(
                keywords.get(keyword).and_then(serde_json::Value::as_u64),
                Some(skipped.blocks),
                "{name}: {keyword}"
            );
        }
        println!("{name}: {} warnings, skipped {:?}", deck.warnings.len(), deck.skipped.keys());
        for warning in &deck.warnings {
            println!("   {warning}");
        }
        seen += 1;
    }
    assert!(seen >= 15);
}
