//! Judged from outside: how well descriptors and their rivals rank runs, and how well modes agree, given labels.
//!
//! Labels come from the user (from geometry, from an expert); nothing is computed from them but the judgement. For
//! each label the query is the medoid of its clear runs; every method ranks all other labelled runs by cosine
//! similarity to the query; a run of another label counts as wrong.

use rayon::prelude::*;
use serde::Serialize;

use crate::Error;
use crate::descriptor::{DescribeOptions, FIRST_M, PCA, Select, Threshold, choose, describe};
use crate::features::Features;
use crate::inputs::Table;
use crate::modes::{self, By, ModesOptions, Points, adjusted_rand_index};
use crate::reconstruct::Errors;
use crate::rivals::Pca;
use crate::similarity::cosine;
use crate::study::{Coefficients, Function, Loaded, Rows};
use crate::target::{self, Named};

/// Everything `compare` finds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// One row a query, choice of coefficients and method.
    pub rows: Vec<Row>,
    /// The rotation spectrum on each query.
    pub rotation: Vec<Row>,
    /// Agreement of modes with labels; empty without labels.
    pub modes: Vec<ModesAgreement>,
    /// How labels were joined to runs, and what was left over.
    pub notes: Vec<String>,
}

/// One method on one query.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// The query's label, or its mode without labels.
    pub label: String,
    /// The query run.
    pub query: String,
    /// Which coefficients: `coordinates`, `difference` or `rotation`.
    pub select: &'static str,
    /// `descriptor`, `first M`, `first K`, `PCA`, `rotation spectrum`.
    pub method: String,
    /// Eigenvectors or components used; numbers of a rotation spectrum.
    pub size: usize,
    /// M-weighted RMS error of its reconstruction of the query, in the length unit; null for a rotation spectrum, which
    /// reconstructs nothing.
    pub rms: Option<f64>,
    /// Largest error of a vertex, in the length unit.
    pub max: Option<f64>,
    /// RMS error over RMS displacement.
    pub relative: Option<f64>,
    /// Share of the nine nearest runs that have the query's label; null without labels.
    pub precision_at_9: Option<f64>,
    /// Average precision of the whole ranking; null without labels.
    pub average_precision: Option<f64>,
    /// The same as a mean over every run of the label as the query, each with its own descriptor.
    pub mean_average_precision: Option<f64>,
    /// The nine nearest runs.
    pub nearest: Vec<String>,
}

/// How well modes found without labels agree with them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModesAgreement {
    /// What made runs alike.
    pub by: By,
    /// The method.
    pub method: modes::Method,
    /// Number of modes.
    pub count: usize,
    /// Whether the program chose that number.
    pub chosen: bool,
    /// Runs without a mode: they are left out of the index.
    pub without: usize,
    /// Mean silhouette.
    pub silhouette: f64,
    /// Adjusted Rand index over the runs whose label has clear runs.
    pub ari: f64,
    /// Adjusted Rand index over all labelled runs.
    pub ari_all: f64,
}

/// Compares the paper's descriptor (both choices of coefficients) with its rivals.
///
/// # Errors
/// [`Error::NoMatch`] for labels that fit no run, [`Error::NoModes`] without labels and modes, reading errors.
pub fn compare(loaded: &Loaded, labels: Option<&Table>, threshold: Threshold) -> Result<Comparison, Error> {
    let rows = &*loaded.last_states()?;
    let (judge, notes) = match labels {
        Some(table) => Judge::of_labels(rows, loaded, table)?,
        None => (
            Judge::of_modes(rows, loaded)?,
            vec!["without labels there is nothing to judge a ranking by: precision is left out".to_owned()],
        ),
    };
    let fixed = Fixed::of(loaded, rows)?;
    let arena = |select| Arena::new(loaded, rows, &judge, &fixed, select, threshold);
    let arenas = [(Select::Coordinates, arena(Select::Coordinates)?), (Select::Difference, arena(Select::Difference)?)];
    let (mut result, mut rotation) = (Vec::new(), Vec::new());
    for query in &judge.queries {
        for (select, arena) in &arenas {
            result.extend(judge_query(loaded, arena, query, *select, threshold)?);
        }
        // In either arena: the choice of coefficients does not matter to it.
        let size = fixed.spectra[0].len();
        rotation.push(arenas[0].1.row(query, Method::Rotation, ROTATION.0, ROTATION.1, size, None));
    }
    let modes = if labels.is_some() { agreements(loaded, rows, &judge)? } else { Vec::new() };
    Ok(Comparison { rows: result, rotation, modes, notes })
}

