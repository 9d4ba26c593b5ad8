//! From slices to one spectrum: cut where neighbours overlap, check that they agree, and that no pair is missing.

use crate::eigen::block::WIDTH;
use crate::eigen::slice::{Slice, Trouble};

/// Two slices are cut apart only at a gap wider than this share of the largest eigenvalue: inside a cluster each would
/// take its own vectors of one eigenspace, and no count could tell.
const CUT_GAP: f64 = 1e-6;

/// Joins the slices of one component, in ascending order, each pair taken from one of them. Result: eigenvalues, and
/// vectors one after another.
///
/// Between two shifts the left slice numbers its pairs from the lower shift's count upwards, the right one from the
/// upper shift's count downwards. Where both found a pair of the same number, its eigenvalues must agree: had either
/// missed one, the numbers would be shifted.
pub(crate) fn assemble(slices: Vec<Slice>, top: f64, tolerance: f64) -> Result<(Vec<f64>, Vec<f64>), Trouble> {
    let mut borders = vec![slices.first().map_or(0, |slice| slice.first)];
    for pair in slices.windows(2) {
        borders.push(border(&pair[0], &pair[1], top, tolerance)?);
    }
    borders.extend(slices.last().map(Slice::end));

    let (mut eigenvalues, mut vectors) = (Vec::new(), Vec::new());
    for (slice, ends) in slices.into_iter().zip(borders.windows(2)) {
        for number in ends[0]..ends[1] {
            let k = number - slice.first;
            eigenvalues.push(slice.eigenvalues[k]);
            vectors.extend(slice.vectors[k / WIDTH].iter().map(|row| row[k % WIDTH]));
        }
    }
    Ok((eigenvalues, vectors))
}

/// The number of the first pair to take from the right slice.
fn border(left: &Slice, right: &Slice, top: f64, tolerance: f64) -> Result<usize, Trouble> {
    for number in right.first..left.end() {
        if let (Some(a), Some(b)) = (left.eigenvalue(number), right.eigenvalue(number))
            && (a - b).abs() > 10.0 * tolerance * top
        {
            return Err(Trouble::Again(format!(
                "eigenvalue {number} is {a:e} from one shift and {b:e} from the next: one is missing"
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
            "a cluster of more than {} pairs between two shifts",
            left.end().saturating_sub(right.first)
        ))),
    }
}

impl Slice {
    /// One more than the number of the highest pair.
    fn end(&self) -> usize {
        self.first + self.eigenvalues.len()
    }

    /// The eigenvalue of a number in the component's spectrum, if this slice found it.
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
    use crate::eigen::block::{Row, ZERO};

    /// Vectors of one entry, the eigenvalue.
    fn slice(first: usize, eigenvalues: &[f64]) -> Slice {
        let block = |chunk: &[f64]| {
            let mut row: Row = ZERO;
            row.0[..chunk.len()].copy_from_slice(chunk);
            vec![row]
        };
        Slice { first, eigenvalues: eigenvalues.to_vec(), vectors: eigenvalues.chunks(WIDTH).map(block).collect() }
    }

    #[test]
    fn slices_are_cut_at_the_widest_gap_of_their_overlap() {
        let left = slice(0, &[0.0, 1.0, 2.0, 3.5, 3.6]);
        let right = slice(2, &[2.0, 3.5, 3.6, 4.0]);
        assert_eq!(border(&left, &right, 4.0, 1e-10).unwrap(), 3);
        let (eigenvalues, vectors) = assemble(vec![left, right], 4.0, 1e-10).unwrap();
        assert_eq!(eigenvalues, [0.0, 1.0, 2.0, 3.5, 3.6, 4.0]);
        assert_eq!(vectors, eigenvalues);
    }

    #[test]
    fn a_missing_pair_is_noticed() {
        // The left slice has not found 2.5, so its numbers are one too low from there on.
        let (left, right) = (slice(0, &[0.0, 1.0, 2.0, 3.0]), slice(2, &[2.0, 2.5, 3.0]));
        assert!(matches!(border(&left, &right, 4.0, 1e-10), Err(Trouble::Again(seen)) if seen.contains("missing")));
        assert!(check_counts(&[0.0, 1.0, 2.0, 3.0], &[(2.6, 4)]).is_err());
        assert_eq!(check_counts(&[0.0, 1.0, 2.0, 2.5], &[(2.6, 4)]).unwrap(), [(2.6, 4, 4)]);
    }

    #[test]
    fn a_cluster_is_not_cut() {
        let (left, right) = (slice(0, &[0.0, 1.0, 1.0 + 1e-9]), slice(1, &[1.0, 1.0 + 1e-9, 1.0 + 2e-9]));
        assert_eq!(border(&left, &right, 2.0, 1e-10).unwrap(), 1);
        let (left, right) = (slice(0, &[1.0, 1.0 + 1e-9]), slice(1, &[1.0 + 1e-9, 1.0 + 2e-9]));
        assert!(matches!(border(&left, &right, 2.0, 1e-10), Err(Trouble::Again(seen)) if seen.contains("cluster")));
    }
}
