//! What each run of a bundle does: drawn from a fixed seed, before any shape exists.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::model::{Inputs, Structure};

/// A run as it was drawn.
pub(crate) struct Run {
    /// Its mode, or `mixed`.
    pub(crate) label: &'static str,
    /// Whether nobody would doubt the label: a large amplitude, and little of anything else.
    pub(crate) clear: bool,
    pub(crate) inputs: Inputs,
}

const SEED: u64 = 2026;

/// All runs of a structure, in an order that says nothing.
pub(crate) fn runs(structure: &dyn Structure) -> Vec<Run> {
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let (each, mixed) = structure.runs();
    let mut labels: Vec<&'static str> = structure.modes().iter().flat_map(|mode| vec![*mode; each]).collect();
    labels.extend(vec!["mixed"; mixed]);
    for last in (1..labels.len()).rev() {
        labels.swap(last, index(&mut random, last + 1));
    }
    labels.into_iter().map(|label| run(structure, label, &mut random)).collect()
}

fn run(structure: &dyn Structure, label: &'static str, random: &mut ChaCha8Rng) -> Run {
    let mut inputs = structure.draw(random);
    inputs.extend(structure.modes().iter().map(|mode| (*mode, 0.0)));
    inputs.insert("onset", between(random, 0.0, 0.3));
    inputs.insert("power", between(random, 0.8, 1.3));
    for name in WAVES {
        let range = if name.ends_with("phase") || name.ends_with("way") { (0.0, 628.0 / 100.0) } else { (-20.0, 20.0) };
        inputs.insert(name, between(random, range.0, range.1));
    }
    let main = if label == "mixed" { structure.modes()[index(random, structure.modes().len())] } else { label };
    let other = another(structure, main, random);
    // One run in four is one over whose label people may differ: weak, or with much of something else.
    let clear = label != "mixed" && random.random::<f64>() < 0.75;
    let weak = random.random::<f64>() < 0.5;
    let (amplitude, beside) = match (label, clear, weak) {
        ("mixed", ..) => ((0.5, 0.9), (0.5, 0.9)),
        (_, true, _) => ((0.5, 1.0), (0.0, 0.1)),
        (_, false, true) => ((0.3, 0.5), (0.0, 0.1)),
        (_, false, false) => ((0.5, 1.0), (0.15, 0.3)),
    };
    inputs.insert(main, between(random, amplitude.0, amplitude.1));
    inputs.insert(other, between(random, beside.0, beside.1));
    Run { label, clear, inputs }
}

const WAVES: [&str; 15] = [
    "wave_a_kx",
    "wave_a_ky",
    "wave_a_kz",
    "wave_a_phase",
    "wave_a_way",
    "wave_b_kx",
    "wave_b_ky",
    "wave_b_kz",
    "wave_b_phase",
    "wave_b_way",
    "wave_c_kx",
    "wave_c_ky",
    "wave_c_kz",
    "wave_c_phase",
    "wave_c_way",
];

/// A mode that can happen together with this one.
fn another(structure: &dyn Structure, main: &str, random: &mut ChaCha8Rng) -> &'static str {
    let opposite = |a: &str, b: &str| structure.opposites().iter().any(|&pair| pair == (a, b) || pair == (b, a));
    let free: Vec<&&str> = structure.modes().iter().filter(|mode| **mode != main && !opposite(main, mode)).collect();
    free[index(random, free.len())]
}

/// Share of its amplitudes that a run has reached at a time from 0 to 1: nothing until its onset, then a power.
pub(crate) fn progress(inputs: &Inputs, time: f64) -> f64 {
    ((time - inputs["onset"]) / (1.0 - inputs["onset"])).max(0.0).powf(inputs["power"])
}

/// Uniform from `low` to `high`.
pub(crate) fn between(random: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * random.random::<f64>()
}

/// Uniform of 0 … count − 1.
fn index(random: &mut ChaCha8Rng, count: usize) -> usize {
    ((random.random::<f64>() * count as f64) as usize).min(count - 1)
}
