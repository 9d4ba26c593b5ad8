//! Units, guessed: a d3plot does not say them.
//!
//! Solvers are run in millimetres, milliseconds and kilograms (speeds of some units), in millimetres, seconds and tonnes
//! (speeds of thousands), or in metres, seconds and kilograms. The size of the mesh tells the length, speeds and times the
//! rest; where they contradict each other nothing is guessed.

use serde::Serialize;

use super::Run;

/// Units of a run as far as its numbers tell.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Units {
    /// `mm` or `m`; `None` where the numbers do not tell.
    pub length: Option<&'static str>,
    /// `s` or `ms`.
    pub time: Option<&'static str>,
    /// The numbers, and what they speak for.
    pub reason: String,
}

/// A mesh of more units than this across is in millimetres: nobody crashes thirty metres.
const METRES: f64 = 30.0;
/// A run that ends later than this is in milliseconds: crashes end within a second.
const SECONDS: f64 = 1.0;
/// Above this a speed is in millimetres a second: nothing in a crash is faster than half a kilometre a second.
const METRES_A_SECOND: f64 = 500.0;

/// What a guess starts from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Numbers {
    /// Diagonal of the box around the mesh.
    pub(super) diagonal: f64,
    /// The last time, if it is beyond 0.
    pub(super) end: Option<f64>,
    /// The largest speed of a node in the first state, if it is beyond 0.
    pub(super) speed: Option<f64>,
}

impl Run {
    /// Guesses the units. Reads the velocities of the first state, where it has them.
    pub(super) fn units(&self) -> Units {
        let mut low = [f64::INFINITY; 3];
        let mut high = [f64::NEG_INFINITY; 3];
        for point in self.undeformed() {
            for axis in 0..3 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
        let length = |vector: [f64; 3]| vector.iter().map(|x| x * x).sum::<f64>().sqrt();
        let velocity = match &self.source {
            super::Source::D3plot(family) if !family.times().is_empty() => family.velocity(0).ok().flatten(),
            _ => None,
        };
        let speed = velocity.iter().flatten().map(|velocity| length(*velocity)).fold(0.0, f64::max);
        guess(Numbers {
            diagonal: length([0, 1, 2].map(|axis| high[axis] - low[axis])),
            end: self.times().last().copied().filter(|end| *end > 0.0),
            speed: (speed > 0.0 && speed.is_finite()).then_some(speed),
        })
    }
}

/// The guess, with its reason in words.
pub(super) fn guess(numbers: Numbers) -> Units {
    let Numbers { diagonal, end, speed } = numbers;
    let mut reason = format!("the mesh is {diagonal:.4} across");
    if let Some(end) = end {
        reason += &format!(", the last time is {end}");
    }
    if let Some(speed) = speed {
        reason += &format!(", the fastest node starts with {speed:.4}");
    }
    let by_end = end.map(|end| if end > SECONDS { "ms" } else { "s" });
    let (length, time, why) = match (diagonal > METRES, by_end, speed) {
        _ if !diagonal.is_finite() => (None, None, "nothing can be told"),
        (true, Some("s"), Some(speed)) if speed <= METRES_A_SECOND => {
            (Some("mm"), None, "size like millimetres, times like seconds, speeds like millimetres a millisecond")
        }
        (true, Some("ms"), Some(speed)) if speed > METRES_A_SECOND => {
            (Some("mm"), None, "size like millimetres, times like milliseconds, speeds like millimetres a second")
        }
        (true, Some(time), _) => (Some("mm"), Some(time), "millimetres by the size"),
        (true, None, Some(speed)) if speed > METRES_A_SECOND => {
            (Some("mm"), Some("s"), "speeds like millimetres a second")
        }
        (true, None, _) => (Some("mm"), None, "millimetres by the size"),
        (false, Some("s"), Some(speed)) if speed <= METRES_A_SECOND && diagonal > 1.0 => {
            (Some("m"), Some("s"), "metres and seconds: a small mesh, short times, speeds like metres a second")
        }
        (false, time, _) => (None, time, "a small mesh: metres, or a small part in millimetres"),
    };
    Units { length, time, reason: format!("{reason}: {why}") }
}

#[cfg(test)]
mod tests {
    use super::{Numbers, guess};

    fn told(diagonal: f64, end: f64, speed: f64) -> (Option<&'static str>, Option<&'static str>) {
        let positive = |value: f64| (value > 0.0).then_some(value);
        let units = guess(Numbers { diagonal, end: positive(end), speed: positive(speed) });
        (units.length, units.time)
    }

    #[test]
    fn the_three_usual_systems() {
        assert_eq!(told(4500.0, 120.0, 15.6), (Some("mm"), Some("ms")));
        assert_eq!(told(4500.0, 0.12, 15_600.0), (Some("mm"), Some("s")));
        assert_eq!(told(4.5, 0.12, 15.6), (Some("m"), Some("s")));
    }

    #[test]
    fn numbers_that_contradict_tell_nothing() {
        assert_eq!(told(4500.0, 0.12, 15.6), (Some("mm"), None));
        assert_eq!(told(8.0, 0.0, 0.0), (None, None));
        assert_eq!(told(f64::NAN, 1.0, 1.0), (None, None));
        assert_eq!(told(800.0, 0.0, 0.0), (Some("mm"), None));
    }
}
