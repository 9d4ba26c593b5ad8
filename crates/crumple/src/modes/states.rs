//! The states that are looked at: the last, chosen ones, or the whole series, on stations that all runs share.
//!
//! Runs write their states at times of their own and end at different moments. A station is a time, or an intrusion: the
//! M-weighted RMS displacement of the part, at the first moment at which the run reaches it. Between two states coefficients
//! are interpolated linearly; before its first state a run is undeformed. Stations end where the shortest run ends; one that
//! ends before half of what is usual is left out instead, so that it does not cut all others short.

use super::{Along, By, SERIES_STATIONS, States};
use crate::Error;
use crate::study::{Coefficients, Rows, Study};

/// A station this far beyond the end of a run, in parts of the station, still takes its last state: solvers end at
/// 5.9999 where 6 was asked for.
const TOLERANCE: f64 = 0.01;

/// Runs at the same stations.
pub(super) struct Sampled {
    /// `per_run` rows a run, runs in order of their ids.
    pub(super) rows: Coefficients,
    pub(super) per_run: usize,
    /// Ids of the runs.
    pub(super) runs: Vec<String>,
    /// Ids of runs that do not reach the stations.
    pub(super) left_out: Vec<String>,
    /// What was done, in words.
    pub(super) notes: Vec<String>,
}

/// The rows that are grouped.
///
/// # Errors
/// [`Error::Value`] for a station that no three runs reach, reading errors.
pub(super) fn sample(study: &Study, by: By, states: &States, total_mass: f64) -> Result<Sampled, Error> {
    let (along, asked) = match states {
        States::Last => {
            let rows = study.coefficients_of(by.function(), None, Rows::Last)?;
            let runs = rows.runs.clone();
            return Ok(Sampled { rows, per_run: 1, runs, left_out: Vec::new(), notes: Vec::new() });
        }
        States::At { along, stations } => (*along, Some(stations)),
        States::Series { along } => (*along, None),
    };
    let histories = Histories::read(study, by, along, total_mass)?;
    let unit = match along {
        Along::Time => &study.settings().time_unit,
        Along::Intrusion => &study.settings().length_unit,
    };
    let reaches: Vec<f64> = histories.runs.iter().map(History::reach).collect();
    let (stations, needed) = match (along, asked) {
        (Along::Time, Some(times)) => (times_asked(times, &reaches, unit)?, times.iter().copied().fold(0.0, f64::max)),
        (_, asked) => {
            let common = common_reach(&reaches);
            let shares = match asked {
                Some(shares) => shares_asked(shares)?,
                None => (1..=SERIES_STATIONS).map(|at| at as f64 / SERIES_STATIONS as f64).collect(),
            };
            (shares.iter().map(|share| share * common).collect(), common)
        }
    };
    let (kept, left): (Vec<&History>, Vec<&History>) =
        histories.runs.iter().partition(|run| run.reach() * (1.0 + TOLERANCE) >= needed);
    let what = match along {
        Along::Time => "time",
        Along::Intrusion => "an RMS displacement of",
    };
    let mut notes = vec![match asked {
        Some(_) => format!("states at {what} {}", list(&stations, unit)),
        None => {
            format!("{} states of each run, up to {what} {}, which all reach", stations.len(), list(&[needed], unit))
        }
    }];
    if !left.is_empty() {
        let names: Vec<&str> = left.iter().take(5).map(|run| run.run.as_str()).collect();
        let more = if left.len() > names.len() { " …" } else { "" };
        notes.push(format!("{} runs do not reach that and have no mode: {}{more}", left.len(), names.join(" ")));
    }
    Ok(Sampled {
        rows: histories.at(&kept, &stations),
        per_run: stations.len(),
        runs: kept.iter().map(|run| run.run.clone()).collect(),
        left_out: left.iter().map(|run| run.run.clone()).collect(),
        notes,
    })
}

fn list(values: &[f64], unit: &str) -> String {
    let shown: Vec<String> = values.iter().map(|value| format!("{}", (value * 1e4).round() / 1e4)).collect();
    format!("{} {unit}", shown.join(", "))
}

fn times_asked(times: &[f64], reaches: &[f64], unit: &str) -> Result<Vec<f64>, Error> {
    let mut sorted = reaches.to_vec();
    sorted.sort_by(|a, b| b.total_cmp(a));
    // Three runs are grouped, fewer are not.
    let most = sorted.get(super::RUNS_MIN - 1).copied().unwrap_or(0.0);
    let good = |time: &f64| *time > 0.0 && *time <= most * (1.0 + TOLERANCE);
    match times.iter().find(|time| !good(time)) {
        None => Ok(times.to_vec()),
        Some(wrong) => Err(Error::Value {
            name: "--at",
            value: wrong.to_string(),
            expected: format!("a time above 0 that three runs reach, so at most {}", list(&[most], unit)),
        }),
    }
}

