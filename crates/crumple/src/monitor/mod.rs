//! Following a run: is it still on the target's own path?
//!
//! A finished run is compared with the target's last state. A run that is being computed must be compared with what the
//! target was like when it had come as far: [`Track`] is the target's numbers along its states, and between two states
//! the straight line. [`Rule`] says how alike is alike enough at each place of it, [`Monitor`] applies it state by
//! state. All three are plain data, so that an optimiser which computes its shapes itself can stop early by the same
//! rule; [`follow`] watches a result file that grows, [`calibrate`] finds the rule in a study, [`stop`] asks the solver
//! to end.
//!
//! ```
//! use crumple::monitor::{Monitor, Place, Rule, Track, Verdict};
//!
//! let place = |at: f64, x: f64, y: f64| Place { at, amount: x.hypot(y), numbers: vec![x, y] };
//! // The target goes along x; a state counts once the target is a tenth of the way; two in a row decide.
//! let target = Track::new([place(0.0, 0.0, 0.0), place(10.0, 1.0, 0.0)]);
//! let mut monitor = Monitor::new(target, Rule::constant(0.9));
//! assert_eq!(monitor.step(0.5, &[0.0, 0.1]).verdict, Verdict::Early);
//! assert_eq!(monitor.step(3.0, &[0.3, 0.0]).verdict, Verdict::Alike);
//! assert_eq!(monitor.step(4.0, &[0.3, 0.3]).verdict, Verdict::Unlike);
//! assert_eq!(monitor.step(5.0, &[0.3, 0.6]).verdict, Verdict::Diverged);
//! ```

mod calibrate;
mod follow;
mod stop;

use std::str::FromStr;

use serde::Serialize;

pub use calibrate::{Calibration, QUANTILE, calibrate};
pub use follow::{Follow, follow};
pub use stop::{STOP_FILE, run_folder, stop};

use crate::Error;
use crate::descriptor::Descriptor;
use crate::features::Features;
use crate::rotation::TURN_MIN;
use crate::select::Kind;
use crate::similarity::cosine;
use crate::study::{Function, Loaded, Rows, Stored};
use crate::target::Target;

/// What tells how far a run has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Align {
    /// The time of the simulation.
    #[default]
    Time,
    /// How far the surface has moved: the largest root mean square displacement so far. For runs of another speed.
    Intrusion,
}

/// One state on a path.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// How far the run has come, in the unit of [`Align`].
    pub at: f64,
    /// How much has happened: root mean square of the rotation field or of the displacement. Below a share of its last
    /// value nothing is judged.
    pub amount: f64,
    /// The numbers that are compared.
    pub numbers: Vec<f64>,
}

/// A run's numbers along its states.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Track {
    places: Vec<Place>,
}

impl Track {
    /// The path through these places, in their order. Where `at` falls it is held at the largest so far.
    pub fn new(places: impl IntoIterator<Item = Place>) -> Self {
        let mut furthest = f64::NEG_INFINITY;
        let held = |mut place: Place| {
            furthest = furthest.max(place.at);
            place.at = furthest;
            place
        };
        Self { places: places.into_iter().map(held).collect() }
    }

    /// Its places.
    pub fn places(&self) -> &[Place] {
        &self.places
    }

    /// How far it goes; 0 without places.
    pub fn end(&self) -> f64 {
        self.places.last().map_or(0.0, |place| place.at)
    }

    /// How far it reaches: its end and a tenth of its last step, since solvers write a state with the first time step
    /// behind the time that was asked for.
    fn reach(&self) -> f64 {
        self.end() + self.slack()
    }

    fn slack(&self) -> f64 {
        match self.places.as_slice() {
            [.., before, last] => 0.1 * (last.at - before.at),
            _ => 0.0,
        }
    }

    /// What has happened at its end.
    fn amount(&self) -> f64 {
        self.places.last().map_or(0.0, |place| place.amount)
    }

    /// The path at a place, between two states by the straight line, before and after it the first and the last.
    pub fn at(&self, at: f64) -> Option<Place> {
        let next = self.places.iter().position(|place| place.at >= at);
        let (from, to) = match next {
            None => return self.places.last().cloned(),
            Some(0) => return self.places.first().cloned(),
            Some(next) => (&self.places[next - 1], &self.places[next]),
        };
        let share = (at - from.at) / (to.at - from.at);
        let between = |a: f64, b: f64| a + share * (b - a);
        let numbers = from.numbers.iter().zip(&to.numbers).map(|(&a, &b)| between(a, b)).collect();
        Some(Place { at, amount: between(from.amount, to.amount), numbers })
    }
}

/// When a run has left the path.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rule {
    /// Smallest similarity that is alike, at places of the path; straight lines between. Never empty.
    pub floor: Vec<(f64, f64)>,
    /// States in a row below the floor that decide.
    pub consecutive: usize,
    /// Share of the target's last amount that must have happened on its path before a state is judged: what moves before
    /// that is elastic ringing.
    pub from: f64,
}

