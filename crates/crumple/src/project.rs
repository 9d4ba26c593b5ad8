//! Projection: the coefficients of every state of a run in the study's eigenbasis.
//!
//! α = Φᵀ M p (the paper's eq. 3, with M because our Φ is orthonormal in M), and δ = Φᵀ M (p − p⁰), so that
//! α = α⁰ + δ. Beside the coefficients: how much of the displacement they catch, how much of it is a rigid motion,
//! and how far the surface is from isometric.

use mesh_spectrum::Watch;

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use crate::Error;
use crate::basis::{Basis, coefficients_of};
use crate::field::Field;
use crate::reference::{Placement, Reference};
use crate::rotation::{self, Rest};
use crate::run::Run;
use crate::strain::{Sizes, quantile};
use crate::vector::{Vector, square, subtract};

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
    /// Where the time went.
    pub spent: Spent,
}

/// Time that projecting took, by what it was spent on.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Spent {
    /// Reading positions and fields, and making sure that they are numbers.
    pub reading: Duration,
    /// Displacements, their coefficients and the measures.
    pub displacement: Duration,
    /// Rotation fields and their coefficients.
    pub rotation: Duration,
    /// Coefficients of other fields.
    pub fields: Duration,
}

impl std::ops::AddAssign for Spent {
    fn add_assign(&mut self, other: Self) {
        self.reading += other.reading;
        self.displacement += other.displacement;
        self.rotation += other.rotation;
        self.fields += other.fields;
    }
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
    /// Coefficients of the fields that the study keeps, K × components each; f32.
    pub fields: Vec<(Field, Vec<f32>)>,
    /// What else is known about the state.
    pub measures: Measures,
}

impl ProjectedState {
    /// Whether every number is one that can be stored: a run that exploded has finite coordinates and coefficients
    /// beyond what f32 holds.
    fn is_finite(&self) -> bool {
        let fields = self.fields.iter().flat_map(|(_, values)| values);
        self.time.is_finite()
            && self.delta.iter().chain(&self.rotation).chain(fields).all(|x| x.is_finite())
            && Measures::COLUMNS.iter().all(|(_, of)| of(&self.measures).is_finite())
    }
}

/// Numbers about one state that need the whole shape.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Measures {
    /// Root mean square displacement over the surface (each vertex by its area), in the length unit.
    pub rms: f64,
    /// Largest displacement of a vertex, in the length unit.
    pub max: f64,
    /// Share of ‖p − p⁰‖²_M that the K coefficients catch (Parseval), 0 to 1; 1 for a state without displacement.
    pub captured: f64,
    /// Share of the mean square displacement over the surface that the best rigid motion explains, 0 to 1; 0 for a state
    /// without displacement.
    pub rigid_share: f64,
    /// Median of |edge strain|: how far the surface is from isometric.
    pub strain_median: f64,
    /// 95 % quantile of |edge strain|.
    pub strain_p95: f64,
    /// Median of |area of a triangle over its undeformed area − 1|.
    pub area_median: f64,
    /// 95 % quantile of the same.
    pub area_p95: f64,
    /// Root mean square of sin θ of the rotation field in M, as its coefficients are (with the lumped mass: over the
    /// surface): how much the surface turned, 0 to 1.
    pub turn: f64,
}

/// A measure: its column's name, and how it is taken.
type Column = (&'static str, fn(&Measures) -> f64);

impl Measures {
    /// Every measure.
    pub(crate) const COLUMNS: [Column; 9] = [
        ("rms", |m| m.rms),
        ("max", |m| m.max),
        ("captured", |m| m.captured),
        ("rigid_share", |m| m.rigid_share),
        ("strain_median", |m| m.strain_median),
        ("strain_p95", |m| m.strain_p95),
        ("area_median", |m| m.area_median),
        ("area_p95", |m| m.area_p95),
        ("turn", |m| m.turn),
    ];
}

/// A sharp fold or two lie within this share of the edges; a surface that is torn or inside out does not.
const TURNED_OVER_MAX: f64 = 0.05;

/// States are projected in batches of at most this many bytes of shapes, displacements and rotations.
const BATCH_BYTES: usize = 256 << 20;

/// Projects one run; for several, make a [`Projector`] once.
///
/// # Errors
/// As [`Projector::project`].
pub fn project(
    run: &Run,
    reference: &Reference,
    basis: &Basis,
    fields: &[Field],
    watch: &dyn Watch,
) -> Result<Projected, Error> {
    Projector::new(reference, basis, fields).project(run, watch)
}

/// Projects runs on one basis.
pub struct Projector<'a> {
    reference: &'a Reference,
    basis: &'a Basis,
    fields: &'a [Field],
    geometry: Geometry<'a>,
    rest: Rest<'a>,
    /// Where the last run's nodes and shells were: the next run of a bundle mostly has the same mesh.
    placed: Mutex<Option<(blake3::Hash, Arc<Placement>)>>,
}

