//! The shapes that the page carries, small enough for a page.

use std::collections::BTreeMap;

use base64::Engine;
use rayon::prelude::*;
use serde::Serialize;

use super::thin::Thin;
use crate::Error;
use crate::basis::synthesize;
use crate::descriptor::Described;
use crate::modes::Modes;
use crate::reconstruct::displaced;
use crate::study::Loaded;
use crate::target::{self, Named};

/// Shapes on the page take at most this many bytes before base64.
const SHAPE_BYTES: usize = 3_500_000;

#[derive(Debug, Clone, Serialize)]
pub(super) struct MeshData {
    /// Little-endian u32, 3 a triangle, base64.
    triangles: String,
    vertices: usize,
    /// A position is origin + step × u16.
    origin: [f64; 3],
    step: f64,
    /// Colours span −range to range of z-displacement, in the length unit.
    range: f64,
}

/// Displacement along z of each vertex, N.
pub(super) fn z_displacement(loaded: &Loaded, shape: &[[f64; 3]]) -> Vec<f64> {
    shape.iter().zip(loaded.reference.mesh.vertices()).map(|(p, q)| p[2] - q[2]).collect()
}

/// Rounded up to two significant digits, for a legend.
pub(super) fn plain(range: f64) -> f64 {
    if range <= 0.0 {
        return 0.0;
    }
    let unit = 10.0_f64.powf(range.log10().floor() - 1.0);
    (range / unit).ceil() * unit
}

/// Quantised shapes: those of the modes, then as many runs as the page has room for.
pub(super) fn shapes(
    loaded: &Loaded,
    modes: &Modes,
    described: &[Described],
    range: f64,
) -> Result<(MeshData, BTreeMap<String, String>), Error> {
    let reference = &loaded.reference;
    let needed = 4 * described.len() + 1;
    // A vertex takes 6 bytes a shape, and its share of the triangles, two of 12 bytes, once.
    let thin =
        Thin::of(reference.mesh.vertices(), reference.mesh.triangles(), (SHAPE_BYTES / (6 * needed + 24)).max(1000));
    let mut wanted: Vec<(String, Vec<[f64; 3]>)> = vec![("reference".into(), thin.shape(reference.mesh.vertices()))];
    for (mode, described) in modes.modes.iter().zip(described) {
        wanted.push((format!("run:{}", mode.medoid), thin.shape(&described.original)));
        wanted.push((format!("{}:first_k", mode.name), thin.shape(&described.first_k)));
        wanted.push((format!("{}:descriptor", mode.name), thin.shape(&described.reconstruction)));
        wanted.push((format!("{}:first_m", mode.name), thin.shape(&described.first_m)));
    }
    let vertices = thin.vertices.len();
    let room = (SHAPE_BYTES.saturating_sub(24 * vertices) / (6 * vertices)).saturating_sub(wanted.len());
    let rows = loaded.last_states()?;
    let runs = &rows.runs;
    let others: Vec<usize> =
        (0..runs.len()).filter(|&row| modes.modes.iter().all(|mode| mode.medoid != runs[row])).take(room).collect();
    let read = |row: usize| Ok((format!("run:{}", runs[row]), thin.shape(&last_shape(loaded, row)?)));
    wanted.extend(others.into_par_iter().map(read).collect::<Result<Vec<_>, Error>>()?);
    let points = || wanted.iter().flat_map(|(_, shape)| shape);
    let origin: [f64; 3] = std::array::from_fn(|c| points().map(|p| p[c]).fold(f64::INFINITY, f64::min));
    let extent = (0..3).map(|c| points().map(|p| p[c] - origin[c]).fold(0.0, f64::max)).fold(0.0, f64::max);
    let step = if extent > 0.0 { extent / 65535.0 } else { 1.0 };
    let encode = |bytes: Vec<u8>| base64::engine::general_purpose::STANDARD.encode(bytes);
    let quantised = |shape: &[[f64; 3]]| {
        encode(
            shape
                .iter()
                .flat_map(|p| (0..3).flat_map(|c| (((p[c] - origin[c]) / step).round() as u16).to_le_bytes()))
                .collect(),
        )
    };
    let shapes = wanted.iter().map(|(name, shape)| (name.clone(), quantised(shape))).collect();
    let triangles = encode(thin.triangles.iter().flatten().flat_map(|vertex| vertex.to_le_bytes()).collect());
    Ok((MeshData { triangles, vertices: thin.vertices.len(), origin, step, range }, shapes))
}

/// The last state of a run from its file; where that is gone or another one, from its K coefficients.
fn last_shape(loaded: &Loaded, row: usize) -> Result<Vec<[f64; 3]>, Error> {
    let rows = loaded.last_states()?;
    let delta = rows.triples(row);
    let run = rows.runs[row].clone();
    let named = Named { run, state: None };
    let from_file = target::resolve(loaded, &named).and_then(|target| target::shape(loaded, &named, &target));
    Ok(from_file.unwrap_or_else(|_| {
        let all: Vec<usize> = (1..=loaded.basis.eigenpairs()).collect();
        displaced(&loaded.reference, &synthesize(&loaded.basis, &all, &delta))
    }))
}
