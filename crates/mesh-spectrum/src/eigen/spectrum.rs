//! How far every component's spectrum must be known for the lowest pairs of all together.
//!
//! Inertia counts are additive over components: a value with K + 1 eigenvalues of all components below it says how many
//! pairs each of them has to deliver, before any has been computed.

use rayon::prelude::*;

use crate::eigen::block::Pool;
use crate::eigen::component::{Component, DENSE_SHARE, Pairs, mix};
use crate::eigen::kernel::Kind;
use crate::eigen::weyl::Weyl;
use crate::eigen::{EigenError, Progress};

/// At least the `count` lowest pairs of all components together, and one more where there is one.
pub(crate) fn lowest(
    components: &[Component],
    dense: &[bool],
    count: usize,
    tolerance: f64,
    seed: u64,
    kind: Kind,
    progress: &Progress,
) -> Result<Vec<Pairs>, EigenError> {
    let solve_dense = |component: &Component| {
        progress.go_on()?;
        component.solve_dense()
    };
    let mut solved: Vec<Option<Pairs>> = components
        .par_iter()
        .zip(dense)
        .map(|(component, dense)| dense.then(|| solve_dense(component)).transpose())
        .collect::<Result<_, _>>()?;
    let area = components.iter().map(|component| component.area).sum();
    let law = Weyl::closed(area, Some(components.iter().map(Component::rows).sum()));
    let (top, below) = top(components, &solved, law, count, progress)?;
    let aim = aim(law, top, below.iter().sum(), count);
    components
        .par_iter()
        .zip(&mut solved)
        .zip(&below)
        .enumerate()
        .map(|(number, ((component, solved), &below))| match solved.take() {
            Some(mut pairs) => {
                pairs.truncate(below);
                progress.add(below);
                Ok(pairs)
            }
            None if below as f64 > DENSE_SHARE * component.rows() as f64 => {
                let mut pairs = solve_dense(component)?;
                pairs.truncate(below);
                progress.add(below);
                Ok(pairs)
            }
            None => {
                // Components are of different sizes, so each has blocks of its own.
                let tools = (kind, &Pool::default());
                component.solve_sliced((top, aim), below, tolerance, mix(seed, number as u64), tools, progress)
            }
        })
        .collect()
}

/// The share of what Weyl's law says λ_K is below a value with a known count that λ_K is taken to be: it varies by a pair or
/// two.
const AIM: f64 = 0.98;

/// About λ_K, which residuals are relative to, and rather less than more.
fn aim(law: Weyl, top: f64, total: usize, count: usize) -> f64 {
    let last = law.through(top, total as f64).inverse(count as f64);
    if last < top { AIM * last } else { top }
}

/// A value with at least count + 1 eigenvalues of all components below it, not many more, and how many of each.
/// Sylvester's law counts them; Weyl's law says where to look.
fn top(
    components: &[Component],
    solved: &[Option<Pairs>],
    law: Weyl,
    count: usize,
    progress: &Progress,
) -> Result<(f64, Vec<usize>), EigenError> {
    let dofs: usize = components.iter().map(Component::rows).sum();
    let wanted = (count + 1).min(dofs);
    let all_dense = solved.iter().all(Option::is_some);
    if wanted == dofs && all_dense {
        return Ok((f64::INFINITY, components.iter().map(Component::rows).collect()));
    }
    if all_dense {
        let mut all: Vec<f64> = solved.iter().flatten().flat_map(|pairs| pairs.eigenvalues.iter().copied()).collect();
        all.sort_by(f64::total_cmp);
        let top = all[wanted - 1]; // included
        let below =
            solved.iter().flatten().map(|pairs| pairs.eigenvalues.iter().filter(|&&e| e <= top).count()).collect();
        return Ok((top, below));
    }
    // Counting a few more costs as many pairs more; counting again costs a factorisation.
    let enough = wanted..=(wanted + 4 + count / 125).min(dofs);
    let (mut low, mut high) = (0.0, 2.0 * components.iter().map(|component| component.norm).fold(0.0, f64::max));
    let mut at = law.inverse(wanted as f64).min(0.5 * high);
    for round in 0..200 {
        progress.go_on()?;
        let counts: Option<Vec<usize>> = components
            .par_iter()
            .zip(solved)
            .map(|(component, solved)| match solved {
                Some(pairs) => Some(pairs.eigenvalues.iter().filter(|&&e| e < at).count()),
                None => component.count_below(at, progress),
            })
            .collect();
        let Some(below) = counts else {
            at *= 1.0 + 1e-5; // on an eigenvalue, to rounding
            continue;
        };
        let total = below.iter().sum::<usize>();
        // A bracket this narrow holds a cluster: take it whole.
        if enough.contains(&total) || (total >= wanted && high - low < 1e-7 * high) {
            return Ok((at, below));
        }
        if total < wanted {
            low = at
        } else {
            high = at
        }
        let guess = law
            .through(at, total as f64)
            .inverse(*enough.start() as f64 + 0.5 * (*enough.end() - *enough.start()) as f64);
        at = if guess > low && guess < high && round < 8 { guess } else { 0.5 * (low + high) };
        if high - low < 1e-7 * high {
            at = high;
        }
    }
    Err(EigenError::NotConverged {
        found: 0,
        wanted: count,
        detail: format!("no shift counts {wanted} eigenvalues, between {low:e} and {high:e}"),
    })
}

/// Keeps the `count` lowest pairs of all components (ties by component); returns the next eigenvalue, if known.
/// Eigenvalues become what is known of them: the first of a component is 0, and none is negative.
pub(crate) fn keep_lowest(solved: &mut [Pairs], count: usize) -> Option<f64> {
    for pairs in solved.iter_mut() {
        pairs.eigenvalues.iter_mut().enumerate().for_each(|(k, e)| *e = if k == 0 { 0.0 } else { e.max(0.0) });
    }
    let mut all: Vec<(f64, usize)> = solved
        .iter()
        .enumerate()
        .flat_map(|(number, pairs)| pairs.eigenvalues.iter().map(move |&e| (e, number)))
        .collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let next = all.get(count).map(|pair| pair.0);
    all.truncate(count);
    for (number, pairs) in solved.iter_mut().enumerate() {
        pairs.truncate(all.iter().filter(|pair| pair.1 == number).count());
    }
    next
}

impl Pairs {
    fn truncate(&mut self, count: usize) {
        self.eigenvalues.truncate(count);
        self.places.truncate(count);
        self.residuals.iter_mut().for_each(|residuals| residuals.truncate(count));
    }
}
