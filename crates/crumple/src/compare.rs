//! Judged from outside: how well descriptors and their rivals rank runs, and how well modes agree, given labels.
//!
//! Labels come from the user (from geometry, from an expert); nothing is computed from them but the judgement. For
//! each label the query is the medoid of its clear runs; every method ranks all other labelled runs by cosine
//! similarity to the query; a run of another label counts as wrong.

use serde::Serialize;

use crate::Error;
use crate::descriptor::{DescribeOptions, FIRST_M, PCA, Select, Threshold, describe, first_k_name};
use crate::inputs::Table;
use crate::modes::{self, ModesOptions, Points, adjusted_rand_index};
use crate::rivals::Pca;
use crate::similarity::cosine;
use crate::study::{Coefficients, Loaded};
use crate::target::Named;

/// Everything `compare` finds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// One row a query, choice of coefficients and method.
    pub rows: Vec<Row>,
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
    /// Which coefficients: `coordinates` or `difference`.
    pub select: &'static str,
    /// `descriptor`, `first M`, `first K`, `PCA`.
    pub method: String,
    /// Eigenvectors or components used.
    pub size: usize,
    /// M-weighted RMS error of its reconstruction of the query, in the length unit.
    pub rms: f64,
    /// Largest error of a vertex, in the length unit.
    pub max: f64,
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
    /// The method.
    pub method: modes::Method,
    /// Number of modes.
    pub count: usize,
    /// Whether the program chose that number.
    pub chosen: bool,
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
    let rows = loaded.last_states()?;
    let (judges, notes) = match labels {
        Some(table) => Judge::of_labels(rows, loaded, table)?,
        None => (
            Judge::of_modes(rows, loaded)?,
            vec!["without labels there is nothing to judge a ranking by: precision is left out".to_owned()],
        ),
    };
    let mut result = Vec::new();
    for judge in &judges.queries {
        for select in [Select::Coordinates, Select::Difference] {
            result.extend(judge_query(loaded, rows, &judges, judge, select, threshold)?);
        }
    }
    let modes = if labels.is_some() { agreements(loaded, rows, &judges)? } else { Vec::new() };
    Ok(Comparison { rows: result, modes, notes })
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
        let column = table.columns.iter().position(|column| column == "label").unwrap_or(0);
        let clear = table.columns.iter().position(|column| column == "clear");
        let joined = table.join(&rows.runs.iter().map(String::as_str).collect::<Vec<_>>())?;
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
        let distances = Points::of(rows, loaded.basis.facts.area).distances();
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

/// A method: from the row of a query to the vectors that the cosine compares.
enum Method {
    /// Values on the eigenvectors that this rule gives for the query.
    Eigenvectors(Choice),
    /// Scores of as many components as the query's descriptor has eigenvectors.
    Components,
}

#[derive(Clone, Copy)]
enum Choice {
    Descriptor,
    FirstM,
    FirstK,
}

fn judge_query(
    loaded: &Loaded,
    rows: &Coefficients,
    judges: &Judge,
    query: &Query,
    select: Select,
    threshold: Threshold,
) -> Result<Vec<Row>, Error> {
    let named = Named { run: rows.runs[query.medoid].clone(), state: None };
    let described = describe(loaded, &named, None, None, &DescribeOptions { select, threshold })?;
    let values = Values::of(loaded, rows, select);
    let m = described.descriptor.eigenvectors.len();
    let mut methods = vec![
        ("descriptor".to_owned(), m, Some(described.descriptor.errors), Method::Eigenvectors(Choice::Descriptor)),
        (FIRST_M.to_owned(), m, error_of(&described, FIRST_M), Method::Eigenvectors(Choice::FirstM)),
        (
            first_k_name(&loaded.basis),
            loaded.basis.eigenpairs(),
            error_of(&described, &first_k_name(&loaded.basis)),
            Method::Eigenvectors(Choice::FirstK),
        ),
    ];
    if select == Select::Difference {
        // PCA sees displacements, so it stands beside the descriptor of displacements.
        methods.push((PCA.to_owned(), m, error_of(&described, PCA), Method::Components));
    }
    let pca = Pca::of(rows, loaded.basis.eigenpairs().min(rows.rows()));
    let ranking = |method: &Method, row: usize| -> Result<Vec<usize>, Error> {
        let chosen = values.select(row, threshold)?;
        let similarity: Vec<f64> = match method {
            Method::Eigenvectors(choice) => {
                let columns: Vec<usize> = match choice {
                    Choice::Descriptor => chosen,
                    Choice::FirstM => (1..=chosen.len()).collect(),
                    Choice::FirstK => (1..=loaded.basis.eigenpairs()).collect(),
                };
                let target = values.on(row, &columns);
                (0..rows.rows()).map(|other| cosine(&target, &values.on(other, &columns))).collect()
            }
            Method::Components => {
                let scores = |row: usize| -> Vec<f64> {
                    let delta: Vec<f64> = rows.row(row).iter().map(|&x| f64::from(x)).collect();
                    pca.scores(&delta).into_iter().take(chosen.len()).collect()
                };
                let target = scores(row);
                (0..rows.rows()).map(|other| cosine(&target, &scores(other))).collect()
            }
        };
        let mut order: Vec<usize> = (0..rows.rows())
            .filter(|&other| other != row && (!judges.judged || judges.label_of_row[other].is_some()))
            .collect();
        order.sort_by(|&a, &b| similarity[b].total_cmp(&similarity[a]).then_with(|| rows.runs[a].cmp(&rows.runs[b])));
        Ok(order)
    };
    let quality = |order: &[usize]| {
        let right: Vec<bool> = order.iter().map(|&row| judges.label_of_row[row] == Some(query.index)).collect();
        (precision_at(&right, 9), average_precision(&right))
    };
    methods
        .into_iter()
        .map(|(name, size, errors, method)| {
            let order = ranking(&method, query.medoid)?;
            let (precision, average) = quality(&order);
            let members: Vec<usize> =
                (0..rows.rows()).filter(|&row| judges.label_of_row[row] == Some(query.index)).collect();
            let mean = if judges.judged {
                members.iter().map(|&row| Ok(quality(&ranking(&method, row)?).1)).sum::<Result<f64, Error>>()?
                    / members.len() as f64
            } else {
                0.0
            };
            let judged = |value: f64| judges.judged.then_some(value);
            Ok(Row {
                label: query.label.clone(),
                query: rows.runs[query.medoid].clone(),
                select: select.word(),
                method: name,
                size,
                rms: errors.map_or(f64::NAN, |errors| errors.rms),
                max: errors.map_or(f64::NAN, |errors| errors.max),
                relative: errors.and_then(|errors| errors.relative),
                precision_at_9: judged(precision),
                average_precision: judged(average),
                mean_average_precision: judged(mean),
                nearest: order.iter().take(9).map(|&row| rows.runs[row].clone()).collect(),
            })
        })
        .collect()
}

