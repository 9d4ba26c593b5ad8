//! Tables for people and other tools: Parquet files that are derived and can be made again.

use std::path::Path;
use std::sync::Arc;

use arrow_array::cast::AsArray;
use arrow_array::{Array, ArrayRef, BooleanArray, Float64Array, Int64Array, RecordBatch, StringArray};
use arrow_schema::{DataType, Field, Schema};
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;

use super::{Manifest, store};
use crate::Error;
use crate::error::io;

/// A column of a table, by kind.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Column {
    /// Texts; `None` is null.
    Text(Vec<Option<String>>),
    /// Numbers; `None` is null.
    Number(Vec<Option<f64>>),
    /// Counts.
    Count(Vec<i64>),
    /// Yes or no.
    Flag(Vec<bool>),
}

impl Column {
    /// Numbers where every text that is there is one, texts otherwise.
    pub(crate) fn of_texts(texts: Vec<Option<&str>>) -> Self {
        let is_value = |text: &&str| !text.is_empty() && !text.eq_ignore_ascii_case("nan");
        let filled = |text: &Option<&str>| text.map(str::trim).filter(is_value).map(str::to_owned);
        let texts: Vec<Option<String>> = texts.iter().map(filled).collect();
        let numbers: Option<Vec<Option<f64>>> = texts
            .iter()
            .map(|text| {
                text.as_ref()
                    .map(|text| text.parse().ok().filter(|x: &f64| x.is_finite()))
                    .map_or(Some(None), |number| number.map(Some))
            })
            .collect();
        numbers.map_or(Self::Text(texts), Self::Number)
    }

    /// Number of rows.
    pub(crate) fn rows(&self) -> usize {
        match self {
            Self::Text(values) => values.len(),
            Self::Number(values) => values.len(),
            Self::Count(values) => values.len(),
            Self::Flag(values) => values.len(),
        }
    }

    /// One value as text; empty for null.
    pub(crate) fn cell(&self, row: usize) -> String {
        match self {
            Self::Text(values) => values[row].clone().unwrap_or_default(),
            Self::Number(values) => values[row].map(|number| number.to_string()).unwrap_or_default(),
            Self::Count(values) => values[row].to_string(),
            Self::Flag(values) => values[row].to_string(),
        }
    }

    fn array(&self) -> (DataType, ArrayRef) {
        match self {
            Self::Text(values) => {
                (DataType::Utf8, Arc::new(StringArray::from_iter(values.iter().map(Option::as_deref))))
            }
            Self::Number(values) => (DataType::Float64, Arc::new(Float64Array::from_iter(values.iter().copied()))),
            Self::Count(values) => (DataType::Int64, Arc::new(Int64Array::from_iter_values(values.iter().copied()))),
            Self::Flag(values) => (DataType::Boolean, Arc::new(BooleanArray::from(values.clone()))),
        }
    }
}

/// Writes a table with the given columns; `metadata` goes into the file's key-value metadata.
///
/// # Errors
/// [`Error::Io`].
pub(crate) fn write_columns(
    path: &Path,
    columns: &[(String, Column)],
    metadata: Option<(&str, String)>,
) -> Result<(), Error> {
    let failed =
        |error: String| Error::Io { action: "write", path: path.to_owned(), source: std::io::Error::other(error) };
    let arrays: Vec<(DataType, ArrayRef)> = columns.iter().map(|(_, column)| column.array()).collect();
    let fields: Vec<Field> =
        columns.iter().zip(&arrays).map(|((name, _), (kind, _))| Field::new(name, kind.clone(), true)).collect();
    let batch =
        RecordBatch::try_new(Arc::new(Schema::new(fields)), arrays.into_iter().map(|(_, array)| array).collect())
            .map_err(|error| failed(error.to_string()))?;
    let properties = WriterProperties::builder()
        .set_created_by(format!("crumple {}", env!("CARGO_PKG_VERSION")))
        .set_key_value_metadata(metadata.map(|(key, value)| vec![KeyValue::new(key.to_owned(), value)]))
        .build();
    store::write_whole(path, |file| {
        let mut writer = ArrowWriter::try_new(&mut *file, batch.schema(), Some(properties))
            .map_err(|error| failed(error.to_string()))?;
        writer.write(&batch).and_then(|()| writer.close()).map_err(|error| failed(error.to_string()))?;
        Ok(())
    })
}

