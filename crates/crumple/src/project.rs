//! Projection: the coefficients of every state of a run in the study's eigenbasis.
//!
//! α = Φᵀ M p (the paper's eq. 3, with M because our Φ is orthonormal in M), and δ = Φᵀ M (p − p⁰), so that
//! α = α⁰ + δ. Beside the coefficients: how much of the displacement they catch, how much of it is a rigid motion,
//! and how far the surface is from isometric.

use faer::Mat;
use mesh_spectrum::Watch;

use crate::Error;
use crate::basis::{Basis, coefficients_of};
use crate::reference::Reference;
use crate::rotation;
use crate::run::Run;

/// A run, projected.
#[derive(Debug, Clone)]
pub struct Projected {
    /// The run's id.
    pub run: String,
    /// Its whole states in order.
    pub states: Vec<ProjectedState>,
    /// BLAKE3 hash of all times and positions on the mesh: equal exactly when nothing that counts has changed.
    pub content: String,
    /// What was noticed, in words.
    pub warnings: Vec<String>,
}

/// One state, projected.
#[derive(Debug, Clone, PartialEq)]
pub struct ProjectedState {
    /// Time, in the model's unit.
    pub time: f64,
    /// δ, K × 3, row-major, in length²; f32 as a study stores it.
    pub delta: Vec<f32>,
    /// ρ = Φᵀ M r of the rotation field r, K × 3, row-major, in length; f32.
    pub rotation: Vec<f32>,
    /// What else is known about the state.
    pub measures: Measures,
}

impl ProjectedState {
    /// Whether every number is one that can be stored: a run that exploded has finite coordinates and coefficients
    /// beyond what f32 holds.
    fn is_finite(&self) -> bool {
        let Measures { rms, max, captured, rigid_share, strain_median, strain_p95 } = self.measures;
        self.delta.iter().chain(&self.rotation).all(|x| x.is_finite())
            && [self.time, rms, max, captured, rigid_share, strain_median, strain_p95].iter().all(|x| x.is_finite())
    }
}

/// Numbers about one state that need the whole shape.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Measures {
    /// M-weighted root mean square displacement, in the length unit.
    pub rms: f64,
    /// Largest displacement of a vertex, in the length unit.
    pub max: f64,
    /// Share of ‖p − p⁰‖²_M that the K coefficients catch (Parseval), 0 to 1; 1 for a state without displacement.
    pub captured: f64,
    /// Share of ‖p − p⁰‖²_M that the best rigid motion explains, 0 to 1; 0 for a state without displacement.
    pub rigid_share: f64,
    /// Median of |edge strain|: how far the surface is from isometric.
    pub strain_median: f64,
    /// 95 % quantile of |edge strain|.
    pub strain_p95: f64,
}

/// States are projected in batches of at most this many bytes of shapes, displacements and rotations.
const BATCH_BYTES: usize = 256 << 20;

/// Projects one run; for several, make a [`Projector`] once.
///
/// # Errors
/// As [`Projector::project`].
pub fn project(run: &Run, reference: &Reference, basis: &Basis, watch: &dyn Watch) -> Result<Projected, Error> {
    Projector::new(reference, basis).project(run, watch)
}

/// Projects runs on one basis.
pub struct Projector<'a> {
    reference: &'a Reference,
    basis: &'a Basis,
    geometry: Geometry<'a>,
}

impl<'a> Projector<'a> {
    /// Prepares what all runs share.
    pub fn new(reference: &'a Reference, basis: &'a Basis) -> Self {
        Self { reference, basis, geometry: Geometry::of(reference, basis) }
    }

