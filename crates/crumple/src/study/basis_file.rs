//! The basis on disk: `basis.safetensors` with eigenvalues [K], eigenvectors [K, N], mass [N], baseline [K, 3]; where the
//! mass is not diagonal also mass_indptr [N + 1], mass_indices, mass_data, which is SciPy's `csr_matrix`; where vertices'
//! areas are not the mass also area [N].

use std::collections::HashMap;
use std::path::Path;

use mesh_spectrum::{Csr, Mass};
use safetensors::tensor::{Dtype, SafeTensors, TensorView};

use super::store;
use crate::Error;
use crate::basis::{Basis, BasisFacts};
use crate::error::io;

/// Its name in a study's folder.
pub(crate) const FILE: &str = "basis.safetensors";

pub(crate) fn write(basis: &Basis, path: &Path) -> Result<(), Error> {
    let (k, n) = (basis.eigenpairs(), basis.vertices());
    let internal = |error: String| Error::Internal(error);
    let eigenvalues = f64_bytes(basis.eigenvalues.iter());
    let mass = f64_bytes(basis.mass.iter());
    let baseline = f64_bytes(basis.baseline.iter().flatten());
    let eigenvectors: Vec<u8> = basis.eigenvectors.iter().flat_map(|x| x.to_le_bytes()).collect();
    let view = |dtype, shape: Vec<usize>, bytes| {
        TensorView::new(dtype, shape, bytes).map_err(|error| internal(error.to_string()))
    };
    let matrix = basis.mass_matrix.as_ref();
    let start: Vec<u8> = matrix.iter().flat_map(|m| &m.start).flat_map(|&x| (x as u64).to_le_bytes()).collect();
    let columns: Vec<u8> = matrix.iter().flat_map(|m| &m.columns).flat_map(|x| x.to_le_bytes()).collect();
    let values = f64_bytes(matrix.iter().flat_map(|m| &m.values));
    let mut tensors = vec![
        ("eigenvalues", view(Dtype::F64, vec![k], &eigenvalues)?),
        ("eigenvectors", view(Dtype::F32, vec![k, n], &eigenvectors)?),
        ("mass", view(Dtype::F64, vec![n], &mass)?),
        ("baseline", view(Dtype::F64, vec![k, 3], &baseline)?),
    ];
    if let Some(matrix) = matrix {
        let entries = matrix.columns.len();
        tensors.push(("mass_indptr", view(Dtype::U64, vec![n + 1], &start)?));
        tensors.push(("mass_indices", view(Dtype::U32, vec![entries], &columns)?));
        tensors.push(("mass_data", view(Dtype::F64, vec![entries], &values)?));
    }
    let area = f64_bytes(basis.area.iter());
    if basis.area != basis.mass {
        tensors.push(("area", view(Dtype::F64, vec![n], &area)?));
    }
    let facts = serde_json::to_string(&basis.facts).map_err(|error| internal(error.to_string()))?;
    let metadata = HashMap::from([("facts".to_owned(), facts)]);
    let bytes = safetensors::serialize(tensors, Some(metadata)).map_err(|error| internal(error.to_string()))?;
    store::write_bytes(path, &bytes)
}

/// Reads a basis; `id` is its content name, from the manifest.
pub(crate) fn read(path: &Path, id: &str) -> Result<Basis, Error> {
    let damaged = |what: String| Error::Damaged { path: path.to_owned(), what };
    let bytes = std::fs::read(path).map_err(io("read", path))?;
    let (_, metadata) = SafeTensors::read_metadata(&bytes).map_err(|error| damaged(error.to_string()))?;
    let tensors = SafeTensors::deserialize(&bytes).map_err(|error| damaged(error.to_string()))?;
    let facts = metadata
        .metadata()
        .as_ref()
        .and_then(|entries| entries.get("facts"))
        .ok_or_else(|| damaged("no facts in it".into()))?;
    let facts = serde_json::from_str(facts).map_err(|error| damaged(error.to_string()))?;
    let tensor = |name: &str, dtype: Dtype| {
        let tensor = tensors.tensor(name).map_err(|error| damaged(error.to_string()))?;
        if tensor.dtype() == dtype {
            Ok(tensor)
        } else {
            Err(damaged(format!("{name} is {:?}, expected {dtype:?}", tensor.dtype())))
        }
    };
    let doubles = |name: &str| {
        Ok::<_, Error>(
            tensor(name, Dtype::F64)?
                .data()
                .as_chunks()
                .0
                .iter()
                .map(|word| f64::from_le_bytes(*word))
                .collect::<Vec<f64>>(),
        )
    };
    let eigenvalues = doubles("eigenvalues")?;
    let mass = doubles("mass")?;
    let area = if tensors.names().contains(&"area") { doubles("area")? } else { mass.clone() };
    let baseline: Vec<[f64; 3]> = doubles("baseline")?.as_chunks().0.to_vec();
    let eigenvectors: Vec<f32> =
        tensor("eigenvectors", Dtype::F32)?.data().as_chunks().0.iter().map(|word| f32::from_le_bytes(*word)).collect();
    let facts: BasisFacts = facts;
    let finite = |values: &[f64]| values.iter().all(|x| x.is_finite());
    let numbers = finite(&eigenvalues) && finite(&mass) && finite(&area) && finite(baseline.as_flattened());
    if !numbers || !eigenvectors.iter().all(|x| x.is_finite()) {
        return Err(damaged("it holds values that are not numbers".into()));
    }
    let inside = |&(first, last): &(usize, usize)| 1 <= first && first <= last && last <= eigenvalues.len();
    if !facts.clusters.iter().chain(&facts.close).all(inside) {
        return Err(damaged("its facts do not fit its eigenvalues".into()));
    }
    if mass.is_empty()
        || area.len() != mass.len()
        || eigenvectors.len() != eigenvalues.len() * mass.len()
        || baseline.len() != eigenvalues.len()
        || eigenvalues.is_empty()
    {
        return Err(damaged("sizes of its arrays do not fit together".into()));
    }
    let mass_matrix = if facts.mass == Mass::Consistent.to_string() {
        let start: Vec<usize> = tensor("mass_indptr", Dtype::U64)?
            .data()
            .as_chunks()
            .0
            .iter()
            .map(|word| u64::from_le_bytes(*word) as usize)
            .collect();
        let columns: Vec<u32> = tensor("mass_indices", Dtype::U32)?
            .data()
            .as_chunks()
            .0
            .iter()
            .map(|word| u32::from_le_bytes(*word))
            .collect();
        let values = doubles("mass_data")?;
        let n = mass.len();
        let fits = start.len() == n + 1 && start[0] == 0 && start.is_sorted() && start[n] == columns.len();
        if !fits
            || values.len() != columns.len()
            || columns.iter().any(|&column| column as usize >= n)
            || !finite(&values)
        {
            return Err(damaged("its mass matrix does not fit its mesh".into()));
        }
        Some(Csr { start, columns, values })
    } else {
        None
    };
    Ok(Basis { id: id.to_owned(), eigenvalues, eigenvectors, mass, mass_matrix, area, baseline, facts })
}

fn f64_bytes<'a>(values: impl Iterator<Item = &'a f64>) -> Vec<u8> {
    values.flat_map(|x| x.to_le_bytes()).collect()
}
