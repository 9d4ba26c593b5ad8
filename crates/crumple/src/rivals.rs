//! Other methods on the same data: principal components of the displacements.
//!
//! The first M eigenvectors (Karni and Gotsman) and the first K (Iza-Teran and Garcke) need no code of their own: they
//! are descriptors with another choice of J.
//!
//! PCA here is that of the displacements in the study's basis, so in the mass-weighted inner product: what it sees
//! does not depend on how fine the mesh is where. Centred by the mean over the last states of all runs.

use faer::{Mat, Side};

use crate::basis::synthesize;
use crate::reconstruct::displaced;
use crate::study::{Coefficients, Loaded};

/// Mean and principal components of displacements.
#[derive(Debug, Clone)]
pub struct Pca {
    /// Mean δ, 3K.
    mean: Vec<f64>,
    /// Orthonormal directions, one after another, M × 3K.
    directions: Vec<Vec<f64>>,
}

impl Pca {
    /// The first `components` principal components of the rows; fewer where the rows do not span as many.
    pub fn of(rows: &Coefficients, components: usize) -> Self {
        let (count, width) = (rows.rows(), rows.width());
        let mut mean = vec![0.0; width];
        for row in 0..count {
            rows.row(row).iter().zip(&mut mean).for_each(|(&x, mean)| *mean += f64::from(x) / count as f64);
        }
        let centred = Mat::from_fn(count, width, |row, column| f64::from(rows.row(row)[column]) - mean[column]);
        // The smaller of the two Gram matrices: X Xᵀ (runs) or Xᵀ X (coefficients).
        let by_rows = count <= width;
        let gram = if by_rows { &centred * centred.transpose() } else { centred.transpose() * &centred };
        let Ok(spectrum) = gram.self_adjoint_eigen(Side::Lower) else {
            return Self { mean, directions: Vec::new() };
        };
        let (values, vectors) = (spectrum.S(), spectrum.U());
        let size = gram.nrows();
        let largest = if size == 0 { 0.0 } else { values[size - 1] };
        let directions = (0..components.min(size))
            .map(|component| size - 1 - component)
            .filter(|&at| values[at] > 1e-12 * largest && largest > 0.0)
            .map(|at| {
                let vector = vectors.col(at);
                if !by_rows {
                    return (0..width).map(|column| vector[column]).collect();
                }
                let norm = values[at].sqrt();
                (0..width)
                    .map(|column| (0..count).map(|row| centred[(row, column)] * vector[row]).sum::<f64>() / norm)
                    .collect()
            })
            .collect();
        Self { mean, directions }
    }

    /// Number of components there are.
    pub fn components(&self) -> usize {
        self.directions.len()
    }

    /// Scores of a displacement with coefficients `delta`, 3K: its centred components along the directions.
    pub fn scores(&self, delta: &[f64]) -> Vec<f64> {
        let along = |direction: &Vec<f64>| {
            direction.iter().zip(delta).zip(&self.mean).map(|((d, x), mean)| d * (x - mean)).sum()
        };
        self.directions.iter().map(along).collect()
    }

    /// The nearest displacement to `delta` that mean and components can make, 3K.
    pub fn approximate(&self, delta: &[f64]) -> Vec<f64> {
        let mut result = self.mean.clone();
        for (score, direction) in self.scores(delta).iter().zip(&self.directions) {
            result.iter_mut().zip(direction).for_each(|(x, d)| *x += score * d);
        }
        result
    }

    /// The shape of [`Pca::approximate`], N × 3, given δ, K × 3.
    pub fn shape(&self, loaded: &Loaded, delta: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let approximated = self.approximate(&delta.iter().flatten().copied().collect::<Vec<_>>());
        let all: Vec<usize> = (1..=loaded.basis.eigenpairs()).collect();
        displaced(&loaded.reference, &synthesize(&loaded.basis, &all, approximated.as_chunks().0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(values: &[&[f32]]) -> Coefficients {
        Coefficients {
            eigenvectors: (1..=values[0].len() / 3).collect(),
            runs: (0..values.len()).map(|row| format!("run_{row}")).collect(),
            states: vec![0; values.len()],
            times: vec![0.0; values.len()],
            values: values.concat(),
            ..Default::default()
        }
    }

    #[test]
    fn points_on_a_line_need_one_component() {
        for count in [3, 9] {
            // 3 rows of 6 numbers use X Xᵀ, 9 rows of 6 use Xᵀ X.
            let line: Vec<Vec<f32>> =
                (0..count).map(|t| (0..6).map(|c| (c as f32 + 1.0) * t as f32 + 2.0).collect()).collect();
            let rows = rows(&line.iter().map(Vec::as_slice).collect::<Vec<_>>());
            let pca = Pca::of(&rows, 4);
            assert_eq!(pca.components(), 1);
            let point: Vec<f64> = line[2].iter().map(|&x| f64::from(x)).collect();
            // Coefficients are f32 and the spread is about 10: f64 rounding of a handful of sums.
            assert!(pca.approximate(&point).iter().zip(&point).all(|(a, b)| (a - b).abs() < 1e-10));
        }
    }

    #[test]
    fn equal_rows_have_no_component() {
        let pca = Pca::of(&rows(&[&[1.0, 2.0, 3.0], &[1.0, 2.0, 3.0]]), 2);
        assert_eq!(pca.components(), 0);
        assert_eq!(pca.approximate(&[0.0; 3]), [1.0, 2.0, 3.0]);
    }
}
