//! Law: a study whose files were cut, exchanged or edited gives an answer or an error that names the file; never a
//! panic, never numbers of another study.

mod world;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use crumple::descriptor::{self, DescribeOptions, Select, Threshold, describe};
use crumple::modes::{ModesOptions, load, modes, save};
use crumple::report::{describe_modes, findings};
use crumple::similarity::{SimilarityOptions, search};
use crumple::study::{Loaded, Rows, Study, check};
use crumple::target::Named;
use world::{Model, World, bend, described};

fn world() -> World {
    let world = World::new();
    for run in 0..4 {
        let angle = 0.5 * f64::from(run) + 0.2;
        world.write(
            &format!("run_{run}"),
            &Model::plate(4, 3, 40.0, 23.0).family(3, move |t, p| bend(40.0, angle * t)(p)),
        );
    }
    let loaded = world.study(8);
    save(&loaded.study, &modes(&loaded.study, &ModesOptions::default(), &()).unwrap()).unwrap();
    let made = described(&loaded, "run_1", Select::Coordinates, Threshold::Top(3)).descriptor;
    descriptor::save(&loaded.study, &made).unwrap();
    world
}

/// Everything a user can ask; the first error is the answer.
fn ask(folder: &Path) -> Result<(), crumple::Error> {
    let loaded = Loaded::open(folder)?;
    for name in descriptor::list(&loaded.study)? {
        let descriptor = descriptor::load(&loaded.study, &name)?;
        search(&loaded, &descriptor, SimilarityOptions::default(), Rows::All)?;
        let target = crumple::target::resolve(&loaded, &Named::parse("run_2"))?;
        crumple::reconstruct::reconstruct(
            &loaded.reference,
            &loaded.basis,
            descriptor.selected.select,
            &descriptor.selected.eigenvectors,
            &target.delta,
        );
    }
    describe(&loaded, &Named::parse("run_2"), None, None, &DescribeOptions::default())?;
    let made = load(&loaded.study)?;
    findings(&loaded, &made, &describe_modes(&loaded, &made, None, &())?)?;
    Ok(())
}

/// The question after a damage: answered, or refused; said without a panic.
fn answer(folder: &Path, damage: &str) -> Result<(), crumple::Error> {
    let answer = catch_unwind(AssertUnwindSafe(|| {
        let _ = check(folder);
        ask(folder)
    }));
    match answer {
        Ok(answer) => answer,
        Err(_) => panic!("{damage}: a panic where an error belongs"),
    }
}

fn part(folder: &Path) -> std::path::PathBuf {
    let parts = std::fs::read_dir(folder.join("coefficients")).unwrap().map(|entry| entry.unwrap().path());
    parts.filter(|path| path.extension().is_some_and(|end| end == "parquet")).last().unwrap()
}

#[test]
fn files_cut_short_are_errors() {
    let world = world();
    let folder = world.path("study");
    let files =
        ["manifest.json", "study.toml", "mesh.vtu", "basis.safetensors", "modes.parquet", "descriptors/run_1.json"];
    let files = files.map(|name| folder.join(name)).into_iter().chain([part(&folder)]);
    for file in files {
        let bytes = std::fs::read(&file).unwrap();
        // (The last per cent of a VTU file is its closing tags.)
        for share in [0, 1, 50, 90] {
            std::fs::write(&file, &bytes[..bytes.len() * share / 100]).unwrap();
            let damage = format!("{} cut to {share} %", file.display());
            assert!(answer(&folder, &damage).is_err(), "{damage}: as if nothing had happened");
        }
        std::fs::write(&file, &bytes).unwrap();
        std::fs::remove_file(&file).unwrap();
        let damage = format!("{} is gone", file.display());
        // A descriptor that is gone is one that was deleted.
        assert!(answer(&folder, &damage).is_err() || file.ends_with("run_1.json"), "{damage}");
        std::fs::write(&file, &bytes).unwrap();
    }
    answer(&folder, "nothing").unwrap();
}

#[test]
fn bytes_turned_over_never_panic() {
    let world = world();
    let folder = world.path("study");
    let names = ["mesh.vtu", "basis.safetensors", "modes.parquet", "manifest.json", "descriptors/run_1.json"];
    for file in names.map(|name| folder.join(name)).into_iter().chain([part(&folder)]) {
        let bytes = std::fs::read(&file).unwrap();
        // Places all over the file, and a head and a tail, where counts and offsets stand.
        let spread = (0..13).map(|at| at * bytes.len() / 13);
        let ends = (0..8).chain(bytes.len() - 9..bytes.len());
        for at in spread.chain(ends) {
            let mut damaged = bytes.clone();
            damaged[at] ^= 0xff;
            std::fs::write(&file, &damaged).unwrap();
            let _ = answer(&folder, &format!("{} with byte {at} turned over", file.display()));
        }
        std::fs::write(&file, &bytes).unwrap();
    }
}

