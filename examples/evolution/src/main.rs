//! Evolution towards a wanted deformation, with the descriptor's distance as objective, then as constraint, and with
//! hopeless designs stopped early by the rule of `crumple monitor`.
//!
//! ```sh
//! cargo run --release -p evolution
//! ```
//!
//! The part is that of `examples/hat-section`; in place of a solver stands [`model`]. What is wanted is the deformation
//! of one design that the optimiser does not know.

mod model;

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use crumple::Error;
use crumple::basis::{Basis, BasisOptions, coefficients};
use crumple::joints::Join;
use crumple::monitor::{Monitor, Place, Rule, Track, Verdict};
use crumple::reference::Reference;
use crumple::rotation::{self, Ruler};
use crumple::run::Run;
use crumple::similarity::cosine;
use metaheuristics_nature::{De, Fx, Solver};
use model::Design;

/// States that a run writes.
const STATES: usize = 10;

/// The design that is looked for; only its deformation is shown to the optimiser.
const HIDDEN: Design = Design { thickness: 2.0, place: 0.7, depth: 0.2 };

/// Generations, and designs in each.
const GENERATIONS: u64 = 25;
const POPULATION: usize = 24;

/// A distance that still counts as the same deformation.
const WITHIN: f64 = 0.02;

/// Below this similarity on the way a design is given up.
const FLOOR: f64 = 0.8;

/// The part, and how its deformations are measured.
struct Part {
    reference: Reference,
    basis: Basis,
    ruler: Ruler,
    target: Track,
    /// States computed so far.
    computed: AtomicUsize,
}

impl Part {
    fn load() -> Result<Self, Error> {
        let run = Path::new(env!("CARGO_MANIFEST_DIR")).join("../hat-section/runs/run_001");
        let reference = Reference::of_run(&Run::open("run_001", &run)?, &[])?;
        let options = BasisOptions { eigenpairs: 60, join: Some(Join::Distance(2.5)), ..Default::default() };
        let basis = Basis::compute(&reference, &[], &options, &())?;
        let ruler = Ruler::of(&basis);
        let mut part = Self { reference, basis, ruler, target: Track::default(), computed: AtomicUsize::new(0) };
        part.target = Track::new((1..=STATES).map(|state| part.place(HIDDEN, state)));
        Ok(part)
    }

    /// One state of a design: what `crumple features` would say about it.
    fn place(&self, design: Design, state: usize) -> Place {
        self.computed.fetch_add(1, Ordering::Relaxed);
        let mesh = &self.reference.mesh;
        let share = state as f64 / STATES as f64;
        let shape = design.shape(mesh.vertices(), share);
        let turned = rotation::field(mesh.triangles(), mesh.vertices(), &shape);
        let square: f64 =
            turned.iter().zip(&self.basis.mass).map(|(r, mass)| mass * r.iter().map(|x| x * x).sum::<f64>()).sum();
        let turn = (square / self.basis.mass.iter().sum::<f64>()).sqrt();
        let numbers = self.ruler.spectrum(&coefficients(&self.basis, &turned), turn).numbers();
        Place { at: share, amount: turn, numbers }
    }

    /// Runs a design. Distance of its last state to the target's, or of the state at which it was stopped; and whether
    /// it was.
    fn run(&self, design: Design, early: bool) -> (f64, bool) {
        let mut monitor = Monitor::new(self.target.clone(), Rule::constant(FLOOR));
        let wanted = self.target.places();
        for (state, target) in (1..=STATES).zip(wanted) {
            let place = self.place(design, state);
            let stopped = early && monitor.step(place.at, &place.numbers).verdict == Verdict::Diverged;
            if stopped || state == STATES {
                return (1.0 - cosine(&target.numbers, &place.numbers), stopped);
            }
        }
        (2.0, true)
    }
}

/// What an optimisation found.
#[derive(Debug)]
struct Found {
    design: Design,
    distance: f64,
    /// States computed, of those that whole runs would have had.
    computed: (usize, usize),
}

/// Minimises `cost(design, distance)`.
fn evolve(part: &Part, early: bool, cost: impl Fn(Design, f64) -> f64 + Sync + Send) -> Found {
    let (before, runs) = (part.computed.load(Ordering::Relaxed), AtomicUsize::new(0));
    let fitness = |x: &[f64; 3]| {
        runs.fetch_add(1, Ordering::Relaxed);
        let (distance, stopped) = part.run(Design::of(x), early);
        // A design that was stopped is worse than any that came to its end, and the more the farther off it was.
        if stopped { cost(Design::of(x), distance) + 100.0 } else { cost(Design::of(x), distance) }
    };
    let function = Fx::new(&Design::BOUNDS, fitness);
    let solver = Solver::build(De::default(), function)
        .seed(1)
        .pop_num(POPULATION)
        .task(|context| context.r#gen >= GENERATIONS)
        .solve();
    let best = solver.as_best_xs();
    let design = Design::of(&[best[0], best[1], best[2]]);
    let computed = part.computed.load(Ordering::Relaxed) - before;
    let whole = STATES * runs.load(Ordering::Relaxed);
    Found { design, distance: part.run(design, false).0, computed: (computed, whole) }
}

/// The distance as objective.
fn nearest(part: &Part, early: bool) -> Found {
    evolve(part, early, |_, distance| distance)
}

/// The distance as constraint: the thinnest sheet that deforms so.
fn thinnest(part: &Part, early: bool) -> Found {
    evolve(part, early, |design, distance| design.thickness + 10.0 * (distance / WITHIN - 1.0).max(0.0))
}

fn main() -> Result<(), Error> {
    let part = Part::load()?;
    println!("wanted: the deformation of {HIDDEN:?}");
    for early in [false, true] {
        let how = if early { "stopped early" } else { "to the end" };
        for (name, found) in [("nearest", nearest(&part, early)), ("thinnest", thinnest(&part, early))] {
            let Found { design: Design { thickness, place, depth }, distance, computed: (computed, whole) } = found;
            println!(
                "{name:8} {how:13}  thickness {thickness:.3}  place {place:.3}  depth {depth:.3}  distance {distance:.4}  \
                 {computed} of {whole} states computed"
            );
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn evolution_finds_the_deformation_and_stopping_saves_states() {
        let part = Part::load().unwrap();
        let whole = nearest(&part, false);
        assert!(whole.distance < 0.01, "{whole:?}");
        assert_eq!(whole.computed.0, whole.computed.1);
        let early = nearest(&part, true);
        assert!(early.distance < 0.01, "{early:?}");
        assert!(early.computed.0 < early.computed.1, "{early:?}");
        let thin = thinnest(&part, true);
        assert!(thin.distance <= WITHIN && thin.design.thickness < HIDDEN.thickness, "{thin:?}");
    }
}
