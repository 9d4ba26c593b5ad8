//! Export: arrays and tables that other tools open without a reader of ours.

use std::io::Write;
use std::path::{Path, PathBuf};

use npyz::WriterBuilder;

use crate::Error;
use crate::descriptor::Descriptor;
use crate::error::io;
use crate::modes;
use crate::study::{Coefficients, Column, Loaded, Rows, column_name, run_columns, store, write_columns};
use crate::vector::{double_area, square};

/// Formats of tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Format {
    /// Comma-separated values.
    #[default]
    Csv,
    /// Parquet.
    Parquet,
}

/// What to export.
#[derive(Debug, Clone, Copy, Default)]
pub struct ExportOptions<'a> {
    /// Format of the tables.
    pub format: Format,
    /// Only the coefficients of this descriptor, not all K.
    pub descriptor: Option<&'a Descriptor>,
    /// Only the last state of each run.
    pub last: bool,
}

/// Writes into `folder`: `eigenvalues.npy` (K), `eigenvectors.npy` (K × N), `mass.npy` (N), `baseline.npy` (K × 3),
/// `vertices.npy` (N × 3), `triangles.npy` (T × 3), `node_ids.npy` (N), `coefficients.npy` (states × |J| × 3, δ), and
/// the tables `coefficients`, `runs` and, where there are modes, `modes`. Returns the files.
///
/// # Errors
/// [`Error::Io`], reading errors.
pub fn export(loaded: &Loaded, folder: &Path, options: &ExportOptions<'_>) -> Result<Vec<PathBuf>, Error> {
    let &ExportOptions { format, descriptor, last } = options;
    std::fs::create_dir_all(folder).map_err(io("make the folder", folder))?;
    let (basis, reference) = (&loaded.basis, &loaded.reference);
    let (k, n, t) = (basis.eigenpairs() as u64, basis.vertices() as u64, reference.mesh.triangles().len() as u64);
    let rows = loaded.study.coefficients(
        descriptor.map(|descriptor| &descriptor.selected.eigenvectors[..]),
        if last { Rows::Last } else { Rows::All },
    )?;
    let path = |name: &str| folder.join(name);
    let mut files = vec![
        array(path("eigenvalues.npy"), &[k], basis.eigenvalues.iter().copied())?,
        array(path("eigenvectors.npy"), &[k, n], basis.eigenvectors.iter().copied())?,
        array(path("mass.npy"), &[n], basis.mass.iter().copied())?,
        array(path("baseline.npy"), &[k, 3], basis.baseline.iter().flatten().copied())?,
        array(path("vertices.npy"), &[n, 3], reference.mesh.vertices().iter().flatten().copied())?,
        array(path("triangles.npy"), &[t, 3], reference.mesh.triangles().iter().flatten().copied())?,
        array(path("node_ids.npy"), &[n], reference.node_ids.iter().copied())?,
        array(
            path("coefficients.npy"),
            &[rows.rows() as u64, rows.eigenvectors.len() as u64, 3],
            rows.values.iter().copied(),
        )?,
    ];
    files.push(table(folder, "coefficients", format, &coefficient_columns(&rows))?);
    files.push(table(folder, "runs", format, &run_columns(loaded.study.manifest()))?);
    match modes::load(&loaded.study) {
        Ok(modes) => files.push(table(folder, "modes", format, &modes::columns(&modes))?),
        Err(Error::NoModes) => {}
        Err(other) => return Err(other),
    }
    Ok(files)
}

fn array<T: npyz::Serialize + npyz::AutoSerialize>(
    path: PathBuf,
    shape: &[u64],
    values: impl Iterator<Item = T>,
) -> Result<PathBuf, Error> {
    store::write_whole(&path, |file| {
        let mut writer = npyz::WriteOptions::new()
            .default_dtype()
            .shape(shape)
            .writer(&mut *file)
            .begin_nd()
            .map_err(io("write", &path))?;
        writer.extend(values).and_then(|()| writer.finish()).map_err(io("write", &path))
    })?;
    Ok(path)
}

