//! Which inputs go with a mode: every column of the input table, the runs of the mode against all others.
//!
//! What deformed alike was not grouped by its inputs, so a difference between the inputs of two modes is a finding. It is
//! told by its size first (Cliff's δ, Cramér's V), and only where chance would hardly make it: p of all questions that are
//! asked of a study together, adjusted for their number.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::Mode;
use super::ranks::{adjusted, categories_p, cliffs_delta, cramers_v, rank_sum_p};
use crate::study::{Manifest, RunRecord};

/// Largest adjusted p of an input that goes with a mode.
const P_MAX: f64 = 0.05;
/// Least |δ| of one: 0.33 is a medium effect (Romano et al. 2006).
const DELTA_MIN: f64 = 0.33;
/// Least V of one: 0.3 is a medium effect (Cohen 1988).
const V_MIN: f64 = 0.3;
/// Modes that are asked about: HDBSCAN may find hundreds among thousands of runs.
const MODES_MAX: usize = 20;
/// Fewer values than this on either side tell nothing.
const VALUES_MIN: usize = 3;

/// An input of the runs of a mode, against all others.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InputEffect {
    /// The column.
    pub input: String,
    /// What its values are.
    pub values: Values,
    /// Size of the difference: Cliff's δ for numbers, −1 to 1, positive where the mode's are larger; Cramér's V for
    /// categories, 0 to 1. 0.11, 0.28, 0.43 of |δ| are customarily called small, medium, large; 0.1, 0.3, 0.5 of V.
    pub effect: f64,
    /// How often chance alone does as much: rank-sum test for numbers, permutations for categories.
    pub p: f64,
    /// The same for all inputs and modes asked at once (Benjamini and Hochberg).
    pub p_adjusted: f64,
    /// Whether it goes with the mode: adjusted p below 0.05 and at least a medium effect.
    pub tells: bool,
}

/// The values of an input in a mode and outside.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", tag = "kind")]
pub enum Values {
    /// Numbers: quartiles.
    Numbers {
        /// Of the mode's runs: lower quartile, median, upper quartile.
        own: [f64; 3],
        /// Of all others.
        rest: [f64; 3],
    },
    /// Categories: the most frequent first.
    Categories {
        /// Category, its share of the mode's runs, its share of all others.
        shares: Vec<(String, f64, f64)>,
    },
}

/// Fills the inputs of the twenty largest modes; strongest first.
pub(super) fn inputs(manifest: &Manifest, modes: &mut [Mode], seed: u64) {
    let count = modes.len().min(MODES_MAX);
    let modes = &mut modes[..count];
    for mode in modes.iter_mut() {
        mode.inputs = manifest.inputs.iter().filter_map(|input| effect(manifest, mode, input, seed)).collect();
    }
    let p: Vec<f64> = modes.iter().flat_map(|mode| mode.inputs.iter().map(|input| input.p)).collect();
    let mut adjusted = adjusted(&p).into_iter();
    for mode in modes {
        for input in &mut mode.inputs {
            input.p_adjusted = adjusted.next().unwrap_or(1.0);
            let least = match input.values {
                Values::Numbers { .. } => DELTA_MIN,
                Values::Categories { .. } => V_MIN,
            };
            input.tells = input.p_adjusted < P_MAX && input.effect.abs() >= least;
        }
        mode.inputs.sort_by(|a, b| b.tells.cmp(&a.tells).then(b.effect.abs().total_cmp(&a.effect.abs())));
    }
}

