//! Runs as points, and all distances between them.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use rayon::prelude::*;

use super::By;
use crate::basis::Basis;
use crate::rotation::Ruler;
use crate::study::Coefficients;
use crate::vector::unit;

/// Points whose distances are found together.
const BLOCK: usize = 128;
/// Two points closer than this share of their lengths (squared, about the mean) are looked at by themselves: what is left
/// then has lost four of sixteen digits.
const CLOSE: f64 = 1e-4;

/// One point a run.
pub(crate) struct Points {
    pub(crate) count: usize,
    pub(crate) width: usize,
    pub(crate) values: Vec<f64>,
}

impl Points {
    /// Runs as points: `per_run` consecutive rows are one run.
    pub(super) fn of(by: By, rows: &Coefficients, per_run: usize, basis: &Basis) -> Self {
        match by {
            By::Rotation | By::RotationAnd(_) => Self::by_rotation(rows, per_run, &Ruler::of(basis)),
            By::Displacement | By::DisplacementAnd(_) | By::Coordinates | By::Field(_) => {
                Self::in_lengths(rows, per_run, basis.total_mass())
            }
        }
    }

    /// Points of the same runs as one: each kind over its spread, so that a field in its own unit says as much as the
    /// shape. A kind that is the same for all runs says nothing.
    pub(super) fn together(mut each: Vec<Self>) -> Self {
        if each.len() == 1 {
            return each.remove(0);
        }
        let count = each.iter().map(Self::count).min().unwrap_or(0);
        let all: Vec<usize> = (0..count).collect();
        let factor = |points: &Self| {
            let square = points.distances_to_mean(&all).iter().map(|d| d * d).sum::<f64>() / count.max(1) as f64;
            if square > 0.0 { 1.0 / square.sqrt() } else { 0.0 }
        };
        let factors: Vec<f64> = each.iter().map(factor).collect();
        let row = |run: &usize| {
            let scaled =
                each.iter().zip(&factors).map(|(points, factor)| points.point(*run).iter().map(move |x| x * factor));
            scaled.flatten().collect::<Vec<f64>>()
        };
        let values = all.iter().flat_map(row).collect();
        Self { count, width: each.iter().map(|points| points.width).sum(), values }
    }

    /// One row a run, coefficients in RMS lengths.
    pub(crate) fn by_displacement(rows: &Coefficients, total_mass: f64) -> Self {
        Self::in_lengths(rows, 1, total_mass)
    }

    /// Coefficients divided by √(total mass), so that distances are RMS distances, over the surface (in M) and over the
    /// states of a run.
    fn in_lengths(rows: &Coefficients, per_run: usize, total_mass: f64) -> Self {
        let scale = 1.0 / (total_mass * per_run as f64).sqrt();
        let (count, width) = (rows.rows() / per_run, rows.width() * per_run);
        let values: Vec<f64> = rows.values.iter().map(|&x| f64::from(x) * scale).collect();
        if count >= width {
            return Self { count, width, values };
        }
        // Fewer points than coordinates: with X = Rᵀ Qᵀ the rows of Rᵀ are the same points in a frame of their own
        // span, all distances kept, and everything below costs that much less.
        let factor = faer::MatRef::from_column_major_slice(&values, width, count).qr();
        let r = factor.thin_R();
        let values = (0..count).flat_map(|run| (0..count).map(move |at| r[(at, run)])).collect();
        Self { count, width: count, values }
    }

    /// Rotation spectra of every state, of length 1, so that distances follow the angle (cosine) and a strong and a weak
    /// deformation of one kind stay together.
    fn by_rotation(rows: &Coefficients, per_run: usize, ruler: &Ruler) -> Self {
        let spectrum = |row: usize| ruler.spectrum(&rows.triples(row), rows.rms[row]).numbers();
        let spectra: Vec<Vec<f64>> = (0..rows.rows()).into_par_iter().map(spectrum).collect();
        let values: Vec<Vec<f64>> = spectra.chunks(per_run).map(|states| unit(states.concat())).collect();
        Self { count: values.len(), width: values.first().map_or(0, Vec::len), values: values.concat() }
    }

    pub(crate) fn count(&self) -> usize {
        self.count
    }

    pub(crate) fn point(&self, run: usize) -> &[f64] {
        &self.values[run * self.width..(run + 1) * self.width]
    }

    /// Some of the points.
    pub(super) fn some(&self, runs: &[usize]) -> Self {
        let values = runs.iter().flat_map(|&run| self.point(run).iter().copied()).collect();
        Self { count: runs.len(), width: self.width, values }
    }

