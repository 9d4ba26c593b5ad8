//! What tube and rail share: axial folding without stretch, turning frames, integration along the axis.
//!
//! **Folding.** All faces of a section with right angles move by the same w along their normals, in and out by turns,
//! and the corners travel through the material (Wierzbicki and Abramowicz 1983, the inextensional mode). Every point of the
//! section then moves by w at a right angle to the axis and to its own face, so with dw/ds = sin ψ and
//! dx/ds = cos ψ no length changes.

use crate::model::Point;

/// Steps of the integration between two stations.
const STEPS: usize = 8;

/// A train of folds: the slope angle ψ along the axis.
pub(crate) struct Folds {
    /// Largest slope, in radians.
    pub(crate) slope: f64,
    pub(crate) place: f64,
    pub(crate) wavelength: f64,
    /// Whole waves in the train.
    pub(crate) waves: f64,
    pub(crate) phase: f64,
    /// Constant part of ψ that brings w back to zero.
    bias: f64,
}

impl Folds {
    pub(crate) fn new(slope: f64, place: f64, wavelength: f64, waves: f64, phase: f64) -> Self {
        let mut folds = Self { slope, place, wavelength, waves, phase, bias: 0.0 };
        let half = (waves / 2.0 + 0.5) * wavelength;
        let left = |folds: &Self| {
            (0..400).map(|i| folds.angle(place - half + half * (i as f64 + 0.5) / 200.0).sin()).sum::<f64>()
        };
        let (mut low, mut high) = (-0.5, 0.5);
        for _ in 0..60 {
            folds.bias = (low + high) / 2.0;
            if left(&folds) > 0.0 { high = folds.bias } else { low = folds.bias }
        }
        folds
    }

    /// ψ at arc length s of the undeformed axis.
    pub(crate) fn angle(&self, s: f64) -> f64 {
        let from = s - self.place;
        let window = 1.0 - step((from.abs() - self.waves / 2.0 * self.wavelength) / (self.wavelength / 2.0));
        let wave = (std::f64::consts::TAU * from / self.wavelength + self.phase).cos();
        if self.slope == 0.0 { 0.0 } else { window * (self.slope * wave + self.bias) }
    }
}

/// 0 below 0, 1 above 1, smooth between.
pub(crate) fn step(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * x * (10.0 - 15.0 * x + 6.0 * x * x)
}

/// ∫ f ds from 0 to each station, by the midpoint rule on eight steps a station.
pub(crate) fn integral<const N: usize>(stations: &[f64], f: impl Fn(f64) -> [f64; N]) -> Vec<[f64; N]> {
    let mut sum = [0.0; N];
    let mut out = vec![sum];
    for ends in stations.windows(2) {
        let h = (ends[1] - ends[0]) / STEPS as f64;
        for at in 0..STEPS {
            let value = f(ends[0] + (at as f64 + 0.5) * h);
            (0..N).for_each(|c| sum[c] += h * value[c]);
        }
        out.push(sum);
    }
    out
}

/// Rotates by `angle` about the unit `axis`.
pub(crate) fn rotate(axis: Point, angle: f64, p: Point) -> Point {
    let (sin, cos) = angle.sin_cos();
    let along: f64 = (0..3).map(|c| axis[c] * p[c]).sum();
    let cross = [0, 1, 2].map(|c| axis[(c + 1) % 3] * p[(c + 2) % 3] - axis[(c + 2) % 3] * p[(c + 1) % 3]);
    std::array::from_fn(|c| cos * p[c] + sin * cross[c] + (1.0 - cos) * along * axis[c])
}
