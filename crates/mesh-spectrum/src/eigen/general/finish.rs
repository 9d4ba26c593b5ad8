//! The last step: M-orthonormal vectors, Rayleigh quotients, the measured evidence, and the basis on vertices.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};

use super::Pairs;
use super::pencil::{Pencil, times};
use crate::eigen::basis::{Eigenbasis, Measured, counts};
use crate::eigen::output::fix_sign;
use crate::eigen::seconds::Step;
use crate::eigen::slice::{Trouble, norm};
use crate::eigen::{EigenError, EigenOptions, Progress};
use crate::operator::Operator;

/// Inner products above this are not made orthogonal but an error: the same eigenspace was taken twice. Below it the
/// vectors span what they should, and the residuals, measured afterwards, decide whether they are eigenvectors.
const OVERLAP_MAX: f64 = 1e-2;

/// Makes the vectors of a component B-orthonormal, the first the null vector in closed form. Eigenvalues stay the Ritz
/// values, which are exact to rounding of 1/(λ − σ), where Rayleigh quotients would take up the upper end's noise.
pub(super) fn orthonormalise(
    pencil: &Pencil,
    eigenvalues: &[f64],
    vectors: &mut Vec<f64>,
    progress: &Progress,
) -> Result<(), Trouble> {
    let (n, count) = (pencil.rows(), eigenvalues.len());
    if count == 0 {
        return Ok(());
    }
    let mut x = MatRef::from_column_major_slice(&vectors[..], n, count).to_owned();
    progress.go_on()?;
    progress.clock.time(Step::Vectors, || smooth(pencil, eigenvalues, &mut x));
    let null = pencil.null_vector();
    x.col_mut(0).iter_mut().zip(&null).for_each(|(x, null)| *x = *null);
    for round in 0..5 {
        progress.go_on()?;
        let mut gram = Mat::<f64>::zeros(count, count);
        matmul(gram.as_mut(), Accum::Replace, x.transpose(), times(&pencil.b, &x).as_ref(), 1.0, Par::Seq);
        // Lengths first: what is left is then small off the diagonal.
        let length: Vec<f64> = (0..count).map(|k| gram[(k, k)].sqrt()).collect();
        let turn = Mat::from_fn(count, count, |i, j| {
            let off = gram[(i, j)] / (length[i] * length[j]);
            let share = if i == j {
                1.0
            } else if i == 0 {
                -off
            } else if j == 0 {
                0.0
            } else {
                -0.5 * off
            };
            share / length[i]
        });
        let worst = (0..count)
            .flat_map(|j| (0..j).map(move |i| (i, j)))
            .map(|(i, j)| (gram[(i, j)] / (length[i] * length[j])).abs())
            .fold(0.0, f64::max);
        if round == 0 && (worst.is_nan() || worst > OVERLAP_MAX) {
            return Err(Trouble::Again(format!("vectors of two intervals have an inner product of {worst:e}")));
        }
        // x = X/|x| (3I − G)/2 without its diagonal: Löwdin's first step; what is left is of the square.
        x = &x * &turn;
        if worst < 1e-13 {
            break;
        }
    }
    *vectors = (0..count).flat_map(|k| x.col(k).iter().copied().collect::<Vec<_>>()).collect();
    Ok(())
}

/// Damps rounding noise at the upper end of the spectrum, which residuals multiply by its eigenvalues: four steps
/// x ← x − ω (A − λB) x, with ω at the Chebyshev points of [‖A‖/8, ‖A‖]. Eigenvectors stay as they are.
fn smooth(pencil: &Pencil, eigenvalues: &[f64], x: &mut Mat<f64>) {
    let high = norm(&pencil.a);
    for step in 0..4 {
        let point = (std::f64::consts::PI * (f64::from(step) + 0.5) / 4.0).cos();
        let omega = 1.0 / (high * (0.5625 + 0.4375 * point));
        let (stiff, mass) = (times(&pencil.a, x), times(&pencil.b, x));
        for (k, &eigenvalue) in eigenvalues.iter().enumerate() {
            let residual = stiff.col(k).iter().zip(mass.col(k).iter()).map(|(a, b)| a - eigenvalue * b);
            x.col_mut(k).iter_mut().zip(residual).for_each(|(x, r)| *x -= omega * r);
        }
    }
}

