//! The result: eigenvalues, eigenvectors on vertices, clusters, and the certificate.

use std::ops::Range;

use crate::eigen::component::{Component, Pairs};
use crate::eigen::finish::Evidence;
use crate::eigen::output::eigenvectors;
use crate::eigen::seconds::Seconds;
use crate::eigen::slice::ROUNDING;
use crate::eigen::{EigenError, EigenOptions};
use crate::operator::Operator;

/// The K lowest eigenpairs of L φ = λ M φ on a mesh of N vertices.
#[derive(Debug, Clone, PartialEq)]
pub struct Eigenbasis {
    /// K eigenvalues λ, ascending, in 1/ℓ²; exactly 0 for the null space, one for each connected component. (On a mesh
    /// with extreme slivers another one below [`Certificate::residual_floor`] may come out as 0.)
    pub eigenvalues: Vec<f64>,
    /// K × N, row-major: one eigenvector after another, values on vertices, in 1/ℓ. With M = diag(`vertex_mass`),
    /// Φᵀ M Φ = I. The entry of largest magnitude is positive; of entries within 1e-3 of it (on symmetric meshes several
    /// are equal but for rounding, which must not decide) the lowest vertex decides.
    pub eigenvectors: Vec<f64>,
    /// N.
    pub vertices: usize,
    /// Ranges of two or more eigenvalues, from 0, whose neighbours are closer than 100 × tolerance × λ_K (1e-8 λ_K by
    /// default). With residuals up to tolerance × λ_K their vectors may be turned into each other by more than a
    /// hundredth: inside such a range only the space that they span means something.
    pub clusters: Vec<Range<usize>>,
    /// Ranges of two or more eigenvalues, from 0, whose neighbours are closer than a thousandth of the eigenvalue. They
    /// are computed exactly, but a change of the mesh by as little (another edge length, another diagonal) turns their
    /// vectors into each other. Every cluster lies in one.
    pub sensitive: Vec<Range<usize>>,
    /// How exact and how complete the basis is.
    pub certificate: Certificate,
}

/// The evidence for an eigenbasis, measured on the vectors that are returned.
#[derive(Debug, Clone, PartialEq)]
pub struct Certificate {
    /// max ‖L φ − λ M φ‖ / λ_K, in the M⁻¹ norm (/ ‖M^-½ L M^-½‖ if λ_K = 0). Not above the tolerance or the floor.
    pub residual_max: f64,
    /// What rounding alone can leave of the residual: 4e-16 ‖M^-½ L M^-½‖∞ / λ_K, times 8. Above the tolerance only on
    /// meshes with slivers or of millions of vertices.
    pub residual_floor: f64,
    /// max |Φᵀ M Φ − I|; at most 1e-10.
    pub orthogonality: f64,
    /// For each component that was solved in slices, the eigenvalues below each shift: those found and those counted
    /// by Sylvester's law. The last shift of a component is above λ_K.
    pub counts: Vec<InertiaCount>,
    /// Every shift has as many eigenvalues below it as were found. Always true in a basis that is returned.
    pub complete: bool,
    /// Connected components: the dimension of the null space, of which K may hold a part.
    pub components: usize,
    /// λ_{K+1}, where it is known (not if K = D).
    pub next_eigenvalue: Option<f64>,
    /// K ends inside a cluster (by the threshold of [`Eigenbasis::clusters`]): the last space is cut, and which of
    /// its vectors are returned is arbitrary.
    pub cluster_cut: bool,
    /// Which solver did the work.
    pub method: Method,
    /// Factorisations, for shifts and for counts.
    pub factorisations: usize,
    /// Right-hand sides solved for.
    pub solves: usize,
    /// Bytes that the computation was expected to need at most, with the result.
    pub peak_bytes: usize,
    /// Where the time went. The only part of a basis that differs from run to run.
    pub seconds: Seconds,
}

/// Eigenvalues of one component below a shift.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InertiaCount {
    /// Component number, as in [`Operator::component_of_dof`].
    pub component: usize,
    /// σ, 1/ℓ².
    pub shift: f64,
    /// Eigenvalues found below σ, before those above λ_K were left out.
    pub below_expected: usize,
    /// Negative pivots of L − σ M: the eigenvalues there are below σ.
    pub below_counted: usize,
}

/// Which solver found the pairs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// The dense solver, which finds all pairs of a component.
    Dense,
    /// Shift-invert block Lanczos in slices of the spectrum, certified by inertia counts.
    Sliced,
    /// Small components by the one, large ones by the other.
    Mixed,
}

