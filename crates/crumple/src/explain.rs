//! Why two states are alike or different, and what a spectrum says, in words that an engineer can check on the part.
//!
//! The similarity of two rotation spectra is a sum: one term an octave of the kind, one a long wave of the direction,
//! over the two lengths. Each term is told with the wavelength it belongs to. Where on the part: the share of the squared
//! rotation of both states that lies at each vertex, in the octave that says most about them.

use serde::Serialize;

use crate::Error;
use crate::basis::{Basis, synthesize};
use crate::rotation::{OCTAVES, RotationSpectrum, Ruler};
use crate::study::Loaded;
use crate::target::Target;
use crate::vector::{Vector, square};

/// What makes two states alike or different.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Explanation {
    /// Cosine of the two spectra, −1 to 1: the sum of all terms.
    pub similarity: f64,
    /// One term an octave of frequency: what kind of deformation.
    pub kind: Vec<Term>,
    /// The sum of the terms of the long waves: which way the part turned.
    pub direction: f64,
    /// How much each state turned: root mean square of sin θ.
    pub turn: [f64; 2],
    /// The octave in which the two differ most in what share of their turning it holds.
    pub differs_in: usize,
    /// The octave in which the two together hold most of their turning.
    pub alike_in: usize,
    /// What it says, in words.
    pub words: Vec<String>,
}

/// One octave of frequency.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Term {
    /// Wavelengths at its ends, the longer one first, in the length unit.
    pub wavelength: (f64, f64),
    /// Share of the squared turning of each state that it holds.
    pub shares: [f64; 2],
    /// What it adds to the similarity.
    pub adds: f64,
}

/// Explains the similarity of two states by their rotation spectra.
pub fn explain(basis: &Basis, a: &Target, b: &Target, unit: &str) -> Explanation {
    let ruler = Ruler::of(basis);
    let (one, other) = (ruler.spectrum(&a.rotation, a.turn), ruler.spectrum(&b.rotation, b.turn));
    let length = |spectrum: &RotationSpectrum| spectrum.numbers().iter().map(|x| x * x).sum::<f64>().sqrt();
    let lengths = length(&one) * length(&other);
    let over = |sum: f64| if lengths > 0.0 { sum / lengths } else { 0.0 };
    let wavelengths = ruler.wavelengths();
    let kind: Vec<Term> = (0..OCTAVES)
        .map(|at| Term {
            wavelength: wavelengths[at],
            shares: [one.octaves[at], other.octaves[at]],
            adds: over(one.kind[at] * other.kind[at]),
        })
        .collect();
    let along = one.direction.iter().flatten().zip(other.direction.iter().flatten());
    let direction = over(along.map(|(x, y)| x * y).sum());
    let similarity = kind.iter().map(|term| term.adds).sum::<f64>() + direction;
    let most = |of: &dyn Fn(&Term) -> f64| {
        (0..OCTAVES).max_by(|&x, &y| of(&kind[x]).total_cmp(&of(&kind[y])).then(y.cmp(&x))).unwrap_or(0)
    };
    let differs_in = most(&|term| (term.shares[0] - term.shares[1]).abs());
    let alike_in = most(&|term| term.shares[0].min(term.shares[1]));
    let mut explanation =
        Explanation { similarity, kind, direction, turn: [a.turn, b.turn], differs_in, alike_in, words: Vec::new() };
    explanation.words = words(&explanation, a, b, unit);
    explanation
}

fn words(found: &Explanation, a: &Target, b: &Target, unit: &str) -> Vec<String> {
    if let Some(still) = [a, b].into_iter().find(|state| state.turn < crate::rotation::TURN_MIN) {
        return vec![format!("{} has not deformed: its surface did not turn but as a whole", still.run)];
    }
    let term = |at: usize| {
        let term = &found.kind[at];
        let percent = |share: f64| format!("{:.0} %", 100.0 * share);
        (waves(term.wavelength, unit), percent(term.shares[0]), percent(term.shares[1]))
    };
    let kind: f64 = found.kind.iter().map(|term| term.adds).sum();
    let mut words = vec![format!(
        "similarity {:.3}: {kind:+.3} from where along the wavelengths they turn, {:+.3} from which way the part turned as a whole",
        found.similarity, found.direction
    )];
    let (waves, first, second) = term(found.alike_in);
    words.push(format!("both turn at wavelengths of {waves}: {first} of {} and {second} of {}", a.run, b.run));
    let (waves, first, second) = term(found.differs_in);
    if (found.kind[found.differs_in].shares[0] - found.kind[found.differs_in].shares[1]).abs() > 0.05 {
        words.push(format!("they differ most at {waves}: {first} of {} against {second} of {}", a.run, b.run));
    }
    if found.direction < -0.2 {
        words.push("as a whole they turned in opposite ways".into());
    }
    words
}