/// Residual of each pair in the B⁻¹ norm, and max |Vᵀ B V − I|.
fn evidence(pencil: &Pencil, pairs: &Pairs) -> Result<(f64, f64), EigenError> {
    let (n, count) = (pencil.rows(), pairs.eigenvalues.len());
    if count == 0 {
        return Ok((0.0, 0.0));
    }
    let x = MatRef::from_column_major_slice(&pairs.vectors[..], n, count).to_owned();
    let mass = times(&pencil.b, &x);
    let mut gram = Mat::<f64>::zeros(count, count);
    matmul(gram.as_mut(), Accum::Replace, x.transpose(), mass.as_ref(), 1.0, Par::Seq);
    let off = |i: usize, j: usize| (gram[(i, j)] - if i == j { 1.0 } else { 0.0 }).abs();
    let loss = (0..count).flat_map(|j| (0..count).map(move |i| (i, j))).map(|(i, j)| off(i, j));
    let loss = loss.fold(0.0, |most: f64, x| if x.is_nan() { x } else { most.max(x) });
    let mut residual = times(&pencil.a, &x);
    for (k, &eigenvalue) in pairs.eigenvalues.iter().enumerate() {
        residual.col_mut(k).iter_mut().zip(mass.col(k).iter()).for_each(|(r, m)| *r -= eigenvalue * m);
    }
    let mut solved = residual.clone();
    let out_of_memory = EigenError::OutOfMemory { dofs: n };
    let dense = |solved: &mut Mat<f64>| {
        let mut b = Mat::<f64>::zeros(n, n);
        (0..n).for_each(|i| pencil.b.row(i).for_each(|(j, value)| b[(i, j)] = value));
        let Ok(factor) = b.llt(faer::Side::Lower) else { return false };
        faer::linalg::solvers::SolveCore::solve_in_place_with_conj(&factor, faer::Conj::No, solved.as_mut());
        true
    };
    let done = match pencil.factor_mass() {
        Some(factor) => factor.solve(solved.as_mut()),
        None if pairs.dense => dense(&mut solved),
        None => false,
    };
    if !done {
        return Err(out_of_memory);
    }
    let square = |k: usize| residual.col(k).iter().zip(solved.col(k).iter()).map(|(r, s)| r * s).sum::<f64>();
    let most = (0..count).map(|k| square(k).max(0.0).sqrt()).fold(0.0, f64::max);
    Ok((most, loss))
}

/// The basis of all components on vertices, with its certificate.
pub(super) fn finish(
    operator: &Operator,
    pencils: &[Pencil],
    mut solved: Vec<Pairs>,
    (count, options): (usize, &EigenOptions),
    progress: &Progress,
) -> Result<Eigenbasis, EigenError> {
    for (pencil, pairs) in pencils.iter().zip(&mut solved).filter(|(_, pairs)| pairs.dense) {
        pairs.eigenvalues.iter_mut().enumerate().for_each(|(k, e)| *e = if k == 0 { 0.0 } else { e.max(0.0) });
        let again = orthonormalise(pencil, &pairs.eigenvalues, &mut pairs.vectors, progress);
        again.map_err(|trouble| match trouble {
            Trouble::Fatal(error) => error,
            Trouble::Again(detail) => EigenError::NotConverged { found: 0, wanted: count, detail },
        })?;
    }
    let mut order: Vec<(usize, usize)> =
        (0..solved.len()).flat_map(|number| (0..solved[number].eigenvalues.len()).map(move |k| (number, k))).collect();
    let eigenvalue = |&(number, k): &(usize, usize)| solved[number].eigenvalues[k];
    order.sort_by(|a, b| eigenvalue(a).total_cmp(&eigenvalue(b)).then(a.cmp(b)));
    let next = order.get(count).map(eigenvalue);
    order.truncate(count);
    let eigenvalues: Vec<f64> = order.iter().map(eigenvalue).collect();

    let vertices = operator.vertex_mass.len();
    let mut row_of_dof = vec![0u32; operator.mass.len()];
    for pencil in pencils {
        pencil.dofs.iter().zip(0..).for_each(|(&dof, row)| row_of_dof[dof as usize] = row);
    }
    let mut eigenvectors = vec![0.0; order.len() * vertices];
    for (phi, &(number, k)) in eigenvectors.chunks_mut(vertices).zip(&order) {
        let pencil = &pencils[number];
        let v = &solved[number].vectors[k * pencil.rows()..][..pencil.rows()];
        for (vertex, &dof) in operator.dof_of_vertex.iter().enumerate() {
            if operator.component_of_dof[dof as usize] as usize == number {
                let row = row_of_dof[dof as usize] as usize;
                phi[vertex] = v[row] / pencil.root_mass[row];
            }
        }
        fix_sign(phi);
    }
    operator.fill_followers(&mut eigenvectors);
    for (number, pairs) in solved.iter_mut().enumerate() {
        let kept = order.iter().filter(|pair| pair.0 == number).count();
        pairs.eigenvalues.truncate(kept);
        pairs.vectors.truncate(kept * pencils[number].rows());
    }
    let mut measured = (0.0f64, 0.0f64);
    for (pencil, pairs) in pencils.iter().zip(&solved) {
        progress.go_on()?;
        let (residual, loss) = progress.clock.time(Step::Certify, || evidence(pencil, pairs))?;
        measured = (measured.0.max(residual), measured.1.max(loss));
    }

    let measured = Measured {
        residual: measured.0,
        orthogonality: measured.1,
        norm: pencils.iter().map(Pencil::norm).fold(0.0, f64::max),
        next,
        counts: counts(solved.iter().map(|pairs| &pairs.counts[..])),
        components: pencils.len(),
        dense: solved.iter().filter(|pairs| pairs.dense).count(),
    };
    let basis = Eigenbasis::new(eigenvalues, eigenvectors, vertices, measured, options.tolerance).checked(options)?;
    progress.add(0);
    Ok(basis)
}
