//! How far a deformed surface is from isometric: the method assumes that it hardly stretches.
//!
//! Strains say where the surface itself is longer or wider: |ℓ / ℓ⁰ − 1| of every edge and |A / A⁰ − 1| of every triangle.
//! Eigenvalues say what that does to the operator, for they depend on lengths on the surface alone: λ of the deformed mesh,
//! with the same ties, against those of the study's basis. On an isometric deformation they are the same.

use mesh_spectrum::{EigenOptions, Mesh, OperatorOptions, Watch, ties_of};
use serde::Serialize;

use crate::Error;
use crate::joints::Join;
use crate::study::Loaded;
use crate::target::{Named, Target, shape};
use crate::vector::{Vector, area, distance};

/// Edges that change by more than this, at the 95 % quantile, make the assumption thin.
pub const STRAIN_THIN: f64 = 0.1;

/// Lengths of the edges and areas of the triangles of a mesh, to compare deformed shapes with.
pub(crate) struct Sizes<'a> {
    triangles: &'a [[u32; 3]],
    areas: Vec<f64>,
    /// Two vertices and their distance, once for each edge that has a length.
    edges: Vec<(u32, u32, f64)>,
}

impl<'a> Sizes<'a> {
    pub(crate) fn of(mesh: &'a Mesh) -> Self {
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
    pub(crate) fn strains(&self, shape: &[Vector]) -> [Vec<f64>; 2] {
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
    fn of(mut values: Vec<f64>) -> Self {
        let mut at = |share| quantile(&mut values, share);
        Self { median: at(0.5), p95: at(0.95), max: at(1.0) }
    }
}

/// How far one state's surface is from isometric.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Isometry {
    /// State, counted from 0.
    pub state: usize,
    /// Its time.
    pub time: f64,
    /// Of the edges.
    pub edges: Quantiles,
    /// Of the areas.
    pub areas: Quantiles,
}

/// How far a state's surface is from isometric.
///
/// # Errors
/// As [`shape`].
pub fn isometry(loaded: &Loaded, named: &Named, target: &Target) -> Result<Isometry, Error> {
    let [edges, areas] = Sizes::of(&loaded.reference.mesh).strains(&shape(loaded, named, target)?);
    let (edges, areas) = (Quantiles::of(edges), Quantiles::of(areas));
    Ok(Isometry { state: target.state, time: target.time, edges, areas })
}

/// Eigenvalues of a deformed mesh against those of the reference.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Shift {
    /// How many were compared; the null space, which stays, is not among them.
    pub count: usize,
    /// Median of |λ / λ⁰ − 1|.
    pub median: f64,
    /// The largest.
    pub max: f64,
    /// Mean of λ / λ⁰ − 1: below zero where the surface has grown.
    pub mean: f64,
    /// λ⁰ and λ, one pair an eigenvalue, rising.
    pub eigenvalues: Vec<[f64; 2]>,
}

/// The first `count` eigenvalues above the null space on a state's surface, against the study's. Costs an eigenbasis.
///
/// # Errors
/// [`Error::Value`] for a count that the study's basis does not have; [`Error::Operator`] where the deformed surface has no
/// operator; [`Error::Eigen`], [`Error::Stopped`], and as [`shape`].
pub fn shift(loaded: &Loaded, named: &Named, target: &Target, count: usize, watch: &dyn Watch) -> Result<Shift, Error> {
    let Loaded { study, reference, basis, .. } = loaded;
    let null_space = basis.facts.null_space;
    let most = basis.eigenpairs() - null_space;
    if count == 0 || count > most {
        let expected = format!("1 to {most}, what the study's basis has above its null space");
        return Err(Error::Value { name: "--eigenvalues", value: count.to_string(), expected });
    }
    let unreadable = |what: String| Error::Damaged { path: study.folder().join("study.toml"), what };
    let (kind, mass) = (study.settings().operator.parse(), study.settings().mass.parse());
    let (kind, mass) = (
        kind.map_err(|_| unreadable("unknown operator".into()))?,
        mass.map_err(|_| unreadable("unknown mass".into()))?,
    );
    // Sheets stay joined where they were joined undeformed.
    let ties = match (study.settings().join.and_then(Join::distance), study.joints()?) {
        (Some(distance), _) => ties_of(&reference.mesh, distance).map_err(Error::Join)?,
        (None, Some(joints)) => crate::study::ties(&joints, reference, &study.settings().reference)?,
        (None, None) => Vec::new(),
    };
    let deformed = reference
        .mesh
        .with_vertices(shape(loaded, named, target)?)
        .map_err(|source| Error::Mesh { run: target.run.clone(), source })?;
    let operator = mesh_spectrum::operator(&deformed, &OperatorOptions { join: None, ties, kind, mass })?;
    let options = EigenOptions { count: null_space + count, ..Default::default() };
    let found = mesh_spectrum::eigenbasis(&operator, &options, watch)?;
    let pairs = basis.eigenvalues.iter().zip(&found.eigenvalues).skip(null_space);
    let eigenvalues: Vec<[f64; 2]> = pairs.map(|(&before, &now)| [before, now]).collect();
    let changes: Vec<f64> = eigenvalues.iter().map(|[before, now]| now / before - 1.0).collect();
    let mut sizes: Vec<f64> = changes.iter().map(|change| change.abs()).collect();
    Ok(Shift {
        count: changes.len(),
        median: quantile(&mut sizes, 0.5),
        max: quantile(&mut sizes, 1.0),
        mean: changes.iter().sum::<f64>() / changes.len().max(1) as f64,
        eigenvalues,
    })
}

/// What to think of comparisons where 95 % of the edges change by less than `p95`; nothing where the surface hardly
/// stretches.
pub fn caveat(p95: f64) -> Option<&'static str> {
    (p95 > STRAIN_THIN).then_some(
        "the method assumes that the surface hardly stretches, and here it does in places, so compare shapes, not small differences",
    )
}
