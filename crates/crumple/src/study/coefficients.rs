//! Coefficient parts on disk: Parquet, one row a state, columns so laid that a descriptor reads only its own.
//!
//! `run`, `state`, `time`, measures, then `d1_x`, `d1_y`, `d1_z`, `d2_x`, …: δ of eigenvector j (counted from 1),
//! `r1_x`, …: ρ of the rotation field, and for each field that the study keeps `plastic_strain_1`, …; all in f32. A part is never changed; its name is the hash of its content.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use arrow_array::cast::AsArray;
use arrow_array::types::{Float32Type, Float64Type, UInt32Type};
use arrow_array::{ArrayRef, Float32Array, Float64Array, RecordBatch, StringArray, UInt32Array};
use arrow_schema::{DataType, Field, Schema};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::arrow::{ArrowWriter, ProjectionMask};
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::reader::ChunkReader;

use super::{Manifest, store};
use crate::Error;
use crate::error::io;
use crate::field::Field as Quantity;
use crate::project::{Measures, Projected, ProjectedState};

/// Folder of the parts in a study.
pub(crate) const FOLDER: &str = "coefficients";
/// What a part is called before its content has given it a name.
const PART: &str = "part";
/// Row group of the last states of a part's runs: most questions read nothing else.
const LAST_STATES: usize = 0;
/// Key of the basis' content name in a part's metadata.
const BASIS: &str = "crumple.basis";
const COMPONENTS: [char; 3] = ['x', 'y', 'z'];

/// The function on the surface that was projected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Function {
    /// p − p⁰: coefficients δ, in length².
    #[default]
    Displacement,
    /// The rotation field: coefficients ρ, in length.
    Rotation,
    /// A quantity of the result files: coefficients in its unit times length.
    Field(Quantity),
}

impl Function {
    /// Numbers a vertex, and so an eigenvector, has: 3, or 1 for a scalar field.
    pub fn components(self) -> usize {
        match self {
            Self::Displacement | Self::Rotation => 3,
            Self::Field(field) => field.components(),
        }
    }

    /// Column of its root mean square over the surface.
    fn rms_column(self) -> Option<&'static str> {
        match self {
            Self::Displacement => Some("rms"),
            Self::Rotation => Some("turn"),
            Self::Field(_) => None,
        }
    }

    /// Its coefficients in a projected state, K × components.
    fn of(self, state: &ProjectedState) -> &[f32] {
        match self {
            Self::Displacement => &state.delta,
            Self::Rotation => &state.rotation,
            Self::Field(field) => {
                state.fields.iter().find(|(name, _)| *name == field).map_or(&[], |(_, values)| values)
            }
        }
    }
}

/// Coefficients that a comparison reads: all K of a function, or those of some eigenvectors.
#[derive(Debug, Clone, PartialEq)]
pub struct Need {
    /// What was projected.
    pub function: Function,
    /// Eigenvectors, counted from 1; all when `None`.
    pub eigenvectors: Option<Vec<usize>>,
}

/// Stored coefficients of one function in one state.
#[derive(Debug, Clone, Copy)]
pub struct Stored<'a> {
    /// Coefficients, as the need says.
    pub values: &'a [f32],
    /// Root mean square of the whole function over the surface; 0 for fields.
    pub rms: f64,
}

/// Rows of coefficients, sorted by run and state.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Coefficients {
    /// What was projected.
    pub function: Function,
    /// Eigenvectors of the columns, counted from 1.
    pub eigenvectors: Vec<usize>,
    /// Run id of each row.
    pub runs: Vec<String>,
    /// State of each row, counted from 0.
    pub states: Vec<u32>,
    /// Time of each row.
    pub times: Vec<f64>,
    /// Root mean square of the whole function over the surface, for each row; empty for fields.
    pub rms: Vec<f64>,
    /// Coefficients of `function`, rows × components · |eigenvectors|, row-major: all components of the first
    /// eigenvector, then of the next.
    pub values: Vec<f32>,
}