impl<'a> Projector<'a> {
    /// Prepares what all runs share. `fields`: projected beside displacement and rotation.
    pub fn new(reference: &'a Reference, basis: &'a Basis, fields: &'a [Field]) -> Self {
        let rest = Rest::of(reference.mesh.triangles(), reference.mesh.vertices());
        Self { reference, basis, fields, geometry: Geometry::of(reference, basis), rest, placed: Mutex::default() }
    }

    /// Projects every whole state of a run. Memory is bounded whatever the number of states.
    ///
    /// # Errors
    /// [`Error::OtherMesh`], [`Error::NotFinite`], [`Error::TooLarge`], [`Error::NoStates`], [`Error::NoCoordinates`],
    /// [`Error::NoField`], [`Error::FieldNotFinite`], [`Error::Stopped`] and reading errors.
    pub fn project(&self, run: &Run, watch: &dyn Watch) -> Result<Projected, Error> {
        let mut warnings = run.warnings();
        if run.times().is_empty() {
            let reason = if warnings.is_empty() { String::new() } else { format!(": {}", warnings.join("; ")) };
            return Err(Error::NoStates { run: run.id().to_owned(), reason });
        }
        let placement = self.place(run)?;
        if placement.offset_max > 1e-3 * self.geometry.sizes.edge_mean() {
            warnings.push(format!("undeformed positions differ from the reference run's by up to {:.2e}; displacements count from the reference", placement.offset_max));
        }
        let functions = 3 + self.fields.len();
        let batch = (BATCH_BYTES / (24 * functions * self.basis.vertices())).clamp(1, 64);
        let mut hash = blake3::Hasher::new();
        let mut spent = Spent::default();
        let (mut states, mut last_shape) = (Vec::with_capacity(run.times().len()), Vec::new());
        for first in (0..run.times().len()).step_by(batch) {
            if watch.stopped() {
                return Err(Error::Stopped);
            }
            let last = (first + batch).min(run.times().len());
            let (found, shape) = self.batch(run, &placement, first..last, &mut hash, &mut spent)?;
            states.extend(found);
            last_shape = shape;
        }
        if let Some(last) = states.last() {
            warnings.extend(last.measures.warnings());
            warnings.extend(self.surface_warnings(run, &placement, states.len() - 1, &last_shape, &last.measures)?);
        }
        Ok(Projected {
            run: run.id().to_owned(),
            states,
            content: hash.finalize().to_hex().to_string(),
            warnings,
            spent,
        })
    }

    /// What happened to the surface that a rotation field of it cannot tell, in words.
    fn surface_warnings(
        &self,
        run: &Run,
        placement: &Placement,
        state: usize,
        shape: &[Vector],
        measures: &Measures,
    ) -> Result<Vec<String>, Error> {
        let mut warnings = Vec::new();
        let deleted = run.deleted_shells(state)?.map_or(0, |deleted| {
            let mut shells = placement.shell_of_triangle.clone();
            shells.dedup();
            shells.iter().filter(|&&shell| deleted.get(shell as usize) == Some(&true)).count()
        });
        if deleted > 0 {
            warnings.push(format!("{deleted} shells of the surface are deleted in the last state; they count by where their nodes are, which may fly apart"));
        }
        let health = self.rest.health(shape);
        if health.without_area > 0 {
            warnings.push(format!(
                "{} faces have lost their area in the last state; they have no rotation and are left out of it",
                health.without_area
            ));
        }
        if health.turned_over > TURNED_OVER_MAX {
            warnings.push(format!(
                "{:.0} % of the edges are folded over by more than 150 degrees in the last state: the surface is torn or turned inside out there, and its rotation means little",
                100.0 * health.turned_over
            ));
        }
        if measures.turn < rotation::TURN_MIN && measures.rms > 0.0 {
            warnings.push("it moved, but did not deform: its surface turned as a whole or not at all".into());
        }
        Ok(warnings)
    }

    /// Projects one state of a run that may still be growing.
    ///
    /// # Errors
    /// As [`Projector::project`].
    pub fn state(&self, run: &Run, state: usize) -> Result<ProjectedState, Error> {
        let placement = self.place(run)?;
        let (mut found, _) =
            self.batch(run, &placement, state..state + 1, &mut blake3::Hasher::new(), &mut Spent::default())?;
        found.pop().ok_or_else(|| Error::Internal("a batch of one state is empty".into()))
    }