/// `30 to 60 mm`.
fn waves((long, short): (f64, f64), unit: &str) -> String {
    format!("{} to {} {unit}", two_digits(short), two_digits(long))
}

/// Two significant digits, whatever the unit.
fn two_digits(length: f64) -> String {
    let step = 10_f64.powf(length.abs().log10().floor() - 1.0);
    let decimals = (1.0 - length.abs().log10().floor()).max(0.0) as usize;
    format!("{:.decimals$}", (length / step).round() * step)
}

/// A spectrum in words: how fine its turning is, at which wavelengths most of it lies, and how much of it is the part
/// bending as a whole.
pub fn spectrum_words(basis: &Basis, spectrum: &RotationSpectrum, unit: &str) -> String {
    let total: f64 = spectrum.octaves.iter().sum();
    if total <= 0.0 {
        return "not deformed".into();
    }
    // The shortest run of octaves that holds half of the turning.
    let mut best = (0, OCTAVES);
    for first in 0..OCTAVES {
        let mut held = 0.0;
        for last in first..OCTAVES {
            held += spectrum.octaves[last];
            if held >= 0.5 * total {
                if last + 1 - first < best.1 - best.0 {
                    best = (first, last + 1);
                }
                break;
            }
        }
    }
    let wavelengths = Ruler::of(basis).wavelengths();
    let range = (wavelengths[best.0].0, wavelengths[best.1 - 1].1);
    let whole: f64 = spectrum.direction.iter().map(|triple| square(*triple)).sum();
    let kind = match whole {
        whole if whole > 0.5 => "bent or twisted as a whole",
        whole if whole > 0.2 => "bent as a whole, and folded",
        _ => "folded",
    };
    let held: f64 = spectrum.octaves[best.0..best.1].iter().sum();
    format!(
        "{kind}: {:.0} % of the turning at wavelengths of {}, {:.0} % in waves as long as the part",
        100.0 * held,
        waves(range, unit),
        100.0 * whole
    )
}

/// Where on the part two states turn in one octave of frequency: for each vertex the share of the octave's squared
/// rotation, per area and relative to an even spread (1 everywhere), of the first state, of the second, and the smaller
/// of the two; N each.
///
/// # Errors
/// [`Error::Value`] for an octave that does not exist.
pub fn regions(loaded: &Loaded, a: &Target, b: &Target, octave: usize) -> Result<[Vec<f64>; 3], Error> {
    if octave >= OCTAVES {
        return Err(Error::Value {
            name: "--octave",
            value: (octave + 1).to_string(),
            expected: format!("1 to {OCTAVES}"),
        });
    }
    let within = Ruler::of(&loaded.basis).eigenvectors_of(octave);
    let of = |target: &Target| -> Vec<f64> {
        let values: Vec<Vector> = within.iter().map(|&j| target.rotation[j - 1]).collect();
        let local: Vec<f64> = synthesize(&loaded.basis, &within, &values).into_iter().map(square).collect();
        let mean =
            local.iter().zip(&loaded.basis.area).map(|(x, share)| x * share).sum::<f64>() / loaded.basis.facts.area;
        local.into_iter().map(|x| if mean > 0.0 { x / mean } else { 0.0 }).collect()
    };
    let (first, second) = (of(a), of(b));
    let both = first.iter().zip(&second).map(|(x, y)| x.min(*y)).collect();
    Ok([first, second, both])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_have_two_digits_in_any_unit() {
        assert_eq!([two_digits(123.4), two_digits(0.0567), two_digits(9.96)], ["120", "0.057", "10.0"]);
    }
}