impl Coefficients {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.runs.len()
    }

    /// Numbers a row has.
    pub fn width(&self) -> usize {
        self.function.components() * self.eigenvectors.len()
    }

    /// One row, [`Coefficients::width`] numbers.
    pub fn row(&self, row: usize) -> &[f32] {
        let width = self.width();
        &self.values[row * width..(row + 1) * width]
    }

    /// One row as a comparison takes it.
    pub fn stored(&self, row: usize) -> Stored<'_> {
        Stored { values: self.row(row), rms: self.rms.get(row).copied().unwrap_or(0.0) }
    }

    /// One row of a vector function as |eigenvectors| × 3.
    pub fn triples(&self, row: usize) -> Vec<[f64; 3]> {
        triples(self.row(row))
    }

    /// Adds the rows of another part.
    pub(crate) fn append(&mut self, mut other: Self) {
        self.runs.append(&mut other.runs);
        self.states.append(&mut other.states);
        self.times.append(&mut other.times);
        self.rms.append(&mut other.rms);
        self.values.append(&mut other.values);
    }

    /// Sorts rows by run and state, so that the order in which parts came does not matter.
    pub(crate) fn sorted(self) -> Self {
        let mut order: Vec<usize> = (0..self.rows()).collect();
        order.sort_by(|&a, &b| (&self.runs[a], self.states[a]).cmp(&(&self.runs[b], self.states[b])));
        if order.is_sorted() {
            return self;
        }
        let mut values = Vec::with_capacity(self.values.len());
        order.iter().for_each(|&row| values.extend_from_slice(self.row(row)));
        let mut runs = self.runs;
        Self {
            states: order.iter().map(|&row| self.states[row]).collect(),
            times: order.iter().map(|&row| self.times[row]).collect(),
            rms: order.iter().filter_map(|&row| self.rms.get(row).copied()).collect(),
            runs: order.iter().map(|&row| std::mem::take(&mut runs[row])).collect(),
            values,
            function: self.function,
            eigenvectors: self.eigenvectors,
        }
    }
}

/// Writes runs as one part into the study's folder; returns its path below the study.
pub(crate) fn write_part(folder: &Path, basis: &str, runs: &[Projected]) -> Result<String, Error> {
    let staged = store::Staged::beside(&folder.join(FOLDER).join(PART));
    let rows = || {
        runs.iter().flat_map(|run| {
            run.states.iter().zip(0..).map(|(state, index)| (run.run.as_str(), index, run.states.len(), state))
        })
    };
    let is_last = |&(_, index, states, _): &(&str, u32, usize, &ProjectedState)| index as usize + 1 == states;
    let last = record_batch(rows().filter(is_last))?;
    let others = record_batch(rows().filter(|row| !is_last(row)))?;
    let internal = |error: parquet::errors::ParquetError| match error {
        parquet::errors::ParquetError::External(source) => match source.downcast::<std::io::Error>() {
            Ok(source) => io("write", folder)(*source),
            Err(other) => Error::Internal(other.to_string()),
        },
        other => {
            Error::Io { action: "write", path: folder.to_owned(), source: std::io::Error::other(other.to_string()) }
        }
    };
    let mut properties = WriterProperties::builder()
        .set_statistics_enabled(EnabledStatistics::None)
        .set_dictionary_enabled(false)
        .set_column_dictionary_enabled("run".into(), true)
        .set_created_by(format!("crumple {}", env!("CARGO_PKG_VERSION")));
    properties = properties
        .set_key_value_metadata(Some(vec![parquet::file::metadata::KeyValue::new(BASIS.to_owned(), basis.to_owned())]));
    let file = staged.create(folder)?;
    let mut writer = ArrowWriter::try_new(std::io::BufWriter::new(file), last.schema(), Some(properties.build()))
        .map_err(internal)?;
    writer.write(&last).and_then(|()| writer.flush()).map_err(internal)?;
    if others.num_rows() > 0 {
        writer.write(&others).map_err(internal)?;
    }
    let file =
        writer.into_inner().map_err(internal)?.into_inner().map_err(|error| io("write", folder)(error.into_error()))?;
    file.sync_all().map_err(io("write", folder))?;
    let record = super::FileRecord::of(&staged.path)?;
    let name = format!("{FOLDER}/{}.parquet", &record.blake3[..16]);
    staged.rename_to(&folder.join(&name))?;
    Ok(name)
}

