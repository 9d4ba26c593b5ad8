//! The mesh as it was at the start: coordinates, elements, and the sections around them that tell how long a state is.
//!
//! Sections stand one after the other without a directory, so a wrong length anywhere shifts all that follows.
//! That is why the result is believed only when connectivity stays within the nodes, the numbering repeats the counts
//! of the control block, and an end mark or a plausible time comes next.

use crate::airbags::{Airbags, read_airbags, uncertain_airbags};
use crate::control::Control;
use crate::cursor::Cursor;
use crate::elements::{Beam, Geometry, Particle, Shell, Solid};
use crate::error::Error;
use crate::members::Stream;
use crate::numbering::{Numbers, read_numbers};
use crate::rigid::{Rigid, UNCHECKED, rigid_bodies, uncertain_rigid_bodies};

/// The float that ends the geometry and the states of a member.
pub(crate) const END_MARK: f64 = -999_999.0;

/// The geometry and what its sections say about the states.
#[derive(Debug, Clone, Default)]
pub(crate) struct Reading {
    pub(crate) geometry: Geometry,
    /// Part numbers by internal order.
    pub(crate) part_ids: Option<Vec<u64>>,
    /// Whether the numbering repeats the counts of the control block (or there is none).
    pub(crate) numbers_agree: bool,
    /// Numbers of the material models of the parts; empty where the file does not tell.
    pub(crate) material_types: Vec<i64>,
    /// NUMRBE: shells without words in the states.
    pub(crate) rigid_shells: u64,
    /// Lengths of what an SPH particle has in a state, the length of their list first.
    pub(crate) sph_flags: Vec<i64>,
    /// Words an SPH particle has in a state: one for its part and as many as the flags add up to.
    pub(crate) sph_words: u64,
    pub(crate) airbags: Airbags,
    /// NDIM 8, 9: the nodes, from 0, that the nodal blocks hold.
    pub(crate) active: Option<Vec<u32>>,
    pub(crate) rigid_bodies: u64,
    /// NDIM 8, 9: for each node its body, from 0, or [`NO_BODY`](crate::rigid::NO_BODY).
    pub(crate) body_of: Vec<u32>,
    /// NDIM 8, 9: every node is either in a rigid body or active.
    pub(crate) rigid_and_active_are_all: bool,
    pub(crate) road_surfaces: u64,
    /// Byte of the stream behind the last section.
    pub(crate) end: u64,
    /// Whether the end mark stands there.
    pub(crate) mark: bool,
}

/// What the manual leaves open.
#[derive(Debug, Clone, Copy)]
struct Choice {
    /// NDIM 8, 9: a section of material types.
    materials: bool,
    /// NDIM 8, 9: the list of active nodes stands once, not after each body.
    once: bool,
    /// Words of a 27-node solid and of a 15-node tetrahedron in the extra connectivity.
    words27: u64,
    words15: u64,
    /// Keep the mesh; `false` only looks whether everything fits, without memory for it.
    keep: bool,
}

/// Reads the geometry; where the layout is open, all readings are tried and the one that checks is taken.
pub(crate) fn read_geometry(control: &Control, stream: &Stream) -> Result<Reading, Error> {
    let choices = choices(control);
    if control.rigid_bodies() {
        let choice = the_certain_one(control, stream, &choices)?;
        return read_one(control, stream, choice);
    }
    let [choice] = choices[..] else {
        return read_one(control, stream, first_that_checks(control, stream, &choices));
    };
    let reading = read_one(control, stream, choice)?;
    let checks = reading.numbers_agree && reading.mark;
    if control.airbags > 0 && !checks { Err(uncertain_airbags(stream)) } else { Ok(reading) }
}

/// Every way to read the geometry, the manual's first.
fn choices(control: &Control) -> Vec<Choice> {
    let materials: &[bool] = if control.rigid_bodies() { &[false, true] } else { &[control.material_section()] };
    let once: &[bool] = if control.rigid_bodies() { &[false, true] } else { &[false] };
    let words27: &[u64] = if control.quadratic && control.nel27 > 0 { &[28, 20] } else { &[28] };
    let words15: &[u64] = if control.quadratic && control.nel15t > 0 { &[16, 8] } else { &[16] };
    let mut choices = Vec::new();
    for &materials in materials {
        for &once in once {
            for &words27 in words27 {
                choices.extend(words15.iter().map(|&words15| Choice { materials, once, words27, words15, keep: true }));
            }
        }
    }
    choices
}

