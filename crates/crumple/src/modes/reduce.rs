//! The principal components of a set of points: what grouping needs of many coordinates.

use faer::{Mat, Side};

use super::Points;

impl Points {
    /// The points in the frame of their first principal components, centred: as few components as leave out no more than
    /// `left_out` of the variance, and at most `most` of them. Points that all coincide get no component at all.
    pub(super) fn principal(&self, left_out: f64, most: usize) -> Self {
        let (count, width) = (self.count(), self.width);
        let none = || Self { count, width: 0, values: Vec::new() };
        if count * width == 0 {
            return none();
        }
        let mut mean = vec![0.0; width];
        for run in 0..count {
            mean.iter_mut().zip(self.point(run)).for_each(|(mean, x)| *mean += x / count as f64);
        }
        let centred = Mat::from_fn(count, width, |run, column| self.point(run)[column] - mean[column]);
        // The smaller of the two Gram matrices; without a Rayon feature faer works on one thread, so sums have one order.
        let by_runs = count <= width;
        let gram = if by_runs { &centred * centred.transpose() } else { centred.transpose() * &centred };
        let Ok(spectrum) = gram.self_adjoint_eigen(Side::Lower) else { return none() };
        let size = gram.nrows();
        let variance = |component: usize| spectrum.S()[size - 1 - component].max(0.0);
        let total: f64 = (0..size).map(variance).sum();
        // Below this it is rounding of equal points.
        let length: f64 = self.values.iter().map(|x| x * x).sum();
        if total <= 1e-24 * length {
            return none();
        }
        let mut caught = 0.0;
        let mut width = 0;
        while width < size.min(most) && total - caught > left_out * total {
            caught += variance(width);
            width += 1;
        }
        let scores = if by_runs {
            Mat::from_fn(count, width, |run, at| spectrum.U()[(run, size - 1 - at)] * variance(at).sqrt())
        } else {
            &centred * Mat::from_fn(size, width, |row, at| spectrum.U()[(row, size - 1 - at)])
        };
        let values = (0..count).flat_map(|run| (0..width).map(move |at| (run, at)));
        Self { count, width, values: values.map(|(run, at)| scores[(run, at)]).collect() }
    }

    /// Every coordinate scaled to a mean square of 1; one that is zero stays zero.
    pub(super) fn of_equal_spread(&self) -> Self {
        let square =
            |at: usize| (0..self.count).map(|run| self.point(run)[at].powi(2)).sum::<f64>() / self.count as f64;
        let squares: Vec<f64> = (0..self.width).map(square).collect();
        let scaled = |(at, &x): (usize, &f64)| {
            let square = squares[at % self.width];
            if square > 0.0 { x / square.sqrt() } else { 0.0 }
        };
        Self { count: self.count, width: self.width, values: self.values.iter().enumerate().map(scaled).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_kept_in_both_shapes_of_the_matrix() {
        for (count, width) in [(5, 9), (9, 5)] {
            let values: Vec<f64> = (0..count * width).map(|i| f64::from(((i * 37) % 53) as i32)).collect();
            let points = Points { count, width, values };
            let reduced = points.principal(0.0, usize::MAX);
            let (before, after) = (points.distances(), reduced.distances());
            for a in 0..count {
                for b in 0..count {
                    // Distances are f32, and eigenvectors good to 1e-12.
                    assert!((before.between(a, b) - after.between(a, b)).abs() < 1e-4, "{count} {width}");
                }
            }
        }
    }

    #[test]
    fn the_first_components_hold_the_most() {
        let values: Vec<f64> = (0..20).flat_map(|i| [f64::from(i), f64::from(i % 2) * 0.01, 3.0]).collect();
        let points = Points { count: 20, width: 3, values };
        assert_eq!(points.principal(1e-3, 10).width, 1);
        assert_eq!(points.principal(0.0, 1).width, 1);
        let still = Points { count: 4, width: 2, values: vec![7.1; 8] };
        assert_eq!((still.principal(0.1, 5).width, still.principal(0.1, 5).count()), (0, 4));
    }
}