/// States in a row that decide, unless told otherwise.
const CONSECUTIVE: usize = 2;
/// Share of the target's last amount before which nothing is judged, unless told otherwise.
const FROM: f64 = 0.1;

impl Rule {
    /// The same floor all along.
    pub fn constant(floor: f64) -> Self {
        Self::along(vec![(0.0, floor)])
    }

    /// A floor along the path; at least one place.
    pub fn along(floor: Vec<(f64, f64)>) -> Self {
        Self { floor, consecutive: CONSECUTIVE, from: FROM }
    }

    /// The floor at a place.
    pub fn floor(&self, at: f64) -> f64 {
        let places = self.floor.iter().map(|&(at, floor)| Place { at, amount: floor, numbers: Vec::new() });
        Track::new(places).at(at).map_or(-1.0, |place| place.amount)
    }
}

/// What is said about one state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Too little has happened to tell.
    Early,
    /// On the path.
    Alike,
    /// Off the path, but not for long enough to decide.
    Unlike,
    /// Off the path for good: the run will not be what it was meant to be.
    Diverged,
}

/// A state and what is said about it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Step {
    /// How far the run has come.
    pub at: f64,
    /// Cosine with the target's path at the same place, −1 to 1; null while it is early.
    pub similarity: Option<f64>,
    /// Smallest similarity that is alike there.
    pub floor: f64,
    /// The verdict.
    pub verdict: Verdict,
}

/// Applies a rule to the states of one run, in their order.
#[derive(Debug, Clone)]
pub struct Monitor {
    target: Track,
    rule: Rule,
    unlike: usize,
    furthest: f64,
}

impl Monitor {
    /// Starts with a run of which nothing has been seen.
    pub fn new(target: Track, rule: Rule) -> Self {
        Self { target, rule, unlike: 0, furthest: f64::NEG_INFINITY }
    }

    /// Judges the next state. `numbers`: as many as the target's places have.
    pub fn step(&mut self, at: f64, numbers: &[f64]) -> Step {
        self.furthest = self.furthest.max(at);
        let (at, floor) = (self.furthest, self.rule.floor(self.furthest));
        let early = Step { at, similarity: None, floor, verdict: Verdict::Early };
        let Some(target) = self.target.at(at) else { return early };
        // A target that never moves at all is never late enough.
        if target.amount < self.rule.from * self.target.amount() || target.amount <= 0.0 {
            return early;
        }
        let similarity = cosine(&target.numbers, numbers);
        self.unlike = if similarity < floor { self.unlike + 1 } else { 0 };
        let verdict = match self.unlike {
            0 => Verdict::Alike,
            unlike if unlike < self.rule.consecutive.max(1) => Verdict::Unlike,
            _ => Verdict::Diverged,
        };
        Step { at, similarity: Some(similarity), floor, verdict }
    }

    /// Whether the run has come as far as the target did.
    pub fn is_over(&self) -> bool {
        self.furthest >= self.target.end() - self.target.slack()
    }

    /// How far the target goes.
    pub fn end(&self) -> f64 {
        self.target.end()
    }
}

/// Turns states into the places of a path: the numbers of a descriptor's kind.
pub struct Tracker<'a> {
    loaded: &'a Loaded,
    features: Features,
    kind: Kind,
    align: Align,
}

impl<'a> Tracker<'a> {
    /// For a descriptor of the study. `kind`: which of its numbers; its own when `None`.
    ///
    /// # Errors
    /// As [`Features::of`].
    pub fn new(loaded: &'a Loaded, descriptor: &Descriptor, kind: Option<Kind>, align: Align) -> Result<Self, Error> {
        let kind = kind.unwrap_or(descriptor.kind);
        Ok(Self { loaded, features: Features::of(&loaded.basis, descriptor, kind)?, kind, align })
    }

    /// Which numbers are compared.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// The place of a state that was named or projected.
    ///
    /// # Errors
    /// [`Error::UnknownField`] if it lacks what is compared.
    pub fn place(&self, target: &Target) -> Result<Place, Error> {
        Ok(self.put(&self.features.sample(target)?.stored(0), target.time, target.rms))
    }

    /// The paths of runs of the study, by run id.
    ///
    /// # Errors
    /// Reading errors.
    pub fn tracks(&self, rows: Rows<'_>) -> Result<Vec<(String, Track)>, Error> {
        let study = &self.loaded.study;
        let samples = self.features.read(study, rows)?;
        // One column is enough: the root mean square is beside it.
        let moved = study.coefficients_of(Function::Displacement, Some(&[1]), rows)?;
        let mut tracks: Vec<(String, Vec<Place>)> = Vec::new();
        for row in 0..samples.rows() {
            let place = self.put(&samples.stored(row), samples.time(row), moved.rms[row]);
            match tracks.last_mut().filter(|(run, _)| run == samples.run(row)) {
                Some((_, places)) => places.push(place),
                None => tracks.push((samples.run(row).to_owned(), vec![place])),
            }
        }
        Ok(tracks.into_iter().map(|(run, places)| (run, Track::new(places))).collect())
    }

