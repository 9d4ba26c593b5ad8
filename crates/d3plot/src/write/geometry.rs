//! Everything in front of the states: control block, mesh, user numbers, end mark, titles.

use std::collections::BTreeSet;

use super::control::{EXTRA, encode, needs_extra, text};
use crate::control::Control;
use crate::elements::Geometry;
use crate::geometry::{END_MARK, Reading, sph_words};
use crate::parts::Part;

/// Number of the rigid material model: its shells have no words in the states where the material numbers are written.
const RIGID: u64 = 20;

/// What the states need to know of the geometry that was encoded.
pub(super) struct Encoded {
    pub(super) bytes: Vec<u8>,
    /// Counts of what the state's blocks have rows for.
    pub(super) reading: Reading,
}

/// The parts in internal order: those given, and further ones without a title for elements that name a part beyond.
fn all_parts(geometry: &Geometry, parts: &[Part]) -> Vec<Part> {
    let mut all = parts.to_vec();
    let used = part_indices(geometry).into_iter().flatten().max().map_or(0, |most| most as usize + 1);
    let mut next = parts.iter().map(|part| part.id).max().unwrap_or(0);
    while all.len() < used {
        next += 1;
        all.push(Part::new(next, ""));
    }
    all
}

/// Which parts have solids, beams, shells, SPH particles, thick shells.
fn part_indices(geometry: &Geometry) -> [BTreeSet<u32>; 5] {
    [
        geometry.solids.iter().map(|solid| solid.part).collect(),
        geometry.beams.iter().map(|beam| beam.part).collect(),
        geometry.shells.iter().map(|shell| shell.part).collect(),
        geometry.sph.iter().map(|particle| particle.part).collect(),
        geometry.thick_shells.iter().map(|solid| solid.part).collect(),
    ]
}

/// Checks what would make a file that no one can read.
pub(super) fn check(geometry: &Geometry, parts: &[Part]) -> Result<(), String> {
    let nodes = geometry.coordinates.len();
    if nodes == 0 {
        return Err("no nodes; at least one is needed".to_owned());
    }
    if nodes > i32::MAX as usize {
        return Err(format!("{nodes} nodes; the format counts to {}", i32::MAX));
    }
    let elements = |kind: &str, at: usize, named: &[u32]| match named.iter().find(|&&node| node as usize >= nodes) {
        Some(node) => Err(format!("{kind} {at} (counted from 0) names node {node}, there are {nodes}")),
        None => Ok(()),
    };
    geometry.solids.iter().enumerate().try_for_each(|(at, solid)| elements("solid", at, &solid.nodes))?;
    geometry.thick_shells.iter().enumerate().try_for_each(|(at, solid)| elements("thick shell", at, &solid.nodes))?;
    geometry.beams.iter().enumerate().try_for_each(|(at, beam)| elements("beam", at, &beam.nodes))?;
    geometry.shells.iter().enumerate().try_for_each(|(at, shell)| elements("shell", at, &shell.nodes))?;
    geometry.sph.iter().enumerate().try_for_each(|(at, particle)| elements("particle", at, &[particle.node]))?;
    let most = part_indices(geometry).into_iter().flatten().max().unwrap_or(0);
    // every part has a title in the file
    if most as usize >= parts.len() + 1_000_000 {
        return Err(format!("an element of part {most} (counted from 0), {} parts are given", parts.len()));
    }
    let lists = [
        ("node", geometry.node_ids.len(), nodes),
        ("solid", geometry.solid_ids.len(), geometry.solids.len()),
        ("beam", geometry.beam_ids.len(), geometry.beams.len()),
        ("shell", geometry.shell_ids.len(), geometry.shells.len()),
        ("thick shell", geometry.thick_shell_ids.len(), geometry.thick_shells.len()),
    ];
    match lists.iter().find(|(_, ids, count)| *ids != 0 && ids != count) {
        Some((kind, ids, count)) => Err(format!("{ids} user numbers for {count} {kind}s; all or none")),
        None => Ok(()),
    }
}

/// Encodes control block, geometry and titles. Completes `control` by what the geometry says.
pub(super) fn encode_geometry(
    control: &mut Control,
    geometry: &Geometry,
    parts: &[Part],
    sph_flags: &[i64],
) -> Encoded {
    let parts = all_parts(geometry, parts);
    let rigid: Vec<bool> = match parts.iter().all(|part| part.material.is_some()) && !parts.is_empty() {
        true => geometry.shells.iter().map(|shell| parts[shell.part as usize].material == Some(RIGID)).collect(),
        false => Vec::new(),
    };
    let materials = !rigid.is_empty() || !parts.is_empty() && parts.iter().all(|part| part.material.is_some());
    let ids = user_numbers(geometry);
    control.parts = parts.len() as u64;
    control.parts_of_kind = parts_of_kind(geometry, control.parts);
    control.narbs = 16 + ids.iter().map(|ids| ids.len() as u64).sum::<u64>() + 3 * control.parts;
    let largest = ids.iter().flatten().copied().chain(parts.iter().map(|part| part.id)).max().unwrap_or(0);
    control.wide_numbers = control.words.size() == 4 && largest > u32::MAX.into();
    control.ndim = if materials { 5 } else { 4 };
    control.extra = if needs_extra(control) { EXTRA } else { 0 };

    let mut bytes = Vec::new();
    encode(control, &mut bytes);
    let rigid_shells = rigid.iter().filter(|rigid| **rigid).count() as u64;
    if materials {
        push_all(control, &mut bytes, [rigid_shells as i64, parts.len() as i64]);
        push_all(control, &mut bytes, parts.iter().map(|part| part.material.unwrap_or(0) as i64));
    }
    if control.sph > 0 {
        push_all(control, &mut bytes, sph_flags.iter().copied());
    }
    control.words.push_floats(&mut bytes, geometry.coordinates.iter().flatten().copied());
    push_elements(control, geometry, &mut bytes);
    push_numbers(control, &ids, &parts, &mut bytes);
    let particles = geometry.sph.iter().flat_map(|particle| [particle.node, particle.part]);
    push_all(control, &mut bytes, particles.map(|word| i64::from(word) + 1));
    push_titles(control, &parts, &mut bytes);
    let mut reading = Reading { rigid_shells, sph_words: sph_words(sph_flags), ..Reading::default() };
    reading.geometry.rigid_shells = if rigid_shells > 0 { rigid } else { Vec::new() };
    Encoded { bytes, reading }
}

