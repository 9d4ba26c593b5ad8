//! What a structure is: a mesh, modes of deformation, and the shape that given inputs lead to.

use std::collections::BTreeMap;

use rand_chacha::ChaCha8Rng;

pub(crate) type Point = [f64; 3];

/// What was drawn for a run, by name: an amplitude for each mode (named as the mode), places, sizes, timing.
pub(crate) type Inputs = BTreeMap<&'static str, f64>;

/// Four-node shells over nodes.
pub(crate) struct Model {
    /// Undeformed positions, in the structure's unit of length.
    pub(crate) nodes: Vec<Point>,
    pub(crate) quads: Vec<[u32; 4]>,
    pub(crate) title: &'static str,
}

/// A structure and the ways in which it deforms.
pub(crate) trait Structure {
    fn name(&self) -> &'static str;
    /// The modes, which are the labels.
    fn modes(&self) -> &'static [&'static str];
    /// Pairs of modes that cannot happen at once.
    fn opposites(&self) -> &'static [(&'static str, &'static str)];
    /// Runs of each mode, and runs that are a mixture of two.
    fn runs(&self) -> (usize, usize);
    /// Where and how large, whatever the mode.
    fn draw(&self, random: &mut ChaCha8Rng) -> Inputs;
    /// Undeformed.
    fn model(&self) -> Model;
    /// Positions of the nodes when all amplitudes have reached this share, 0 to 1.
    fn shape(&self, inputs: &Inputs, share: f64) -> Vec<Point>;
}

/// A grid of quads over `columns` × `rows` nodes, node = row · columns + column; `closed` joins the last column of quads
/// to the first.
pub(crate) fn grid(columns: usize, rows: usize, closed: bool) -> Vec<[u32; 4]> {
    let node = |column: usize, row: usize| (row * columns + column % columns) as u32;
    let across = if closed { columns } else { columns - 1 };
    (0..rows - 1)
        .flat_map(|row| (0..across).map(move |column| (column, row)))
        .map(|(i, j)| [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)])
        .collect()
}

/// Waves that no mode is: three plane waves of random direction, of a thousandth of the size, along space.
pub(crate) fn waviness(points: &mut [Point], undeformed: &[Point], size: f64, inputs: &Inputs, share: f64) {
    let waves = ["a", "b", "c"].map(|wave| {
        let get = |name: &str| {
            inputs.iter().find(|(key, _)| **key == format!("wave_{wave}_{name}")).map_or(0.0, |(_, value)| *value)
        };
        ([get("kx"), get("ky"), get("kz")], get("phase"), get("way"))
    });
    for (point, from) in points.iter_mut().zip(undeformed) {
        for (number, (per_size, phase, way)) in waves.iter().enumerate() {
            let along: f64 = (0..3).map(|c| per_size[c] * from[c]).sum::<f64>() / size;
            let height = 1e-3 * size * share * (along + phase).sin();
            let direction =
                [(number as f64 + way).cos(), (number as f64 + way).sin() * 0.8, (number as f64 + way).sin() * 0.6];
            (0..3).for_each(|c| point[c] += height * direction[c]);
        }
    }
}