/// Renews `runs.parquet` from the manifest.
pub(crate) fn write_runs(folder: &Path, manifest: &Manifest) -> Result<(), Error> {
    write_columns(&folder.join("runs.parquet"), &run_columns(manifest), None)
}

/// The records of the runs as a table.
pub(crate) fn run_columns(manifest: &Manifest) -> Vec<(String, Column)> {
    let runs: Vec<_> = manifest.runs.values().collect();
    let text =
        |value: &dyn Fn(&super::RunRecord) -> String| Column::Text(runs.iter().map(|run| Some(value(run))).collect());
    let number =
        |value: &dyn Fn(&super::RunRecord) -> f64| Column::Number(runs.iter().map(|run| Some(value(run))).collect());
    let mut columns = vec![
        ("run".to_owned(), Column::Text(manifest.runs.keys().cloned().map(Some).collect())),
        ("path".to_owned(), text(&|run| run.path.display().to_string())),
        ("content".to_owned(), text(&|run| run.content.clone())),
        ("part".to_owned(), text(&|run| run.part.clone())),
        ("states".to_owned(), Column::Count(runs.iter().map(|run| run.times.len() as i64).collect())),
        ("first_time".to_owned(), number(&|run| run.times.first().copied().unwrap_or(f64::NAN))),
        ("last_time".to_owned(), number(&|run| run.times.last().copied().unwrap_or(f64::NAN))),
        ("rms".to_owned(), number(&|run| run.last.rms)),
        ("max".to_owned(), number(&|run| run.last.max)),
        ("captured".to_owned(), number(&|run| run.last.captured)),
        ("rigid_share".to_owned(), number(&|run| run.last.rigid_share)),
        ("strain_median".to_owned(), number(&|run| run.last.strain_median)),
        ("strain_p95".to_owned(), number(&|run| run.last.strain_p95)),
        ("warnings".to_owned(), text(&|run| run.warnings.join("; "))),
    ];
    let values = |input: &String| manifest.runs.values().map(|run| run.inputs.get(input).map(String::as_str)).collect();
    add_inputs(&mut columns, manifest.inputs.iter().map(|input| (input.as_str(), values(input))));
    columns
}

/// Appends inputs, name and texts; one that is called like a column that is there gets `input_` before its name.
pub(crate) fn add_inputs<'a>(
    columns: &mut Vec<(String, Column)>,
    inputs: impl Iterator<Item = (&'a str, Vec<Option<&'a str>>)>,
) {
    for (input, values) in inputs {
        let mut name = input.to_owned();
        while columns.iter().any(|(column, _)| *column == name) {
            name = format!("input_{name}");
        }
        columns.push((name, Column::of_texts(values)));
    }
}

/// One text column of a table.
pub(crate) fn read_strings(path: &Path, column: &str) -> Result<Vec<String>, Error> {
    let damaged = |what: String| Error::Damaged { path: path.to_owned(), what };
    let file = std::fs::File::open(path).map_err(io("read", path))?;
    let reader = ParquetRecordBatchReaderBuilder::try_new(file)
        .and_then(ParquetRecordBatchReaderBuilder::build)
        .map_err(|error| damaged(error.to_string()))?;
    let mut values = Vec::new();
    for batch in reader {
        let batch = batch.map_err(|error| damaged(error.to_string()))?;
        let texts = batch
            .column_by_name(column)
            .and_then(|column| column.as_string_opt::<i32>())
            .ok_or_else(|| damaged(format!("no text column '{column}'")))?;
        values.extend((0..texts.len()).map(|row| texts.value(row).to_owned()));
    }
    Ok(values)
}

/// A value of a table's key-value metadata.
pub(crate) fn metadata_of(path: &Path, key: &str) -> Result<String, Error> {
    let damaged = |what: String| Error::Damaged { path: path.to_owned(), what };
    let file = std::fs::File::open(path).map_err(io("read", path))?;
    let builder = ParquetRecordBatchReaderBuilder::try_new(file).map_err(|error| damaged(error.to_string()))?;
    let entries = builder.metadata().file_metadata().key_value_metadata();
    let entry = entries.into_iter().flatten().find(|entry| entry.key == key);
    entry.and_then(|entry| entry.value.clone()).ok_or_else(|| damaged(format!("no '{key}' in its metadata")))
}
