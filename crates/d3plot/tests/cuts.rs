//! A family for every feature, its root and its first and last members cut after every word: what is left is an error, or the
//! same mesh and some of the same states.

mod shared;

use std::path::PathBuf;

use d3plot::{Family, Precision};

use shared::testdata;

type Files = Vec<(PathBuf, Vec<u8>)>;

/// Every family that can be read, with its files.
fn families() -> Vec<(Family, Files)> {
    let mut families = Vec::new();
    for entry in std::fs::read_dir(testdata()).unwrap() {
        let folder = entry.unwrap().path();
        let Ok(family) = Family::open(&folder) else { continue };
        let read = |path: &PathBuf| (path.clone(), std::fs::read(path).unwrap());
        let files = family.members().iter().map(|member| read(&member.path)).collect();
        families.push((family, files));
    }
    assert!(families.len() >= 26);
    families
}

#[test]
fn a_family_cut_after_any_word_is_refused_or_read_in_part() {
    for (whole, files) in families() {
        let word = if whole.header().precision == Precision::Double { 8 } else { 4 };
        let mut members = vec![0, 1, files.len() - 1];
        members.retain(|member| *member < files.len());
        members.dedup();
        for member in members {
            for length in (0..files[member].1.len()).step_by(word) {
                let mut cut = files.clone();
                cut[member].1.truncate(length);
                let Ok(family) = Family::of_bytes(cut) else { continue };
                check(&whole, &family, &format!("{} cut at {length}", files[member].0.display()));
            }
        }
    }
}

fn check(whole: &Family, family: &Family, what: &str) {
    assert_eq!(family.geometry(), whole.geometry(), "{what}");
    let mut from = 0;
    for (state, time) in family.times().iter().enumerate() {
        let same = whole.times()[from..].iter().position(|other| other == time);
        let same = from + same.unwrap_or_else(|| panic!("{what}: a state at {time} that is not there"));
        from = same + 1;
        // one node tells whether the state is where it was
        let position = |family: &Family, state: usize| {
            let mut values: Vec<f64> = Vec::new();
            family.values_into(state, "coordinates", d3plot::Rows::These(&[0]), &mut values).unwrap();
            values.into_iter().map(f64::to_bits).collect::<Vec<u64>>()
        };
        assert_eq!(position(family, state), position(whole, same), "{what}, time {time}");
    }
}