fn shares_asked(shares: &[f64]) -> Result<Vec<f64>, Error> {
    match shares.iter().find(|share| !(**share > 0.0 && **share <= 1.0)) {
        None => Ok(shares.to_vec()),
        Some(wrong) => Err(Error::Value {
            name: "--at-intrusion",
            value: wrong.to_string(),
            expected: "a share of the RMS displacement that all runs reach, above 0 and at most 1".into(),
        }),
    }
}

/// What all reach, but for those that end before half of the median.
pub(super) fn common_reach(reaches: &[f64]) -> f64 {
    let mut sorted = reaches.to_vec();
    sorted.sort_by(f64::total_cmp);
    let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    sorted.into_iter().find(|&reach| reach >= median / 2.0).unwrap_or(0.0)
}

/// All states of all runs.
pub(super) struct Histories {
    rows: Coefficients,
    pub(super) runs: Vec<History>,
}

/// The states of one run.
pub(super) struct History {
    pub(super) run: String,
    /// Its first row.
    first: usize,
    /// Time or intrusion of each state.
    pub(super) progress: Vec<f64>,
}

impl History {
    /// How far it gets.
    pub(super) fn reach(&self) -> f64 {
        self.progress.iter().copied().fold(0.0, f64::max)
    }

    /// The row before a place, the row after it, and the weight of the latter; no row before the first state, where the
    /// part is undeformed.
    fn around(&self, place: f64) -> (Option<usize>, usize, f64) {
        let after = self.progress.iter().position(|&progress| progress >= place);
        let Some(after) = after else {
            // Beyond the end, by the tolerance: the state that got farthest.
            let reach = self.reach();
            let at = self.progress.iter().position(|&progress| progress >= reach).unwrap_or(0);
            return (None, self.first + at, 1.0);
        };
        let before = after.checked_sub(1);
        let from = before.map_or(0.0, |before| self.progress[before]);
        let step = self.progress[after] - from;
        let weight = if step > 0.0 { ((place - from) / step).clamp(0.0, 1.0) } else { 1.0 };
        (before.map(|before| self.first + before), self.first + after, weight)
    }
}

impl Histories {
    /// Reads them.
    ///
    /// # Errors
    /// Reading errors.
    pub(super) fn read(study: &Study, by: By, along: Along, total_mass: f64) -> Result<Self, Error> {
        let rows = study.coefficients_of(by.function(), None, Rows::All)?;
        let progress: Vec<f64> = match along {
            Along::Time => rows.times.clone(),
            Along::Intrusion if by.function() == crate::study::Function::Displacement => intrusions(&rows, total_mass),
            Along::Intrusion => intrusions(&study.coefficients(None, Rows::All)?, total_mass),
        };
        let mut runs: Vec<History> = Vec::new();
        for (row, run) in rows.runs.iter().enumerate() {
            match runs.last_mut().filter(|last| last.run == *run) {
                Some(last) => last.progress.push(progress[row]),
                None => runs.push(History { run: run.clone(), first: row, progress: vec![progress[row]] }),
            }
        }
        Ok(Self { rows, runs })
    }

    /// The runs at the stations, one row each, run by run.
    pub(super) fn at(&self, runs: &[&History], stations: &[f64]) -> Coefficients {
        let mut found = Coefficients {
            function: self.rows.function,
            eigenvectors: self.rows.eigenvectors.clone(),
            ..Default::default()
        };
        for run in runs {
            for &station in stations {
                let (before, after, weight) = run.around(station);
                found.runs.push(run.run.clone());
                found.states.push(self.rows.states[after]);
                found.times.push(self.rows.times[after]);
                // Of a mixture of two states the root mean square is not known; between theirs it is to second order.
                let rms = |row: usize| self.rows.rms.get(row).copied().unwrap_or(0.0);
                found.rms.push(weight * rms(after) + (1.0 - weight) * before.map_or(0.0, rms));
                let after = self.rows.row(after).iter().map(|&x| f64::from(x) * weight);
                match before {
                    None => found.values.extend(after.map(|x| x as f32)),
                    Some(before) => {
                        let before = self.rows.row(before).iter().map(|&x| f64::from(x) * (1.0 - weight));
                        found.values.extend(after.zip(before).map(|(a, b)| (a + b) as f32));
                    }
                }
            }
        }
        found
    }
}

/// M-weighted RMS displacement of every row, of what its coefficients hold.
fn intrusions(rows: &Coefficients, total_mass: f64) -> Vec<f64> {
    let square = |row: usize| rows.row(row).iter().map(|&x| f64::from(x).powi(2)).sum::<f64>();
    (0..rows.rows()).map(|row| (square(row) / total_mass).sqrt()).collect()
}
