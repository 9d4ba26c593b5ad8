//! The lowest eigenpairs of L φ = λ M φ, with the evidence that they are right and that none is missing.
//!
//! In the order of the work: `component` (mass scaled out, one connected component at a time), `order` (elimination
//! order), `spectrum` (how far each one's spectrum must go), `factor` with `front` (L D Lᵀ and inertia), `solve` (its
//! solves), `chain` (shifts, one after another),
//! `slice` (the pairs around a shift), `krylov` with `projected`, `tridiagonal` and `loss` (the space they are found in),
//! `assemble` (chains to a spectrum), `finish` with `gram` and `single` (orthogonality, residuals), `output` (eigenvectors on
//! vertices), `basis` (the result). `kernel` with `arithmetic` (which instructions), `products`, `parts` (the same on several
//! threads), `block` and `pages` hold what the time is spent in. `dense` solves small components; `general` does all of it
//! for a mass that is not diagonal.

mod arithmetic;
mod assemble;
mod basis;
mod block;
mod chain;
mod component;
mod dense;
mod factor;
mod finish;
mod front;
mod general;
mod gram;
mod kernel;
mod krylov;
mod loss;
mod memory;
mod order;
mod output;
mod pages;
mod parts;
mod polish;
mod products;
mod projected;
mod seconds;
mod single;
mod slice;
mod solve;
mod spectrum;
mod tridiagonal;
mod weyl;

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use thiserror::Error;

use crate::operator::Operator;
pub use basis::{Certificate, Eigenbasis, InertiaCount, Method};
use block::WIDTH;
use component::{Component, DENSE_BELOW, DENSE_SHARE, Pairs};
use finish::finish;
use kernel::Kind;
pub use seconds::Seconds;
use seconds::{Clock, Step};
use spectrum::{keep_lowest, lowest};

/// How many eigenpairs, and how exactly.
#[derive(Debug, Clone, PartialEq)]
pub struct EigenOptions {
    /// K, eigenpairs wanted; all there are if fewer. Default 500 (Iza-Teran and Garcke 2018). Time grows in proportion,
    /// memory by 8 N bytes a pair.
    pub count: usize,
    /// A pair is accepted when ‖L φ − λ M φ‖ in the M⁻¹ norm is below tolerance × λ_K. Default 1e-10, which leaves
    /// eigenvalues exact to about 1e-12 λ_K. A looser one saves little: the solver never aims at less than 1e-8, which
    /// keeps vectors of neighbouring slices apart.
    pub tolerance: f64,
    /// Seed of the random start vectors. Default 1. Another seed gives the same spectrum with other rounding.
    pub seed: u64,
    /// Components of at most this many degrees of freedom, and those of which nearly all pairs are wanted, go through
    /// the dense solver. Default 400: a slice solves a dense problem of 250 to 300 itself. The dense solver takes
    /// O(n³) time.
    pub dense_below: usize,
    /// How far eigenvectors may be from orthonormal. Default [`Orthogonality::Standard`].
    pub orthogonality: Orthogonality,
    /// Which instructions to use. Default [`Instructions::Best`]. Bytes are the same for the same instructions.
    pub instructions: Instructions,
    /// Bytes that may be used, with the result. Default `None`: what the system says is available, where it says so.
    pub memory_limit: Option<usize>,
}

/// How far from orthonormal eigenvectors may be, max |Φᵀ M Φ − I|.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Orthogonality {
    /// At most 1e-10.
    #[default]
    Standard,
    /// At most 1e-12, for 3 N K² operations more.
    Full,
}

impl Orthogonality {
    /// The largest entry allowed.
    fn allowed(self) -> f64 {
        match self {
            Orthogonality::Standard => 1e-10,
            Orthogonality::Full => 1e-12,
        }
    }
}

/// Instructions of the processor that the solver's own products are compiled for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Instructions {
    /// The best that this processor has.
    #[default]
    Best,
    /// AVX2 and FMA at most.
    Avx2,
    /// Those that every processor of the architecture has.
    Portable,
}

impl Instructions {
    fn kind(self) -> Kind {
        match self {
            Instructions::Best => Kind::best(),
            Instructions::Avx2 if Kind::Avx2.is_available() => Kind::Avx2,
            Instructions::Avx2 | Instructions::Portable => Kind::Portable,
        }
    }
}

impl Default for EigenOptions {
    fn default() -> EigenOptions {
        EigenOptions {
            count: 500,
            tolerance: 1e-10,
            seed: 1,
            dense_below: DENSE_BELOW,
            orthogonality: Orthogonality::Standard,
            instructions: Instructions::Best,
            memory_limit: None,
        }
    }
}

