//! Which vertices of different components are each other's nearest: the pairs that [`join`](crate::join) makes one,
//! and the distance that [`inspect`](crate::inspect) reports as the gap between sheets.
//!
//! A uniform grid with cells as wide as the search radius, so that a vertex looks into 27 cells.

use std::collections::HashMap;

use crate::mesh::{Point, dot, sub};

/// Two vertices of different components, each the other's nearest, and their distance.
pub(crate) struct Pair {
    pub(crate) low: u32,
    pub(crate) high: u32,
    pub(crate) distance: f64,
}

/// All mutually nearest pairs at most `radius` apart, in the order of their lower vertex.
/// Of several vertices at the same distance the lowest is the nearest, so the result is unique.
pub(crate) fn mutual_pairs(vertices: &[Point], component_of_vertex: &[u32], radius: f64) -> Vec<Pair> {
    let grid = Grid::new(vertices, radius);
    let nearest: Vec<Option<(u32, f64)>> = (0..vertices.len())
        .map(|vertex| grid.nearest_elsewhere(vertices, component_of_vertex, vertex, radius))
        .collect();
    let mut pairs = Vec::new();
    for (vertex, found) in nearest.iter().enumerate() {
        if let Some((other, distance)) = *found
            && other as usize > vertex
            && nearest[other as usize].is_some_and(|(back, _)| back as usize == vertex)
        {
            pairs.push(Pair { low: vertex as u32, high: other, distance });
        }
    }
    pairs
}

struct Grid {
    origin: Point,
    width: f64,
    /// Vertices by cell, each list in ascending order.
    cells: HashMap<[i64; 3], Vec<u32>>,
}

impl Grid {
    fn new(vertices: &[Point], width: f64) -> Grid {
        let mut origin = [f64::INFINITY; 3];
        for point in vertices {
            for axis in 0..3 {
                origin[axis] = origin[axis].min(point[axis]);
            }
        }
        let mut grid = Grid { origin, width, cells: HashMap::new() };
        for (vertex, &point) in vertices.iter().enumerate() {
            grid.cells.entry(grid.cell(point)).or_default().push(vertex as u32);
        }
        grid
    }

    /// Saturates far from the origin, where all points share one cell: slower, never wrong.
    fn cell(&self, point: Point) -> [i64; 3] {
        let limit = (i64::MAX / 4) as f64;
        sub(point, self.origin).map(|x| (x / self.width).floor().min(limit) as i64)
    }

    fn nearest_elsewhere(
        &self,
        vertices: &[Point],
        component_of_vertex: &[u32],
        vertex: usize,
        radius: f64,
    ) -> Option<(u32, f64)> {
        let home = self.cell(vertices[vertex]);
        let mut best: Option<(u32, f64)> = None;
        for step in 0..27 {
            let cell = [home[0] + step % 3 - 1, home[1] + step / 3 % 3 - 1, home[2] + step / 9 - 1];
            for &other in self.cells.get(&cell).into_iter().flatten() {
                if component_of_vertex[other as usize] == component_of_vertex[vertex] {
                    continue;
                }
                let between = sub(vertices[other as usize], vertices[vertex]);
                let distance = dot(between, between).sqrt();
                let better = best.is_none_or(|(old, least)| distance < least || (distance == least && other < old));
                if distance <= radius && better {
                    best = Some((other, distance));
                }
            }
        }
        best
    }
}
