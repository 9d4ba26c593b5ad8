//! Runs as points, and all distances between them.

use rayon::prelude::*;

use super::By;
use crate::basis::Basis;
use crate::rotation::Ruler;
use crate::study::Coefficients;
use crate::vector::unit;

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
            By::Rotation => Self::by_rotation(rows, per_run, &Ruler::of(basis)),
            By::Displacement | By::Coordinates | By::Field(_) => Self::in_lengths(rows, per_run, basis.total_mass()),
        }
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

    pub(crate) fn distances(&self) -> Distances {
        let count = self.count();
        let lengths: Vec<f64> = (0..count).map(|a| square_length(self.point(a))).collect();
        let lengths = &lengths;
        let row = |a: usize| {
            (0..count).map(move |b| {
                let square = square_distance(self.point(a), self.point(b));
                if is_distance(square, lengths[a] + lengths[b]) { square.sqrt() as f32 } else { 0.0 }
            })
        };
        Distances { count, values: (0..count).into_par_iter().flat_map_iter(row).collect() }
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
