//! The reference mesh: the surface that all runs of a study share.
//!
//! Faces of the chosen parts in the reference run's undeformed geometry; vertices that no face uses are dropped. A run
//! belongs to the mesh by node ids and connectivity. The part of an element does not matter there: a notch may be a
//! part of its own in one run and none in the next.

use std::collections::HashMap;

use mesh_spectrum::Mesh;

use crate::Error;
use crate::field::Field;
use crate::run::{FieldValues, Run};
use crate::vector::{Vector, area, distance, double_area};

/// The surface, with what is needed to find it again in another run.
#[derive(Debug, Clone)]
pub struct Reference {
    /// The triangle mesh, undeformed, in the model's length unit.
    pub mesh: Mesh,
    /// Index in the reference run of the shell that each triangle comes from, T.
    pub shell_of_triangle: Vec<u32>,
    /// User id of each vertex's node, N.
    pub node_ids: Vec<u64>,
    /// Labels of the parts it was taken from.
    pub parts: Vec<String>,
}

/// Where a run's nodes are, and what was noticed.
#[derive(Debug, Clone, PartialEq)]
pub struct Placement {
    /// For each vertex of the mesh the index of its node in the run, N.
    pub node_of_vertex: Vec<u32>,
    /// For each triangle of the mesh the index of its shell in the run, T.
    pub shell_of_triangle: Vec<u32>,
    /// Largest distance between the undeformed positions in the run and in the reference, in the length unit.
    pub offset_max: f64,
}

/// A face by the user ids of its nodes, in rising order: the same face in any run, whatever the order of its corners.
pub(crate) type FaceKey = [u64; 4];

impl Reference {
    /// Takes the shells of the named parts (ids or titles; all shells when none is named) of a run.
    ///
    /// # Errors
    /// [`Error::NoSurface`], [`Error::UnknownPart`], [`Error::Mesh`].
    pub fn of_run(run: &Run, parts: &[String]) -> Result<Self, Error> {
        let all = run.parts();
        let chosen = choose_parts(run, &all, parts)?;
        let is_chosen = |part: u32| chosen.get(part as usize).copied().unwrap_or(parts.is_empty());
        // A face without area has no part in the operator, and a vertex that only such faces use would have no mass.
        let (shells, faces): (Vec<u32>, Vec<[u32; 4]>) = (0..)
            .zip(run.faces())
            .filter(|(_, (face, part))| is_chosen(*part) && has_area(run.undeformed(), face))
            .map(|(shell, (face, _))| (shell, face))
            .unzip();
        if faces.is_empty() {
            return Err(Error::NoSurface { run: run.id().to_owned(), found: run.contents() });
        }
        let (vertex_of_node, nodes) = used_nodes(run.node_ids().len(), &faces);
        let vertices = nodes.iter().map(|&node| run.undeformed()[node as usize]).collect();
        let faces: Vec<[u32; 4]> = faces.iter().map(|face| face.map(|node| vertex_of_node[node as usize])).collect();
        let mesh =
            Mesh::from_faces(vertices, &faces).map_err(|source| Error::Mesh { run: run.id().to_owned(), source })?;
        let node_ids = nodes.iter().map(|&node| run.node_ids()[node as usize]).collect();
        let labels = all.iter().zip(&chosen).filter(|(_, chosen)| **chosen).map(|(part, _)| part.label()).collect();
        let shell_of_triangle = mesh.face_of_triangle().iter().map(|&face| shells[face as usize]).collect();
        Ok(Self { shell_of_triangle, mesh, node_ids, parts: labels })
    }

    /// Number of vertices N.
    pub fn vertices(&self) -> usize {
        self.node_ids.len()
    }