/// The first choice whose numbering agrees and that ends in the mark, or simply the first.
fn first_that_checks(control: &Control, stream: &Stream, choices: &[Choice]) -> Choice {
    let checks = |choice: &&Choice| {
        let reading = read_one(control, stream, Choice { keep: false, ..**choice });
        reading.is_ok_and(|reading| reading.numbers_agree && reading.mark)
    };
    *choices.iter().find(checks).unwrap_or(&choices[0])
}

/// NDIM 8, 9: no sample is known, so a reading must check in all respects: numbering, end mark, and every node either
/// in a rigid body or active; and no other reading may do so with other nodes.
fn the_certain_one(control: &Control, stream: &Stream, choices: &[Choice]) -> Result<Choice, Error> {
    let (mut certain, mut first_error): (Option<(Choice, Reading)>, _) = (None, None);
    let mut read = 0;
    for &choice in choices {
        let reading = match read_one(control, stream, Choice { keep: false, ..choice }) {
            Ok(reading) => reading,
            Err(error) => {
                first_error = first_error.or(Some(error));
                continue;
            }
        };
        read += 1;
        if !(reading.numbers_agree && reading.mark && reading.rigid_and_active_are_all) {
            continue;
        }
        let same = |other: &Reading| (&other.active, other.rigid_shells) == (&reading.active, reading.rigid_shells);
        if certain.as_ref().is_some_and(|(_, other)| !same(other)) {
            return Err(uncertain_rigid_bodies(control, stream, UNCHECKED));
        }
        certain = certain.or(Some((choice, reading)));
    }
    match (certain, first_error) {
        (Some((choice, _)), _) => Ok(choice),
        (None, Some(error)) if read == 0 => Err(error),
        (None, _) => Err(uncertain_rigid_bodies(control, stream, UNCHECKED)),
    }
}

/// Reads one of the possible layouts. Whatever goes wrong after the root's end was passed means that the root is cut.
fn read_one(control: &Control, stream: &Stream, choice: Choice) -> Result<Reading, Error> {
    let start = (64 + control.extra) * control.words.size();
    let mut cursor = Cursor::new(stream, control.words, start, stream.run_on_limit(0, control.words.size()));
    let result = read_sections(control, stream, choice, &mut cursor);
    match (result, cursor.crossed()) {
        (Err(error @ (Error::Io { .. } | Error::Changed { .. })), _) => Err(error),
        (Err(_), Some(section)) => Err(cursor.cut_in_root(section)),
        (Ok(reading), Some(section)) if !reading.mark => Err(cursor.cut_in_root(section)),
        (result, _) => result,
    }
}