    /// Projects a few states together; the block of Φ that is being read serves all of them. Beside them the last shape.
    fn batch(
        &self,
        run: &Run,
        placement: &Placement,
        states: std::ops::Range<usize>,
        hash: &mut blake3::Hasher,
        spent: &mut Spent,
    ) -> Result<(Vec<ProjectedState>, Vec<Vector>), Error> {
        let Self { reference, basis, geometry, .. } = self;
        let mut clock = Clock::start();
        let mut shapes = Vec::with_capacity(states.len());
        let mut quantities: Vec<Vec<Vec<Vector>>> = vec![Vec::new(); self.fields.len()];
        for state in states.clone() {
            let shape = reference.shape(run, placement, state)?;
            hash.update(&run.times()[state].to_le_bytes());
            let bytes: Vec<u8> = shape.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
            hash.update(&bytes);
            shapes.push(shape);
            for (field, values) in self.fields.iter().zip(&mut quantities) {
                values.push(reference.field(run, placement, *field, state)?);
            }
        }
        clock.lap(&mut spent.reading);
        let displacements: Vec<Vec<Vector>> = shapes.iter().map(|shape| geometry.displacement(shape)).collect();
        clock.lap(&mut spent.displacement);
        let turned: Vec<Vec<Vector>> = shapes.iter().map(|shape| self.rest.field(shape)).collect();
        clock.lap(&mut spent.rotation);
        // One pass over Φ for both; each has half of the time.
        let both: Vec<&[Vector]> = displacements.iter().chain(&turned).map(Vec::as_slice).collect();
        let mut deltas = coefficients_of(basis, &both);
        let rotations = deltas.split_off(shapes.len());
        let mut projecting = Duration::default();
        clock.lap(&mut projecting);
        spent.displacement += projecting / 2;
        spent.rotation += projecting / 2;
        let mut measures: Vec<Measures> =
            (0..shapes.len()).map(|at| geometry.measures(&shapes[at], &displacements[at], &deltas[at])).collect();
        clock.lap(&mut spent.displacement);
        measures.iter_mut().zip(&turned).for_each(|(measures, turned)| measures.turn = geometry.turn(turned));
        clock.lap(&mut spent.rotation);
        let quantities: Vec<Vec<Vec<Vector>>> =
            quantities.iter().map(|values| coefficients_of(basis, values)).collect();
        clock.lap(&mut spent.fields);
        let narrow = |values: &[Vector]| values.iter().flatten().map(|&x| x as f32).collect();
        let mut projected = Vec::with_capacity(shapes.len());
        for (at, state) in states.enumerate() {
            let fields = self.fields.iter().zip(&quantities).map(|(field, values)| {
                let leading = |triple: &Vector| triple[..field.components()].to_vec();
                (*field, values[at].iter().flat_map(leading).map(|x| x as f32).collect())
            });
            let found = ProjectedState {
                time: run.times()[state],
                delta: narrow(&deltas[at]),
                rotation: narrow(&rotations[at]),
                fields: fields.collect(),
                measures: measures[at],
            };
            if !found.is_finite() {
                return Err(Error::TooLarge { run: run.id().to_owned(), state, time: found.time });
            }
            projected.push(found);
        }
        Ok((projected, shapes.pop().unwrap_or_default()))
    }

    /// Where the run's nodes and shells are; kept for the next run, which mostly has the same mesh.
    fn place(&self, run: &Run) -> Result<Arc<Placement>, Error> {
        let mut hasher = blake3::Hasher::new();
        let mut numbers = |bytes: Vec<u8>| {
            hasher.update(&bytes);
        };
        numbers(run.node_ids().iter().flat_map(|id| id.to_le_bytes()).collect());
        numbers(run.undeformed().iter().flatten().flat_map(|x| x.to_le_bytes()).collect());
        numbers(run.faces().flat_map(|(face, _)| face).flat_map(u32::to_le_bytes).collect());
        let mesh = hasher.finalize();
        let kept = self.placed.lock().unwrap_or_else(PoisonError::into_inner).clone();
        if let Some((_, placement)) = kept.filter(|(kept, _)| *kept == mesh) {
            return Ok(placement);
        }
        let placement = Arc::new(self.reference.place(run)?);
        *self.placed.lock().unwrap_or_else(PoisonError::into_inner) = Some((mesh, Arc::clone(&placement)));
        Ok(placement)
    }
}

/// Adds the time since the last lap to a sum.
struct Clock(Instant);

