//! The smallest d3plot family that a reader accepts: control block, nodes, shells, numbering, titles; then states of a
//! time and the nodes' positions, in a file of their own.

use std::path::Path;

use crate::model::{Model, Point};

/// The end of the geometry, of the titles and of the states.
const END: f32 = -999_999.0;

/// Writes `folder`/d3plot and `folder`/d3plot01.
pub(crate) fn write(
    folder: &Path,
    model: &Model,
    states: impl Iterator<Item = (f64, Vec<Point>)>,
) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    let (nodes, shells) = (model.nodes.len(), model.quads.len());
    let mut words = Words::default();
    words.text(model.title, 40);
    // By word of the control block: NDIM, NUMNP, ICODE, IU, NEL4, NUMMAT4, MAXINT, NARBS, nothing of IOSHL, NMMAT.
    let control = [
        (11, 1),
        (15, 4),
        (16, nodes),
        (17, 6),
        (20, 1),
        (31, shells),
        (32, 1),
        (36, 3),
        (39, 19 + nodes + shells),
        (43, 999),
        (44, 999),
        (45, 999),
        (46, 999),
        (51, 1),
    ];
    for word in 10..64 {
        match word {
            13 => words.text("R910", 4),
            14 => words.float(960.0),
            _ => words.int(control.iter().find(|(at, _)| *at == word).map_or(0, |(_, value)| *value as i32)),
        }
    }
    model.nodes.iter().flatten().for_each(|&x| words.float(x as f32));
    for quad in &model.quads {
        quad.iter().for_each(|&node| words.int(node as i32 + 1));
        words.int(1);
    }
    [-1, 1, 1, 1, 1, nodes as i32, 0, 0, shells as i32, 0, 1, 1, 1, 1, 0, 1]
        .into_iter()
        .for_each(|word| words.int(word));
    (1..=nodes).chain(1..=shells).for_each(|id| words.int(id as i32));
    [1, 1, 1].into_iter().for_each(|word| words.int(word));
    words.float(END);
    [90001, 1, 1].into_iter().for_each(|word| words.int(word));
    words.text(model.title, 72);
    words.int(90000);
    words.text(model.title, 72);
    words.float(END);
    words.save(&folder.join("d3plot"))?;
    let mut words = Words::default();
    for (time, points) in states {
        words.float(time as f32);
        points.iter().flatten().for_each(|&x| words.float(x as f32));
    }
    words.float(END);
    words.save(&folder.join("d3plot01"))
}

#[derive(Default)]
struct Words(Vec<u8>);

impl Words {
    fn int(&mut self, value: i32) {
        self.0.extend(value.to_le_bytes());
    }

    fn float(&mut self, value: f32) {
        self.0.extend(value.to_le_bytes());
    }

    fn text(&mut self, text: &str, bytes: usize) {
        self.0.extend(format!("{text:bytes$.bytes$}").into_bytes());
    }

    fn save(mut self, path: &Path) -> std::io::Result<()> {
        self.0.resize(self.0.len().next_multiple_of(2048), 0);
        std::fs::write(path, self.0)
    }
}
