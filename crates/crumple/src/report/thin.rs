//! A thinner mesh for the page: a report must stay small whatever the model's size.
//!
//! Vertices that fall into one cell of a uniform grid become one (Rossignac and Borrel 1993); a shape on the thin mesh
//! is the full shape at the vertices that stand for their cells. For pictures only: no number of the report uses it.

use std::collections::HashMap;

/// A subset of a mesh's vertices and the triangles between them.
pub(super) struct Thin {
    /// The vertices kept, by their number in the full mesh.
    pub(super) vertices: Vec<u32>,
    /// Triangles of the thin mesh, by position in `vertices`.
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Thin {
    /// The mesh itself where it has at most `most` vertices, else one with at most that many.
    pub(super) fn of(positions: &[[f64; 3]], triangles: &[[u32; 3]], most: usize) -> Self {
        let whole = Self { vertices: (0..positions.len() as u32).collect(), triangles: triangles.to_vec() };
        let extent = |c: usize| {
            let (low, high) = positions
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (low.min(p[c]), high.max(p[c])));
            (low, high - low)
        };
        let bounds: [(f64, f64); 3] = std::array::from_fn(extent);
        let longest = bounds.iter().map(|b| b.1).fold(0.0, f64::max);
        let mut cells = 1024.0;
        let mut thin = whole;
        while thin.vertices.len() > most && cells > 1.0 {
            thin = cluster(positions, triangles, &bounds, longest / cells);
            cells /= 1.25;
        }
        thin
    }

    /// A shape on the thin mesh.
    pub(super) fn shape(&self, full: &[[f64; 3]]) -> Vec<[f64; 3]> {
        self.vertices.iter().map(|&vertex| full[vertex as usize]).collect()
    }
}

fn cluster(positions: &[[f64; 3]], triangles: &[[u32; 3]], bounds: &[(f64, f64); 3], cell: f64) -> Thin {
    let mut vertices = Vec::new();
    let mut of_cell: HashMap<[i64; 3], u32> = HashMap::new();
    let key = |p: &[f64; 3]| std::array::from_fn(|c| ((p[c] - bounds[c].0) / cell).floor() as i64);
    let of_vertex: Vec<u32> = positions
        .iter()
        .zip(0..)
        .map(|(p, vertex)| {
            *of_cell.entry(key(p)).or_insert_with(|| {
                vertices.push(vertex);
                vertices.len() as u32 - 1
            })
        })
        .collect();
    let mut seen = std::collections::HashSet::new();
    let mapped = triangles.iter().map(|triangle| triangle.map(|vertex| of_vertex[vertex as usize]));
    let triangles = mapped
        .filter(|&[a, b, c]| a != b && b != c && c != a)
        .filter(|triangle| {
            let mut key = *triangle;
            key.sort_unstable();
            seen.insert(key)
        })
        .collect();
    Thin { vertices, triangles }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_plate_becomes_small_and_stays_a_plate() {
        let side = 60_u32;
        let positions: Vec<[f64; 3]> =
            (0..side * side).map(|v| [f64::from(v % side), f64::from(v / side), 0.0]).collect();
        let corner = |i: u32, j: u32| j * side + i;
        let triangles: Vec<[u32; 3]> = (0..side - 1)
            .flat_map(|j| {
                (0..side - 1).flat_map(move |i| {
                    [
                        [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1)],
                        [corner(i, j), corner(i + 1, j + 1), corner(i, j + 1)],
                    ]
                })
            })
            .collect();
        let whole = Thin::of(&positions, &triangles, 10_000);
        assert_eq!((whole.vertices.len(), whole.triangles.len()), (3600, triangles.len()));
        let thin = Thin::of(&positions, &triangles, 500);
        assert!(thin.vertices.len() <= 500 && thin.vertices.len() > 100, "{}", thin.vertices.len());
        assert!(thin.triangles.iter().flatten().all(|&v| (v as usize) < thin.vertices.len()));
        assert_eq!(thin.shape(&positions).len(), thin.vertices.len());
    }
}
