//! Law of the layout: who asks for ten of 500 eigenvectors reads the bytes of ten.
//!
//! Measured where the system counts the bytes that this process reads (Linux); alone in its file, so that no other test
//! of the process is counted.

mod world;

use crumple::descriptor::{DescribeOptions, Threshold, describe};
use crumple::select::Kind;
use crumple::similarity::{SimilarityOptions, search, search_best};
use crumple::study::{AddOptions, Loaded, Rows};
use crumple::target::Named;
use world::{Model, World, bend};

/// Bytes that this process has read.
fn bytes_read() -> Option<u64> {
    let counts = std::fs::read_to_string("/proc/self/io").ok()?;
    counts.lines().find_map(|line| line.strip_prefix("rchar: "))?.parse().ok()
}

#[test]
fn ten_of_five_hundred_eigenvectors_cost_little_more_than_their_share() {
    if bytes_read().is_none() {
        println!("skipped: this system does not count the bytes read");
        return;
    }
    let world = World::new();
    let model = Model::plate(29, 16, 290.0, 123.0);
    for run in 0..12 {
        let turn = 0.1 * f64::from(run + 1);
        world.write(&format!("run_{run:02}"), &model.family(60, move |t, p| bend(290.0, turn * t)(p)));
    }
    let mut study = world.empty_study("study", "run_00", 500);
    study.add(&world.found(), AddOptions::default(), &()).unwrap();
    let part = std::fs::read_dir(world.path("study/coefficients"))
        .unwrap()
        .map(|entry| entry.unwrap().metadata().unwrap().len())
        .sum::<u64>();
    let cost = |eigenvectors: Option<&[usize]>| {
        let before = bytes_read().unwrap();
        let rows = study.coefficients(eigenvectors, Rows::All).unwrap();
        assert_eq!(rows.rows(), 720);
        // Reading the counter itself is a few hundred bytes.
        bytes_read().unwrap() - before
    };
    let all = cost(None);
    let ten = cost(Some(&[1, 2, 3, 50, 51, 120, 200, 333, 444, 500]));
    // All: at least the 720 × 1500 numbers. Ten: 2 % of them, the table of contents (some 100 bytes for each of 3000
    // columns in each of two row groups: last states, and the others), and what a buffered reader takes too much at each
    // of 33 columns (8 KB) in each.
    assert!(all >= 720 * 1500 * 4, "{all} bytes hold all coefficients");
    let allowed = (10 * 3 * 720 * 4) + 2 * (3_100 * 150 + 33 * 8192);
    assert!(ten <= allowed, "ten eigenvectors cost {ten} bytes, all cost {all}, the study has {part}");
    assert!(ten * 5 < all, "ten eigenvectors cost {ten} bytes, all 500 cost {all}");

    // The same of a search, from opening the study on: beside its own ten eigenvectors it reads manifest, mesh and basis.
    let options = DescribeOptions { kind: Kind::Paper, threshold: Threshold::Top(10), ..DescribeOptions::default() };
    let loaded = Loaded::of(study).unwrap();
    let descriptor = describe(&loaded, &Named::parse("run_03"), None, Some("d"), &options).unwrap().descriptor;
    let before = bytes_read().unwrap();
    let opened = Loaded::open(&world.path("study")).unwrap();
    let found = search_best(&opened, &descriptor, SimilarityOptions::default(), Rows::All, 5).unwrap();
    let searched = bytes_read().unwrap() - before;
    let size = |name: &str| world.path("study").join(name).metadata().unwrap().len();
    let study_itself = size("manifest.json") + size("mesh.vtu") + size("basis.safetensors") + 4096;
    assert!(searched <= allowed + study_itself, "{searched} bytes for a search, {ten} for its coefficients alone");
    // The best five are the first of all.
    assert_eq!((found.searched, found.hits.len()), (720, 5));
    let every = search(&opened, &descriptor, SimilarityOptions::default(), Rows::All).unwrap();
    assert_eq!(found.hits, every[..5]);
    assert_eq!((every.len(), every[0].score.similarity), (720, 1.0));
}
