//! Rigid bodies whose nodes the states leave out (NDIM 8 and 9).
//!
//! The manual leaves open whether the list of active nodes stands behind every body or once; no real file was at hand.

use crate::control::Control;
use crate::cursor::Cursor;
use crate::error::Error;
use crate::geometry::index;
use crate::members::Stream;

/// The body of a node that belongs to none.
pub(crate) const NO_BODY: u32 = u32::MAX;

/// NDIM 8, 9: the bodies, and the nodes that are left in the nodal blocks.
#[derive(Default)]
pub(crate) struct Rigid {
    pub(crate) bodies: u64,
    /// For each node its body, counted from 0, or [`NO_BODY`]; the first one if there are several.
    pub(crate) body_of: Vec<u32>,
    pub(crate) active: Option<Vec<u32>>,
    /// Every node is either in a body or active.
    pub(crate) complete: bool,
}

/// Reads the section; `once`: the active nodes are listed behind the last body, not behind each.
pub(crate) fn rigid_bodies(control: &Control, cursor: &mut Cursor, once: bool) -> Result<Rigid, Error> {
    let bodies = cursor.count("rigid bodies")?;
    let nodes = usize::try_from(control.nodes).unwrap_or(usize::MAX);
    let (mut body_of, mut is_active) = (vec![NO_BODY; nodes], vec![false; nodes]);
    for body in 0..bodies {
        cursor.skip(1, 1, "rigid body")?;
        let number = u32::try_from(body).unwrap_or(NO_BODY);
        for node in node_list(cursor, nodes, "nodes of a rigid body")? {
            if body_of[node as usize] == NO_BODY {
                body_of[node as usize] = number;
            }
        }
        if !once || body + 1 == bodies {
            node_list(cursor, nodes, "active nodes")?.into_iter().for_each(|node| is_active[node as usize] = true);
        }
    }
    if bodies == 0 {
        return Ok(Rigid { complete: true, ..Rigid::default() });
    }
    let complete = body_of.iter().zip(&is_active).all(|(body, active)| (*body == NO_BODY) == *active);
    let active = (0_u32..).zip(&is_active).filter(|(_, active)| **active).map(|(node, _)| node).collect();
    Ok(Rigid { bodies, body_of, active: Some(active), complete })
}

/// Reads a list of nodes, its length first.
fn node_list(cursor: &mut Cursor, nodes: usize, section: &'static str) -> Result<Vec<u32>, Error> {
    let count = cursor.count(section)?;
    let start = cursor.at();
    let most = nodes as i64;
    let numbers = cursor.ints(count, section)?;
    let wrong = |number| cursor.wrong(section, start, format!("node {number}"), format!("1 to {most}"));
    numbers.into_iter().map(|number| index(number, most).ok_or_else(|| wrong(number))).collect()
}

/// Why a family with rigid bodies is refused, if neither marks nor lists confirm any layout.
pub(crate) const UNCHECKED: &str = "in no layout that checks";

/// The refusal of a family whose states leave out rigid nodes in a way that cannot be told, with what speaks against it.
pub(crate) fn uncertain_rigid_bodies(control: &Control, stream: &Stream, why: &str) -> Error {
    let what = format!("rigid bodies left out of the states (NDIM = {}), {why}", control.ndim);
    Error::Unsupported { path: stream.root().to_owned(), what }
}