impl Clock {
    fn start() -> Self {
        Self(Instant::now())
    }

    fn lap(&mut self, sum: &mut Duration) {
        let now = Instant::now();
        *sum += now - self.0;
        self.0 = now;
    }
}

impl Measures {
    /// In plain words, what the user should know before trusting the numbers of this state.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.rigid_share > 0.5 {
            warnings.push(format!(
                "{:.0} % of the displacement is a rigid motion of the whole part; the paper's similarities then speak of where it went more than of how it deformed",
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
    undeformed: &'a [Vector],
    sizes: Sizes<'a>,
    /// For M-products.
    basis: &'a Basis,
    /// Area of each vertex, N.
    shares: &'a [f64],
    area: f64,
    /// Σ a |p⁰ − centre|²: the size of the part.
    spread: f64,
}

impl<'a> Geometry<'a> {
    fn of(reference: &'a Reference, basis: &'a Basis) -> Self {
        let undeformed = reference.mesh.vertices();
        let sizes = Sizes::of(&reference.mesh);
        let (shares, area) = (&basis.area[..], basis.area.iter().sum());
        let mut geometry = Self { undeformed, sizes, basis, shares, area, spread: 0.0 };
        let centre = geometry.centre(undeformed);
        geometry.spread = undeformed.iter().zip(shares).map(|(p, share)| share * square(subtract(*p, centre))).sum();
        geometry
    }

    /// Centre of mass of a shape.
    fn centre(&self, shape: &[[f64; 3]]) -> [f64; 3] {
        std::array::from_fn(|c| shape.iter().zip(self.shares).map(|(p, share)| share * p[c]).sum::<f64>() / self.area)
    }

    fn displacement(&self, shape: &[[f64; 3]]) -> Vec<[f64; 3]> {
        shape.iter().zip(self.undeformed).map(|(p, q)| subtract(*p, *q)).collect()
    }

    /// Root mean square of a rotation field in M, so that `turn`² ‖1‖²_M is the energy that its coefficients share.
    fn turn(&self, rotation: &[Vector]) -> f64 {
        (self.basis.square_norm(rotation) / self.basis.total_mass()).sqrt()
    }

    fn measures(&self, shape: &[[f64; 3]], displacement: &[[f64; 3]], delta: &[[f64; 3]]) -> Measures {
        let norm2: f64 = displacement.iter().zip(self.shares).map(|(d, share)| share * square(*d)).sum();
        let energy = self.basis.square_norm(displacement);
        let max = displacement.iter().map(|d| square(*d)).fold(0.0, f64::max).sqrt();
        let caught: f64 = delta.iter().map(|d| square(*d)).sum();
        let [mut strains, mut stretches] = self.sizes.strains(shape);
        Measures {
            rms: (norm2 / self.area).sqrt(),
            max,
            captured: if energy > 0.0 { (caught / energy).min(1.0) } else { 1.0 },
            // Of a displacement that is tiny against the part the difference of two large sums says nothing.
            rigid_share: if norm2 > 1e-12 * self.spread {
                (1.0 - self.rigid_rest(shape) / norm2).clamp(0.0, 1.0)
            } else {
                0.0
            },
            strain_median: quantile(&mut strains, 0.5),
            strain_p95: quantile(&mut strains, 0.95),
            area_median: quantile(&mut stretches, 0.5),
            area_p95: quantile(&mut stretches, 0.95),
            // Known once the rotation field is.
            turn: 0.0,
        }
    }

    /// min over rigid motions of Σ a |p − (R p⁰ + t)|²: Horn 1987, the rotation from the largest eigenvector of a 4 × 4
    /// matrix. With centred shapes the minimum is Σ a (|p|² + |p⁰|²) − 2 λ_max.
    fn rigid_rest(&self, shape: &[[f64; 3]]) -> f64 {
        let (p0, q0) = (self.centre(self.undeformed), self.centre(shape));
        let mut s = [[0.0; 3]; 3];
        let mut spread = 0.0;
        for ((p, q), m) in self.undeformed.iter().zip(shape).zip(self.shares) {
            let (p, q) = (subtract(*p, p0), subtract(*q, q0));
            for i in 0..3 {
                for j in 0..3 {
                    s[i][j] += m * p[i] * q[j];
                }
                spread += m * (p[i] * p[i] + q[i] * q[i]);
            }
        }
        let largest = rotation::horn(&s)
            .self_adjoint_eigenvalues(faer::Side::Lower)
            .ok()
            .and_then(|values| values.last().copied())
            .unwrap_or(0.0);
        (spread - 2.0 * largest).max(0.0)
    }
}
