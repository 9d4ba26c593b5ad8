//! What a deck's welds and ties hold, on disk: `joints.json`, ties by the ids of nodes.

use std::path::Path;

use mesh_spectrum::Tie;

use super::{Loaded, store};
use crate::Error;
use crate::error::io;
use crate::joints::{Join, Joints};
use crate::reference::Reference;

/// Its name in a study's folder.
pub(crate) const FILE: &str = "joints.json";

pub(crate) fn write(joints: &Joints, path: &Path) -> Result<(), Error> {
    let text = serde_json::to_string(joints).map_err(|error| Error::Internal(error.to_string()))?;
    store::write_bytes(path, text.as_bytes())
}

pub(crate) fn read(path: &Path) -> Result<Joints, Error> {
    let text = std::fs::read(path).map_err(io("read", path))?;
    serde_json::from_slice(&text).map_err(|error| Error::Damaged { path: path.to_owned(), what: error.to_string() })
}

/// The ties by vertices that a study's surface was joined by, as its settings say; none if it was not joined.
pub(crate) fn ties_of(loaded: &Loaded) -> Result<Vec<Tie>, Error> {
    let Loaded { study, reference, .. } = loaded;
    match study.settings().join {
        None => Ok(Vec::new()),
        Some(Join::Distance(distance)) => Ok(mesh_spectrum::ties_of(&reference.mesh, distance)?),
        Some(Join::Deck(_)) => {
            study.joints()?.map_or(Ok(Vec::new()), |joints| ties(&joints, reference, &study.settings().reference))
        }
    }
}

/// The ties by vertices of the mesh.
pub(crate) fn ties(joints: &Joints, reference: &Reference, run: &str) -> Result<Vec<Tie>, Error> {
    joints.on_vertices(reference).map_err(|node| Error::OtherDeck {
        deck: joints.deck.clone(),
        what: format!("it ties node {node}, which is not on the surface of {run}"),
    })
}