fn error_of(described: &crate::descriptor::Described, method: &str) -> Option<crate::reconstruct::Errors> {
    described.descriptor.rivals.iter().find(|rival| rival.method == method).map(|rival| rival.errors)
}

/// Values of all rows on all eigenvectors.
struct Values {
    width: usize,
    values: Vec<[f64; 3]>,
}

impl Values {
    fn of(loaded: &Loaded, rows: &Coefficients, select: Select) -> Self {
        let width = rows.eigenvectors.len();
        let delta = |row: usize| -> Vec<[f64; 3]> {
            rows.row(row).as_chunks().0.iter().map(|triple: &[f32; 3]| triple.map(f64::from)).collect()
        };
        Self { width, values: (0..rows.rows()).flat_map(|row| select.values(&loaded.basis, &delta(row))).collect() }
    }

    fn row(&self, row: usize) -> &[[f64; 3]] {
        &self.values[row * self.width..(row + 1) * self.width]
    }

    fn on(&self, row: usize, eigenvectors: &[usize]) -> Vec<f64> {
        eigenvectors.iter().flat_map(|&j| self.row(row)[j - 1]).collect()
    }

    fn select(&self, row: usize, threshold: Threshold) -> Result<Vec<usize>, Error> {
        let left_out = |order: &[usize], m: usize| {
            order[m..].iter().map(|&j| self.row(row)[j - 1].iter().map(|x| x * x).sum::<f64>()).sum::<f64>().sqrt()
        };
        Ok(threshold.select(self.row(row), left_out)?.eigenvectors)
    }
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

fn agreements(loaded: &Loaded, rows: &Coefficients, judges: &Judge) -> Result<Vec<ModesAgreement>, Error> {
    let asked = judges.queries.len();
    let mut result = Vec::new();
    for method in [modes::Method::KMeans, modes::Method::Ward, modes::Method::Average] {
        for count in [Some(asked), None] {
            if asked < 2 || asked > rows.rows() {
                continue;
            }
            let found = modes::modes(&loaded.study, &ModesOptions { count, method, ..Default::default() }, &())?;
            let mode_of = |run: &str| {
                found.modes.iter().position(|mode| mode.members.iter().any(|member| member == run)).unwrap_or(0)
            };
            let index = |keep: &dyn Fn(usize) -> bool| {
                let pairs: (Vec<usize>, Vec<usize>) = judges
                    .label_of_row
                    .iter()
                    .enumerate()
                    .filter_map(|(row, label)| {
                        label.filter(|&label| keep(label)).map(|label| (mode_of(&rows.runs[row]), label))
                    })
                    .unzip();
                adjusted_rand_index(&pairs.0, &pairs.1)
            };
            let silhouette = found.runs.iter().map(|run| run.silhouette).sum::<f64>() / found.runs.len() as f64;
            let queried = |label: usize| judges.queries.iter().any(|query| query.index == label);
            result.push(ModesAgreement {
                method,
                count: found.modes.len(),
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
