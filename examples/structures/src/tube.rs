//! A closed square tube of 0.9 m, clamped at x = 0 and loaded at its free end: it kinks upward, downward or sideways, is twisted,
//! or folds. Unit of length: m.
//!
//! **Kink.** The compressed face moves in by w(s), a bell; it keeps its length when the tube bends with curvature
//! κ = (1 − √(1 − w′²)) / (b − w) about its tension face, which keeps its length too. The side walls bulge.

use rand_chacha::ChaCha8Rng;

use crate::beam::{Folds, integral, rotate, step};
use crate::model::{Inputs, Model, Point, Structure, grid, waviness};
use crate::plan::between;

pub(crate) struct Tube;

const LENGTH: f64 = 0.9;
const SIDE: f64 = 0.07;
/// Shells along a side and along the axis.
const ACROSS: usize = 7;
const ALONG: usize = 120;

impl Structure for Tube {
    fn name(&self) -> &'static str {
        "tube"
    }

    fn modes(&self) -> &'static [&'static str] {
        &["bend_down", "bend_side", "bend_up", "fold", "twist"]
    }

    fn opposites(&self) -> &'static [(&'static str, &'static str)] {
        &[("bend_up", "bend_down")]
    }

    fn runs(&self) -> (usize, usize) {
        (15, 5)
    }

    fn draw(&self, random: &mut ChaCha8Rng) -> Inputs {
        let wavelength = between(random, 0.05, 0.085);
        let waves = between(random, 1.0, 4.0);
        let margin = (waves / 2.0 + 0.7) * wavelength;
        Inputs::from([
            ("fold_wavelength", wavelength),
            ("fold_waves", waves),
            ("fold_place", between(random, margin, LENGTH - margin)),
            ("fold_phase", between(random, 0.0, 628.0 / 100.0)),
            ("kink_place", between(random, 0.12, 0.7)),
            ("kink_half_width", between(random, 0.06, 0.1)),
            ("twist_from", between(random, 0.0, 0.3)),
            ("twist_to", between(random, 0.6, 0.9)),
        ])
    }

    fn model(&self) -> Model {
        let nodes = (0..=ALONG).flat_map(|i| {
            (0..4 * ACROSS).map(move |j| {
                let [y, z] = section(perimeter(j), 0.0);
                [station(i), y, z]
            })
        });
        Model { nodes: nodes.collect(), quads: grid(4 * ACROSS, ALONG + 1, true), title: "TUBE" }
    }

    fn shape(&self, inputs: &Inputs, share: f64) -> Vec<Point> {
        let at = |name: &str| inputs[name];
        let folds = Folds::new(
            1.25 * share * at("fold"),
            at("fold_place"),
            at("fold_wavelength"),
            at("fold_waves"),
            at("fold_phase"),
        );
        let (up, side) = (at("bend_up") - at("bend_down"), at("bend_side"));
        let size = up.hypot(side);
        let way = if size > 0.0 { [side / size, up / size] } else { [0.0, 1.0] };
        let kink = Kink::of_angle(0.87 * share * size, at("kink_place"), at("kink_half_width"));
        let twist =
            |s: f64| 1.05 * share * at("twist") * step((s - at("twist_from")) / (at("twist_to") - at("twist_from")));

        let stations: Vec<f64> = (0..=ALONG).map(station).collect();
        // The tip goes where `way` points; turned about the axis at a right angle to it.
        let axis = [0.0, -way[1], way[0]];
        let turned = integral(&stations, |s| [kink.curvature(s)]);
        let folded = integral(&stations, |s| [folds.angle(s).sin()]);
        let angle_at = |s: f64| {
            let before = ((s / LENGTH * ALONG as f64) as usize).min(ALONG - 1);
            let part = (s - stations[before]) / (stations[before + 1] - stations[before]);
            turned[before][0] * (1.0 - part) + turned[before + 1][0] * part
        };
        let line = integral(&stations, |s| rotate(axis, angle_at(s), [folds.angle(s).cos(), 0.0, 0.0]));
        let mut points = Vec::new();
        for (i, &s) in stations.iter().enumerate() {
            // The line is the middle of the tension face, away from where the tip goes.
            let tension = [0.0, -way[0] * SIDE / 2.0, -way[1] * SIDE / 2.0];
            for j in 0..4 * ACROSS {
                let p = kink.pushed(section(perimeter(j), folded[i][0]), way, s);
                let [_, y, z] = rotate([1.0, 0.0, 0.0], twist(s), [0.0, p[0], p[1]]);
                let arm = rotate(axis, turned[i][0], [0.0, y - tension[1], z - tension[2]]);
                points.push(std::array::from_fn(|c| line[i][c] + tension[c] + arm[c]));
            }
        }
        waviness(&mut points, &self.model().nodes, LENGTH, inputs, share);
        points
    }
}

