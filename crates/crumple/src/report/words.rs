//! What the page says in sentences.

use std::cmp::Ordering;

use super::shapes::z_displacement;
use crate::basis::BasisFacts;
use crate::isometry;
use crate::modes::Modes;
use crate::study::{Loaded, RunRecord, Study};

/// In words: the mesh is several pieces, what that does, and what helps.
pub(super) fn join_words(components: usize, distance: f64, unit: &str) -> String {
    format!(
        "the mesh is {components} pieces that share no nodes, a small distance apart; each has a spectrum of its own, and equal pieces bring nearly equal eigenvalues in pairs. \
         To treat them as one part: --join {distance} ({unit})"
    )
}

/// What a deck holds together, in words.
pub(super) fn deck_words(facts: &BasisFacts) -> String {
    let pieces = if facts.null_space == 1 { "one piece".to_owned() } else { format!("{} pieces", facts.null_space) };
    format!("joined to {pieces} by {} ties of the deck's welds and tied contacts", facts.joined_pairs - facts.idle_ties)
}

/// How far the surfaces are from isometric, in words.
pub(super) fn isometry_words(records: &[&RunRecord]) -> Option<String> {
    let mut strains: Vec<f64> = records.iter().map(|run| run.last.strain_p95).collect();
    strains.sort_by(f64::total_cmp);
    let median = *strains.get(strains.len() / 2)?;
    let caveat = isometry::caveat(median).map(|caveat| format!("; {caveat}")).unwrap_or_default();
    Some(format!(
        "in the last state of a typical run, 95 % of the edges change their length by less than {:.1} %{caveat}",
        100.0 * median
    ))
}

/// What the user should know before reading the page.
pub(super) fn warnings(loaded: &Loaded, modes: &Modes) -> Vec<String> {
    let facts = &loaded.basis.facts;
    let mut warnings = Vec::new();
    if facts.non_manifold_edges > 0 {
        warnings.push(format!(
            "{} edges of the mesh have more than two faces; all their faces are summed",
            facts.non_manifold_edges
        ));
    }
    if facts.flat_triangles > 0 {
        warnings.push(format!("{} triangles without area are left out of the operator", facts.flat_triangles));
    }
    warnings.extend(early_words(&loaded.study));
    let ungrouped = loaded.study.manifest().runs.len().saturating_sub(modes.runs.len());
    if ungrouped > 0 {
        warnings.push(format!("{ungrouped} runs were added after the modes were found; `crumple modes` groups them"));
    }
    warnings
}

/// Which runs end before the others, in words.
pub fn early_words(study: &Study) -> Option<String> {
    let early = study.ends_early();
    let (first, time) = early.first()?;
    let unit = &study.settings().time_unit;
    Some(format!(
        "{} of {} runs end well before the others ({first} at {} {unit} the first); they are grouped and ranked by the state they reached",
        early.len(),
        study.manifest().runs.len(),
        *time as f32
    ))
}

/// What the medoid did, in numbers that an engineer reads off a picture: the change along its longest axis, and how
/// far it rose and fell.
pub(super) fn mode_words(loaded: &Loaded, shape: &[[f64; 3]]) -> String {
    let before = loaded.reference.mesh.vertices();
    let unit = &loaded.study.settings().length_unit;
    let extent = |points: &[[f64; 3]], c: usize| {
        let (low, high) =
            points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (low.min(p[c]), high.max(p[c])));
        high - low
    };
    let axis = (0..3).max_by(|&a, &b| extent(before, a).total_cmp(&extent(before, b))).unwrap_or(0);
    let (rise, fall) = z_displacement(loaded, shape)
        .into_iter()
        .fold((0.0_f64, 0.0_f64), |(rise, fall), z| (rise.max(z), fall.min(z)));
    format!(
        "{} from {} to {} {unit} along {}; rises by up to {} {unit}, falls by up to {} {unit} (z)",
        match extent(shape, axis).total_cmp(&extent(before, axis)) {
            Ordering::Less => "shortens",
            Ordering::Equal => "stays",
            Ordering::Greater => "grows",
        },
        three_digits(extent(before, axis)),
        three_digits(extent(shape, axis)),
        ['x', 'y', 'z'][axis],
        three_digits(rise),
        three_digits(fall.abs())
    )
}

/// A length with three significant digits, whatever its unit.
fn three_digits(length: f64) -> String {
    if length == 0.0 {
        return "0".into();
    }
    let decimals = (2.0 - length.abs().log10().floor()).max(0.0) as usize;
    format!("{length:.decimals$}")
}