fn read_sections(control: &Control, stream: &Stream, choice: Choice, cursor: &mut Cursor) -> Result<Reading, Error> {
    if control.quadratic || control.cubic {
        let parts = cursor.count("higher-order parts")?;
        cursor.skip(parts, 9, "higher-order parts")?;
    }
    let (mut rigid_shells, mut types) = (0, Vec::new());
    if choice.materials {
        rigid_shells = cursor.count("material types")?.min(control.shells);
        let count = cursor.count("material types")?;
        types = cursor.ints(count, "material types")?;
    }
    cursor.skip(control.fluid_parts, 1, "fluid parts")?;
    let sph_flags = if control.sph > 0 { sph_flags(cursor)? } else { Vec::new() };
    let airbags = read_airbags(control, cursor)?;

    let keep = choice.keep;
    let mut geometry = Geometry { coordinates: coordinates(control, cursor, keep)?, ..Geometry::default() };
    geometry.solids = elements(control, cursor, control.solids, "solids", solid, keep)?;
    geometry.thick_shells = elements(control, cursor, control.thick_shells, "thick shells", solid, keep)?;
    geometry.beams = elements(control, cursor, control.beams, "beams", beam, keep)?;
    geometry.shells = elements(control, cursor, control.shells, "shells", shell, keep)?;
    let Numbers { agree, nodes, solids, beams, shells, thick_shells, parts } = read_numbers(control, cursor, keep)?;
    geometry.node_ids = nodes;
    geometry.solid_ids = solids;
    geometry.beam_ids = beams;
    geometry.shell_ids = shells;
    geometry.thick_shell_ids = thick_shells;
    if rigid_shells > 0 {
        let rigid = |shell: &Shell| types.get(shell.part as usize) == Some(&20);
        geometry.rigid_shells = geometry.shells.iter().map(rigid).collect();
    }

    let rigid = if control.rigid_bodies() { rigid_bodies(control, cursor, choice.once)? } else { Rigid::default() };
    cursor.skip(control.adapted, 2, "parents of adapted elements")?;
    geometry.sph = elements(control, cursor, control.sph, "SPH particles", particle, keep)?;
    airbags.skip_geometry(control, cursor)?;
    let road_surfaces = if control.road() { road(cursor)? } else { 0 };
    extra_connectivity(control, cursor, choice)?;

    let end = cursor.at();
    let mark = cursor.left() >= control.words.size()
        && control.words.floats(&stream.read(end, control.words.size())?).next() == Some(END_MARK);
    Ok(Reading {
        geometry,
        part_ids: parts,
        numbers_agree: agree,
        material_types: types,
        rigid_shells,
        sph_words: sph_words(&sph_flags),
        sph_flags,
        airbags,
        active: rigid.active,
        rigid_bodies: rigid.bodies,
        body_of: rigid.body_of,
        rigid_and_active_are_all: rigid.complete,
        road_surfaces,
        end,
        mark,
    })
}

/// The list of flags of SPH particles. The first is the length of the list, 10 or 11 by the manuals.
fn sph_flags(cursor: &mut Cursor) -> Result<Vec<i64>, Error> {
    let start = cursor.at();
    let length = cursor.count("SPH flags")?;
    if !(1..=64).contains(&length) {
        return Err(cursor.wrong("SPH flags", start, format!("a list of {length} flags"), "10 or 11 flags".to_owned()));
    }
    let mut flags = vec![length as i64];
    flags.extend(cursor.ints(length - 1, "SPH flags")?);
    let words = sph_words(&flags);
    if words > 1000 {
        return Err(cursor.wrong("SPH flags", start, format!("{words} words a particle"), "at most 1000".to_owned()));
    }
    Ok(flags)
}

/// One word for the part of a particle and as many as the flags behind the first add up to.
pub(crate) fn sph_words(flags: &[i64]) -> u64 {
    match flags {
        [] => 0,
        [_, lengths @ ..] => lengths.iter().fold(1_u64, |sum, flag| sum.saturating_add(flag.unsigned_abs())),
    }
}

fn coordinates(control: &Control, cursor: &mut Cursor, keep: bool) -> Result<Vec<[f64; 3]>, Error> {
    let dimensions = control.dimensions();
    let section = cursor.skip(control.nodes, dimensions, "node coordinates")?;
    if !keep {
        return Ok(Vec::new());
    }
    let row = dimensions * control.words.size();
    let mut points = Vec::with_capacity((section.bytes / row) as usize);
    cursor.pieces(section, row, |bytes| {
        points.extend(bytes.chunks_exact(row as usize).map(|node| {
            let mut point = [0.0; 3];
            for (coordinate, value) in point.iter_mut().zip(control.words.floats(node)) {
                *coordinate = value;
            }
            point
        }));
    })?;
    Ok(points)
}

/// How the words of one element become an element; `None` if a node or the part is out of range.
type Decode<T, const W: usize> = fn(&[i64; W], nodes: i64) -> Option<T>;

