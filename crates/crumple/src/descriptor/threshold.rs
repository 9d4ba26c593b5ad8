//! The threshold t: which coefficients are large enough to be kept.
//!
//! A magnitude is compared with t, as the paper's text says (its equation is printed without bars); an eigenvector is
//! kept as soon as one of its three components passes, and then with all three (the paper's completed triples).

use std::fmt;
use std::str::FromStr;

use crate::Error;

/// How t is found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Threshold {
    /// t = mean + C standard deviations over all 3K magnitudes. The paper's is `std:1`.
    Std(f64),
    /// t = C × mean over all 3K magnitudes.
    Mean(f64),
    /// t itself, in length².
    Value(f64),
    /// The M eigenvectors with the largest magnitude.
    Top(usize),
    /// The fewest eigenvectors, by magnitude, that hold this share of Σ over all K of the squared coefficients.
    Energy(f64),
    /// The fewest eigenvectors, by magnitude, whose reconstruction has at most this M-weighted RMS error, in the
    /// length unit: the paper's loop that adjusts t.
    Error(f64),
}

/// What a threshold selects.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection {
    /// Eigenvectors kept, counted from 1, rising.
    pub eigenvectors: Vec<usize>,
    /// t, in length². For `top`, `energy` and `error` the smallest magnitude that is kept.
    pub threshold: f64,
}

impl Default for Threshold {
    /// The paper's: one standard deviation above the mean.
    fn default() -> Self {
        Self::Std(1.0)
    }
}

impl Threshold {
    /// The rule, if its number makes sense.
    fn checked(self) -> Result<Self, Error> {
        let (number, sensible, expected) = match self {
            Self::Std(c) => (c, true, ""),
            Self::Mean(c) => (c, c > 0.0, "the number must be above zero"),
            Self::Value(t) => (t, t >= 0.0, "the number must not be negative"),
            Self::Top(m) => (m as f64, m >= 1, "the number must be a whole number from 1"),
            Self::Energy(share) => (share, share > 0.0 && share <= 1.0, "the share must be above 0 and at most 1"),
            Self::Error(length) => (length, length > 0.0, "the number must be above zero"),
        };
        let fail = |what: &str| Err(Error::Threshold { rule: self.to_string(), what: what.to_owned() });
        match (number.is_finite(), sensible) {
            (false, _) => fail("what follows the colon is not a number"),
            (true, false) => fail(expected),
            (true, true) => Ok(self),
        }
    }