    /// Finds the mesh in a run.
    ///
    /// # Errors
    /// [`Error::OtherMesh`] naming the first node or face that is not there.
    pub fn place(&self, run: &Run) -> Result<Placement, Error> {
        let other = |what: String| Error::OtherMesh { run: run.id().to_owned(), what };
        let node_of_id: HashMap<u64, u32> = run.node_ids().iter().zip(0..).map(|(&id, node)| (id, node)).collect();
        if node_of_id.len() < run.node_ids().len() {
            return Err(other("several of its nodes have the same id, so the mesh cannot be found in it".into()));
        }
        let node_of_vertex: Vec<u32> = self
            .node_ids
            .iter()
            .map(|id| {
                node_of_id.get(id).copied().ok_or_else(|| {
                    other(format!(
                        "node {id} of the mesh is not in the run ({} nodes there, {} vertices here)",
                        run.node_ids().len(),
                        self.vertices()
                    ))
                })
            })
            .collect::<Result<_, _>>()?;
        let ids = run.node_ids();
        let there: HashMap<FaceKey, u32> = run
            .faces()
            .zip(0..)
            .map(|((face, _), shell)| (face_key(face.map(|node| ids[node as usize])), shell))
            .collect();
        let mut shell_of_triangle = Vec::with_capacity(self.mesh.triangles().len());
        for (key, triangles) in self.face_keys() {
            let Some(&shell) = there.get(&key) else {
                return Err(other(format!(
                    "no shell of the run joins nodes {}",
                    key.map(|id| id.to_string()).join(", ")
                )));
            };
            shell_of_triangle.extend(std::iter::repeat_n(shell, triangles));
        }
        let undeformed = run.undeformed();
        let offset = |(vertex, &node): (usize, &u32)| distance(self.mesh.vertices()[vertex], undeformed[node as usize]);
        let offset_max = node_of_vertex.iter().enumerate().map(offset).fold(0.0, f64::max);
        Ok(Placement { node_of_vertex, shell_of_triangle, offset_max })
    }

    /// Positions of the mesh's vertices in one state of a run, N × 3.
    ///
    /// # Errors
    /// [`Error::NotFinite`] naming the first node without a usable position, and reading errors.
    pub fn shape(&self, run: &Run, placement: &Placement, state: usize) -> Result<Vec<[f64; 3]>, Error> {
        let positions = run.positions(state)?;
        let shape: Vec<[f64; 3]> = placement.node_of_vertex.iter().map(|&node| positions[node as usize]).collect();
        let broken = |point: &[f64; 3]| !point.iter().all(|x| x.is_finite());
        if let Some(first) = shape.iter().position(broken) {
            return Err(Error::NotFinite {
                run: run.id().to_owned(),
                state,
                time: run.times()[state],
                count: shape.iter().filter(|point| broken(point)).count(),
                vertices: shape.len(),
                node: self.node_ids[first],
            });
        }
        Ok(shape)
    }

    /// A field on the vertices in one state of a run, N × 3; scalars have their value in the first place and zeros behind
    /// it. Values of shells go to the vertices by area: f_v = Σ A_t f_t / Σ A_t over the triangles t at v.
    ///
    /// # Errors
    /// [`Error::NoField`] where the run does not carry it, [`Error::FieldNotFinite`], reading errors.
    pub fn field(&self, run: &Run, placement: &Placement, field: Field, state: usize) -> Result<Vec<[f64; 3]>, Error> {
        let values = match run.field(field, state)? {
            FieldValues::Nodes(values) => placement.node_of_vertex.iter().map(|&node| values[node as usize]).collect(),
            FieldValues::Shells(values) => self.to_vertices(placement, &values),
        };
        if values.as_flattened().iter().all(|x| x.is_finite()) {
            return Ok(values);
        }
        Err(Error::FieldNotFinite {
            run: run.id().to_owned(),
            field: field.to_string(),
            state,
            time: run.times()[state],
        })
    }

    /// Means of the values of the shells around each vertex, weighted by area.
    fn to_vertices(&self, placement: &Placement, values: &[f64]) -> Vec<[f64; 3]> {
        let mut sums = vec![[0.0; 3]; self.vertices()];
        let mut areas = vec![0.0; self.vertices()];
        for (triangle, &shell) in self.mesh.triangles().iter().zip(&placement.shell_of_triangle) {
            let area = area(triangle.map(|vertex| self.mesh.vertices()[vertex as usize]));
            for &vertex in triangle {
                sums[vertex as usize][0] += area * values[shell as usize];
                areas[vertex as usize] += area;
            }
        }
        sums.iter_mut().zip(&areas).filter(|(_, area)| **area > 0.0).for_each(|(sum, area)| sum[0] /= area);
        sums
    }

