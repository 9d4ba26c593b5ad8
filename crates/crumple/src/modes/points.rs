//! Runs as points, and all distances between them.

use rayon::prelude::*;

use crate::rotation::Ruler;
use crate::study::Coefficients;

/// One point a run.
pub(crate) struct Points {
    pub(crate) width: usize,
    pub(crate) values: Vec<f64>,
}

impl Points {
    /// Coefficients in RMS lengths.
    pub(crate) fn by_displacement(rows: &Coefficients, area: f64) -> Self {
        let scale = 1.0 / area.sqrt();
        let (count, width) = (rows.rows(), 3 * rows.eigenvectors.len());
        let values: Vec<f64> = rows.values.iter().map(|&x| f64::from(x) * scale).collect();
        if count >= width {
            return Self { width, values };
        }
        // Fewer points than coordinates: with X = Rᵀ Qᵀ the rows of Rᵀ are the same points in a frame of their own
        // span, all distances kept, and everything below costs that much less.
        let factor = faer::MatRef::from_column_major_slice(&values, width, count).qr();
        let r = factor.thin_R();
        let values = (0..count).flat_map(|run| (0..count).map(move |at| r[(at, run)])).collect();
        Self { width: count, values }
    }

    /// Rotation spectra, of length 1, so that distances follow the angle (cosine) and a strong and a weak deformation of
    /// one kind stay together.
    pub(crate) fn by_rotation(rows: &Coefficients, ruler: &Ruler) -> Self {
        let spectrum = |row: usize| unit(ruler.spectrum(&rows.triples(row), rows.rms[row]).numbers());
        let values: Vec<Vec<f64>> = (0..rows.rows()).map(spectrum).collect();
        Self { width: values.first().map_or(0, Vec::len), values: values.concat() }
    }

    pub(crate) fn count(&self) -> usize {
        self.values.len() / self.width
    }

    pub(crate) fn point(&self, run: usize) -> &[f64] {
        &self.values[run * self.width..(run + 1) * self.width]
    }

    pub(crate) fn distances(&self) -> Distances {
        let count = self.count();
        let lengths: Vec<f64> = (0..count).map(|a| self.point(a).iter().map(|x| x * x).sum()).collect();
        let lengths = &lengths;
        let row = |a: usize| {
            (0..count).map(move |b| {
                let square = square_distance(self.point(a), self.point(b));
                // Equal runs may differ by rounding, which is no distance.
                if square > 1e-26 * (lengths[a] + lengths[b]) { square.sqrt() as f32 } else { 0.0 }
            })
        };
        Distances { count, values: (0..count).into_par_iter().flat_map_iter(row).collect() }
    }

    pub(super) fn distances_to_mean(&self, members: &[usize]) -> Vec<f64> {
        let mut mean = vec![0.0; self.width];
        for &run in members {
            mean.iter_mut().zip(self.point(run)).for_each(|(mean, x)| *mean += x / members.len() as f64);
        }
        members.iter().map(|&run| square_distance(self.point(run), &mean).sqrt()).collect()
    }
}

/// Of length 1; a zero row stays zero.
fn unit(mut row: Vec<f64>) -> Vec<f64> {
    let length = row.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length > 0.0 {
        row.iter_mut().for_each(|x| *x /= length);
    }
    row
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
}