/// Merges the components' pairs into one basis on vertices. `next`: λ_{K+1}.
pub(crate) fn merge(
    operator: &Operator,
    components: &[Component],
    solved: Vec<Pairs>,
    evidence: &[Evidence],
    next: Option<f64>,
    tolerance: f64,
) -> Eigenbasis {
    let vertices = operator.vertex_mass.len();
    let mut order: Vec<(usize, usize)> = solved
        .iter()
        .enumerate()
        .flat_map(|(number, pairs)| (0..pairs.eigenvalues.len()).map(move |k| (number, k)))
        .collect();
    let eigenvalue = |&(number, k): &(usize, usize)| solved[number].eigenvalues[k];
    order.sort_by(|a, b| eigenvalue(a).total_cmp(&eigenvalue(b)).then(a.cmp(b)));
    let eigenvalues: Vec<f64> = order.iter().map(eigenvalue).collect();
    let measured = Measured {
        residual: evidence.iter().map(|evidence| evidence.residual).fold(0.0, f64::max),
        orthogonality: evidence.iter().map(|evidence| evidence.orthogonality).fold(0.0, f64::max),
        norm: components.iter().map(|component| component.norm).fold(0.0, f64::max),
        next,
        counts: counts(solved.iter().map(|pairs| &pairs.counts[..])),
        components: components.len(),
        dense: solved.iter().filter(|pairs| pairs.dense).count(),
    };
    let eigenvectors = eigenvectors(operator, components, solved, evidence, &order);
    Eigenbasis::new(eigenvalues, eigenvectors, vertices, measured, tolerance)
}

/// What was counted and measured while a basis was computed.
pub(crate) struct Measured {
    /// max ‖L φ − λ M φ‖ in the M⁻¹ norm.
    pub(crate) residual: f64,
    /// max |Φᵀ M Φ − I|.
    pub(crate) orthogonality: f64,
    /// ‖M^-½ L M^-½‖∞.
    pub(crate) norm: f64,
    /// λ_{K+1}.
    pub(crate) next: Option<f64>,
    pub(crate) counts: Vec<InertiaCount>,
    pub(crate) components: usize,
    /// Components solved by the dense solver.
    pub(crate) dense: usize,
}

/// The counts of all components, from the shifts of each with the eigenvalues found and counted below them.
pub(crate) fn counts<'a>(components: impl Iterator<Item = &'a [(f64, usize, usize)]>) -> Vec<InertiaCount> {
    let of_component = |(component, counts): (usize, &'a [(f64, usize, usize)])| {
        counts.iter().map(move |&(shift, below_expected, below_counted)| InertiaCount {
            component,
            shift,
            below_expected,
            below_counted,
        })
    };
    components.enumerate().flat_map(of_component).collect()
}

impl Eigenbasis {
    /// A basis with its clusters and its certificate; what the work cost is not known here.
    pub(crate) fn new(
        eigenvalues: Vec<f64>,
        eigenvectors: Vec<f64>,
        vertices: usize,
        measured: Measured,
        tolerance: f64,
    ) -> Eigenbasis {
        let Measured { residual, orthogonality, norm, next, counts, components, dense } = measured;
        let scale = eigenvalues.last().copied().filter(|&last| last > 0.0).unwrap_or(norm).max(f64::MIN_POSITIVE);
        let cluster_gap = 100.0 * tolerance * scale;
        Eigenbasis {
            clusters: ranges(&eigenvalues, |_| cluster_gap),
            sensitive: ranges(&eigenvalues, |eigenvalue| cluster_gap.max(1e-3 * eigenvalue)),
            certificate: Certificate {
                residual_max: residual / scale,
                residual_floor: ROUNDING * norm / scale,
                orthogonality,
                complete: counts.iter().all(|count| count.below_expected == count.below_counted),
                counts,
                components,
                next_eigenvalue: next,
                cluster_cut: next.zip(eigenvalues.last()).is_some_and(|(next, last)| next - last <= cluster_gap),
                method: if dense == components {
                    Method::Dense
                } else if dense == 0 {
                    Method::Sliced
                } else {
                    Method::Mixed
                },
                factorisations: 0,
                solves: 0,
                peak_bytes: 0,
                seconds: Seconds::default(),
            },
            eigenvalues,
            eigenvectors,
            vertices,
        }
    }

    /// Whether it is what was promised.
    ///
    /// # Errors
    /// [`EigenError::Residual`], [`EigenError::NotOrthogonal`].
    pub(crate) fn checked(self, options: &EigenOptions) -> Result<Eigenbasis, EigenError> {
        let &EigenOptions { tolerance, orthogonality, .. } = options;
        let Certificate { residual_max: residual, residual_floor: floor, orthogonality: loss, .. } = self.certificate;
        if residual.is_nan() || residual > tolerance.max(floor) {
            return Err(EigenError::Residual { residual, tolerance, floor });
        }
        if loss.is_nan() || loss > orthogonality.allowed() {
            return Err(EigenError::NotOrthogonal { loss });
        }
        Ok(self)
    }
}

/// Maximal runs of two or more ascending values whose neighbours are at most `gap(the upper value)` apart.
pub(crate) fn ranges(values: &[f64], gap: impl Fn(f64) -> f64) -> Vec<Range<usize>> {
    let mut ranges = Vec::new();
    let mut start = 0;
    for k in 1..=values.len() {
        if k == values.len() || values[k] - values[k - 1] > gap(values[k]) {
            if k - start > 1 {
                ranges.push(start..k);
            }
            start = k;
        }
    }
    ranges
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_close_values() {
        assert_eq!(ranges(&[0.0, 0.0, 1.0, 2.0, 2.05, 2.1, 3.0], |_| 0.06), [0..2, 3..6]);
        assert_eq!(ranges(&[], |_| 1.0), Vec::<Range<usize>>::new());
    }
}