    /// All distances. By |a|² + |b|² − 2 a·b about the mean, which is a product of matrices; where little is left of the
    /// lengths, by (a − b)², which is exact however close two points are.
    pub(crate) fn distances(&self) -> Distances {
        let (count, width) = (self.count(), self.width);
        let mean = self.mean(&(0..count).collect::<Vec<_>>());
        let centred: Vec<f64> =
            (0..count).flat_map(|run| self.point(run).iter().zip(&mean).map(|(x, m)| x - m)).collect();
        let lengths: Vec<f64> = (0..count).map(|a| square_length(self.point(a))).collect();
        let off: Vec<f64> = (0..count).map(|a| square_length(&centred[a * width..(a + 1) * width])).collect();
        let all = MatRef::from_column_major_slice(&centred, width, count);
        let distance = |a: usize, b: usize, product: f64| {
            let (quick, both) = (off[a] + off[b] - 2.0 * product, off[a] + off[b]);
            let square = if quick > CLOSE * both { quick } else { square_distance(self.point(a), self.point(b)) };
            if is_distance(square, lengths[a] + lengths[b]) { square.sqrt() as f32 } else { 0.0 }
        };
        let mut values = vec![0.0; count * count];
        values.par_chunks_mut(BLOCK * count.max(1)).enumerate().for_each(|(block, values)| {
            let (first, rows) = (BLOCK * block, values.len() / count);
            // Only up to the diagonal: the rest is the same.
            let mut products = Mat::<f64>::zeros(first + rows, rows);
            let (left, right) = (all.subcols(0, first + rows), all.subcols(first, rows));
            matmul(products.as_mut(), Accum::Replace, left.transpose(), right, 1.0, Par::Seq);
            for (row, values) in values.chunks_exact_mut(count).enumerate() {
                let a = first + row;
                (0..a).for_each(|b| values[b] = distance(a, b, products[(b, row)]));
            }
        });
        mirror(&mut values, count);
        Distances { count, values }
    }

    /// The distance of each of these points to their mean.
    pub(super) fn distances_to_mean(&self, members: &[usize]) -> Vec<f64> {
        let mean = self.mean(members);
        members.iter().map(|&run| self.distance_to(run, &mean)).collect()
    }

    /// The mean of these points.
    pub(super) fn mean(&self, members: &[usize]) -> Vec<f64> {
        let mut mean = vec![0.0; self.width];
        for &run in members {
            mean.iter_mut().zip(self.point(run)).for_each(|(mean, x)| *mean += x / members.len() as f64);
        }
        mean
    }

    /// The distance of a point to a place.
    pub(super) fn distance_to(&self, run: usize, place: &[f64]) -> f64 {
        let square = square_distance(self.point(run), place);
        if is_distance(square, square_length(self.point(run)) + square_length(place)) { square.sqrt() } else { 0.0 }
    }
}

/// Equal runs may differ by rounding, which is no distance.
fn is_distance(square: f64, square_lengths: f64) -> bool {
    square > 1e-26 * square_lengths
}

fn square_length(a: &[f64]) -> f64 {
    a.iter().map(|x| x * x).sum()
}

pub(crate) fn square_distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// Copies what is below the diagonal above it, square by square, so that both sides stay in the cache.
fn mirror(values: &mut [f32], count: usize) {
    for rows in (0..count).step_by(BLOCK) {
        for columns in (0..=rows).step_by(BLOCK) {
            for row in rows..(rows + BLOCK).min(count) {
                for column in columns..(columns + BLOCK).min(row) {
                    values[column * count + row] = values[row * count + column];
                }
            }
        }
    }
}

/// All distances between runs; f32, so that ten thousand runs take 400 MB.
pub(crate) struct Distances {
    pub(crate) count: usize,
    values: Vec<f32>,
}

impl Distances {
    pub(crate) fn between(&self, a: usize, b: usize) -> f64 {
        f64::from(self.values[a * self.count + b])
    }

    /// Those between some of the runs.
    pub(super) fn some(&self, runs: &[usize]) -> Self {
        let row = |&a: &usize| runs.iter().map(move |&b| self.values[a * self.count + b]);
        Self { count: runs.len(), values: runs.iter().flat_map(row).collect() }
    }
}

#[cfg(test)]
impl Points {
    /// Points on a line.
    pub(super) fn on_a_line(values: &[f64]) -> Self {
        Self { count: values.len(), width: 1, values: values.to_vec() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_the_points_however_close_and_wherever_they_lie() {
        // More points than two blocks, some equal, some a millionth apart, all far from the origin.
        let value = |run: usize, at: usize| 1e3 + ((run / 3 * 7919 + at * 104_729) % 1009) as f64 / 100.0;
        let nudge = |run: usize, at: usize| if run % 3 == 2 && at == 4 { 1e-6 } else { 0.0 };
        let (count, width) = (300, 7);
        let values = (0..count * width).map(|i| value(i / width, i % width) + nudge(i / width, i % width)).collect();
        let points = Points { count, width, values };
        let distances = points.distances();
        for a in 0..count {
            for b in 0..count {
                let expected = square_distance(points.point(a), points.point(b)).sqrt();
                let found = distances.between(a, b);
                assert!((found - expected).abs() <= 1e-7 * expected, "{a} {b}: {found} {expected}");
                assert_eq!(found, distances.between(b, a));
            }
        }
        assert_eq!(distances.between(0, 1), 0.0);
        assert!(distances.between(0, 2) > 9e-7);
    }
}