    /// The path of the descriptor's own run, up to the state it describes.
    ///
    /// # Errors
    /// [`Error::UnknownRun`] if the study no longer has the run, reading errors.
    pub fn target(&self, descriptor: &Descriptor) -> Result<Track, Error> {
        self.loaded.study.record(&descriptor.run)?;
        let (_, mut track) = self.tracks(Rows::Run(&descriptor.run))?.pop().unwrap_or_default();
        track.places.truncate(descriptor.state + 1);
        if track.amount() > 0.0 {
            return Ok(track);
        }
        Err(Error::Value {
            name: "descriptor",
            value: format!("'{}' of {}@{}", descriptor.name, descriptor.run, descriptor.state),
            expected: "a deformed state: there is no path to follow to the undeformed one".into(),
        })
    }

    fn put(&self, stored: &[Stored<'_>], time: f64, moved: f64) -> Place {
        let amount = match self.kind {
            // Less is rounding of the files.
            Kind::Rotation => stored.first().map(|stored| stored.rms).filter(|rms| *rms >= TURN_MIN).unwrap_or(0.0),
            Kind::Paper => moved,
        };
        let at = match self.align {
            Align::Time => time,
            Align::Intrusion => moved,
        };
        Place { at, amount, numbers: self.features.vector(stored) }
    }
}

impl FromStr for Align {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        match text {
            "time" => Ok(Self::Time),
            "intrusion" => Ok(Self::Intrusion),
            _ => Err(Error::Value { name: "--align", value: text.into(), expected: "time or intrusion".into() }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(at: f64, x: f64, y: f64) -> Place {
        Place { at, amount: x.hypot(y), numbers: vec![x, y] }
    }

    fn along_x() -> Track {
        Track::new((0..=10).map(|t| place(f64::from(t), f64::from(t), 0.0)))
    }

    #[test]
    fn a_path_is_straight_between_states_and_still_beyond_its_ends() {
        let track = Track::new([place(1.0, 0.0, 2.0), place(3.0, 4.0, 0.0)]);
        assert_eq!(track.at(2.0).unwrap().numbers, [2.0, 1.0]);
        assert_eq!(track.at(0.0).unwrap().numbers, [0.0, 2.0]);
        assert_eq!(track.at(9.0).unwrap().numbers, [4.0, 0.0]);
        assert_eq!(Track::default().at(1.0), None);
    }

    #[test]
    fn intrusion_never_goes_back() {
        let track = Track::new([place(1.0, 1.0, 0.0), place(5.0, 5.0, 0.0), place(4.0, 4.0, 0.0)]);
        assert_eq!(track.end(), 5.0);
        let mut monitor = Monitor::new(track, Rule::constant(0.9));
        monitor.step(5.0, &[1.0, 0.0]);
        assert_eq!(monitor.step(4.0, &[1.0, 0.0]).at, 5.0);
        assert!(monitor.is_over());
    }

    #[test]
    fn a_run_that_ends_a_time_step_earlier_is_over() {
        let mut monitor = Monitor::new(along_x(), Rule::constant(0.9));
        monitor.step(9.0, &[1.0, 0.0]);
        assert!(!monitor.is_over());
        monitor.step(9.998, &[1.0, 0.0]);
        assert!(monitor.is_over());
    }

    #[test]
    fn one_odd_state_does_not_decide() {
        let mut monitor = Monitor::new(along_x(), Rule::constant(0.9));
        let verdicts = [(2.0, 1.0), (3.0, -1.0), (4.0, 1.0), (5.0, -1.0), (6.0, -1.0)]
            .map(|(at, x)| monitor.step(at, &[x, 0.0]).verdict);
        use Verdict::{Alike, Diverged, Unlike};
        assert_eq!(verdicts, [Alike, Unlike, Alike, Unlike, Diverged]);
    }

    #[test]
    fn ringing_at_the_start_is_not_judged() {
        let mut monitor = Monitor::new(along_x(), Rule::constant(0.9));
        for at in [0.0, 0.3, 0.6, 0.9] {
            let step = monitor.step(at, &[-1.0, 5.0]);
            assert_eq!((step.verdict, step.similarity), (Verdict::Early, None));
        }
        // A run that does not deform at all while the target does is unlike it.
        monitor.step(5.0, &[0.0, 0.0]);
        assert_eq!(monitor.step(6.0, &[0.0, 0.0]).verdict, Verdict::Diverged);
    }

    #[test]
    fn the_floor_may_change_along_the_path() {
        let rule = Rule::along(vec![(0.0, 0.5), (10.0, 0.9)]);
        assert!((rule.floor(5.0) - 0.7).abs() < 1e-12);
        assert_eq!((rule.floor(-1.0), rule.floor(20.0)), (0.5, 0.9));
    }
}