/// How a long computation reports to its caller, and how the caller stops it. Called from several threads.
pub trait Watch: Sync {
    /// `done` of `total` units of a stage are done.
    fn step(&self, _stage: &'static str, _done: usize, _total: usize) {}
    /// `done` of about `expected` slices of the spectrum are done; the second grows when one has to be tried again.
    /// Together with the seconds that have passed, an estimate of those that are left.
    fn slices(&self, _done: usize, _expected: usize) {}
    /// Asked often; once it says true, the computation ends with [`EigenError::Stopped`].
    fn stopped(&self) -> bool {
        false
    }
}

/// Silence: what tests and scripts pass.
impl Watch for () {}

/// Why there is no eigenbasis.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum EigenError {
    /// The caller stopped the computation.
    #[error("stopped")]
    Stopped,
    /// An option is out of its range.
    #[error("{option} = {value}: {expected}")]
    Option {
        /// The option's name.
        option: &'static str,
        /// Its value.
        value: f64,
        /// What was expected.
        expected: &'static str,
    },
    /// L or M scale to numbers that cannot be held.
    #[error(
        "degree of freedom {dof}: stiffness divided by mass is not finite; rescale the model or drop its tiny faces"
    )]
    NotFinite {
        /// The degree of freedom, numbered from 0.
        dof: usize,
    },
    /// The factor does not fit in memory.
    #[error("{dofs} degrees of freedom: the factorisation does not fit in memory")]
    OutOfMemory {
        /// Degrees of freedom of the component.
        dofs: usize,
    },
    /// The computation would need more memory than there is.
    #[error(
        "about {needed_mb} MB are needed and {available_mb} MB may be used; ask for fewer eigenpairs, use fewer threads, or a coarser mesh"
    )]
    TooLittleMemory {
        /// Expected at most, 10⁶ bytes.
        needed_mb: usize,
        /// The limit given, or what the system has available, 10⁶ bytes.
        available_mb: usize,
    },
    /// Pairs are missing after all attempts. Nothing is returned, because a spectrum with holes looks like one without.
    #[error("{found} of {wanted} eigenpairs found: {detail}; try another seed, or fewer pairs")]
    NotConverged {
        /// Pairs found.
        found: usize,
        /// Pairs wanted.
        wanted: usize,
        /// What was seen at the last attempt.
        detail: String,
    },
    /// Two vectors share an eigenspace.
    #[error("eigenvectors are not orthogonal: an inner product of {loss:e}; try another seed")]
    NotOrthogonal {
        /// max |Φᵀ M Φ − I|.
        loss: f64,
    },
    /// Residuals are above what was asked for and above what rounding explains.
    #[error(
        "residual {residual:e} of the largest eigenvalue: above the tolerance {tolerance:e} and the rounding floor {floor:e}"
    )]
    Residual {
        /// max ‖L φ − λ M φ‖ / λ_K.
        residual: f64,
        /// The tolerance asked for.
        tolerance: f64,
        /// What rounding alone leaves, relative to λ_K.
        floor: f64,
    },
}

/// The watch, with a common count of pairs found.
pub(crate) struct Progress<'a> {
    watch: &'a dyn Watch,
    done: AtomicUsize,
    total: usize,
    slices: AtomicUsize,
    slices_expected: AtomicUsize,
    pub(crate) clock: Clock,
}

