//! The last step of every component: the exact null vector, orthogonality across slices, and the measured evidence.

use rayon::prelude::*;

use crate::eigen::block::{Row, WIDTH, ZERO};
use crate::eigen::component::{Component, Pairs};
use crate::eigen::gram::{Gram, are_small, couple, larger};
use crate::eigen::kernel::{self, Kind};
use crate::eigen::{EigenError, Orthogonality, Progress};

/// Inner products above this share of what is allowed are removed, once one is above `CLEAN_FROM` of it. Slices leave
/// 1e-12 (inside) to 2e-10 (across a border).
const CLEAN_ABOVE: f64 = 0.8;
const CLEAN_FROM: f64 = 0.9;

/// Inner products above this are no rounding: the same eigenspace was taken twice. Below it the vectors span what they
/// should, even where slivers make rounding large, and residuals measured afterwards decide whether they are eigenvectors.
const OVERLAP_MAX: f64 = 1e-2;

/// What was measured on the vectors.
#[derive(Debug, Clone)]
pub(crate) struct Evidence {
    /// max ‖A v − λ v‖, 1/ℓ².
    pub(crate) residual: f64,
    /// max |Vᵀ V − I|.
    pub(crate) orthogonality: f64,
    /// For each pair, what its vector as stored is to be multiplied with to have length 1.
    pub(crate) scales: Vec<f64>,
}

/// Puts in the null pair in closed form, removes what vectors have in common beyond rounding, and measures.
///
/// # Errors
/// [`EigenError::NotOrthogonal`] if two vectors share more than rounding.
pub(crate) fn finish(
    component: &Component,
    pairs: &mut Pairs,
    orthogonality: Orthogonality,
    kind: Kind,
    progress: &Progress,
) -> Result<Evidence, EigenError> {
    let n = component.rows();
    let count = pairs.eigenvalues.len();
    if count == 0 {
        return Ok(Evidence { residual: 0.0, orthogonality: 0.0, scales: Vec::new() });
    }
    let null = component.null_vector();
    let first = pairs.places[0];
    let block = &mut pairs.vectors[first / WIDTH * n..][..n];
    block.iter_mut().zip(&null).for_each(|(row, null)| row[first % WIDTH] = *null);

    let used: Vec<usize> = pairs.places.chunk_by(|a, b| a / WIDTH == b / WIDTH).map(|same| same[0] / WIDTH).collect();
    // Place of each pair among the blocks in use.
    let mut places = Vec::with_capacity(count);
    for (i, same) in pairs.places.chunk_by(|a, b| a / WIDTH == b / WIDTH).enumerate() {
        places.extend(same.iter().map(|place| WIDTH * i + place % WIDTH));
    }
    let mut blocks: Vec<&mut [Row]> = pairs.vectors.chunks_exact_mut(n).collect();
    let mut number = 0;
    blocks.retain(|_| {
        number += 1;
        used.binary_search(&(number - 1)).is_ok()
    });

    let mut gram = Gram::of(&blocks, kind, progress)?;
    let mut loss = gram.loss(&places);
    if loss.is_nan() || loss > OVERLAP_MAX {
        return Err(EigenError::NotOrthogonal { loss });
    }
    let allowed = orthogonality.allowed();
    let (above, enough) = match orthogonality {
        Orthogonality::Standard => (CLEAN_ABOVE * allowed, CLEAN_FROM * allowed),
        Orthogonality::Full => (0.0, 0.0),
    };
    let mut touched = vec![false; blocks.len()];
    touched[0] = true; // it has the null vector now
    for pass in 0..4 {
        // Slivers may need several passes. Full orthogonality is one at least, and more only where it is not yet there.
        if loss <= if pass == 0 { enough } else { enough.max(0.1 * allowed) } {
            break;
        }
        let couplings = gram.couplings(&places, above);
        let changed = couple(&mut blocks, &couplings, kind, progress)?;
        changed.iter().for_each(|&i| touched[i] = true);
        if orthogonality == Orthogonality::Standard && are_small(&couplings) {
            gram.follow(&couplings);
        } else {
            gram.renew(&changed, &blocks, kind, progress)?;
        }
        loss = gram.loss(&places);
    }
    let scales: Vec<f64> = places.iter().map(|&place| 1.0 / gram.entry(place, place).sqrt()).collect();

    // What was measured before holds where nothing has been changed since.
    let known = pairs.residuals.as_ref();
    let mut per_block = vec![Measured { known: 0.0, eigenvalues: ZERO, scales: ZERO }; blocks.len()];
    for (k, (&place, scale)) in places.iter().zip(&scales).enumerate() {
        let block = &mut per_block[place / WIDTH];
        block.eigenvalues[place % WIDTH] = pairs.eigenvalues[k] / component.unit;
        block.scales[place % WIDTH] = *scale;
        block.known = larger(known.map_or(0.0, |known| known[k] * scale), block.known);
    }
    let residual = blocks
        .par_iter()
        .zip(&per_block)
        .enumerate()
        .map(|(number, (block, Measured { known: most, eigenvalues, scales }))| {
            if !touched[number] && known.is_some() {
                return Ok(*most);
            }
            progress.go_on()?;
            let mut squares = ZERO;
            kernel::residual(kind, &component.matrix, block, eigenvalues, &mut squares);
            Ok(component.unit * (0..WIDTH).map(|k| squares[k].sqrt() * scales[k]).fold(0.0, larger))
        })
        .try_reduce(|| 0.0, |a, b| Ok(larger(a, b)))?; // a maximum, the same in any order
    Ok(Evidence { residual, orthogonality: loss, scales })
}

/// What is known of the columns of a block, which need not all belong to a pair.
#[derive(Clone)]
struct Measured {
    /// The largest residual, 1/ℓ², if that has been measured.
    known: f64,
    eigenvalues: Row,
    scales: Row,
}