fn coefficient_columns(rows: &Coefficients) -> Vec<(String, Column)> {
    let mut columns = vec![
        ("run".to_owned(), Column::Text(rows.runs.iter().cloned().map(Some).collect())),
        ("state".to_owned(), Column::Count(rows.states.iter().map(|&state| i64::from(state)).collect())),
        ("time".to_owned(), Column::Number(rows.times.iter().copied().map(Some).collect())),
    ];
    for (at, &j) in rows.eigenvectors.iter().enumerate() {
        let components = rows.function.components();
        for component in 0..components {
            let values =
                (0..rows.rows()).map(|row| Some(f64::from(rows.row(row)[components * at + component]))).collect();
            columns.push((column_name(rows.function, j, component), Column::Number(values)));
        }
    }
    columns
}

fn table(folder: &Path, name: &str, format: Format, columns: &[(String, Column)]) -> Result<PathBuf, Error> {
    match format {
        Format::Parquet => {
            let path = folder.join(format!("{name}.parquet"));
            write_columns(&path, columns, None)?;
            Ok(path)
        }
        Format::Csv => {
            let path = folder.join(format!("{name}.csv"));
            store::write_whole(&path, |file| write_csv(file, &path, columns))?;
            Ok(path)
        }
    }
}

/// Writes a table as CSV. `path` is named in errors.
pub(crate) fn write_csv(file: &mut dyn Write, path: &Path, columns: &[(String, Column)]) -> Result<(), Error> {
    let failed =
        |error: csv::Error| Error::Io { action: "write", path: path.to_owned(), source: std::io::Error::other(error) };
    let rows = columns.first().map_or(0, |(_, column)| column.rows());
    let mut writer = csv::Writer::from_writer(file);
    writer.write_record(columns.iter().map(|(name, _)| name)).map_err(failed)?;
    for row in 0..rows {
        writer.write_record(columns.iter().map(|(_, column)| column.cell(row))).map_err(failed)?;
    }
    writer.flush().map_err(io("write", path))
}

/// Writes a surface as OBJ: for any viewer. `positions` N × 3.
///
/// # Errors
/// [`Error::Io`].
pub fn write_obj(path: &Path, positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<(), Error> {
    store::write_whole(path, |file| {
        let mut lines = || -> std::io::Result<()> {
            positions.iter().try_for_each(|[x, y, z]| writeln!(file, "v {x} {y} {z}"))?;
            triangles.iter().try_for_each(|[a, b, c]| writeln!(file, "f {} {} {}", a + 1, b + 1, c + 1))
        };
        lines().map_err(io("write", path))
    })
}

/// Writes a surface as binary STL. `positions` N × 3.
///
/// # Errors
/// [`Error::Io`].
pub fn write_stl(path: &Path, positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<(), Error> {
    store::write_whole(path, |file| {
        let mut bytes = || -> std::io::Result<()> {
            let mut head = [b' '; 80];
            head[..12].copy_from_slice(b"crumple mesh");
            file.write_all(&head)?;
            file.write_all(&(triangles.len() as u32).to_le_bytes())?;
            for triangle in triangles {
                let corners = triangle.map(|vertex| positions[vertex as usize]);
                let normal = normal(corners);
                for x in normal.iter().chain(corners.iter().flatten()) {
                    file.write_all(&(*x as f32).to_le_bytes())?;
                }
                file.write_all(&[0, 0])?;
            }
            Ok(())
        };
        bytes().map_err(io("write", path))
    })
}

/// Unit normal; zero for a triangle without area, as STL readers expect.
fn normal(corners: [[f64; 3]; 3]) -> [f64; 3] {
    let n = double_area(corners);
    let length = square(n).sqrt();
    if length > 0.0 { n.map(|x| x / length) } else { [0.0; 3] }
}
