//! `crumple eigen`: any mesh in, certified eigenpairs out, in a file that other tools open; and what it refuses.

#[macro_use]
mod world;

use std::path::{Path, PathBuf};

use serde_json::Value;
use world::{example_run, folder, repository};

fn hat_section() -> PathBuf {
    repository().join("crates/mesh-spectrum/testdata/hat-section.obj")
}

/// A sheet of 6 × 4 cells as OBJ, with one vertex that no face uses.
fn sheet(folder: &Path, name: &str) -> PathBuf {
    let mut text = String::from("v 99 99 99\n");
    for j in 0..5 {
        (0..7).for_each(|i| text += &format!("v {i} {j} 0\n"));
    }
    for j in 0..4 {
        for i in 0..6 {
            let a = 2 + 7 * j + i;
            text += &format!("f {a} {} {} {}\n", a + 1, a + 8, a + 7);
        }
    }
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path
}

/// The header of a safetensors file and where its data begin.
fn header(path: &Path) -> (Value, Vec<u8>) {
    let bytes = std::fs::read(path).unwrap();
    let length = u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    (serde_json::from_slice(&bytes[8..8 + length]).unwrap(), bytes[8 + length..].to_vec())
}

fn doubles(header: &Value, data: &[u8], name: &str) -> Vec<f64> {
    let ends = &header[name]["data_offsets"];
    let bytes = &data[ends[0].as_u64().unwrap() as usize..ends[1].as_u64().unwrap() as usize];
    bytes.as_chunks().0.iter().map(|word| f64::from_le_bytes(*word)).collect()
}

#[test]
fn the_json_holds_what_is_promised() {
    let place = folder();
    let file = place.path().join("basis.safetensors");
    let seen = crumple!["eigen", hat_section(), "-K", "40", "--join", "2.5", "-o", &file, "--json"].done().json();
    assert_eq!((&seen["pairs"], &seen["certified"], &seen["components"]), (&40.into(), &true.into(), &1.into()));
    assert_eq!(seen["eigenvalues"].as_array().unwrap().len(), 40);
    assert!(seen["residual"].as_f64().unwrap() < 1e-10 && seen["orthogonality"].as_f64().unwrap() < 1e-10);
    assert!(seen["residual_floor"].is_f64());
    for step in ["read", "inspect", "operator", "eigenbasis", "write", "total"] {
        assert!(seen["seconds"][step].is_f64(), "{step}");
    }
    if cfg!(target_os = "linux") {
        assert!(seen["peak_bytes"].as_u64().unwrap() > 1_000_000);
    }
    assert!(seen["solver"]["peak_bytes_expected"].as_u64().unwrap() > 0);
    assert!(seen["solver"]["thread_seconds"]["factor"].is_f64());

    let (header, data) = header(&file);
    let n = seen["vertices"].as_u64().unwrap();
    assert_eq!(header["eigenvectors"]["shape"], serde_json::json!([40, n]));
    assert_eq!(header["eigenvectors"]["dtype"], "F64");
    let (phi, mass) = (doubles(&header, &data, "eigenvectors"), doubles(&header, &data, "mass"));
    let inner = |i: usize, j: usize| -> f64 {
        let row = |k: usize| &phi[k * mass.len()..][..mass.len()];
        row(i).iter().zip(row(j)).zip(&mass).map(|((a, b), m)| a * b * m).sum()
    };
    for i in 0..40 {
        assert!((0..=i).all(|j| (inner(i, j) - f64::from(i == j)).abs() < 1e-10), "ΦᵀMΦ = I, row {i}");
    }
    let stored: Vec<f64> = doubles(&header, &data, "eigenvalues");
    let printed: Vec<f64> = seen["eigenvalues"].as_array().unwrap().iter().map(|e| e.as_f64().unwrap()).collect();
    assert_eq!(stored, printed, "to the last bit");
    let facts: Value = serde_json::from_str(header["__metadata__"]["facts"].as_str().unwrap()).unwrap();
    assert_eq!(facts["join"], 2.5);
}

#[test]
fn single_precision_halves_the_vectors_and_nothing_else() {
    let place = folder();
    let (whole, half) = (place.path().join("a.safetensors"), place.path().join("b.safetensors"));
    crumple!["eigen", hat_section(), "--eigenpairs", "10", "-o", &whole].done();
    crumple!["eigen", hat_section(), "--eigenpairs", "10", "-o", &half, "--f32"].done();
    let (a, b) = (header(&whole), header(&half));
    assert_eq!((&b.0["eigenvectors"]["dtype"], &b.0["eigenvalues"]["dtype"]), (&"F32".into(), &"F64".into()));
    let end = |h: &Value, at: usize| h["eigenvectors"]["data_offsets"][at].as_u64().unwrap();
    let size = |h: &Value| end(h, 1) - end(h, 0);
    assert_eq!(size(&a.0), 2 * size(&b.0));
    assert_eq!(doubles(&a.0, &a.1, "mass"), doubles(&b.0, &b.1, "mass"));
}