fn push_all(control: &Control, into: &mut Vec<u8>, values: impl IntoIterator<Item = i64>) {
    values.into_iter().for_each(|value| control.words.push_int(into, value));
}

/// Parts of each kind; together they are all parts, as readers that add them up expect.
fn parts_of_kind(geometry: &Geometry, parts: u64) -> [u64; 5] {
    let mut counts = part_indices(geometry).map(|parts| parts.len() as u64);
    let unused = parts.saturating_sub(counts.iter().sum());
    let kind = counts.iter().position(|count| *count > 0).unwrap_or(2);
    counts[kind] += unused;
    counts
}

fn push_elements(control: &Control, geometry: &Geometry, into: &mut Vec<u8>) {
    let solids = |solids: &[crate::elements::Solid], into: &mut Vec<u8>| {
        let words = solids.iter().flat_map(|solid| solid.nodes.into_iter().chain([solid.part]));
        push_all(control, into, words.map(|word| i64::from(word) + 1));
    };
    solids(&geometry.solids, into);
    solids(&geometry.thick_shells, into);
    for beam in &geometry.beams {
        let [from, to] = beam.nodes.map(|node| i64::from(node) + 1);
        let orientation = beam.orientation.map_or(0, |node| i64::from(node) + 1);
        push_all(control, into, [from, to, orientation, 0, 0, i64::from(beam.part) + 1]);
    }
    let words = geometry.shells.iter().flat_map(|shell| shell.nodes.into_iter().chain([shell.part]));
    push_all(control, into, words.map(|word| i64::from(word) + 1));
}

/// User numbers of nodes, solids, beams, shells, thick shells: 1, 2, 3 … where none are given.
fn user_numbers(geometry: &Geometry) -> [Vec<u64>; 5] {
    let or_counted = |ids: &[u64], count: usize| match ids {
        [] => (1..=count as u64).collect(),
        ids => ids.to_vec(),
    };
    [
        or_counted(&geometry.node_ids, geometry.coordinates.len()),
        or_counted(&geometry.solid_ids, geometry.solids.len()),
        or_counted(&geometry.beam_ids, geometry.beams.len()),
        or_counted(&geometry.shell_ids, geometry.shells.len()),
        or_counted(&geometry.thick_shell_ids, geometry.thick_shells.len()),
    ]
}

/// The numbering section. Readers differ on which of the two lists of part numbers is the one in internal order, so both
/// are; the third gives the places of the sorted numbers.
fn push_numbers(control: &Control, ids: &[Vec<u64>; 5], parts: &[Part], into: &mut Vec<u8>) {
    let words = if control.wide_numbers { control.words.wide() } else { control.words };
    let mut push = |value: u64| words.push_int(into, value as i64);
    // pointers in the solver's memory; the first is negative because lists of parts follow
    push(u64::MAX);
    (0..4).for_each(|_| push(1));
    ids.iter().for_each(|ids| push(ids.len() as u64));
    [1, 1, 1, parts.len() as u64, 0, parts.len() as u64].into_iter().for_each(&mut push);
    ids.iter().flatten().copied().for_each(&mut push);
    parts.iter().for_each(|part| push(part.id));
    parts.iter().for_each(|part| push(part.id));
    let mut places: Vec<usize> = (0..parts.len()).collect();
    places.sort_by_key(|&place| parts[place].id);
    places.iter().for_each(|&place| push(place as u64 + 1));
}

/// End mark, titles of parts and of the run, end mark. A part's number has the word's size, or 8 bytes where it needs them.
fn push_titles(control: &Control, parts: &[Part], into: &mut Vec<u8>) {
    let words = control.words;
    let wide = control.wide_numbers && parts.iter().any(|part| part.id > u32::MAX.into());
    words.push_floats(into, [END_MARK]);
    push_all(control, into, [90001, parts.len() as i64]);
    for part in parts {
        let words = if wide { words.wide() } else { words };
        words.push_int(into, part.id as i64);
        into.extend(text(&part.title_bytes, 72));
    }
    words.push_int(into, 90000);
    into.extend(text(&control.title, 72));
    words.push_floats(into, [END_MARK]);
}