    /// The triangles of each face, by its node ids.
    pub(crate) fn triangles_of_face(&self) -> HashMap<FaceKey, Vec<u32>> {
        let mut triangles: HashMap<FaceKey, Vec<u32>> = HashMap::new();
        let mut next = 0;
        for (key, count) in self.face_keys() {
            triangles.entry(key).or_default().extend(next..next + count as u32);
            next += count as u32;
        }
        triangles
    }

    /// The input faces in order, each by its node ids, with the number of its triangles; a quad is put together again
    /// from its two.
    fn face_keys(&self) -> Vec<(FaceKey, usize)> {
        let ids_of = |triangle: &[u32; 3]| triangle.map(|vertex| self.node_ids[vertex as usize]);
        let mut keys = Vec::new();
        let mut triangles = self.mesh.triangles().iter().zip(&self.shell_of_triangle).peekable();
        while let Some((triangle, face)) = triangles.next() {
            let [a, b, c] = ids_of(triangle);
            let other_half = triangles.next_if(|(_, next)| *next == face).map(|(triangle, _)| ids_of(triangle));
            let fourth = other_half.and_then(|ids| ids.into_iter().find(|id| ![a, b, c].contains(id)));
            let count = 1 + usize::from(other_half.is_some());
            keys.push((face_key([a, b, c, fourth.unwrap_or(c)]), count));
        }
        keys
    }
}

fn choose_parts(run: &Run, all: &[crate::run::Part], asked: &[String]) -> Result<Vec<bool>, Error> {
    let mut chosen: Vec<bool> = all.iter().map(|part| asked.is_empty() && part.shells > 0).collect();
    for name in asked {
        let matches = |part: &crate::run::Part| {
            part.shells > 0 && (part.id.to_string() == *name || part.title.eq_ignore_ascii_case(name.trim()))
        };
        let mut any = false;
        for (chosen, part) in chosen.iter_mut().zip(all) {
            if matches(part) {
                *chosen = true;
                any = true;
            }
        }
        if !any {
            let available = all
                .iter()
                .filter(|part| part.shells > 0)
                .map(|part| format!("'{}'", part.label()))
                .collect::<Vec<_>>()
                .join(", ");
            return Err(Error::UnknownPart { run: run.id().to_owned(), asked: name.clone(), available });
        }
    }
    Ok(chosen)
}

fn has_area(points: &[[f64; 3]], &[a, b, c, d]: &[u32; 4]) -> bool {
    let no_area =
        |a: u32, b: u32, c: u32| double_area([a, b, c].map(|node| points[node as usize])) == Vector::default();
    // A coordinate that is not a number is left for the mesh to name.
    !(no_area(a, b, c) && no_area(a, c, d))
}

/// New index of each node (`u32::MAX` for unused ones), and the used nodes in rising order.
fn used_nodes(nodes: usize, faces: &[[u32; 4]]) -> (Vec<u32>, Vec<u32>) {
    let mut vertex_of_node = vec![u32::MAX; nodes];
    for &node in faces.iter().flatten() {
        vertex_of_node[node as usize] = 0;
    }
    let mut used = Vec::new();
    for (node, vertex) in (0..).zip(vertex_of_node.iter_mut()) {
        if *vertex == 0 {
            *vertex = used.len() as u32;
            used.push(node);
        }
    }
    (vertex_of_node, used)
}

/// Distinct ids in rising order, the last one repeated where there are fewer than four.
pub(crate) fn face_key(ids: [u64; 4]) -> FaceKey {
    let mut key = ids;
    key.sort_unstable();
    let mut distinct: Vec<u64> = key.to_vec();
    distinct.dedup();
    std::array::from_fn(|corner| distinct[corner.min(distinct.len() - 1)])
}