#[test]
fn formats_and_result_files_give_the_same_spectrum() {
    let place = folder();
    // The undeformed shells of a run, and the same surface as OBJ; single precision there.
    let run = crumple!["eigen", example_run("run_001"), "-K", "12", "--json"].done().json();
    let obj = crumple!["eigen", hat_section(), "-K", "12", "--json"].done().json();
    assert_eq!(run["vertices"], obj["vertices"]);
    let eigenvalues = |seen: &Value| -> Vec<f64> {
        seen["eigenvalues"].as_array().unwrap().iter().map(|e| e.as_f64().unwrap()).collect()
    };
    for (a, b) in eigenvalues(&run).iter().zip(eigenvalues(&obj)) {
        assert!((a - b).abs() <= 1e-5 * b.max(1e-9), "{a} {b}");
    }
    // A mesh file of an unknown name is told by its first bytes.
    let plain = sheet(place.path(), "sheet.obj");
    let off = place.path().join("sheet.mesh");
    std::fs::write(&off, "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").unwrap();
    assert_eq!(crumple!["eigen", &off, "--json"].done().json()["pairs"], 3);
    let seen = crumple!["eigen", &plain, "--json"].done();
    assert!(seen.stderr.contains("1 vertices that no face uses are dropped"), "{}", seen.stderr);
    assert!(seen.stderr.contains("35 eigenpairs, not 500"), "{}", seen.stderr);
    assert_eq!(seen.json()["unused_vertices"], 1);
}

#[test]
fn every_operator_and_every_mass() {
    let place = folder();
    let mesh = sheet(place.path(), "sheet.obj");
    let mut second = Vec::new();
    for operator in ["cotan", "tufted", "polygon"] {
        for mass in ["lumped", "consistent", "identity"] {
            let file = place.path().join(format!("{operator}-{mass}.safetensors"));
            let seen =
                crumple!["eigen", &mesh, "-K", "9", "--operator", operator, "--mass", mass, "-o", &file, "--json"]
                    .done()
                    .json();
            assert_eq!(
                (&seen["certified"], &seen["operator"], &seen["mass"]),
                (&true.into(), &operator.into(), &mass.into())
            );
            assert_eq!(header(&file).0.get("mass_data").is_some(), mass == "consistent");
            second.push(seen["eigenvalues"][1].as_f64().unwrap());
        }
    }
    // (π/6)² on this sheet; the identity gives a vertex the weight 1, where the others give it an area of ½ or ¼ on the edge.
    let exact = (std::f64::consts::PI / 6.0).powi(2);
    for (k, eigenvalue) in second.iter().enumerate() {
        let (least, most) = if k % 3 == 2 { (0.3, 0.9) } else { (0.95, 1.05) };
        assert!((least..most).contains(&(eigenvalue / exact)), "{k}: {eigenvalue} is not near {exact}");
    }
}

#[test]
fn a_non_manifold_or_badly_shaped_mesh_is_pointed_to_the_tufted_operator() {
    let operators = repository().join("crates/mesh-spectrum/testdata/operators");
    for (name, why) in [("fins.obj", "more than two faces"), ("needles.obj", "badly shaped")] {
        let plain = crumple!["eigen", operators.join(name), "-K", "5", "--operator", "cotan", "--json"];
        assert!(plain.stderr.contains("--operator tufted") && plain.stderr.contains(why), "{}", plain.stderr);
        let tufted = crumple!["eigen", operators.join(name), "-K", "5", "--operator", "tufted", "--json"].done();
        assert!(!tufted.stderr.contains("--operator tufted"));
        assert_eq!(tufted.json()["recommended_operator"], "tufted");
    }
}