/// Labels by row, and which rows are asked about.
struct Judge {
    /// Label of each row; `None` for runs that are left out.
    label_of_row: Vec<Option<usize>>,
    queries: Vec<Query>,
    judged: bool,
}

struct Query {
    label: String,
    index: usize,
    medoid: usize,
}

impl Judge {
    fn of_labels(rows: &Coefficients, loaded: &Loaded, table: &Table) -> Result<(Self, Vec<String>), Error> {
        let joined = table.join(&rows.runs.iter().map(String::as_str).collect::<Vec<_>>())?;
        let column = table.columns.iter().position(|column| column == "label");
        let no_label = || Error::Table { path: table.path.clone(), what: "no column 'label'".into() };
        let column = column.ok_or_else(no_label)?;
        let clear = table.columns.iter().position(|column| column == "clear");
        let cell = |row: usize, column: usize| table.rows[row].1.get(column).map_or("", String::as_str);
        let mut names: Vec<&str> =
            joined.row_of_run.iter().flatten().map(|&row| cell(row, column)).filter(|name| !name.is_empty()).collect();
        names.sort_unstable();
        names.dedup();
        let label_of_row: Vec<Option<usize>> = joined
            .row_of_run
            .iter()
            .map(|row| row.and_then(|row| names.binary_search(&cell(row, column)).ok()))
            .collect();
        let is_clear = |row: usize| {
            let word = |column| cell(row, column).to_ascii_lowercase();
            clear.is_none_or(|column| matches!(word(column).as_str(), "true" | "1" | "yes"))
        };
        let distances = Points::by_displacement(rows, loaded.basis.total_mass()).distances();
        let queries = names.iter().enumerate().filter_map(|(index, name)| {
            let members = |run: &usize| label_of_row[*run] == Some(index);
            let clear: Vec<usize> =
                (0..rows.rows()).filter(members).filter(|&run| joined.row_of_run[run].is_some_and(is_clear)).collect();
            let several = (0..rows.rows()).filter(members).count() > 1;
            (several && !clear.is_empty()).then(|| Query {
                label: (*name).to_owned(),
                index,
                medoid: modes::medoid(&distances, &clear),
            })
        });
        let queries = queries.collect();
        Ok((Self { label_of_row, queries, judged: true }, joined.notes))
    }

    fn of_modes(rows: &Coefficients, loaded: &Loaded) -> Result<Self, Error> {
        let modes = modes::load(&loaded.study)?;
        let row_of = |run: &str| rows.runs.iter().position(|other| other == run);
        let queries =
            modes.modes.iter().enumerate().filter_map(|(index, mode)| {
                Some(Query { label: mode.name.clone(), index, medoid: row_of(&mode.medoid)? })
            });
        Ok(Self { queries: queries.collect(), label_of_row: vec![None; rows.rows()], judged: false })
    }
}

/// What the cosine of a method compares.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Method {
    /// Values on the eigenvectors of the query's own descriptor.
    Descriptor,
    /// Values on as many eigenvectors of lowest frequency.
    FirstM,
    /// Values on all K.
    FirstK,
    /// Scores of as many principal components.
    Components,
    /// The rotation spectrum.
    Rotation,
}

/// Function and name of the rotation spectrum's rows.
const ROTATION: (&str, &str) = ("rotation", "rotation spectrum");

/// What of the runs is the same under either choice of coefficients.
struct Fixed {
    /// Scores of each run on all principal components.
    scores: Vec<Vec<f64>>,
    /// Rotation spectrum of each run.
    spectra: Vec<Vec<f64>>,
}

impl Fixed {
    fn of(loaded: &Loaded, rows: &Coefficients) -> Result<Self, Error> {
        let pca = Pca::of(rows, rows.rows());
        let features = Features::rotation(&loaded.basis);
        let turned = features.read(&loaded.study, Rows::Last)?;
        Ok(Self {
            scores: (0..rows.rows()).into_par_iter().map(|row| pca.scores(rows.triples(row).as_flattened())).collect(),
            spectra: (0..rows.rows()).map(|row| features.vector(&turned.stored(row))).collect(),
        })
    }
}

