//! A plate of 300 × 400 mm, held at x = 0: it is dented inward or outward, turns up along a hinge line, or corrugates. Unit of
//! length: mm. Hinge and corrugation bend the plate into cylinders, without stretch; dents stretch it by half the
//! square of their slope.

use rand_chacha::ChaCha8Rng;

use crate::beam::{Folds, integral, step};
use crate::model::{Inputs, Model, Point, Structure, grid, waviness};
use crate::plan::between;

pub(crate) struct Plate;

const SIZE: [f64; 2] = [300.0, 400.0];
const SHELLS: [usize; 2] = [50, 66];

impl Structure for Plate {
    fn name(&self) -> &'static str {
        "plate"
    }

    fn modes(&self) -> &'static [&'static str] {
        &["corrugate", "dent_in", "dent_out", "hinge"]
    }

    fn opposites(&self) -> &'static [(&'static str, &'static str)] {
        &[("dent_in", "dent_out")]
    }

    fn runs(&self) -> (usize, usize) {
        (16, 6)
    }

    fn draw(&self, random: &mut ChaCha8Rng) -> Inputs {
        let radius = between(random, 40.0, 90.0);
        let wavelength = between(random, 35.0, 70.0);
        let waves = between(random, 1.0, 3.0);
        let margin = (waves / 2.0 + 0.6) * wavelength;
        Inputs::from([
            ("dent_radius", radius),
            ("dent_aspect", between(random, 0.7, 1.0)),
            ("dent_x", between(random, radius, SIZE[0] - radius)),
            ("dent_y", between(random, radius, SIZE[1] - radius)),
            ("hinge_x", between(random, 70.0, 220.0)),
            ("hinge_turn", between(random, -0.5, 0.5)),
            ("hinge_width", between(random, 20.0, 60.0)),
            ("corrugate_wavelength", wavelength),
            ("corrugate_waves", waves),
            ("corrugate_place", between(random, margin, SIZE[0] - margin)),
            ("corrugate_turn", between(random, -0.3, 0.3)),
            ("corrugate_phase", between(random, 0.0, 628.0 / 100.0)),
        ])
    }

    fn model(&self) -> Model {
        let nodes = (0..=SHELLS[1]).flat_map(|j| (0..=SHELLS[0]).map(move |i| [place(i, 0), place(j, 1), 0.0]));
        Model { nodes: nodes.collect(), quads: grid(SHELLS[0] + 1, SHELLS[1] + 1, false), title: "PLATE" }
    }

    fn shape(&self, inputs: &Inputs, share: f64) -> Vec<Point> {
        let at = |name: &str| inputs[name];
        let undeformed = self.model().nodes;
        // Corrugation: arc length along its direction becomes distance and height.
        let folds = Folds::new(
            1.2 * share * at("corrugate"),
            at("corrugate_place"),
            at("corrugate_wavelength"),
            at("corrugate_waves"),
            at("corrugate_phase"),
        );
        let along: Vec<f64> = (0..=800).map(|i| -200.0 + f64::from(i)).collect();
        let wave = integral(&along, |s| [folds.angle(s).cos() - 1.0, folds.angle(s).sin()]);
        let dent = share * (at("dent_out") - at("dent_in")) * 0.22 * at("dent_radius");
        let hinge = Hinge { angle: 1.2 * share * at("hinge"), width: at("hinge_width") };
        let mut points: Vec<Point> = undeformed
            .iter()
            .map(|&[x, y, _]| {
                let (rise, run) = at("corrugate_turn").sin_cos();
                let s = x * run + (y - SIZE[1] / 2.0) * rise;
                let [shift, height] = between_samples(&wave, s + 200.0);
                let (ex, ey) = (
                    (x - at("dent_x")) / at("dent_radius"),
                    (y - at("dent_y")) / (at("dent_aspect") * at("dent_radius")),
                );
                let inside = (1.0 - ex * ex - ey * ey).max(0.0);
                let z = height + dent * inside * inside;
                let (x, y) = (x + shift * run, y + shift * rise);
                // Hinge: distance from its line turns into an arc and what follows it.
                let (rise, run) = at("hinge_turn").sin_cos();
                let from = (x - at("hinge_x")) * run + (y - SIZE[1] / 2.0) * rise;
                let (over, up) = hinge.moved(from, z);
                [x + (over - from) * run, y + (over - from) * rise, up]
            })
            .collect();
        waviness(&mut points, &undeformed, SIZE[1], inputs, share);
        points
    }
}

fn place(i: usize, c: usize) -> f64 {
    SIZE[c] * i as f64 / SHELLS[c] as f64
}

/// Linear between samples at 0, 1, 2, …
fn between_samples(samples: &[[f64; 2]], at: f64) -> [f64; 2] {
    let before = (at.max(0.0) as usize).min(samples.len() - 2);
    let part = at - before as f64;
    std::array::from_fn(|c| samples[before][c] * (1.0 - part) + samples[before + 1][c] * part)
}

struct Hinge {
    angle: f64,
    width: f64,
}

impl Hinge {
    /// Where a point at distance `from` beyond the line and height `z` goes: the plate turns up over the hinge's width.
    fn moved(&self, from: f64, z: f64) -> (f64, f64) {
        let angle = |s: f64| self.angle * step(s / self.width + 0.5);
        let (mut over, mut up) = (from.min(-self.width / 2.0), 0.0);
        let end = from.min(self.width / 2.0);
        let length = end + self.width / 2.0;
        if length > 0.0 {
            for i in 0..64 {
                let s = -self.width / 2.0 + length * (f64::from(i) + 0.5) / 64.0;
                over += length / 64.0 * angle(s).cos();
                up += length / 64.0 * angle(s).sin();
            }
        }
        let (sin, cos) = angle(from).sin_cos();
        let beyond = (from - self.width / 2.0).max(0.0);
        (over + beyond * cos - z * sin, up + beyond * sin + z * cos)
    }
}
