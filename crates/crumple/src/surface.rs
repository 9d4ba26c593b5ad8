//! A surface from any file: mesh files (OBJ, PLY, STL, OFF, VTU) by `mesh-files`, result files by [`run`](crate::run).
//!
//! For whoever wants eigenpairs without a study. Vertices that no face uses are dropped, because nothing determines a
//! field there; where each vertex stood in the file is kept.

use std::path::Path;

use mesh_spectrum::Mesh;

use crate::Error;
use crate::reference::Reference;
use crate::run::Run;

/// A mesh and where it is from.
#[derive(Debug, Clone)]
pub struct Surface {
    /// The mesh, in the model's length unit, without unused vertices.
    pub mesh: Mesh,
    /// N: the number of each vertex in the mesh file, from 0, or the user id of its node in a result file.
    pub vertex_ids: Vec<u64>,
    /// Vertices that no face uses, which were dropped (a result file's other nodes are not counted).
    pub unused_vertices: usize,
    /// What was in the file and was not read, for the user.
    pub notes: Vec<String>,
}

impl Surface {
    /// Reads the surface of a mesh file, or the shells of a result file or of its folder (of the parts named; all when
    /// none is): the undeformed ones, or with `@N` or `@last` behind the path those of a state, with the triangles of the
    /// undeformed ones.
    ///
    /// # Errors
    /// [`Error::NoSuchPath`], [`Error::MeshFile`], [`Error::Mesh`], [`Error::UnknownState`], and those of [`Run::open`] and
    /// [`Reference::of_run`].
    pub fn read(path: &Path, parts: &[String]) -> Result<Surface, Error> {
        if let Some((path, state)) = state_named(path) {
            let run = Run::open(path.display().to_string(), path)?;
            return Surface::of_state(&run, state, parts);
        }
        if !path.exists() {
            return Err(Error::NoSuchPath(path.to_owned()));
        }
        if path.is_dir() || mesh_files::format_of(path).is_none() {
            match Run::open(path.display().to_string(), path) {
                Ok(run) => return Surface::of_run(&run, parts),
                // A deck by its name, whose fault is known.
                Err(error @ Error::Deck(_)) => return Err(error),
                // Its first bytes may still say what it is.
                Err(error) if path.is_dir() || has_the_name_of_a_run(path) => return Err(error),
                Err(_) => {}
            }
        }
        if let Some(part) = parts.first() {
            let expected = "no --part: a mesh file has no parts".into();
            return Err(Error::Value { name: "--part", value: part.clone(), expected });
        }
        let file = mesh_files::read(path).map_err(Error::MeshFile)?;
        let wrong = |source| Error::BadMesh { path: path.to_owned(), source };
        let whole = Mesh::from_polygons(file.vertices.clone(), file.faces()).map_err(wrong)?;
        let (mesh, kept) = whole.without_unused_vertices();
        Ok(Surface {
            unused_vertices: file.vertices.len() - kept.len(),
            vertex_ids: kept.into_iter().map(u64::from).collect(),
            mesh,
            notes: file.notes,
        })
    }

    fn of_state(run: &Run, state: &str, parts: &[String]) -> Result<Surface, Error> {
        let (id, states) = (run.id().to_owned(), run.times().len());
        let number = if state == "last" { states.checked_sub(1) } else { state.parse().ok() };
        let unknown = || Error::UnknownState { run: id.clone(), state: state.to_owned(), states };
        let number = number.filter(|number| *number < states).ok_or_else(unknown)?;
        let reference = Reference::of_run(run, parts)?;
        let shape = reference.shape(run, &reference.place(run)?, number)?;
        let mesh = reference.mesh.moved(shape).map_err(|source| Error::Mesh { run: id, source })?;
        Ok(Surface { mesh, vertex_ids: reference.node_ids, unused_vertices: 0, notes: run.warnings() })
    }

    fn of_run(run: &Run, parts: &[String]) -> Result<Surface, Error> {
        let Reference { mesh, node_ids, .. } = Reference::of_run(run, parts)?;
        Ok(Surface { mesh, vertex_ids: node_ids, unused_vertices: 0, notes: run.warnings() })
    }
}

/// The result file and the state that `RUN@N` or `RUN@last` names; none where a file has that very name, or there is no
/// such run.
pub fn state_named(path: &Path) -> Option<(&Path, &str)> {
    let (run, state) = path.to_str()?.rsplit_once('@')?;
    let is_state = state == "last" || (!state.is_empty() && state.bytes().all(|byte| byte.is_ascii_digit()));
    (is_state && !path.exists() && Path::new(run).exists()).then_some((Path::new(run), state))
}

fn has_the_name_of_a_run(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().to_ascii_lowercase().contains("d3plot"))
}