    /// Applies the rule to the coefficients of one state, K × 3, of which the first `components` of each triple count.
    /// `signed`: a value is compared as it is, as the paper's equation is printed, not by its magnitude.
    ///
    /// `rms_with_first(order, m)` gives the RMS error of a reconstruction from the first m eigenvectors of `order`;
    /// it is asked only by [`Threshold::Error`].
    ///
    /// # Errors
    /// [`Error::Threshold`] if the rule makes no sense, if nothing passes or everything does, or the wanted error cannot
    /// be reached with K eigenvectors.
    pub fn select(
        &self,
        values: &[[f64; 3]],
        components: usize,
        signed: bool,
        rms_with_first: impl Fn(&[usize], usize) -> f64,
    ) -> Result<Selection, Error> {
        self.checked()?;
        let looked_at = |x: &f64| if signed { *x } else { x.abs() };
        let largest: Vec<f64> = values
            .iter()
            .map(|triple| triple[..components].iter().map(looked_at).fold(f64::NEG_INFINITY, f64::max))
            .collect();
        let fail = |what: String| Error::Threshold { rule: self.to_string(), what };
        let count = (components * values.len()) as f64;
        let magnitudes = || values.iter().flat_map(|triple| &triple[..components]).map(looked_at);
        let mean = magnitudes().sum::<f64>() / count;
        let above = |t: f64| {
            let eigenvectors: Vec<usize> = (1..=values.len()).filter(|&j| largest[j - 1] > t).collect();
            let most = largest.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            if values.as_flattened().iter().all(|&x| x == 0.0) {
                Err(fail("all coefficients are zero: the state is the undeformed one".into()))
            } else if eigenvectors.is_empty() {
                Err(fail(format!("no coefficient is larger than t = {t:.6}; the largest is {most:.6}")))
            } else if eigenvectors.len() == values.len()
                && values.len() > 1
                && !matches!(self, Self::Std(c) if *c >= 0.0)
            {
                let least = largest.iter().copied().fold(f64::INFINITY, f64::min);
                Err(fail(format!(
                    "all {} eigenvectors have a coefficient larger than t = {t:.6}, so it chooses nothing; t of {least:.6} and more leaves some out",
                    values.len()
                )))
            } else {
                Ok(Selection { eigenvectors, threshold: t })
            }
        };
        // By falling magnitude, ties by number: lowering t walks along this order.
        let mut order: Vec<usize> = (1..=values.len()).collect();
        order.sort_by(|&a, &b| largest[b - 1].total_cmp(&largest[a - 1]).then(a.cmp(&b)));
        let first = |m: usize| {
            let mut eigenvectors = order[..m].to_vec();
            eigenvectors.sort_unstable();
            Selection { eigenvectors, threshold: largest[order[m - 1] - 1] }
        };
        if values.is_empty() {
            return Err(fail("there are no coefficients".into()));
        }
        match *self {
            Self::Std(c) => {
                let variance = magnitudes().map(|x| (x - mean).powi(2)).sum::<f64>() / count;
                above(mean + c * variance.sqrt())
            }
            Self::Mean(c) => above(c * mean),
            Self::Value(t) => above(t),
            Self::Top(m) if m > values.len() => Err(fail(format!("there are {} eigenvectors", values.len()))),
            Self::Top(m) => Ok(first(m)),
            Self::Energy(share) => {
                let energy = |j: usize| values[j - 1].iter().map(|x| x * x).sum::<f64>();
                let total: f64 = order.iter().map(|&j| energy(j)).sum();
                let mut held = 0.0;
                let m = order.iter().position(|&j| {
                    held += energy(j);
                    held >= share * total
                });
                Ok(first(m.map_or(values.len(), |m| m + 1)))
            }
            Self::Error(wanted) => {
                // The error falls as m grows: bisection.
                let reached = |m: usize| rms_with_first(&order, m) <= wanted;
                if !reached(values.len()) {
                    return Err(fail(format!(
                        "all {} eigenvectors leave an error of {:.4}",
                        values.len(),
                        rms_with_first(&order, values.len())
                    )));
                }
                let (mut low, mut high) = (0, values.len());
                while high - low > 1 {
                    let middle = (low + high) / 2;
                    if reached(middle) { high = middle } else { low = middle }
                }
                Ok(first(high))
            }
        }
    }
}

impl Threshold {
    /// The rule in words, for a page.
    pub fn words(&self) -> String {
        match self {
            Self::Std(c) if *c == 1.0 => "mean + 1 standard deviation of all".into(),
            Self::Std(c) => format!("mean + {c} standard deviations of all"),
            Self::Mean(c) => format!("{c} times the mean of all"),
            Self::Value(_) => "a given value".into(),
            Self::Top(m) => format!("the {m} largest"),
            Self::Energy(share) => format!("{:.3} % of the squared coefficients", 100.0 * share),
            Self::Error(length) => format!("as many as leave an error of {length}"),
        }
    }
}

impl fmt::Display for Threshold {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Std(c) => write!(f, "std:{c}"),
            Self::Mean(c) => write!(f, "mean:{c}"),
            Self::Value(t) => write!(f, "value:{t}"),
            Self::Top(m) => write!(f, "top:{m}"),
            Self::Energy(share) => write!(f, "energy:{share}"),
            Self::Error(length) => write!(f, "error:{length}"),
        }
    }
}