#[test]
fn what_is_refused() {
    let place = folder();
    let write = |name: &str, text: &str| {
        let path = place.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let good = sheet(place.path(), "good.obj");
    crumple!["eigen", place.path().join("none.obj")].refused(&["none.obj", "no such file"]);
    crumple!["eigen", write("empty.obj", "")].refused(&["empty.obj", "no faces", "0 vertices"]).hints("write it again");
    crumple!["eigen", write("points.obj", "v 0 0 0\nv 1 0 0\n")].refused(&["points.obj", "no faces", "2 vertices"]);
    crumple!["eigen", write("range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n")].refused(&[
        "range.obj",
        "line 4",
        "vertex 4",
        "there are 3",
    ]);
    crumple!["eigen", write("nan.obj", "v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n")]
        .refused(&["nan.obj", "vertex 1", "finite"]);
    crumple!["eigen", write("line.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")].refused(&[
        "vertex 0",
        "no triangle with area",
        "tufted",
    ]);
    crumple!["eigen", write("photo.jpg", "\u{ff}\u{d8}")].refused(&["photo.jpg", ".obj", ".vtu"]);
    crumple!["eigen", write("d3plot", "no result file at all")].refused(&["d3plot"]);
    crumple!["eigen", &good, "-K", "0"].refused(&["--eigenpairs = 0", "at least one"]);
    crumple!["eigen", &good, "-K", "-3"].refused(&["-3"]);
    for tolerance in ["-1e-8", "0", "nan", "1"] {
        crumple!["eigen", &good, "--tolerance", tolerance].refused(&["--tolerance", "above 0 and below 0.01"]);
    }
    crumple!["eigen", &good, "--join", "-1"].refused(&["join", "-1", "positive"]);
    crumple!["eigen", &good, "--operator", "laplace"].refused(&["--operator", "laplace", "cotan, tufted or polygon"]);
    crumple!["eigen", &good, "--mass", "heavy"].refused(&["--mass", "heavy", "lumped, consistent or identity"]);
    crumple!["eigen", &good, "--part", "7"].refused(&["--part", "no parts"]);
    crumple!["eigen", &good, "-o", place.path()].refused(&["cannot write", "folder"]);
    crumple!["eigen", &good, "-o", place.path().join("no/such/folder/b.safetensors")]
        .refused(&["cannot write", "b.safetensors"]);
    if Path::new("/dev/full").exists() {
        crumple!["eigen", &good, "-o", "/dev/full"].refused(&["/dev/full", "cannot write", "space"]);
    }
    let left: Vec<_> = std::fs::read_dir(place.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert!(left.iter().all(|name| !name.to_string_lossy().contains("tmp")), "{left:?}");
}

#[test]
fn a_study_keeps_its_operator_and_its_mass() {
    let place = folder();
    let study = place.path().join("study");
    let reference = example_run("run_001");
    for (operator, mass) in [("tufted", "identity"), ("polygon", "consistent")] {
        let study = study.with_extension(operator);
        let made = crumple![
            "init",
            &study,
            "--reference",
            &reference,
            "-K",
            "20",
            "--operator",
            operator,
            "--mass",
            mass,
            "--json"
        ]
        .done()
        .json();
        assert_eq!((&made["operator"], &made["mass"]), (&operator.into(), &mass.into()));
        let settings = std::fs::read_to_string(study.join("study.toml")).unwrap();
        assert!(
            settings.contains(&format!("operator = \"{operator}\""))
                && settings.contains(&format!("mass = \"{mass}\""))
        );
        let info = crumple!["info", &study].done().stdout;
        assert!(info.contains(&format!("{operator}, {mass} mass")), "{info}");
        // Runs are projected with the same mass: no more than everything is caught, and adding again changes nothing.
        crumple!["add", &study, example_run("run_001"), example_run("run_007")].done();
        crumple!["check", &study].done();
        crumple!["init", &study, "--reference", &reference].refused(&["study is here"]);
    }
}

#[test]
fn a_state_is_a_mesh_of_its_own() {
    let run = example_run("run_007");
    let at = |state: &str| PathBuf::from(format!("{}@{state}", run.display()));
    let eigen = |mesh: &Path| crumple!["eigen", mesh, "-K", "20", "--json"].done().json();
    let values = |seen: &Value| -> Vec<f64> {
        seen["eigenvalues"].as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect()
    };
    let (undeformed, first, last) = (eigen(&run), eigen(&at("0")), eigen(&at("last")));
    assert_eq!(values(&undeformed), values(&first), "state 0 is the undeformed one");
    assert_eq!(values(&last), values(&eigen(&at("3"))), "and 3 the last");
    assert_eq!(undeformed["triangles"], last["triangles"]);
    // The bound of a near isometry: edges keep their lengths but for a few, so eigenvalues move by some per cent.
    let ratio = |k: usize| values(&last)[k] / values(&undeformed)[k];
    assert!((2..20).all(|k| (0.8..1.25).contains(&ratio(k))) && (2..20).any(|k| (ratio(k) - 1.0).abs() > 1e-3));
    crumple!["eigen", at("4")].refused(&["4 states", "@3", "no @4"]);
    crumple!["eigen", at("last"), "--join", "2.5"].refused(&["--join", "undeformed"]);
    crumple!["eigen", at("x")].refused(&["run_007@x"]);
}