fn station(i: usize) -> f64 {
    LENGTH * i as f64 / ALONG as f64
}

fn perimeter(j: usize) -> f64 {
    4.0 * SIDE * j as f64 / (4 * ACROSS) as f64
}

/// The point at arc length `at` of the section's outline when the walls ±y have moved out and ±z in by w.
fn section(at: f64, w: f64) -> [f64; 2] {
    let (a, c) = (SIDE / 2.0 + w, SIDE / 2.0 - w);
    // From the middle of the wall +y through +z, −y, −z.
    let half = 2.0 * SIDE;
    let (at, sign) = if at < half { (at, 1.0) } else { (at - half, -1.0) };
    let [y, z] = if at < c {
        [a, at]
    } else if at < c + 2.0 * a {
        [a - (at - c), c]
    } else {
        [-a, c - (at - c - 2.0 * a)]
    };
    [sign * y, sign * z]
}

struct Kink {
    depth: f64,
    place: f64,
    half_width: f64,
}

impl Kink {
    /// As deep as the angle, in radians, needs.
    fn of_angle(angle: f64, place: f64, half_width: f64) -> Self {
        let mut kink = Self { depth: 0.0, place, half_width };
        let (mut low, mut high) = (0.0, (0.6 * SIDE).min(0.62 * half_width));
        for _ in 0..50 {
            kink.depth = (low + high) / 2.0;
            let step = half_width / 200.0;
            let reached: f64 =
                (0..400).map(|i| step * kink.curvature(place - half_width + step * (i as f64 + 0.5))).sum();
            if reached > angle { high = kink.depth } else { low = kink.depth }
        }
        kink
    }

    /// How far the compressed face has moved in, and its slope.
    fn dent(&self, s: f64) -> (f64, f64) {
        let x = (s - self.place) / self.half_width;
        if x.abs() >= 1.0 {
            return (0.0, 0.0);
        }
        let angle = std::f64::consts::PI * x;
        (
            self.depth * (1.0 + angle.cos()) / 2.0,
            -self.depth * std::f64::consts::PI / (2.0 * self.half_width) * angle.sin(),
        )
    }

    fn curvature(&self, s: f64) -> f64 {
        let (w, slope) = self.dent(s);
        (1.0 - (1.0 - (slope * slope).min(0.99)).sqrt()) / (SIDE - w)
    }

    /// A point of the section, pushed in from the side `way`.
    fn pushed(&self, [y, z]: [f64; 2], way: [f64; 2], s: f64) -> [f64; 2] {
        let (w, _) = self.dent(s);
        let height = SIDE / 2.0 + y * way[0] + z * way[1];
        let aside = z * way[0] - y * way[1];
        let share = (height / SIDE).clamp(0.0, 1.0);
        // A wall of height b over b − w bulges in a sine; some of the length goes into the corners.
        let bulge = 0.7 * std::f64::consts::FRAC_2_PI * (w * (SIDE - w)).sqrt() * (std::f64::consts::PI * share).sin();
        let (height, aside) = (height - w * share, aside * (1.0 + 2.0 * bulge / SIDE));
        let from = height - SIDE / 2.0;
        [from * way[0] - aside * way[1], from * way[1] + aside * way[0]]
    }
}