/// All runs under one choice of coefficients, ready to be ranked by any method with any run as the query.
struct Arena<'a> {
    rows: &'a Coefficients,
    judge: &'a Judge,
    fixed: &'a Fixed,
    /// α or δ of each run, K × 3.
    values: Vec<Vec<[f64; 3]>>,
    /// Eigenvectors of each run's own descriptor.
    chosen: Vec<Vec<usize>>,
}

impl<'a> Arena<'a> {
    fn new(
        loaded: &Loaded,
        rows: &'a Coefficients,
        judge: &'a Judge,
        fixed: &'a Fixed,
        select: Select,
        threshold: Threshold,
    ) -> Result<Self, Error> {
        let delta = |row: usize| rows.triples(row);
        let options = DescribeOptions { select, threshold, ..Default::default() };
        let chosen = |row: usize| {
            let named = Named { run: rows.runs[row].clone(), state: None };
            let original = || target::shape(loaded, &named, &target::resolve(loaded, &named)?);
            Ok(choose(loaded, Function::Displacement, &options, &delta(row), original)?.eigenvectors)
        };
        let all = 0..rows.rows();
        Ok(Self {
            rows,
            judge,
            fixed,
            values: all.clone().map(|row| select.values(&loaded.basis, &delta(row))).collect(),
            chosen: all.into_par_iter().map(chosen).collect::<Result<_, Error>>()?,
        })
    }

    /// What is compared of `row` when `query` asks.
    fn vector(&self, method: Method, query: usize, row: usize) -> Vec<f64> {
        let (values, chosen) = (&self.values[row], &self.chosen[query]);
        match method {
            Method::Descriptor => chosen.iter().flat_map(|&j| values[j - 1]).collect(),
            Method::FirstM => values[..chosen.len()].as_flattened().to_vec(),
            Method::FirstK => values.as_flattened().to_vec(),
            Method::Rotation => self.fixed.spectra[row].clone(),
            Method::Components => self.fixed.scores[row].iter().copied().take(chosen.len()).collect(),
        }
    }

    /// All other judged runs, best first; ties by run id.
    fn ranking(&self, method: Method, query: usize) -> Vec<usize> {
        let target = self.vector(method, query, query);
        let taken = |&row: &usize| row != query && (!self.judge.judged || self.judge.label_of_row[row].is_some());
        let similarity = |row: usize| (row, cosine(&target, &self.vector(method, query, row)));
        let mut order: Vec<(usize, f64)> = (0..self.rows.rows()).filter(taken).map(similarity).collect();
        order.sort_by(|a, b| b.1.total_cmp(&a.1).then_with(|| self.rows.runs[a.0].cmp(&self.rows.runs[b.0])));
        order.into_iter().map(|(row, _)| row).collect()
    }

    /// Precision at nine and average precision of a ranking for a label.
    fn quality(&self, order: &[usize], label: usize) -> (f64, f64) {
        let right: Vec<bool> = order.iter().map(|&row| self.judge.label_of_row[row] == Some(label)).collect();
        (precision_at(&right, 9), average_precision(&right))
    }

    /// Mean over every run of a label as the query.
    fn mean_average_precision(&self, method: Method, label: usize) -> f64 {
        let members: Vec<usize> =
            (0..self.rows.rows()).filter(|&row| self.judge.label_of_row[row] == Some(label)).collect();
        let each: Vec<f64> = members.par_iter().map(|&row| self.quality(&self.ranking(method, row), label).1).collect();
        each.iter().sum::<f64>() / each.len().max(1) as f64
    }

    fn row(
        &self,
        query: &Query,
        method: Method,
        select: &'static str,
        name: &str,
        size: usize,
        errors: Option<Errors>,
    ) -> Row {
        let order = self.ranking(method, query.medoid);
        let (precision, average) = self.quality(&order, query.index);
        let judged = self.judge.judged;
        Row {
            label: query.label.clone(),
            query: self.rows.runs[query.medoid].clone(),
            select,
            method: name.to_owned(),
            size,
            rms: errors.map(|errors| errors.rms),
            max: errors.map(|errors| errors.max),
            relative: errors.and_then(|errors| errors.relative),
            precision_at_9: judged.then_some(precision),
            average_precision: judged.then_some(average),
            mean_average_precision: judged.then(|| self.mean_average_precision(method, query.index)),
            nearest: order.iter().take(9).map(|&row| self.rows.runs[row].clone()).collect(),
        }
    }
}

