//! The lowest eigenpairs of L φ = λ M φ for a mass matrix M that is not diagonal.
//!
//! The mass cannot be scaled out here, so every inner product is an M-product. The path is the plain one: inertia counts
//! cut the spectrum of each connected component into intervals (`pencil`); each interval's pairs come from a shift-invert
//! block Lanczos run of its own with full reorthogonalisation and the library's solves (`krylov`); `finish` makes all of
//! them M-orthonormal and measures them. Correct first: it takes several times as long as the solver for diagonal mass
//! (docs/operators.md).

mod finish;
mod krylov;
mod pencil;

use rayon::prelude::*;

use crate::eigen::basis::Eigenbasis;
use crate::eigen::component::{DENSE_SHARE, mix};
use crate::eigen::seconds::Step;
use crate::eigen::slice::Trouble;
use crate::eigen::weyl::Weyl;
use crate::eigen::{EigenError, EigenOptions, Progress, Watch, check, memory};
use crate::operator::{Csr, Operator};
use pencil::Pencil;

/// Pairs of an interval.
const PAIRS: usize = 56;

/// Intervals meet only where the spectrum has a gap of at least this share of the largest eigenvalue.
const GAP: f64 = 1e-6;

/// The pairs of one component, ascending.
struct Pairs {
    eigenvalues: Vec<f64>,
    /// One vector after another on the component's rows, M-orthonormal.
    vectors: Vec<f64>,
    /// Shifts with the eigenvalues found and counted below them.
    counts: Vec<(f64, usize, usize)>,
    dense: bool,
}

/// What [`crate::eigenbasis`] does where the operator has a mass matrix; the same promises.
pub(crate) fn eigenbasis(
    operator: &Operator,
    mass: &Csr,
    options: &EigenOptions,
    watch: &dyn Watch,
) -> Result<Eigenbasis, EigenError> {
    let count = check(options)?.min(operator.mass.len());
    let progress = Progress::new(watch, count);
    let clock = &progress.clock;
    let vertices = operator.vertex_mass.len();
    // The result alone, before anything is built.
    memory::check(count.saturating_mul(vertices).saturating_mul(8), options.memory_limit)?;
    let mut pencils = clock.time(Step::Order, || Pencil::split(operator, mass))?;
    let area: f64 = operator.mass.iter().sum();
    let is_dense = |pencil: &Pencil| {
        let expected = 1.2 * pencil.area / area * count as f64 + 2.0;
        pencil.rows() <= options.dense_below.max(16) || expected > DENSE_SHARE * pencil.rows() as f64
    };
    let dense: Vec<bool> = pencils.iter().map(is_dense).collect();
    let sliced = pencils.par_iter_mut().zip(&dense).filter(|(_, dense)| !**dense);
    sliced.try_for_each(|(pencil, _)| clock.time(Step::Order, || pencil.prepare()))?;
    let expected = bytes_expected(&pencils, &dense, count, vertices);
    memory::check(expected, options.memory_limit)?;
    let solve_dense = |(pencil, dense): (&Pencil, &bool)| {
        progress.go_on()?;
        dense.then(|| clock.time(Step::Project, || pencil.solve_dense(count.min(pencil.rows())))).transpose()
    };
    let mut solved: Vec<Option<Pairs>> =
        pencils.par_iter().zip(&dense).map(solve_dense).collect::<Result<_, EigenError>>()?;
    let (top, below) = top(&pencils, &solved, count, &progress)?;
    let tolerance = options.tolerance.min(1e-8);
    let solved: Vec<Pairs> = pencils
        .par_iter()
        .zip(&mut solved)
        .zip(&below)
        .enumerate()
        .map(|(number, ((pencil, solved), &below))| match solved.take() {
            Some(mut pairs) => {
                pairs.eigenvalues.truncate(below);
                pairs.vectors.truncate(below * pencil.rows());
                progress.add(below);
                Ok(pairs)
            }
            None => in_intervals(pencil, top, below, tolerance, mix(options.seed, number as u64), &progress),
        })
        .collect::<Result<_, EigenError>>()?;
    let mut basis = finish::finish(operator, &pencils, solved, (count, options), &progress)?;
    basis.certificate.seconds = clock.seconds();
    basis.certificate.factorisations = clock.times(Step::Factor);
    basis.certificate.solves = krylov::WIDTH * clock.times(Step::Solve);
    basis.certificate.peak_bytes = expected;
    Ok(basis)
}

