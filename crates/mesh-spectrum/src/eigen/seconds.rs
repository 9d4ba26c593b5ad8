//! Where the time goes.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::Instant;

/// Wall seconds of each step, summed over threads: on two threads they add up to twice the time that passes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Seconds {
    /// Mass scaled out, elimination order, pattern of L.
    pub order: f64,
    /// Factorisations, for shifts and for counts.
    pub factor: f64,
    /// Solves with the factors.
    pub solve: f64,
    /// Three-term recurrences and orthogonalisation.
    pub orthogonalise: f64,
    /// Small dense eigenproblems.
    pub project: f64,
    /// Ritz vectors, those handed over, polish, and the residuals that decide about it.
    pub vectors: f64,
    /// Gram matrix, last orthogonalisation, residuals.
    pub certify: f64,
    /// Eigenvectors on vertices.
    pub output: f64,
}

/// A step of [`Seconds`].
#[derive(Debug, Clone, Copy)]
pub(crate) enum Step {
    Order,
    Factor,
    Solve,
    Orthogonalise,
    Project,
    Vectors,
    Certify,
    Output,
}

/// Nanoseconds of each step so far, from all threads, and how often it was done.
#[derive(Debug, Default)]
pub(crate) struct Clock([(AtomicU64, AtomicUsize); 8]);

impl Clock {
    /// Does something and counts how long it took.
    pub(crate) fn time<T>(&self, step: Step, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = work();
        let passed = u64::try_from(start.elapsed().as_nanos()).unwrap_or(u64::MAX);
        let (time, times) = &self.0[step as usize];
        time.fetch_add(passed, Ordering::Relaxed);
        times.fetch_add(1, Ordering::Relaxed);
        result
    }

    /// How often a step was done.
    pub(crate) fn times(&self, step: Step) -> usize {
        self.0[step as usize].1.load(Ordering::Relaxed)
    }

    pub(crate) fn seconds(&self) -> Seconds {
        let [order, factor, solve, orthogonalise, project, vectors, certify, output] =
            self.0.each_ref().map(|(time, _)| time.load(Ordering::Relaxed) as f64 * 1e-9);
        Seconds { order, factor, solve, orthogonalise, project, vectors, certify, output }
    }
}
