//! How well descriptors rank the runs of the example, against an independent plain implementation.
//!
//! The table is that of the example's documentation ("What a plain reference implementation gets", README.md of the
//! hat-section bundle), made with `benches/ranking_reference.py`: LAPACK's dense eigensolver and NumPy.

#[macro_use]
mod world;

use serde_json::Value;
use world::{example, number, rows};

/// Queries: the medoids of the clear runs of each label.
const QUERIES: [(&str, &str); 3] = [("crush", "run_007"), ("down", "run_065"), ("up", "run_074")];

/// Method, choice of coefficients, label, M, precision at nine, average precision, mean average precision over all
/// runs of the label.
const TABLE: [(&str, &str, &str, usize, f64, f64, f64); 21] = [
    ("descriptor", "coordinates", "crush", 10, 0.78, 0.754, 0.667),
    ("descriptor", "coordinates", "down", 11, 0.89, 0.816, 0.669),
    ("descriptor", "coordinates", "up", 12, 1.00, 0.899, 0.791),
    ("first M", "coordinates", "crush", 10, 0.78, 0.747, 0.665),
    ("first M", "coordinates", "down", 11, 0.89, 0.817, 0.665),
    ("first M", "coordinates", "up", 12, 1.00, 0.900, 0.790),
    ("first 500", "coordinates", "crush", 500, 0.78, 0.767, 0.674),
    ("first 500", "coordinates", "down", 500, 0.78, 0.794, 0.657),
    ("first 500", "coordinates", "up", 500, 1.00, 0.894, 0.785),
    ("descriptor", "difference", "crush", 8, 0.78, 0.655, 0.633),
    ("descriptor", "difference", "down", 12, 0.89, 0.782, 0.691),
    ("descriptor", "difference", "up", 13, 1.00, 0.936, 0.784),
    ("first M", "difference", "crush", 8, 0.78, 0.648, 0.627),
    ("first M", "difference", "down", 12, 0.89, 0.799, 0.694),
    ("first M", "difference", "up", 13, 1.00, 0.937, 0.787),
    ("first 500", "difference", "crush", 500, 0.78, 0.660, 0.642),
    ("first 500", "difference", "down", 500, 0.89, 0.776, 0.688),
    ("first 500", "difference", "up", 500, 1.00, 0.944, 0.788),
    ("PCA", "difference", "crush", 8, 0.56, 0.452, 0.493),
    ("PCA", "difference", "down", 12, 1.00, 0.849, 0.721),
    ("PCA", "difference", "up", 13, 1.00, 0.920, 0.818),
];

/// The table's numbers are rounded, ours come from f32 coefficients, and vectors of nearly equal eigenvalues may be
/// mixed: a neighbour or two in a ranking of 99 may change places.
const TOLERANCE: f64 = 0.005;

fn compared(join: Option<&str>) -> Value {
    let study = world::hundred(join);
    let compared = crumple!["compare", &study, "--labels", example().join("labels.csv"), "--json"].done().json();
    for (label, query) in QUERIES {
        let all = rows(&compared["rows"]).iter().filter(|row| row["label"] == label);
        assert!(all.clone().count() == 7 && all.clone().all(|row| row["query"] == query), "{label}");
    }
    assert_eq!(rows(&compared["rows"]).len(), 21, "`mixed` has no clear run, so it is no query");
    compared
}

fn sizes(compared: &Value, select: &str) -> Vec<usize> {
    let descriptors =
        rows(&compared["rows"]).iter().filter(|row| row["method"] == "descriptor" && row["select"] == select);
    descriptors.map(|row| number(&row["size"]) as usize).collect()
}

#[test]
fn rankings_agree_with_an_independent_implementation() {
    let compared = compared(None);
    assert_eq!(sizes(&compared, "coordinates"), [10, 11, 12]);
    assert_eq!(sizes(&compared, "difference"), [8, 12, 13]);
    for (method, select, label, size, precision, average, mean) in TABLE {
        let row = rows(&compared["rows"])
            .iter()
            .find(|row| row["method"] == method && row["select"] == select && row["label"] == label)
            .unwrap_or_else(|| panic!("no row for {method}, {select}, {label}"));
        assert_eq!(row["size"], size, "{method}, {select}, {label}");
        for (key, expected) in
            [("precision_at_9", precision), ("average_precision", average), ("mean_average_precision", mean)]
        {
            let found = number(&row[key]);
            assert!(
                (found - expected).abs() <= TOLERANCE,
                "{method}, {select}, {label}: {key} is {found:.4}, the reference has {expected}"
            );
        }
    }
}

#[test]
fn joined_sheets_need_fewer_eigenvectors() {
    let compared = compared(Some("2.5"));
    assert_eq!(sizes(&compared, "coordinates"), [7, 8, 8]);
    assert_eq!(sizes(&compared, "difference"), [4, 8, 7]);
}