fn record_batch<'a>(
    rows: impl Iterator<Item = (&'a str, u32, usize, &'a ProjectedState)>,
) -> Result<RecordBatch, Error> {
    let rows: Vec<(&str, u32, &ProjectedState)> = rows.map(|(run, index, _, state)| (run, index, state)).collect();
    let mut fields = vec![
        Field::new("run", DataType::Utf8, false),
        Field::new("state", DataType::UInt32, false),
        Field::new("time", DataType::Float64, false),
    ];
    let mut columns: Vec<ArrayRef> = vec![
        Arc::new(StringArray::from_iter_values(rows.iter().map(|row| row.0))),
        Arc::new(UInt32Array::from_iter_values(rows.iter().map(|row| row.1))),
        Arc::new(Float64Array::from_iter_values(rows.iter().map(|row| row.2.time))),
    ];
    for (name, of) in Measures::COLUMNS {
        fields.push(Field::new(name, DataType::Float64, false));
        columns.push(Arc::new(Float64Array::from_iter_values(rows.iter().map(|row| of(&row.2.measures)))));
    }
    let kept = rows.first().into_iter().flat_map(|row| &row.2.fields).map(|(field, _)| Function::Field(*field));
    for function in [Function::Displacement, Function::Rotation].into_iter().chain(kept) {
        let components = function.components();
        let width = rows.first().map_or(0, |row| function.of(row.2).len());
        for column in 0..width {
            let name = column_name(function, column / components + 1, column % components);
            let values = rows.iter().map(|row| function.of(row.2).get(column).copied().unwrap_or_default());
            fields.push(Field::new(name, DataType::Float32, false));
            columns.push(Arc::new(Float32Array::from_iter_values(values)));
        }
    }
    RecordBatch::try_new(Arc::new(Schema::new(fields)), columns).map_err(|error| Error::Internal(error.to_string()))
}

/// Stored coefficients, x, y, z of one eigenvector after another, as triples.
pub(crate) fn triples(stored: &[f32]) -> Vec<[f64; 3]> {
    stored.as_chunks().0.iter().map(|triple: &[f32; 3]| triple.map(f64::from)).collect()
}

/// Name of the column of an eigenvector (counted from 1) and a component (0, 1, 2).
pub fn column_name(function: Function, eigenvector: usize, component: usize) -> String {
    let axis = COMPONENTS[component];
    match function {
        Function::Displacement => format!("d{eigenvector}_{axis}"),
        Function::Rotation => format!("r{eigenvector}_{axis}"),
        Function::Field(field) if field.components() == 1 => format!("{}_{eigenvector}", field.column()),
        Function::Field(field) => format!("{}_{eigenvector}_{axis}", field.column()),
    }
}

/// Which rows of a part are wanted.
pub(crate) struct Wanted<'a> {
    /// Content name of the study's basis.
    pub(crate) basis: &'a str,
    /// Only last states; they have a row group of their own.
    pub(crate) last: bool,
    /// Says yes by run and state.
    pub(crate) keep: &'a (dyn Fn(&str, u32) -> bool + Sync),
}