    /// Projects every whole state of a run. Memory is bounded whatever the number of states.
    ///
    /// # Errors
    /// [`Error::OtherMesh`], [`Error::NotFinite`], [`Error::TooLarge`], [`Error::NoStates`], [`Error::NoCoordinates`],
    /// [`Error::Stopped`] and reading errors.
    pub fn project(&self, run: &Run, watch: &dyn Watch) -> Result<Projected, Error> {
        let Self { reference, basis, geometry } = self;
        let mut warnings = run.warnings();
        if run.times().is_empty() {
            let reason = if warnings.is_empty() { String::new() } else { format!(": {}", warnings.join("; ")) };
            return Err(Error::NoStates { run: run.id().to_owned(), reason });
        }
        let placement = reference.place(run)?;
        if placement.offset_max > 1e-3 * geometry.edge_mean {
            warnings.push(format!("undeformed positions differ from the reference run's by up to {:.2e}; displacements count from the reference", placement.offset_max));
        }
        let batch = (BATCH_BYTES / (72 * basis.vertices())).clamp(1, 64);
        let mut hash = blake3::Hasher::new();
        let mut states = Vec::with_capacity(run.times().len());
        for first in (0..run.times().len()).step_by(batch) {
            if watch.stopped() {
                return Err(Error::Stopped);
            }
            let last = (first + batch).min(run.times().len());
            let mut shapes = Vec::with_capacity(last - first);
            for state in first..last {
                let shape = reference.shape(run, &placement, state)?;
                hash.update(&run.times()[state].to_le_bytes());
                let bytes: Vec<u8> = shape.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
                hash.update(&bytes);
                shapes.push(shape);
            }
            let displacements: Vec<Vec<[f64; 3]>> = shapes.iter().map(|shape| geometry.displacement(shape)).collect();
            let turned: Vec<Vec<[f64; 3]>> = shapes
                .iter()
                .map(|shape| rotation::field(reference.mesh.triangles(), reference.mesh.vertices(), shape))
                .collect();
            let deltas = coefficients_of(basis, &displacements);
            let rotations = coefficients_of(basis, &turned);
            let narrow = |values: &[[f64; 3]]| values.iter().flatten().map(|&x| x as f32).collect();
            for (at, (delta, rotation)) in deltas.iter().zip(&rotations).enumerate() {
                let projected = ProjectedState {
                    time: run.times()[first + at],
                    delta: narrow(delta),
                    rotation: narrow(rotation),
                    measures: geometry.measures(&shapes[at], &displacements[at], delta),
                };
                if !projected.is_finite() {
                    return Err(Error::TooLarge { run: run.id().to_owned(), state: first + at, time: projected.time });
                }
                states.push(projected);
            }
        }
        if let Some(last) = states.last() {
            warnings.extend(last.measures.warnings());
        }
        Ok(Projected { run: run.id().to_owned(), states, content: hash.finalize().to_hex().to_string(), warnings })
    }
}

impl Measures {
    /// In plain words, what the user should know before trusting the numbers of this state.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.rigid_share > 0.5 {
            warnings.push(format!(
                "{:.0} % of the displacement is a rigid motion of the whole part; similarities then speak of where it went more than of how it deformed",
                100.0 * self.rigid_share
            ));
        }
        if self.captured < 0.9 {
            warnings.push(format!(
                "the eigenvectors catch {:.0} % of the displacement only; ask for more of them (-K)",
                100.0 * self.captured
            ));
        }
        warnings
    }
}

/// Undeformed positions and edges, once for all runs.
struct Geometry<'a> {
    undeformed: &'a [[f64; 3]],
    mass: &'a [f64],
    /// For M-products where the mass is not diagonal.
    basis: &'a Basis,
    area: f64,
    /// Σ m |p⁰ − centre|²: the size of the part.
    spread: f64,
    edges: Vec<(u32, u32, f64)>,
    edge_mean: f64,
}

impl<'a> Geometry<'a> {
    fn of(reference: &'a Reference, basis: &'a Basis) -> Self {
        let undeformed = reference.mesh.vertices();
        let mut ends: Vec<(u32, u32)> = reference
            .mesh
            .triangles()
            .iter()
            .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
            .map(|(a, b)| (a.min(b), a.max(b)))
            .collect();
        ends.sort_unstable();
        ends.dedup();
        let length = |a: u32, b: u32| distance(undeformed[a as usize], undeformed[b as usize]);
        let edges: Vec<_> = ends.into_iter().map(|(a, b)| (a, b, length(a, b))).filter(|edge| edge.2 > 0.0).collect();
        let edge_mean = edges.iter().map(|edge| edge.2).sum::<f64>() / edges.len().max(1) as f64;
        let (mass, area) = (&basis.mass[..], basis.mass.iter().sum());
        let mut geometry = Self { undeformed, mass, basis, area, spread: 0.0, edges, edge_mean };
        let centre = geometry.centre(undeformed);
        let square = |p: &[f64; 3]| (0..3).map(|c| (p[c] - centre[c]).powi(2)).sum::<f64>();
        geometry.spread = undeformed.iter().zip(mass).map(|(p, m)| m * square(p)).sum();
        geometry
    }

