//! A cheap stand-in for a crash solver: formulas that move the vertices of a real part.
//!
//! Not physics, but shaped like it: a beam that is hit at its end folds behind a weakening, with longer folds in thicker
//! sheet, and kinks there in place of folding where the weakening is deep and far from the ends. Both grow with the
//! share of the time that has passed.

/// What the optimiser may change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Design {
    /// Thickness of the sheet, mm.
    pub(crate) thickness: f64,
    /// Place of the weakening along the beam, 0 to 1.
    pub(crate) place: f64,
    /// Depth of the weakening, 0 to 1.
    pub(crate) depth: f64,
}

impl Design {
    /// Ranges of thickness, place and depth.
    pub(crate) const BOUNDS: [[f64; 2]; 3] = [[1.0, 4.0], [0.1, 0.9], [0.0, 1.0]];

    pub(crate) fn of(&[thickness, place, depth]: &[f64; 3]) -> Self {
        Self { thickness, place, depth }
    }

    /// How much of the deformation is folding, 0 to 1; the rest is one kink.
    fn folding(self) -> f64 {
        let weakness = self.depth * 4.0 * self.place * (1.0 - self.place);
        1.0 / (1.0 + (12.0 * (weakness - 0.4)).exp())
    }

    /// The part after a share of the time, N × 3.
    pub(crate) fn shape(self, undeformed: &[[f64; 3]], share: f64) -> Vec<[f64; 3]> {
        let axis = longest(undeformed);
        let (low, high) = extent(undeformed, axis);
        let (bottom, top) = extent(undeformed, 2);
        let (length, middle) = (high - low, (bottom + top) / 2.0);
        let fold = 0.06 + 0.03 * self.thickness;
        let (crush, (sin, cos)) = (share * self.folding(), (0.9 * share * (1.0 - self.folding())).sin_cos());
        let hinge = low + self.place * length;
        let moved = |p: &[f64; 3]| {
            let along = (p[axis] - low) / length;
            let near = (-((along - self.place) / 0.2).powi(2)).exp();
            let mut q = *p;
            q[2] += 14.0 * crush * near * (std::f64::consts::TAU * along / fold).sin();
            q[axis] -= 0.3 * crush * length * smooth_step((along - self.place + 0.2) / 0.4);
            if p[axis] > hinge {
                let (x, z) = (q[axis] - hinge, q[2] - middle);
                (q[axis], q[2]) = (hinge + cos * x - sin * z, middle + sin * x + cos * z);
            }
            q
        };
        undeformed.iter().map(moved).collect()
    }
}

fn smooth_step(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

fn extent(points: &[[f64; 3]], axis: usize) -> (f64, f64) {
    let values = points.iter().map(|point| point[axis]);
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
}

/// The axis that the part is longest along, of x and y.
fn longest(points: &[[f64; 3]]) -> usize {
    let length = |axis| {
        let (low, high) = extent(points, axis);
        high - low
    };
    usize::from(length(1) > length(0))
}