impl FromStr for Threshold {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let fail = |what: &str| Error::Threshold { rule: text.to_owned(), what: what.to_owned() };
        let (rule, value) = text.split_once(':').ok_or_else(|| fail("expected RULE:NUMBER"))?;
        let number: f64 = value.trim().parse().map_err(|_| fail("what follows the colon is not a number"))?;
        let threshold = match rule {
            "std" => Self::Std(number),
            "mean" => Self::Mean(number),
            "value" => Self::Value(number),
            "top" if number < 1.0 || number.fract() != 0.0 => {
                return Err(fail("the number must be a whole number from 1"));
            }
            "top" => Self::Top(number as usize),
            "energy" => Self::Energy(number),
            "error" => Self::Error(number),
            _ => return Err(fail("no such rule")),
        };
        threshold.checked()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const VALUES: [[f64; 3]; 4] = [[10.0, 0.0, 0.0], [0.0, -4.0, 0.0], [1.0, 1.0, 1.0], [0.0, 0.0, 6.0]];

    fn selected(rule: &str) -> Result<Vec<usize>, Error> {
        let rms = |order: &[usize], m: usize| {
            order[m..].iter().map(|&j| VALUES[j - 1].iter().map(|x| x * x).sum::<f64>()).sum::<f64>().sqrt()
        };
        Ok(rule.parse::<Threshold>()?.select(&VALUES, 3, false, rms)?.eigenvectors)
    }

    #[test]
    fn every_rule_selects_by_magnitude() {
        // Magnitudes: mean 23/12 = 1.917, standard deviation √(155/12 − 1.917²) = 3.040.
        assert_eq!(selected("std:1").unwrap(), [1, 4]);
        assert_eq!(selected("std:0.5").unwrap(), [1, 2, 4]);
        assert_eq!(selected("mean:2").unwrap(), [1, 2, 4]);
        assert_eq!(selected("value:5").unwrap(), [1, 4]);
        assert!(matches!(selected("value:0.9"), Err(Error::Threshold { what, .. }) if what.contains("all 4")));
        assert_eq!(selected("top:3").unwrap(), [1, 2, 4]);
        assert_eq!(selected("energy:0.7").unwrap(), [1, 4]); // 136 of 155 is the first to reach it
        assert_eq!(selected("error:1.8").unwrap(), [1, 2, 4]); // √3 is left
        assert_eq!(selected("error:0.1").unwrap(), [1, 2, 3, 4]);
    }

    #[test]
    fn the_equation_as_printed_keeps_only_large_positive_values() {
        // Without bars: mean 13/12 + … of signed values; −4 is never above t.
        let rms = |_: &[usize], _: usize| 0.0;
        let kept = |rule: &str| rule.parse::<Threshold>().unwrap().select(&VALUES, 3, true, rms).unwrap().eigenvectors;
        assert_eq!(kept("value:0.5"), [1, 3, 4]);
        assert_eq!(kept("top:3"), [1, 3, 4]);
    }

    #[test]
    fn a_scalar_has_one_component() {
        let values = [[10.0, 0.0, 0.0], [1.0, 0.0, 0.0], [-7.0, 0.0, 0.0]];
        let kept = Threshold::Mean(1.0).select(&values, 1, false, |_, _| 0.0).unwrap();
        assert_eq!((kept.eigenvectors, kept.threshold), (vec![1, 3], 6.0));
    }

    #[test]
    fn rules_that_select_nothing_or_make_no_sense_say_so() {
        for rule in [
            "std:99", "value:10", "top:5", "top:0", "top:1.5", "energy:0", "energy:2", "error:-1", "mean:0", "half:1",
            "std", "std:x", "std:nan",
        ] {
            let error = selected(rule).unwrap_err();
            assert!(matches!(error, Error::Threshold { .. }), "{rule}: {error}");
        }
    }

    #[test]
    fn rules_are_written_as_they_are_read() {
        for rule in ["std:1", "mean:2.5", "value:0.1", "top:14", "energy:0.9", "error:3"] {
            assert_eq!(rule.parse::<Threshold>().unwrap().to_string(), rule);
        }
    }
}
