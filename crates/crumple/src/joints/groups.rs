//! Nodes that are held as one, such as the two or three nodes of a weld or the rings around a bolt: which of them to
//! couple.
//!
//! Vertices of a group that share an edge of the mesh belong to one patch: a ring, or a piece of a sheet, which the body
//! moves as a whole and whose shape is its own. Patches are joined along a shortest tree, each branch by the mutually
//! nearest vertices of its two patches. A group in one patch joins nothing.

use std::collections::HashMap;

use mesh_spectrum::Mesh;

use super::closest::distance;

/// Groups with more vertices are left out: all pairs of them are looked at.
pub(super) const MOST: usize = 4000;

/// Triangles by vertex.
pub(super) struct Groups {
    start: Vec<usize>,
    triangles: Vec<u32>,
}

impl Groups {
    pub(super) fn of(mesh: &Mesh) -> Self {
        let mut start = vec![0; mesh.vertices().len() + 1];
        mesh.triangles().iter().flatten().for_each(|&vertex| start[vertex as usize + 1] += 1);
        (1..start.len()).for_each(|at| start[at] += start[at - 1]);
        let mut next = start.clone();
        let mut triangles = vec![0; 3 * mesh.triangles().len()];
        for (triangle, corners) in mesh.triangles().iter().enumerate() {
            for &vertex in corners {
                triangles[next[vertex as usize]] = triangle as u32;
                next[vertex as usize] += 1;
            }
        }
        Self { start, triangles }
    }

    fn at(&self, vertex: u32) -> &[u32] {
        &self.triangles[self.start[vertex as usize]..self.start[vertex as usize + 1]]
    }

    /// A triangle at a vertex.
    pub(super) fn triangle_at(&self, vertex: u32) -> Option<u32> {
        self.at(vertex).first().copied()
    }

    /// The triangles within two rings around one.
    pub(super) fn triangles_around(&self, mesh: &Mesh, triangle: u32) -> Vec<u32> {
        let mut found = vec![triangle];
        for _ in 0..2 {
            let vertices = found.iter().flat_map(|&triangle| mesh.triangles()[triangle as usize]);
            let mut wider: Vec<u32> = vertices.flat_map(|vertex| self.at(vertex).iter().copied()).collect();
            wider.sort_unstable();
            wider.dedup();
            found = wider;
        }
        found
    }

    /// Pairs of vertices that couple the patches of a group; `None` if it is too large.
    pub(super) fn pairs(&self, mesh: &Mesh, group: &[u32]) -> Option<Vec<(u32, u32)>> {
        if group.len() > MOST {
            return None;
        }
        let patch = self.patches(mesh, group);
        let place = |at: usize| mesh.vertices()[group[at] as usize];
        // The nearest pair of each two patches.
        let mut shortest: HashMap<(usize, usize), (f64, usize, usize)> = HashMap::new();
        for a in 0..group.len() {
            for b in a + 1..group.len() {
                if patch[a] == patch[b] {
                    continue;
                }
                let key = (patch[a].min(patch[b]), patch[a].max(patch[b]));
                let length = distance(place(a), place(b));
                let best = shortest.entry(key).or_insert((length, a, b));
                if length < best.0 {
                    *best = (length, a, b);
                }
            }
        }
        let mut branches: Vec<(f64, (usize, usize))> = shortest.into_iter().map(|(key, best)| (best.0, key)).collect();
        branches.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut tree: Vec<usize> = (0..group.len()).collect();
        let mut pairs = Vec::new();
        for (_, (p, q)) in branches {
            let (a, b) = (root(&mut tree, p), root(&mut tree, q));
            if a != b {
                tree[a.max(b)] = a.min(b);
                self.mutual(mesh, group, &patch, [p, q], &mut pairs);
            }
        }
        Some(pairs)
    }

    /// The patch of each vertex of the group, named by its first member.
    fn patches(&self, mesh: &Mesh, group: &[u32]) -> Vec<usize> {
        let place: HashMap<u32, usize> = group.iter().enumerate().map(|(at, &vertex)| (vertex, at)).collect();
        let mut tree: Vec<usize> = (0..group.len()).collect();
        for (at, &vertex) in group.iter().enumerate() {
            for &triangle in self.at(vertex) {
                for other in mesh.triangles()[triangle as usize].iter().filter_map(|corner| place.get(corner)) {
                    let (a, b) = (root(&mut tree, at), root(&mut tree, *other));
                    tree[a.max(b)] = a.min(b);
                }
            }
        }
        (0..group.len()).map(|at| root(&mut tree, at)).collect()
    }

    fn mutual(&self, mesh: &Mesh, group: &[u32], patch: &[usize], of: [usize; 2], pairs: &mut Vec<(u32, u32)>) {
        let members = |which: usize| -> Vec<usize> { (0..group.len()).filter(|&at| patch[at] == which).collect() };
        let (p, q) = (members(of[0]), members(of[1]));
        let length =
            |a: usize, b: usize| distance(mesh.vertices()[group[a] as usize], mesh.vertices()[group[b] as usize]);
        let nearest = |from: usize, among: &[usize]| {
            among.iter().copied().min_by(|&a, &b| length(from, a).total_cmp(&length(from, b)).then(a.cmp(&b)))
        };
        for &a in &p {
            if let Some(b) = nearest(a, &q)
                && nearest(b, &p) == Some(a)
            {
                pairs.push((group[a], group[b]));
            }
        }
    }
}

fn root(tree: &mut [usize], at: usize) -> usize {
    let mut at = at;
    while tree[at] != at {
        tree[at] = tree[tree[at]];
        at = tree[at];
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three squares above each other, one apart, corners 0–3, 4–7, 8–11.
    fn stack() -> Mesh {
        let mut vertices = Vec::new();
        let mut faces = Vec::new();
        for level in 0..3u32 {
            let z = f64::from(level);
            vertices.extend([[0.0, 0.0, z], [9.0, 0.0, z], [9.0, 9.0, z], [0.0, 9.0, z]]);
            faces.push([0, 1, 2, 3].map(|corner| corner + 4 * level));
        }
        Mesh::from_faces(vertices, &faces).unwrap()
    }

    #[test]
    fn sheets_are_coupled_from_one_to_the_next() {
        let mesh = stack();
        let groups = Groups::of(&mesh);
        assert_eq!(groups.pairs(&mesh, &[0, 4, 8]).unwrap(), [(0, 4), (4, 8)]);
        // A whole edge of two sheets: one patch each, both ends coupled.
        assert_eq!(groups.pairs(&mesh, &[0, 1, 4, 5]).unwrap(), [(0, 4), (1, 5)]);
        // One sheet's own nodes: nothing to join.
        assert_eq!(groups.pairs(&mesh, &[0, 1, 2, 3]).unwrap(), []);
    }
}