/// Bytes of everything at its largest, with the result.
fn bytes_expected(pencils: &[Pencil], dense: &[bool], count: usize, vertices: usize) -> usize {
    let area: f64 = pencils.iter().map(|pencil| pencil.area).sum();
    let (mut kept, mut working) = (0, Vec::new());
    for (pencil, dense) in pencils.iter().zip(dense) {
        let n = pencil.rows();
        let pairs = ((pencil.area / area * count as f64) as usize + 2).min(n);
        // The pairs, and while they are made orthonormal, their products with A and B and what they become.
        kept += pencil.bytes() + 8 * n * 4 * pairs;
        let space = 90 + 7 * PAIRS / 2; // columns that an interval needs, with its pairs
        let one = if *dense { 48 * n * n } else { pencil.factor_bytes() + 8 * n * space.min(2 * n) };
        working.extend((0..if *dense { 1 } else { pairs.div_ceil(PAIRS) }).map(|_| one));
    }
    // As many at a time as there are threads, the largest of them.
    working.sort_unstable_by(|a, b| b.cmp(a));
    kept + working.iter().take(rayon::current_num_threads()).sum::<usize>().max(8 * count * vertices)
}

/// A value with at least count + 1 eigenvalues of all components below it, not many more, and how many of each.
fn top(
    pencils: &[Pencil],
    solved: &[Option<Pairs>],
    count: usize,
    progress: &Progress,
) -> Result<(f64, Vec<usize>), EigenError> {
    let dofs: usize = pencils.iter().map(Pencil::rows).sum();
    let wanted = (count + 1).min(dofs);
    if solved.iter().all(Option::is_some) {
        let mut all: Vec<f64> = solved.iter().flatten().flat_map(|pairs| pairs.eigenvalues.iter().copied()).collect();
        all.sort_by(f64::total_cmp);
        let top = all[wanted - 1]; // included
        let below = |pairs: &Pairs| pairs.eigenvalues.iter().filter(|&&e| e <= top).count();
        return Ok((top, solved.iter().flatten().map(below).collect()));
    }
    let enough = wanted..=(wanted + 4 + count / 40).min(dofs);
    let area: f64 = pencils.iter().map(|pencil| pencil.area).sum();
    let (mut low, mut high) = (0.0, 2.0 * pencils.iter().map(Pencil::norm).fold(0.0, f64::max));
    let law = Weyl::closed(area, None);
    let mut at = law.inverse(wanted as f64).min(0.5 * high);
    let clock = &progress.clock;
    let counts = |at: f64| -> Option<Vec<usize>> {
        let below = |(pencil, solved): (&Pencil, &Option<Pairs>)| match solved {
            Some(pairs) => Some(pairs.eigenvalues.iter().filter(|&&e| e < at).count()),
            None => pencil.factor(at, clock).filter(|factor| factor.pivot_min > 1e-9 * at).map(|factor| factor.below),
        };
        pencils.par_iter().zip(solved).map(below).collect()
    };
    for round in 0..200 {
        progress.go_on()?;
        let Some(below) = counts(at) else {
            at *= 1.0 + 1e-5; // on an eigenvalue, to rounding
            continue;
        };
        let total = below.iter().sum::<usize>();
        // A bracket this narrow holds a cluster: take it whole.
        if enough.contains(&total) || (total >= wanted && high - low < 1e-7 * high) {
            return in_a_gap(counts, at, GAP * at, f64::INFINITY).ok_or_else(|| EigenError::NotConverged {
                found: 0,
                wanted: count,
                detail: format!("no gap in the spectrum above {at:e}"),
            });
        }
        if total < wanted {
            low = at
        } else {
            high = at
        }
        let middle = 0.5 * (*enough.start() + *enough.end()) as f64;
        let guess = law.through(at, total as f64).inverse(middle);
        at = if guess > low && guess < high && round < 8 { guess } else { 0.5 * (low + high) };
        if high - low < 1e-7 * high {
            at = high;
        }
    }
    let detail = format!("no shift counts {wanted} eigenvalues, between {low:e} and {high:e}");
    Err(EigenError::NotConverged { found: 0, wanted: count, detail })
}

/// The first value from `at` on, below `limit`, around which there is no eigenvalue within half of `gap`, and the counts
/// there. A border inside a cluster would give each side its own vectors of one eigenspace.
fn in_a_gap<T: PartialEq>(counts: impl Fn(f64) -> Option<T>, at: f64, gap: f64, limit: f64) -> Option<(f64, T)> {
    let (mut at, mut step) = (at, gap);
    for _ in 0..60 {
        if at + gap >= limit {
            return None;
        }
        match (counts(at), counts(at + gap)) {
            (Some(low), Some(high)) if low == high => return Some((at + 0.5 * gap, low)),
            _ => (at, step) = (at + step, 1.5 * step),
        }
    }
    None
}