/// Reads the rows of a part that are wanted, only the columns of the named eigenvectors, and appends them to `into`,
/// whose `eigenvectors` say which.
pub(crate) fn read_part<R: ChunkReader + 'static>(
    source: R,
    path: &Path,
    wanted: &Wanted<'_>,
    into: &mut Coefficients,
) -> Result<(), Error> {
    let damaged = |what: String| Error::Damaged { path: path.to_owned(), what };
    let builder = ParquetRecordBatchReaderBuilder::try_new(source).map_err(|error| damaged(error.to_string()))?;
    let function = into.function;
    let entries = builder.metadata().file_metadata().key_value_metadata().into_iter().flatten();
    if !entries.clone().any(|entry| entry.key == BASIS && entry.value.as_deref() == Some(wanted.basis)) {
        return Err(damaged("it belongs to another eigenbasis than the study's".into()));
    }
    let rms = function.rms_column();
    let facts: Vec<&str> = ["run", "state", "time"].into_iter().chain(rms).collect();
    let names = facts.iter().map(|name| (*name).to_owned());
    let names: Vec<String> = names
        .chain(
            into.eigenvectors
                .iter()
                .flat_map(|&j| (0..function.components()).map(move |c| column_name(function, j, c))),
        )
        .collect();
    let schema = builder.parquet_schema();
    let by_name: std::collections::HashMap<&str, usize> =
        schema.columns().iter().zip(0..).map(|(column, leaf)| (column.name(), leaf)).collect();
    let leaves: Vec<usize> = names
        .iter()
        .map(|name| by_name.get(name.as_str()).copied().ok_or_else(|| damaged(format!("no column '{name}'"))))
        .collect::<Result<_, _>>()?;
    let mask = ProjectionMask::leaves(schema, leaves);
    let builder = if wanted.last { builder.with_row_groups(vec![LAST_STATES]) } else { builder };
    let reader = builder.with_projection(mask).build().map_err(|error| damaged(error.to_string()))?;
    for batch in reader {
        let batch = batch.map_err(|error| damaged(error.to_string()))?;
        let column = |name: &str| batch.column_by_name(name).ok_or_else(|| damaged(format!("no column '{name}'")));
        let wrong = |name: &str| damaged(format!("column '{name}' has another type than expected"));
        let runs = column("run")?.as_string_opt::<i32>().ok_or_else(|| wrong("run"))?;
        let states = column("state")?.as_primitive_opt::<UInt32Type>().ok_or_else(|| wrong("state"))?.values();
        let times = column("time")?.as_primitive_opt::<Float64Type>().ok_or_else(|| wrong("time"))?.values();
        let rms = rms
            .map(|name| {
                Ok::<_, Error>(column(name)?.as_primitive_opt::<Float64Type>().ok_or_else(|| wrong(name))?.values())
            })
            .transpose()?;
        let values: Vec<&[f32]> = names[facts.len()..]
            .iter()
            .map(|name| {
                Ok::<_, Error>(
                    &column(name)?.as_primitive_opt::<Float32Type>().ok_or_else(|| wrong(name))?.values()[..],
                )
            })
            .collect::<Result<_, _>>()?;
        for row in (0..batch.num_rows()).filter(|&row| (wanted.keep)(runs.value(row), states[row])) {
            into.runs.push(runs.value(row).to_owned());
            into.states.push(states[row]);
            into.times.push(times[row]);
            into.rms.extend(rms.map(|rms| rms[row]));
            into.values.extend(values.iter().map(|column| column[row]));
        }
    }
    Ok(())
}

/// What a killed writer leaves behind: parts that no manifest names, and temporary files.
pub(crate) fn litter(folder: &Path, manifest: &Manifest) -> Result<Vec<PathBuf>, Error> {
    let tables = ["manifest.json", "runs.parquet", "modes.parquet", "report.html"];
    let mut paths: Vec<PathBuf> = tables.iter().flat_map(|name| store::temporaries(folder, name)).collect();
    paths.extend(store::temporaries(&folder.join(super::DESCRIPTORS), ""));
    let parts = folder.join(FOLDER);
    for entry in std::fs::read_dir(&parts).map_err(io("read the folder", &parts))? {
        let entry = entry.map_err(io("read the folder", &parts))?;
        let name = format!("{FOLDER}/{}", entry.file_name().to_string_lossy());
        if entry.file_name() != super::WRITERS && entry.path().is_file() && !manifest.files.contains_key(&name) {
            paths.push(entry.path());
        }
    }
    paths.sort();
    Ok(paths)
}