impl<'a> Progress<'a> {
    pub(crate) fn new(watch: &'a dyn Watch, total: usize) -> Progress<'a> {
        let zero = AtomicUsize::default;
        Progress { watch, done: zero(), total, slices: zero(), slices_expected: zero(), clock: Clock::default() }
    }

    /// So many slices more are going to be computed.
    pub(crate) fn expect_slices(&self, slices: usize) {
        self.slices_expected.fetch_add(slices, Ordering::Relaxed);
    }

    /// A slice is done, and with it so many pairs.
    pub(crate) fn slice(&self, pairs: usize) {
        self.add(pairs);
        let done = self.slices.fetch_add(1, Ordering::Relaxed) + 1;
        self.watch.slices(done, self.slices_expected.load(Ordering::Relaxed).max(done));
    }

    /// [`EigenError::Stopped`] once the caller wants no more.
    pub(crate) fn go_on(&self) -> Result<(), EigenError> {
        if self.watch.stopped() { Err(EigenError::Stopped) } else { Ok(()) }
    }

    pub(crate) fn add(&self, pairs: usize) {
        let done = self.done.fetch_add(pairs, Ordering::Relaxed) + pairs;
        self.watch.step("eigenpairs", done.min(self.total), self.total);
    }
}

/// The K lowest eigenpairs of L φ = λ M φ.
///
/// Every connected component is solved by itself and the spectra are merged, so an eigenvector lives on one component
/// and is zero on the others. Null vectors, one a component, are in closed form. Equal components bring equal
/// eigenvalues, which [`Eigenbasis::clusters`] and [`Eigenbasis::sensitive`] report.
///
/// Large components go through shift-invert block Lanczos in slices of the spectrum; Sylvester's law of inertia counts
/// the eigenvalues below every shift, so that none can be missing. The result is the same bytes on any number of
/// threads, on one kind of processor.
///
/// # Errors
/// Pairs that cannot be found, or not to the tolerance, are an error that says so with numbers; never a shorter or
/// poorer basis. [`EigenError::Stopped`] soon after [`Watch::stopped`]: it is asked before every factorisation, every
/// solve with eight right-hand sides, and every 32 768 rows of what takes as long. A factorisation and the dense solver
/// are not interrupted: less than a second for meshes of up to some hundred thousand vertices.
pub fn eigenbasis(operator: &Operator, options: &EigenOptions, watch: &dyn Watch) -> Result<Eigenbasis, EigenError> {
    if let Some(mass) = &operator.mass_matrix {
        return general::eigenbasis(operator, mass, options, watch);
    }
    let &EigenOptions { tolerance, seed, dense_below, orthogonality, instructions, memory_limit, .. } = options;
    let kind = instructions.kind();
    let count = check(options)?.min(operator.mass.len());
    let progress = Progress::new(watch, count);
    let clock = &progress.clock;

    // The result alone, before anything is built.
    memory::check(count.saturating_mul(operator.vertex_mass.len()).saturating_mul(8), memory_limit)?;
    let mut components = clock.time(Step::Order, || split(operator))?;
    let area: f64 = operator.mass.iter().sum();
    // The share of the pairs that Weyl's law gives a component, with a fifth to spare.
    let expected = |component: &Component| 1.2 * component.area / area * count as f64 + 2.0;
    let dense: Vec<bool> = components
        .iter()
        .map(|component| {
            component.rows() <= dense_below.max(16) || expected(component) > DENSE_SHARE * component.rows() as f64
        })
        .collect();
    components
        .par_iter_mut()
        .zip(&dense)
        .filter(|(_, dense)| !**dense)
        .try_for_each(|(component, _)| clock.time(Step::Order, || component.prepare(kind)))?;

    let expected = memory::expected(&components, &dense, count, operator.vertex_mass.len());
    memory::check(expected, memory_limit)?;
    let mut solved: Vec<Pairs> = lowest(&components, &dense, count, tolerance.min(1e-8), seed, kind, &progress)?;
    let next = keep_lowest(&mut solved, count);
    let evidence = components
        .par_iter()
        .zip(&mut solved)
        .map(|(component, pairs)| {
            clock.time(Step::Certify, || finish(component, pairs, orthogonality, kind, &progress))
        })
        .collect::<Result<Vec<_>, _>>()?;
    progress.go_on()?;
    let mut basis =
        clock.time(Step::Output, || basis::merge(operator, &components, solved, &evidence, next, tolerance));
    operator.fill_followers(&mut basis.eigenvectors);
    basis.certificate.seconds = clock.seconds();
    basis.certificate.factorisations = clock.times(Step::Factor);
    basis.certificate.solves = WIDTH * clock.times(Step::Solve);
    basis.certificate.peak_bytes = expected;
    let basis = basis.checked(options)?;
    progress.add(0);
    Ok(basis)
}

/// K as asked for, once the options are in their ranges.
fn check(options: &EigenOptions) -> Result<usize, EigenError> {
    let &EigenOptions { count, tolerance, .. } = options;
    if count == 0 {
        return Err(EigenError::Option { option: "count", value: 0.0, expected: "at least one eigenpair" });
    }
    if !(tolerance > 0.0 && tolerance < 1e-2) {
        return Err(EigenError::Option { option: "tolerance", value: tolerance, expected: "between 0 and 0.01" });
    }
    Ok(count)
}

/// The operator's connected components, each with its own rows.
fn split(operator: &Operator) -> Result<Vec<Component>, EigenError> {
    let mut dofs: Vec<Vec<u32>> = vec![Vec::new(); operator.components];
    let mut place_of_dof = vec![0; operator.mass.len()];
    for (dof, &component) in operator.component_of_dof.iter().enumerate() {
        place_of_dof[dof] = dofs[component as usize].len() as u32;
        dofs[component as usize].push(dof as u32);
    }
    dofs.into_par_iter().map(|dofs| Component::new(operator, dofs, &place_of_dof)).collect()
}
