//! A table for optimisers and meta-models: a row a run or a state, the numbers that are compared under stable names.
//!
//! Columns: `run`, `state`, `time`, `similarity` and `distance` to the descriptor, the numbers ([`Features::names`]),
//! then the inputs of the run. The names depend on the study's basis and the descriptor, never on the runs.

use std::io::Write;
use std::path::Path;

use crate::Error;
use crate::descriptor::Descriptor;
use crate::error::io;
use crate::export::write_csv;
use crate::features::{Features, Samples};
use crate::select::Kind;
use crate::similarity::{Comparer, Score, SimilarityOptions};
use crate::study::{Column, Loaded, Rows, add_inputs, store, write_columns};
use crate::target::Target;

/// Rows of numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureTable {
    /// Names of the numbers.
    pub names: Vec<String>,
    /// The rows, by run and state.
    pub rows: Vec<FeatureRow>,
    /// Names of the study's inputs.
    inputs: Vec<String>,
    /// For each row the inputs of its run, as they were given; empty for a run outside of the study.
    inputs_of_row: Vec<Vec<Option<String>>>,
    compared: bool,
}

/// One state.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureRow {
    /// Run id.
    pub run: String,
    /// State, counted from 0.
    pub state: usize,
    /// Its time.
    pub time: f64,
    /// How alike it is to the descriptor; `None` without one.
    pub score: Option<Score>,
    /// The numbers.
    pub numbers: Vec<f64>,
}

/// What is put into a row: a descriptor's numbers and the comparison with it, or, without one, the rotation spectrum.
pub struct FeatureMaker<'a> {
    loaded: &'a Loaded,
    features: Features,
    comparer: Option<Comparer>,
}

impl<'a> FeatureMaker<'a> {
    /// Prepares the table.
    ///
    /// # Errors
    /// As [`Comparer::new`]; [`Error::Value`] for the paper's kind without a descriptor, which alone says which
    /// eigenvectors matter.
    pub fn new(loaded: &'a Loaded, descriptor: Option<&Descriptor>, options: SimilarityOptions) -> Result<Self, Error> {
        let comparer = descriptor.map(|descriptor| Comparer::new(loaded, descriptor, options)).transpose()?;
        let features = match &comparer {
            Some(comparer) => comparer.features().clone(),
            None if options.kind == Some(Kind::Paper) => {
                return Err(Error::Value {
                    name: "--kind",
                    value: "paper".into(),
                    expected: "a descriptor beside it: it says which eigenvectors matter (`crumple describe`)".into(),
                });
            }
            None => Features::rotation(&loaded.basis),
        };
        Ok(Self { loaded, features, comparer })
    }

    /// Rows of the study.
    ///
    /// # Errors
    /// [`Error::TooFewRuns`] for a study without runs, reading errors.
    pub fn study(&self, rows: Rows<'_>) -> Result<FeatureTable, Error> {
        let samples = self.features.read(&self.loaded.study, rows)?;
        if samples.rows() == 0 {
            return Err(Error::TooFewRuns { what: "a table of features", needed: 1, have: 0 });
        }
        Ok(self.table(&samples))
    }

    /// One row for a state that was named or projected.
    ///
    /// # Errors
    /// [`Error::UnknownField`] if it lacks what is compared.
    pub fn target(&self, target: &Target) -> Result<FeatureTable, Error> {
        Ok(self.table(&self.features.sample(target)?))
    }

    fn table(&self, samples: &Samples) -> FeatureTable {
        let row = |row: usize| {
            let stored = samples.stored(row);
            FeatureRow {
                run: samples.run(row).to_owned(),
                state: samples.state(row) as usize,
                time: samples.time(row),
                score: self.comparer.as_ref().map(|comparer| comparer.score(&stored)),
                numbers: self.features.vector(&stored),
            }
        };
        let rows: Vec<FeatureRow> = (0..samples.rows()).map(row).collect();
        let manifest = self.loaded.study.manifest();
        let inputs = |row: &FeatureRow| {
            let record = manifest.runs.get(&row.run);
            manifest.inputs.iter().map(|input| record.and_then(|record| record.inputs.get(input).cloned())).collect()
        };
        FeatureTable {
            names: self.features.names(),
            inputs: manifest.inputs.clone(),
            inputs_of_row: rows.iter().map(inputs).collect(),
            compared: self.comparer.is_some(),
            rows,
        }
    }
}

impl FeatureTable {
    /// Writes the table: Parquet where the name ends so, else CSV.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("parquet")) {
            return write_columns(path, &self.columns(), None);
        }
        store::write_whole(path, |file| write_csv(&mut *file, path, &self.columns()))
    }

    /// The table as CSV.
    ///
    /// # Errors
    /// [`Error::Internal`] if it is no text.
    pub fn csv(&self) -> Result<String, Error> {
        let mut bytes = Vec::new();
        write_csv(&mut bytes, Path::new("standard output"), &self.columns())?;
        bytes.flush().map_err(io("write", Path::new("standard output")))?;
        String::from_utf8(bytes).map_err(|error| Error::Internal(error.to_string()))
    }

    /// Inputs of a row by name, as they were given.
    pub fn inputs(&self, row: usize) -> impl Iterator<Item = (&str, Option<&str>)> {
        self.inputs.iter().map(String::as_str).zip(self.inputs_of_row[row].iter().map(Option::as_deref))
    }

    fn columns(&self) -> Vec<(String, Column)> {
        let number =
            |of: &dyn Fn(&FeatureRow) -> f64| Column::Number(self.rows.iter().map(|row| Some(of(row))).collect());
        let mut columns = vec![
            ("run".to_owned(), Column::Text(self.rows.iter().map(|row| Some(row.run.clone())).collect())),
            ("state".to_owned(), Column::Count(self.rows.iter().map(|row| row.state as i64).collect())),
            ("time".to_owned(), number(&|row| row.time)),
        ];
        if self.compared {
            let score = |of: fn(Score) -> f64| Column::Number(self.rows.iter().map(|row| row.score.map(of)).collect());
            columns.push(("similarity".to_owned(), score(|score| score.similarity)));
            columns.push(("distance".to_owned(), score(|score| score.distance)));
        }
        for (at, name) in self.names.iter().enumerate() {
            columns.push((name.clone(), number(&|row| row.numbers[at])));
        }
        let inputs = self.inputs.iter().enumerate().map(|(at, input)| {
            let values = self.inputs_of_row.iter().map(|inputs| inputs[at].as_deref()).collect();
            (input.as_str(), values)
        });
        add_inputs(&mut columns, inputs);
        columns
    }
}
