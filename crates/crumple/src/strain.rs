//! Strains of a deformed surface: by how much its edges change their length and its triangles their area.

use mesh_spectrum::Mesh;
use serde::Serialize;

use crate::vector::{Vector, area, distance};

/// Lengths of the edges and areas of the triangles of a mesh, to compare deformed shapes with.
pub struct Sizes<'a> {
    triangles: &'a [[u32; 3]],
    areas: Vec<f64>,
    /// Two vertices and their distance, once for each edge that has a length.
    edges: Vec<(u32, u32, f64)>,
}

impl<'a> Sizes<'a> {
    /// Measures the undeformed mesh.
    pub fn of(mesh: &'a Mesh) -> Self {
        let at = |vertex: u32| mesh.vertices()[vertex as usize];
        let triangles = mesh.triangles();
        let sides = triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        let mut ends: Vec<(u32, u32)> = sides.map(|(a, b)| (a.min(b), a.max(b))).collect();
        ends.sort_unstable();
        ends.dedup();
        let edges = ends.into_iter().map(|(a, b)| (a, b, distance(at(a), at(b)))).filter(|edge| edge.2 > 0.0);
        let areas = triangles.iter().map(|corners| area(corners.map(at)));
        Self { triangles, areas: areas.collect(), edges: edges.collect() }
    }

    /// Mean length of an edge; 0 without edges.
    pub(crate) fn edge_mean(&self) -> f64 {
        self.edges.iter().map(|edge| edge.2).sum::<f64>() / self.edges.len().max(1) as f64
    }

    /// |ℓ / ℓ⁰ − 1| of every edge and |A / A⁰ − 1| of every triangle that has an area.
    pub fn strains(&self, shape: &[Vector]) -> [Vec<f64>; 2] {
        let at = |vertex: u32| shape[vertex as usize];
        let strain = |&(a, b, length): &(u32, u32, f64)| (distance(at(a), at(b)) / length - 1.0).abs();
        let with_area = self.triangles.iter().zip(&self.areas).filter(|(_, area)| **area > 0.0);
        let stretch = |(corners, from): (&[u32; 3], &f64)| (area(corners.map(at)) / from - 1.0).abs();
        [self.edges.iter().map(strain).collect(), with_area.map(stretch).collect()]
    }
}

/// The value below which this share of the values lies; 0 of none.
pub(crate) fn quantile(values: &mut [f64], share: f64) -> f64 {
    let at = ((values.len() as f64 - 1.0) * share).round() as usize;
    if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(at, f64::total_cmp).1 }
}

/// Quantiles of the magnitudes of strains; 0.01 is one per cent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Quantiles {
    /// Half of them are smaller.
    pub median: f64,
    /// 95 % are smaller.
    pub p95: f64,
    /// The largest.
    pub max: f64,
}

impl Quantiles {
    /// Of magnitudes of strains; 0 of none.
    pub fn of(mut values: Vec<f64>) -> Self {
        let mut at = |share| quantile(&mut values, share);
        Self { median: at(0.5), p95: at(0.95), max: at(1.0) }
    }
}