/// Nothing where either side has too few values, or all values are equal.
fn effect(manifest: &Manifest, mode: &Mode, input: &str, seed: u64) -> Option<InputEffect> {
    let value = |run: &RunRecord| run.inputs.get(input).map(|text| text.trim().to_owned()).filter(|t| !t.is_empty());
    let (mut own, mut rest) = (Vec::new(), Vec::new());
    for (id, run) in &manifest.runs {
        if let Some(value) = value(run) {
            let here = mode.members.binary_search(id).is_ok();
            if here { own.push(value) } else { rest.push(value) }
        }
    }
    let varies = own.iter().chain(&rest).any(|value| Some(value) != own.first());
    if own.len() < VALUES_MIN || rest.len() < VALUES_MIN || !varies {
        return None;
    }
    let (values, effect, p) = match (numbers(&own), numbers(&rest)) {
        (Some(own), Some(rest)) => {
            let values = Values::Numbers { own: quartiles(&own), rest: quartiles(&rest) };
            (values, cliffs_delta(&own, &rest), rank_sum_p(&own, &rest))
        }
        _ => {
            let own: Vec<&str> = own.iter().map(String::as_str).collect();
            let rest: Vec<&str> = rest.iter().map(String::as_str).collect();
            let values = Values::Categories { shares: shares(&own, &rest) };
            (values, cramers_v(&own, &rest), categories_p(&own, &rest, seed))
        }
    };
    Some(InputEffect { input: input.to_owned(), values, effect, p, p_adjusted: p, tells: false })
}

fn numbers(values: &[String]) -> Option<Vec<f64>> {
    values.iter().map(|value| value.parse().ok().filter(|x: &f64| x.is_finite())).collect()
}

fn quartiles(values: &[f64]) -> [f64; 3] {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    [0.25, 0.5, 0.75].map(|share| {
        let at = share * (sorted.len() - 1) as f64;
        let (low, high) = (sorted[at.floor() as usize], sorted[at.ceil() as usize]);
        low + (high - low) * at.fract()
    })
}

fn shares(own: &[&str], rest: &[&str]) -> Vec<(String, f64, f64)> {
    let mut counts: BTreeMap<&str, [usize; 2]> = BTreeMap::new();
    own.iter().for_each(|value| counts.entry(value).or_default()[0] += 1);
    rest.iter().for_each(|value| counts.entry(value).or_default()[1] += 1);
    let mut shares: Vec<(String, f64, f64)> = counts
        .into_iter()
        .map(|(value, [here, there])| {
            (value.to_owned(), here as f64 / own.len() as f64, there as f64 / rest.len() as f64)
        })
        .collect();
    shares.sort_by(|a, b| b.1.total_cmp(&a.1).then_with(|| b.2.total_cmp(&a.2)).then_with(|| a.0.cmp(&b.0)));
    shares
}

impl InputEffect {
    /// The finding in words.
    pub fn words(&self) -> String {
        let digits = |x: f64| format!("{}", (x * 1e3).round() / 1e3);
        match &self.values {
            Values::Numbers { own, rest } => {
                let way = if self.effect > 0.0 { "larger" } else { "smaller" };
                format!(
                    "{} is {way}: median {} against {} (Cliff's δ {:+.2}, adjusted p {})",
                    self.input,
                    digits(own[1]),
                    digits(rest[1]),
                    self.effect,
                    p_words(self.p_adjusted)
                )
            }
            Values::Categories { shares } => {
                let farthest = shares.iter().max_by(|a, b| (a.1 - a.2).abs().total_cmp(&(b.1 - b.2).abs()));
                let (name, own, rest) = farthest.cloned().unwrap_or_default();
                format!(
                    "{} differs, {} values taken together (Cramér's V {:.2}, adjusted p {}); most: {name}, {:.0} % of its runs, {:.0} % of the others",
                    self.input,
                    shares.len(),
                    self.effect,
                    p_words(self.p_adjusted),
                    100.0 * own,
                    100.0 * rest
                )
            }
        }
    }
}

fn p_words(p: f64) -> String {
    if p < 0.001 { "below 0.001".into() } else { format!("{p:.3}") }
}

impl Mode {
    /// Which inputs go with the mode, in words; nothing where there are no inputs.
    pub fn input_words(&self) -> Vec<String> {
        let told: Vec<String> = self.inputs.iter().filter(|input| input.tells).map(InputEffect::words).collect();
        match self.inputs.iter().max_by(|a, b| a.effect.abs().total_cmp(&b.effect.abs())) {
            Some(strongest) if told.is_empty() => vec![format!(
                "no input tells this mode apart; the strongest is {} (effect {:.2}, adjusted p {})",
                strongest.input,
                strongest.effect,
                p_words(strongest.p_adjusted)
            )],
            _ => told,
        }
    }
}