fn elements<T, const W: usize>(
    control: &Control,
    cursor: &mut Cursor,
    count: u64,
    section: &'static str,
    decode: Decode<T, W>,
    keep: bool,
) -> Result<Vec<T>, Error> {
    let start = cursor.at();
    let passed = cursor.skip(count, W as u64, section)?;
    let nodes = i64::try_from(control.nodes).unwrap_or(i64::MAX);
    let row = W as u64 * control.words.size();
    let mut elements = Vec::with_capacity(if keep { (passed.bytes / row) as usize } else { 0 });
    let (mut index, mut wrong) = (0, None);
    cursor.pieces(passed, row, |bytes| {
        let mut words = [0; W];
        for element in bytes.chunks_exact(row as usize) {
            for (word, value) in words.iter_mut().zip(control.words.ints(element)) {
                *word = value;
            }
            match decode(&words, nodes) {
                Some(element) if keep => elements.push(element),
                Some(_) => {}
                None => wrong = wrong.or(Some((index, words))),
            }
            index += 1;
        }
    })?;
    let Some((index, words)): Option<(usize, [i64; W])> = wrong else {
        return Ok(elements);
    };
    let found = format!("{words:?} for element {index} (counted from 0)");
    let expected = format!("nodes from 1 to {nodes} and a part from 1 on");
    Err(cursor.wrong(section, start, found, expected))
}

/// A number that counts from 1 to `most` as an index from 0.
pub(crate) fn index(number: i64, most: i64) -> Option<u32> {
    (1..=most).contains(&number).then(|| u32::try_from(number - 1).ok())?
}

fn solid(words: &[i64; 9], most: i64) -> Option<Solid> {
    let mut nodes = [0; 8];
    for (node, &word) in nodes.iter_mut().zip(words) {
        *node = index(word, most)?;
    }
    Some(Solid { nodes, part: index(words[8], i64::MAX)? })
}

fn shell(words: &[i64; 5], most: i64) -> Option<Shell> {
    let mut nodes = [0; 4];
    for (node, &word) in nodes.iter_mut().zip(words) {
        *node = index(word, most)?;
    }
    Some(Shell { nodes, part: index(words[4], i64::MAX)? })
}

fn beam(words: &[i64; 6], most: i64) -> Option<Beam> {
    // the third node may be 0, or beyond 10⁹ for a spot weld: not a node then
    let orientation = index(words[2], most);
    let nodes = [index(words[0], most)?, index(words[1], most)?];
    Some(Beam { nodes, orientation, part: index(words[5], i64::MAX)? })
}

fn particle(words: &[i64; 2], most: i64) -> Option<Particle> {
    Some(Particle { node: index(words[0], most)?, part: index(words[1], i64::MAX)? })
}

/// The road surface section; returns the number of surfaces.
fn road(cursor: &mut Cursor) -> Result<u64, Error> {
    let nodes = cursor.count("road surface")?;
    cursor.skip(1, 1, "road surface")?;
    let surfaces = cursor.count("road surface")?;
    cursor.skip(1, 1, "road surface")?;
    cursor.skip(nodes, 4, "road surface nodes")?;
    for _ in 0..surfaces {
        cursor.skip(1, 1, "road surface segments")?;
        let segments = cursor.count("road surface segments")?;
        cursor.skip(segments, 4, "road surface segments")?;
    }
    Ok(surfaces)
}

/// Further nodes of elements with more of them. They are passed over: the corners are what the mesh needs.
fn extra_connectivity(control: &Control, cursor: &mut Cursor, choice: Choice) -> Result<(), Error> {
    if control.ten_node_solids {
        cursor.skip(control.solids, 2, "nodes of 10-node tetrahedra")?;
    }
    cursor.skip(control.nel48, 5, "nodes of 8-node shells")?;
    cursor.skip(control.nel20, 13, "nodes of 20-node solids")?;
    if control.quadratic {
        cursor.skip(control.nel27, choice.words27, "nodes of 27-node solids")?;
        cursor.skip(control.nel21p, 22, "nodes of 21-node wedges")?;
        cursor.skip(control.nel15t, choice.words15, "nodes of 15-node tetrahedra")?;
    }
    if control.cubic {
        cursor.skip(control.nel20t, 21, "nodes of 20-node tetrahedra")?;
        cursor.skip(control.nel40p, 41, "nodes of 40-node wedges")?;
        cursor.skip(control.nel64, 65, "nodes of 64-node solids")?;
    }
    Ok(())
}
