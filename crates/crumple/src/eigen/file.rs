//! `basis.safetensors` of any surface.
//!
//! The format is a length, a header in JSON and the arrays as they are. It is written here array by array, because the
//! `safetensors` crate takes all of them as bytes at once, and the eigenvectors of a million vertices are 4 GB; what is
//! written is read back by that crate in the tests.

use std::io::Write;
use std::path::Path;

use serde_json::{Map, Value, json};

use super::Solved;
use crate::Error;
use crate::error::io;
use crate::study::store;
use crate::surface::Surface;

/// How eigenvectors are stored. Everything else is f64.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Precision {
    /// As they were computed.
    #[default]
    F64,
    /// Half the size, six digits.
    F32,
}

/// An array on its way into the file.
enum Array<'a> {
    F64(&'a [f64]),
    F32(&'a [f64]),
    U32(&'a [u32]),
    U64(Vec<u64>),
}

impl Array<'_> {
    fn dtype(&self) -> &'static str {
        match self {
            Array::F64(_) => "F64",
            Array::F32(_) => "F32",
            Array::U32(_) => "U32",
            Array::U64(_) => "U64",
        }
    }

    fn bytes(&self) -> usize {
        match self {
            Array::F64(values) => 8 * values.len(),
            Array::F32(values) => 4 * values.len(),
            Array::U32(values) => 4 * values.len(),
            Array::U64(values) => 8 * values.len(),
        }
    }

    fn write(&self, out: &mut impl Write) -> std::io::Result<()> {
        fn each<T: Copy, const B: usize>(
            out: &mut impl Write,
            values: &[T],
            word: impl Fn(T) -> [u8; B],
        ) -> std::io::Result<()> {
            let mut buffer = Vec::with_capacity(8192 * B);
            for chunk in values.chunks(8192) {
                buffer.clear();
                chunk.iter().for_each(|&value| buffer.extend(word(value)));
                out.write_all(&buffer)?;
            }
            Ok(())
        }
        match self {
            Array::F64(values) => each(out, values, f64::to_le_bytes),
            Array::F32(values) => each(out, values, |x| (x as f32).to_le_bytes()),
            Array::U32(values) => each(out, values, u32::to_le_bytes),
            Array::U64(values) => each(out, values, u64::to_le_bytes),
        }
    }
}

/// Writes the basis; `facts` goes into the header's metadata under that name.
///
/// # Errors
/// [`Error::Io`] naming `path`; what was there before stays then.
pub fn write(
    path: &Path,
    surface: &Surface,
    solved: &Solved,
    precision: Precision,
    facts: &Value,
) -> Result<(), Error> {
    let (basis, operator) = (&solved.basis, &solved.operator);
    let (k, n) = (basis.eigenvalues.len(), basis.vertices);
    let (points, triangles) = (surface.mesh.vertices(), surface.mesh.triangles());
    let eigenvectors = match precision {
        Precision::F64 => Array::F64(&basis.eigenvectors),
        Precision::F32 => Array::F32(&basis.eigenvectors),
    };
    // Arrays of eight-byte numbers first, so that each begins where its numbers are aligned.
    let mut arrays = vec![
        ("eigenvalues", vec![k], Array::F64(&basis.eigenvalues)),
        ("mass", vec![n], Array::F64(&operator.vertex_mass)),
        ("points", vec![n, 3], Array::F64(points.as_flattened())),
        ("vertex_ids", vec![n], Array::U64(surface.vertex_ids.clone())),
    ];
    if let Some(mass) = &operator.vertex_mass_matrix {
        let start = mass.start.iter().map(|&start| start as u64).collect();
        arrays.push(("mass_indptr", vec![n + 1], Array::U64(start)));
        arrays.push(("mass_data", vec![mass.values.len()], Array::F64(&mass.values)));
    }
    arrays.push(("eigenvectors", vec![k, n], eigenvectors));
    arrays.push(("triangles", vec![triangles.len(), 3], Array::U32(triangles.as_flattened())));
    if let Some(mass) = &operator.vertex_mass_matrix {
        arrays.push(("mass_indices", vec![mass.columns.len()], Array::U32(&mass.columns)));
    }

    let mut header = Map::new();
    header.insert("__metadata__".into(), json!({ "facts": facts.to_string() }));
    let mut at = 0;
    for (name, shape, array) in &arrays {
        let end = at + array.bytes();
        header.insert((*name).into(), json!({ "dtype": array.dtype(), "shape": shape, "data_offsets": [at, end] }));
        at = end;
    }
    let mut header = Value::Object(header).to_string();
    header.extend(std::iter::repeat_n(' ', header.len().next_multiple_of(8) - header.len()));
    store::write_whole(path, |file| {
        let mut put = || {
            file.write_all(&(header.len() as u64).to_le_bytes())?;
            file.write_all(header.as_bytes())?;
            arrays.iter().try_for_each(|(_, _, array)| array.write(file))
        };
        put().map_err(io("write", path))
    })
}

/// Whether a file can be made at `path`: better asked before the work than after.
///
/// # Errors
/// [`Error::Io`] naming `path`.
pub fn check_writable(path: &Path) -> Result<(), Error> {
    if path.is_dir() {
        let is_folder = std::io::Error::new(std::io::ErrorKind::IsADirectory, "it is a folder");
        return Err(io("write", path)(is_folder));
    }
    if path.exists() && !path.is_file() {
        return Ok(()); // a device or a pipe
    }
    let staged = store::Staged::beside(path);
    staged.create(path).map(drop)
}