    /// Centre of mass of a shape.
    fn centre(&self, shape: &[[f64; 3]]) -> [f64; 3] {
        std::array::from_fn(|c| shape.iter().zip(self.mass).map(|(p, m)| m * p[c]).sum::<f64>() / self.area)
    }

    fn displacement(&self, shape: &[[f64; 3]]) -> Vec<[f64; 3]> {
        shape.iter().zip(self.undeformed).map(|(p, q)| std::array::from_fn(|c| p[c] - q[c])).collect()
    }

    fn measures(&self, shape: &[[f64; 3]], displacement: &[[f64; 3]], delta: &[[f64; 3]]) -> Measures {
        let square = |d: &[f64; 3]| d.iter().map(|x| x * x).sum::<f64>();
        let norm2: f64 = displacement.iter().zip(self.mass).map(|(d, m)| m * square(d)).sum();
        let norm2_m: f64 = match self.basis.mass_matrix {
            Some(_) => {
                let weighed = self.basis.weigh(displacement);
                displacement.iter().zip(&weighed).map(|(d, w)| (0..3).map(|c| d[c] * w[c]).sum::<f64>()).sum()
            }
            None => norm2,
        };
        let max = displacement.iter().map(square).fold(0.0, f64::max).sqrt();
        let caught: f64 = delta.iter().map(square).sum();
        let mut strains: Vec<f64> = self
            .edges
            .iter()
            .map(|&(a, b, length)| (distance(shape[a as usize], shape[b as usize]) / length - 1.0).abs())
            .collect();
        let mut quantile = |share: f64| {
            let at = ((strains.len() as f64 - 1.0) * share).round() as usize;
            if strains.is_empty() { 0.0 } else { *strains.select_nth_unstable_by(at, f64::total_cmp).1 }
        };
        Measures {
            rms: (norm2 / self.area).sqrt(),
            max,
            captured: if norm2 > 0.0 { (caught / norm2_m).min(1.0) } else { 1.0 },
            // Of a displacement that is tiny against the part the difference of two large sums says nothing.
            rigid_share: if norm2 > 1e-12 * self.spread {
                (1.0 - self.rigid_rest(shape) / norm2).clamp(0.0, 1.0)
            } else {
                0.0
            },
            strain_median: quantile(0.5),
            strain_p95: quantile(0.95),
        }
    }

    /// min over rigid motions of ‖p − (R p⁰ + t)‖²_M: Horn 1987, the rotation from the largest eigenvector of a 4 × 4
    /// matrix. With centred shapes the minimum is Σ m (|p|² + |p⁰|²) − 2 λ_max.
    fn rigid_rest(&self, shape: &[[f64; 3]]) -> f64 {
        let (p0, q0) = (self.centre(self.undeformed), self.centre(shape));
        let mut s = [[0.0; 3]; 3];
        let mut spread = 0.0;
        for ((p, q), m) in self.undeformed.iter().zip(shape).zip(self.mass) {
            let (p, q): ([f64; 3], [f64; 3]) =
                (std::array::from_fn(|c| p[c] - p0[c]), std::array::from_fn(|c| q[c] - q0[c]));
            for i in 0..3 {
                for j in 0..3 {
                    s[i][j] += m * p[i] * q[j];
                }
                spread += m * (p[i] * p[i] + q[i] * q[i]);
            }
        }
        let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = s;
        let horn = [
            [xx + yy + zz, yz - zy, zx - xz, xy - yx],
            [yz - zy, xx - yy - zz, xy + yx, zx + xz],
            [zx - xz, xy + yx, yy - xx - zz, yz + zy],
            [xy - yx, zx + xz, yz + zy, zz - xx - yy],
        ];
        let horn = Mat::from_fn(4, 4, |i, j| horn[i][j]);
        let largest = horn
            .self_adjoint_eigenvalues(faer::Side::Lower)
            .ok()
            .and_then(|values| values.last().copied())
            .unwrap_or(0.0);
        (spread - 2.0 * largest).max(0.0)
    }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
}
