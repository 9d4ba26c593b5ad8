//! From chains to one spectrum: cut where neighbours overlap, check that they agree, and that no pair is missing.

use crate::eigen::chain::Found;
use crate::eigen::slice::{CUT_GAP, Trouble};

/// Pairs of one component, in ascending order.
#[derive(Debug, Default)]
pub(crate) struct Joined {
    pub(crate) eigenvalues: Vec<f64>,
    /// Where each one's vector is, among the blocks of all chains.
    pub(crate) places: Vec<usize>,
    /// ‖A x − λ x‖ of each.
    pub(crate) residuals: Vec<f64>,
}

/// Joins the chains of one component, each pair taken from one of them; `starts` says where each chain's vectors begin.
///
/// Around the value where two chains meet, both number their pairs from the inertia count there. Where both found a
/// pair of the same number, its eigenvalues must agree: had either missed one, the numbers would be shifted.
pub(crate) fn assemble(chains: &[Found], starts: &[usize], top: f64, tolerance: f64) -> Result<Joined, Trouble> {
    let mut borders = vec![chains.first().map_or(0, |chain| chain.first)];
    for pair in chains.windows(2) {
        borders.push(border(&pair[0], &pair[1], top, tolerance)?);
    }
    borders.extend(chains.last().map(Found::end));

    let mut joined = Joined::default();
    for ((chain, start), ends) in chains.iter().zip(starts).zip(borders.windows(2)) {
        for number in ends[0]..ends[1] {
            joined.eigenvalues.push(chain.eigenvalues[number - chain.first]);
            joined.places.push(start + number - chain.first);
            joined.residuals.push(chain.residuals[number - chain.first]);
        }
    }
    Ok(joined)
}

/// The number of the first pair to take from the right chain.
fn border(left: &Found, right: &Found, top: f64, tolerance: f64) -> Result<usize, Trouble> {
    for number in right.first..left.end() {
        if let (Some(a), Some(b)) = (left.eigenvalue(number), right.eigenvalue(number))
            && (a - b).abs() > 10.0 * tolerance * top
        {
            return Err(Trouble::Again(format!(
                "eigenvalue {number} is {a:e} from one chain and {b:e} from the next: one is missing"
            )));
        }
    }
    let gap = |number: usize| {
        let before = number.checked_sub(1).and_then(|number| left.eigenvalue(number).or(right.eigenvalue(number)));
        let after = right.eigenvalue(number).or(left.eigenvalue(number));
        before.zip(after).map_or(f64::INFINITY, |(before, after)| after - before)
    };
    match (right.first..=left.end()).max_by(|&a, &b| gap(a).total_cmp(&gap(b))) {
        Some(widest) if gap(widest) > CUT_GAP * top => Ok(widest),
        _ => Err(Trouble::Again(format!(
            "a cluster of more than {} pairs where two chains meet",
            left.end().saturating_sub(right.first)
        ))),
    }
}

impl Found {
    /// One more than the number of the highest pair.
    fn end(&self) -> usize {
        self.first + self.eigenvalues.len()
    }

    /// The eigenvalue of a number in the component's spectrum, if this chain found it.
    fn eigenvalue(&self, number: usize) -> Option<f64> {
        number.checked_sub(self.first).and_then(|k| self.eigenvalues.get(k)).copied()
    }
}

/// Every shift must have as many eigenvalues below it as its inertia says. Result: shift, found, counted.
pub(crate) fn check_counts(eigenvalues: &[f64], counts: &[(f64, usize)]) -> Result<Vec<(f64, usize, usize)>, Trouble> {
    let compare = |&(shift, counted): &(f64, usize)| {
        let found = eigenvalues.iter().filter(|&&eigenvalue| eigenvalue < shift).count();
        if found != counted {
            return Err(Trouble::Again(format!(
                "{found} eigenvalues found below {shift:e}, {counted} counted by inertia"
            )));
        }
        Ok((shift, found, counted))
    };
    counts.iter().map(compare).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chain(first: usize, eigenvalues: &[f64]) -> Found {
        let residuals = vec![0.0; eigenvalues.len()];
        Found { first, eigenvalues: eigenvalues.to_vec(), residuals, counts: Vec::new() }
    }

    #[test]
    fn chains_are_cut_at_the_widest_gap_of_their_overlap() {
        let left = chain(0, &[0.0, 1.0, 2.0, 3.5, 3.6]);
        let right = chain(2, &[2.0, 3.5, 3.6, 4.0]);
        assert_eq!(border(&left, &right, 4.0, 1e-10).unwrap(), 3);
        let Joined { eigenvalues, places, .. } = assemble(&[left, right], &[0, 8], 4.0, 1e-10).unwrap();
        assert_eq!(eigenvalues, [0.0, 1.0, 2.0, 3.5, 3.6, 4.0]);
        assert_eq!(places, [0, 1, 2, 9, 10, 11]);
    }

    #[test]
    fn a_missing_pair_is_noticed() {
        // The left chain has not found 2.5, so its numbers are one too low from there on.
        let (left, right) = (chain(0, &[0.0, 1.0, 2.0, 3.0]), chain(2, &[2.0, 2.5, 3.0]));
        assert!(matches!(border(&left, &right, 4.0, 1e-10), Err(Trouble::Again(seen)) if seen.contains("missing")));
        assert!(check_counts(&[0.0, 1.0, 2.0, 3.0], &[(2.6, 4)]).is_err());
        assert_eq!(check_counts(&[0.0, 1.0, 2.0, 2.5], &[(2.6, 4)]).unwrap(), [(2.6, 4, 4)]);
    }

    #[test]
    fn a_cluster_is_not_cut() {
        let (left, right) = (chain(0, &[0.0, 1.0, 1.0 + 1e-9]), chain(1, &[1.0, 1.0 + 1e-9, 1.0 + 2e-9]));
        assert_eq!(border(&left, &right, 2.0, 1e-10).unwrap(), 1);
        let (left, right) = (chain(0, &[1.0, 1.0 + 1e-9]), chain(1, &[1.0 + 1e-9, 1.0 + 2e-9]));
        assert!(matches!(border(&left, &right, 2.0, 1e-10), Err(Trouble::Again(seen)) if seen.contains("cluster")));
    }
}
