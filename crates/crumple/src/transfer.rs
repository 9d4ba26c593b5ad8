//! A descriptor of another study: of the same part on another mesh, or of another part.
//!
//! The kind of a rotation spectrum can be compared as it is: its frequencies are counted by area. The direction belongs
//! to the longest waves of one mesh; where the two meshes lie on each other it is carried over by the functional map
//! C = Φ₂ᵀ M₂ (Φ₁ ∘ n), n the nearest vertex of mesh 1 to each of mesh 2 (Ovsjanikov and others 2012), and elsewhere it
//! is left out. The paper's coefficients cannot be carried over.

use rayon::prelude::*;

use crate::Error;
use crate::descriptor::Descriptor;
use crate::rotation::Ruler;
use crate::select::Kind;
use crate::study::Loaded;
use crate::target::{Named, resolve};
use crate::vector::{Vector, distance};

/// Long waves are smooth: as many vertices of either mesh as this carry them.
const SAMPLES: usize = 20_000;
/// Meshes lie on each other where the mean distance of nearest vertices is below this share of the part's length.
const NEAR: f64 = 0.02;

/// A descriptor of `from`, made fit for `to`; and whether its direction could be carried over.
///
/// # Errors
/// Those of reading the run it was made from.
pub fn transfer(from: &Loaded, to: &Loaded, descriptor: &Descriptor) -> Result<(Descriptor, bool), Error> {
    let mut spectrum = descriptor.spectrum.clone();
    if to.basis.id != from.basis.id {
        spectrum.direction = match map(from, to) {
            Some(map) => {
                let named = Named { run: descriptor.run.clone(), state: Some(descriptor.state) };
                let rho = resolve(from, &named)?.rotation;
                let carried: Vec<Vector> = map
                    .iter()
                    .map(|row| std::array::from_fn(|c| row.iter().zip(&rho).map(|(weight, rho)| weight * rho[c]).sum()))
                    .collect();
                // The energy is the query's own, in the mass that its coefficients have now.
                Ruler::of(&to.basis).direction(&carried, spectrum.turn * to.basis.total_mass().sqrt())
            }
            None => Vec::new(),
        };
    }
    let carried = !spectrum.direction.is_empty();
    let descriptor = Descriptor { kind: Kind::Rotation, basis: to.basis.id.clone(), spectrum, ..descriptor.clone() };
    Ok((descriptor, carried))
}

/// C: a row for each long wave of `to`, a column for each of `from`; `None` where the meshes do not lie on each other.
fn map(from: &Loaded, to: &Loaded) -> Option<Vec<Vec<f64>>> {
    let sampled = |loaded: &Loaded| -> Vec<usize> {
        let vertices = loaded.basis.vertices();
        (0..vertices).step_by(vertices.div_ceil(SAMPLES).max(1)).collect()
    };
    let (here, there) = (sampled(to), sampled(from));
    let nearest = |&vertex: &usize| -> (usize, f64) {
        let place = to.reference.mesh.vertices()[vertex];
        let far = |&other: &usize| (other, distance(place, from.reference.mesh.vertices()[other]));
        there.iter().map(far).min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::INFINITY))
    };
    let nearest: Vec<(usize, f64)> = here.par_iter().map(nearest).collect();
    let mean = nearest.iter().map(|(_, distance)| distance).sum::<f64>() / nearest.len() as f64;
    let length = from.basis.facts.length;
    // NaN and infinity are not near.
    if !(mean < NEAR * length && (to.basis.facts.length / length - 1.0).abs() < NEAR) {
        return None;
    }
    let sampled_mass: f64 = here.iter().map(|&vertex| to.basis.mass[vertex]).sum();
    let scale = to.basis.total_mass() / sampled_mass;
    let entry = |j: usize, k: usize| -> f64 {
        let (phi, other) = (to.basis.eigenvector(j), from.basis.eigenvector(k));
        let product = |(&vertex, &(near, _)): (&usize, &(usize, f64))| {
            f64::from(phi[vertex]) * to.basis.mass[vertex] * f64::from(other[near])
        };
        scale * here.iter().zip(&nearest).map(product).sum::<f64>()
    };
    let (rows, columns) = (Ruler::of(&to.basis).directions(), long_waves(from));
    Some((1..=rows).into_par_iter().map(|j| (1..=columns).map(|k| entry(j, k)).collect()).collect())
}

/// Eigenvectors of `from` that are carried over: two octaves of wavelength beyond those that have a direction.
fn long_waves(from: &Loaded) -> usize {
    let basis = &from.basis;
    let limit = 16.0 * (std::f64::consts::PI / basis.facts.length).powi(2) / basis.per_square_length();
    basis.eigenvalues.iter().take_while(|&&eigenvalue| eigenvalue < limit).count()
}