/// The descriptor and its rivals on one query.
fn judge_query(
    loaded: &Loaded,
    arena: &Arena<'_>,
    query: &Query,
    select: Select,
    threshold: Threshold,
) -> Result<Vec<Row>, Error> {
    let named = Named { run: arena.rows.runs[query.medoid].clone(), state: None };
    let options = DescribeOptions { select, threshold, ..Default::default() };
    let selected = describe(loaded, &named, None, None, &options)?.descriptor.selected;
    let row = |method, name: &str, size, errors| arena.row(query, method, select.word(), name, size, errors);
    let mut rows = vec![row(Method::Descriptor, "descriptor", selected.eigenvectors.len(), selected.errors)];
    for rival in &selected.rivals {
        let method = match rival.method.as_str() {
            FIRST_M => Method::FirstM,
            // PCA sees displacements, so it stands beside the descriptor of displacements.
            PCA if select == Select::Coordinates => continue,
            PCA => Method::Components,
            _ => Method::FirstK,
        };
        rows.push(row(method, &rival.method, rival.size, Some(rival.errors)));
    }
    Ok(rows)
}

/// Share of the first `count` that are right; of all where there are fewer.
pub fn precision_at(right: &[bool], count: usize) -> f64 {
    let first = &right[..count.min(right.len())];
    first.iter().filter(|&&right| right).count() as f64 / first.len().max(1) as f64
}

/// Mean over the right ones of the precision at their rank.
pub fn average_precision(right: &[bool]) -> f64 {
    let mut found = 0;
    let mut sum = 0.0;
    for (rank, _) in right.iter().enumerate().filter(|(_, right)| **right) {
        found += 1;
        sum += f64::from(found) / (rank + 1) as f64;
    }
    if found == 0 { 0.0 } else { sum / f64::from(found) }
}

fn agreements(loaded: &Loaded, rows: &Coefficients, judge: &Judge) -> Result<Vec<ModesAgreement>, Error> {
    let asked = judge.queries.len();
    let mut result = Vec::new();
    let ways =
        [By::Rotation, By::Displacement].into_iter().flat_map(|by| modes::Method::ALL.map(|method| (by, method)));
    for (by, method) in ways {
        for count in [Some(asked), None] {
            if asked < 2 || asked > rows.rows() || count.is_some() && !method.takes_count() {
                continue;
            }
            let options = ModesOptions { count, method, by, ..Default::default() };
            let found = modes::groups(&loaded.study, &loaded.basis, &options, &())?;
            // Runs that HDBSCAN leaves out agree with nothing and are counted apart.
            let mode_of = |run: &str| {
                found
                    .modes
                    .iter()
                    .position(|mode| mode.members.binary_search_by(|member| member.as_str().cmp(run)).is_ok())
            };
            let index = |keep: &dyn Fn(usize) -> bool| {
                let pairs: (Vec<usize>, Vec<usize>) = judge
                    .label_of_row
                    .iter()
                    .enumerate()
                    .filter_map(|(row, label)| {
                        label.filter(|&label| keep(label)).and_then(|label| Some((mode_of(&rows.runs[row])?, label)))
                    })
                    .unzip();
                adjusted_rand_index(&pairs.0, &pairs.1)
            };
            let with_mode: Vec<f64> = found.runs.iter().filter_map(|run| run.silhouette).collect();
            let silhouette = with_mode.iter().sum::<f64>() / with_mode.len().max(1) as f64;
            let queried = |label: usize| judge.queries.iter().any(|query| query.index == label);
            result.push(ModesAgreement {
                by,
                method,
                count: found.modes.len(),
                without: found.without_mode().len(),
                chosen: count.is_none(),
                silhouette,
                ari: index(&queried),
                ari_all: index(&|_| true),
            });
        }
    }
    Ok(result)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn precision_and_average_precision_by_hand() {
        let right = [true, false, true, false];
        assert_eq!(precision_at(&right, 2), 0.5);
        assert_eq!(precision_at(&right, 9), 0.5);
        assert_eq!(average_precision(&right), (1.0 + 2.0 / 3.0) / 2.0);
        assert_eq!(average_precision(&[false, false]), 0.0);
        assert_eq!(precision_at(&[], 9), 0.0);
    }
}
