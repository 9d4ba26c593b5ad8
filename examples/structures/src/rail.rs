//! An S-shaped rail of channel section, 1100 mm long, both ends on the axis of the load: it buckles up or down about
//! three hinges, folds, or is twisted. Unit of length: mm. Folding does not stretch the section, twisting warps it so that its
//! faces do not shear; hinges are spread over two to three heights of the section, and stretch and shorten its flanges.

use rand_chacha::ChaCha8Rng;

use crate::beam::{Folds, integral, rotate, step};
use crate::model::{Inputs, Model, Point, Structure, grid, waviness};
use crate::plan::between;

pub(crate) struct Rail;

const LENGTH: f64 = 1100.0;
const WEB: f64 = 80.0;
const FLANGE: f64 = 40.0;
/// Shells of half the web and of a flange, and along the axis.
const ACROSS: usize = 4;
const ALONG: usize = 160;

impl Structure for Rail {
    fn name(&self) -> &'static str {
        "rail"
    }

    fn modes(&self) -> &'static [&'static str] {
        &["buckle_down", "buckle_up", "fold", "twist"]
    }

    fn opposites(&self) -> &'static [(&'static str, &'static str)] {
        &[("buckle_up", "buckle_down")]
    }

    fn runs(&self) -> (usize, usize) {
        (16, 6)
    }

    fn draw(&self, random: &mut ChaCha8Rng) -> Inputs {
        let wavelength = between(random, 50.0, 90.0);
        let waves = between(random, 1.0, 4.0);
        let margin = (waves / 2.0 + 0.7) * wavelength;
        Inputs::from([
            ("fold_wavelength", wavelength),
            ("fold_waves", waves),
            ("fold_place", between(random, margin, LENGTH - margin)),
            ("fold_phase", between(random, 0.0, 628.0 / 100.0)),
            ("hinge_1", between(random, 120.0, 220.0)),
            ("hinge_2", between(random, 400.0, 700.0)),
            ("hinge_3", between(random, 880.0, 980.0)),
            ("hinge_width", between(random, 160.0, 240.0)),
            ("twist_from", between(random, 0.0, 350.0)),
            ("twist_to", between(random, 750.0, 1100.0)),
        ])
    }

    fn model(&self) -> Model {
        let nodes = placed(|_| 0.0, |_| 0.0, |_| 0.0, &|_| 0.0);
        Model { nodes, quads: grid(4 * ACROSS + 1, ALONG + 1, false), title: "RAIL" }
    }

    fn shape(&self, inputs: &Inputs, share: f64) -> Vec<Point> {
        let at = |name: &str| inputs[name];
        let folds = Folds::new(
            1.2 * share * at("fold"),
            at("fold_place"),
            at("fold_wavelength"),
            at("fold_waves"),
            at("fold_phase"),
        );
        // Up by the first angle, down by the second, so that both ends stay on the axis.
        let first = 0.33 * share * (at("buckle_up") - at("buckle_down"));
        let (one, two, three) = (at("hinge_1"), at("hinge_2"), at("hinge_3"));
        let second = (first.sin() * (two - one) / (three - two)).asin();
        let hinge = |s: f64, place: f64| step((s - place) / at("hinge_width") + 0.5);
        let pitch = |s: f64| first * hinge(s, one) - (first + second) * hinge(s, two) + second * hinge(s, three);
        let (from, to) = (at("twist_from"), at("twist_to"));
        let twist = |s: f64| 0.8 * share * at("twist") * step((s - from) / (to - from));
        let mut points = placed(pitch, |s| folds.angle(s), twist, &|s| twist(s + 0.5) - twist(s - 0.5));
        waviness(&mut points, &self.model().nodes, LENGTH, inputs, share);
        points
    }
}

/// All nodes, given along the axis: pitch and twist of the section, slope ψ of its folds, and rate of twist.
fn placed(
    pitch: impl Fn(f64) -> f64,
    slope: impl Fn(f64) -> f64,
    twist: impl Fn(f64) -> f64,
    rate: &dyn Fn(f64) -> f64,
) -> Vec<Point> {
    let stations: Vec<f64> = (0..=ALONG).map(|i| LENGTH * i as f64 / ALONG as f64).collect();
    let turned = |s: f64, p: Point| rotate([0.0, -1.0, 0.0], pitch(s), rotate([0.0, 0.0, 1.0], heading(s), p));
    let line = integral(&stations, |s| turned(s, [slope(s).cos(), 0.0, 0.0]));
    let folded = integral(&stations, |s| [slope(s).sin()]);
    let mut points = Vec::new();
    for (i, &s) in stations.iter().enumerate() {
        for j in 0..=4 * ACROSS {
            let at = outline(j);
            let [y, z] = section(at, folded[i][0]);
            let warped = [-rate(s) * sectorial(at), 0.0, 0.0];
            let [_, y, z] = rotate([1.0, 0.0, 0.0], twist(s), [0.0, y, z]);
            let arm = turned(s, [warped[0], y, z]);
            points.push(std::array::from_fn(|c| line[i][c] + arm[c]));
        }
    }
    points
}

/// Of the undeformed axis, in its plane: an S.
fn heading(s: f64) -> f64 {
    0.35 * (step((s - 250.0) / 250.0) - step((s - 600.0) / 250.0))
}

/// Arc length of the section's node j from the middle of the web, −80 to 80.
fn outline(j: usize) -> f64 {
    (WEB / 2.0 + FLANGE) * (j as f64 / (2 * ACROSS) as f64 - 1.0)
}

/// The point of the section when the web has moved by w towards the edges of the flanges, and the flanges out by w.
fn section(at: f64, w: f64) -> [f64; 2] {
    let half = WEB / 2.0 + w;
    if at.abs() < half { [w, at] } else { [w + at.abs() - half, half.copysign(at)] }
}

/// Sectorial coordinate about the middle of the web: twice the area that the radius sweeps.
fn sectorial(at: f64) -> f64 {
    let beyond = (at.abs() - WEB / 2.0).max(0.0);
    -(WEB / 2.0) * beyond * at.signum()
}
