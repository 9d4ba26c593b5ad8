//! How far a deformed surface is from isometric: the method assumes that it hardly stretches.
//!
//! Strains say where the surface itself is longer or wider: |ℓ / ℓ⁰ − 1| of every edge and |A / A⁰ − 1| of every triangle.
//! Eigenvalues say what that does to the operator, for they depend on lengths on the surface alone: λ of the deformed mesh,
//! with the same ties, against those of the study's basis. On an isometric deformation they are the same.

use mesh_spectrum::{EigenOptions, OperatorOptions, Watch};
use serde::Serialize;

use crate::Error;
use crate::strain::{Quantiles, Sizes, quantile};
use crate::study::Loaded;
use crate::target::{Named, Target, shape};

/// Edges that change by more than this, at the 95 % quantile, make the assumption thin.
pub const STRAIN_THIN: f64 = 0.1;

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
    let ties = crate::study::ties_of(loaded)?;
    let deformed = reference
        .mesh
        .moved(shape(loaded, named, target)?)
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
