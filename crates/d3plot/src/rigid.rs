//! Rigid bodies whose nodes the states leave out (NDIM 8 and 9).
//!
//! The manual leaves open whether the list of active nodes stands behind every body or once; no real file was at hand.

use crate::control::Control;
use crate::cursor::Cursor;
use crate::error::Error;
use crate::geometry::index;
use crate::members::Stream;

/// NDIM 8, 9: the bodies, and the nodes that are left in the nodal blocks.
#[derive(Default)]
pub(crate) struct Rigid {
    pub(crate) bodies: u64,
    pub(crate) active: Option<Vec<u32>>,
    /// Every node is either in a body or active.
    pub(crate) complete: bool,
}

/// Reads the section; `once`: the active nodes are listed behind the last body, not behind each.
pub(crate) fn rigid_bodies(control: &Control, cursor: &mut Cursor, once: bool) -> Result<Rigid, Error> {
    let bodies = cursor.count("rigid bodies")?;
    let nodes = usize::try_from(control.nodes).unwrap_or(usize::MAX);
    let (mut is_rigid, mut is_active) = (vec![false; nodes], vec![false; nodes]);
    for body in 0..bodies {
        cursor.skip(1, 1, "rigid body")?;
        mark_nodes(cursor, &mut is_rigid, "nodes of a rigid body")?;
        if !once || body + 1 == bodies {
            mark_nodes(cursor, &mut is_active, "active nodes")?;
        }
    }
    if bodies == 0 {
        return Ok(Rigid { complete: true, ..Rigid::default() });
    }
    let complete = is_rigid.iter().zip(&is_active).all(|(rigid, active)| rigid != active);
    let active = (0_u32..).zip(&is_active).filter(|(_, active)| **active).map(|(node, _)| node).collect();
    Ok(Rigid { bodies, active: Some(active), complete })
}

/// Reads a list of nodes, its length first, and sets their flags.
fn mark_nodes(cursor: &mut Cursor, flags: &mut [bool], section: &'static str) -> Result<(), Error> {
    let count = cursor.count(section)?;
    let start = cursor.at();
    let most = flags.len() as i64;
    for number in cursor.ints(count, section)? {
        let Some(node) = index(number, most) else {
            return Err(cursor.wrong(section, start, format!("node {number}"), format!("1 to {most}")));
        };
        flags[node as usize] = true;
    }
    Ok(())
}

/// The refusal of a family whose states leave out rigid nodes in a way that cannot be told.
pub(crate) fn uncertain_rigid_bodies(control: &Control, stream: &Stream) -> Error {
    let what = format!("rigid bodies left out of the states (NDIM = {}), in no layout that checks", control.ndim);
    Error::Unsupported { path: stream.root().to_owned(), what }
}