#[test]
fn a_mesh_of_another_study_is_refused() {
    for (nx, ny) in [(3, 3), (6, 3)] {
        let world = world();
        world.write("other", &Model::plate(nx, ny, 40.0, 23.0).family(1, |_, p| p));
        world.empty_study("second", "other", 8);
        std::fs::copy(world.path("second/mesh.vtu"), world.path("study/mesh.vtu")).unwrap();
        assert!(answer(&world.path("study"), "mesh.vtu of another study").is_err());
    }
}

#[test]
fn a_basis_of_another_study_is_refused() {
    let world = world();
    // The same mesh, fewer eigenpairs: all sizes but K fit.
    world.empty_study("second", "run_0", 5);
    std::fs::copy(world.path("second/basis.safetensors"), world.path("study/basis.safetensors")).unwrap();
    assert!(answer(&world.path("study"), "basis.safetensors of another study").is_err());
    assert!(!check(&world.path("study")).unwrap().whole);
}

#[test]
fn a_part_of_another_study_is_refused() {
    let world = world();
    // Another mesh of as many eigenpairs: the columns are there, the numbers mean something else.
    let other = World::new();
    for run in 0..4 {
        other.write(&format!("run_{run}"), &Model::plate(5, 3, 40.0, 19.0).family(3, |t, p| bend(40.0, t)(p)));
    }
    other.study(8);
    std::fs::copy(part(&other.path("study")), part(&world.path("study"))).unwrap();
    assert!(!check(&world.path("study")).unwrap().whole);
    let study = Study::open(&world.path("study")).unwrap();
    let rows = study.coefficients(None, Rows::All);
    assert!(rows.is_err(), "coefficients in another basis are taken for ours");
}

fn edited(path: &Path, edit: impl FnOnce(String) -> String) {
    let text = std::fs::read_to_string(path).unwrap();
    let edited = edit(text.clone());
    assert_ne!(text, edited, "the edit changes something");
    std::fs::write(path, edited).unwrap();
}

#[test]
fn a_manifest_edited_by_hand_never_panics() {
    type Edit = fn(String) -> String;
    let edits: [(&str, Edit); 7] = [
        ("a state more", |text| text.replacen("\"times\": [", "\"times\": [\n -1.0,", 1)),
        ("no states", |text| {
            let (head, rest) = text.split_once("\"times\": [").unwrap();
            format!("{head}\"times\": [{}", &rest[rest.find(']').unwrap()..])
        }),
        ("a run that no part has", |text| text.replacen("\"run_3\"", "\"run_8\"", 1)),
        ("a part that is not there", |text| {
            text.replacen("\"part\": \"coefficients/", "\"part\": \"coefficients/x", 1)
        }),
        ("another basis", |text| text.replacen("\"basis\": \"", "\"basis\": \"f", 1)),
        ("another layout", |text| text.replacen("\"layout\": 2", "\"layout\": 3", 1)),
        ("a path that is gone", |text| text.replace("/d3plot\"", "/d4plot\"")),
    ];
    let mut passed_over = Vec::new();
    for (what, edit) in edits {
        let world = world();
        edited(&world.path("study/manifest.json"), edit);
        if answer(&world.path("study"), what).is_ok() {
            passed_over.push(what);
        }
    }
    assert!(passed_over.is_empty(), "as if nothing had happened: {passed_over:?}");
}

#[test]
fn a_descriptor_that_does_not_fit_the_study_is_refused() {
    let world = world();
    let study = Study::open(&world.path("study")).unwrap();
    let made = descriptor::load(&study, "run_1").unwrap();
    let path = world.path("study/descriptors/run_1.json");
    let write = |eigenvectors: Vec<usize>| {
        let values = vec![vec![1.0, 2.0, 3.0]; eigenvectors.len()];
        let selected = descriptor::Selected { eigenvectors, values, ..made.selected.clone() };
        let descriptor = descriptor::Descriptor { selected, ..made.clone() };
        std::fs::write(&path, serde_json_of(&descriptor)).unwrap();
    };
    for eigenvectors in [vec![], vec![0, 1], vec![1, 9], vec![1, usize::MAX], vec![3, 2], vec![2, 2]] {
        write(eigenvectors.clone());
        assert!(answer(&world.path("study"), &format!("eigenvectors {eigenvectors:?}")).is_err(), "{eigenvectors:?}");
    }
    write(vec![1, 8]);
    answer(&world.path("study"), "eigenvectors 1 and 8 of 8").unwrap();
    edited(&path, |text| text.replacen("\"basis\": \"", "\"basis\": \"0", 1));
    assert!(matches!(answer(&world.path("study"), "basis"), Err(crumple::Error::OtherBasis { .. })));
}

/// As it is stored, made by saving it under a name of its own.
fn serde_json_of(descriptor: &descriptor::Descriptor) -> String {
    let world = World::new();
    world.write("run", &Model::plate(2, 2, 4.0, 3.0).family(1, |_, p| p));
    let study = world.empty_study("study", "run", 2);
    let path = descriptor::save(&study, descriptor).unwrap();
    std::fs::read_to_string(path).unwrap()
}