/// The `count` pairs of a component below `top`, interval by interval.
fn in_intervals(
    pencil: &Pencil,
    top: f64,
    count: usize,
    tolerance: f64,
    seed: u64,
    progress: &Progress,
) -> Result<Pairs, EigenError> {
    let mut detail = String::new();
    for attempt in 0..4 {
        match intervals(pencil, top, count, attempt, progress).and_then(|borders| {
            let solve = |(k, ends): (usize, &[(f64, usize)])| {
                let interval = krylov::Interval { low: ends[0].0, high: ends[1].0, pairs: ends[1].1 - ends[0].1, top };
                krylov::solve(pencil, interval, tolerance, mix(seed, 100 * attempt as u64 + k as u64), progress)
            };
            progress.expect_slices(borders.len() - 1);
            let parts: Vec<_> = borders.par_windows(2).enumerate().map(solve).collect::<Result<Vec<_>, Trouble>>()?;
            let (eigenvalues, vectors): (Vec<Vec<f64>>, Vec<Vec<f64>>) = parts.into_iter().unzip();
            let (mut eigenvalues, mut vectors) = (eigenvalues.concat(), vectors.concat());
            finish::orthonormalise(pencil, &eigenvalues, &mut vectors, progress)?;
            let found = |shift: f64| eigenvalues.iter().filter(|&&eigenvalue| eigenvalue < shift).count();
            let counts: Vec<_> = borders[1..].iter().map(|&(at, below)| (at, found(at), below)).collect();
            if let Some((at, found, counted)) = counts.iter().find(|(_, found, counted)| found != counted) {
                return Err(Trouble::Again(format!("{found} eigenvalues found below {at:e}, {counted} counted")));
            }
            eigenvalues[0] = 0.0; // the null vector's, in closed form
            Ok(Pairs { eigenvalues, vectors, counts, dense: false })
        }) {
            Err(Trouble::Again(seen)) => detail = seen,
            Err(Trouble::Fatal(error)) => return Err(error),
            Ok(pairs) => return Ok(pairs),
        }
    }
    Err(EigenError::NotConverged { found: 0, wanted: count, detail })
}

/// Borders of the intervals, with the eigenvalues below each: from 0 to `top`, ascending.
fn intervals(
    pencil: &Pencil,
    top: f64,
    count: usize,
    attempt: usize,
    progress: &Progress,
) -> Result<Vec<(f64, usize)>, Trouble> {
    let weyl = Weyl::closed(pencil.area, None).through(top, count as f64);
    let wanted = count.div_ceil(PAIRS) + attempt;
    let guesses: Vec<f64> = (1..wanted).map(|k| weyl.inverse((k * count) as f64 / wanted as f64)).collect();
    let at = |shift: f64| -> Result<Option<(f64, usize)>, Trouble> {
        progress.go_on()?;
        Ok(in_a_gap(|at| pencil.factor(at, &progress.clock).map(|factor| factor.below), shift, GAP * top, top))
    };
    let mut borders = vec![(f64::NEG_INFINITY, 0), (top, count)];
    borders.extend(guesses.into_par_iter().map(at).collect::<Result<Vec<_>, _>>()?.into_iter().flatten());
    for _ in 0..8 {
        borders.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Where Weyl's law was too far off, halve the interval.
        let crowded = |ends: &&[(f64, usize)]| {
            ends[1].1.saturating_sub(ends[0].1) > 2 * PAIRS && ends[1].0 - ends[0].0.max(0.0) > 1e-5 * top
        };
        let more: Vec<f64> =
            borders.windows(2).filter(crowded).map(|ends| 0.5 * (ends[0].0.max(0.0) + ends[1].0)).collect();
        if more.is_empty() {
            break;
        }
        borders.extend(more.into_par_iter().map(at).collect::<Result<Vec<_>, _>>()?.into_iter().flatten());
    }
    borders.sort_by(|a, b| a.0.total_cmp(&b.0));
    borders.retain(|&(at, _)| at <= top);
    borders.dedup_by_key(|border| border.1); // empty intervals; the lower border stays
    if let Some(last) = borders.last_mut() {
        *last = (top, count);
    }
    if borders.windows(2).any(|ends| ends[0].1 > ends[1].1) {
        return Err(Trouble::Again("inertia counts are not monotone".into()));
    }
    Ok(borders)
}
