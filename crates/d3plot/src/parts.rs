//! Parts: number and title out of three sections of the file, and how many elements each has.

use std::collections::{BTreeSet, HashMap};

use crate::control::Control;
use crate::elements::Geometry;
use crate::error::Error;
use crate::geometry::Reading;
use crate::members::Stream;
use crate::titles::Titles;
use crate::warning::Warning;
use crate::words::{decode_text, trim_end};

/// A part of the model.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct Part {
    /// Its number in the deck; its place, from 1, where the file has no numbers.
    pub id: u64,
    /// Its title: UTF-8 if it is valid, else read as Latin-1; without blanks at both ends. Often empty.
    pub title: String,
    /// The title as it is in the file, in whatever encoding the pre-processor used, without blanks at its end.
    pub title_bytes: Vec<u8>,
    /// Number of its material model in the solver (20 is rigid), where the file tells: only files that leave the results
    /// of rigid shells out do (NDIM 5, 7).
    pub material: Option<u64>,
    /// Solids in it.
    pub solids: usize,
    /// Thick shells in it.
    pub thick_shells: usize,
    /// Beams in it.
    pub beams: usize,
    /// Shells in it.
    pub shells: usize,
    /// SPH particles in it.
    pub sph: usize,
}

impl Part {
    /// A part for a family that is to be written: its number in the deck and its title, of which the file keeps 72 bytes.
    pub fn new(id: u64, title: &str) -> Part {
        Part { id, title: title.to_owned(), title_bytes: title.as_bytes().to_vec(), ..Part::default() }
    }

    /// Whether any element belongs to it. Nodal rigid bodies and parts left out of the output do not have any.
    pub fn is_used(&self) -> bool {
        self.solids + self.thick_shells + self.beams + self.shells + self.sph > 0
    }
}

/// Puts the parts together, in internal order: elements name them by place. Parts beyond the count of the control
/// block are added at the end, and the elements' indices moved there.
pub(crate) fn assemble(
    control: &Control,
    reading: &mut Reading,
    titles: &Titles,
    stream: &Stream,
    warnings: &mut Vec<Warning>,
) -> Result<Vec<Part>, Error> {
    let counted = control.parts as usize;
    let added = add_missing(&mut reading.geometry, counted, warnings);
    if (counted + added) as u64 > control.most_parts {
        return Err(Error::Geometry {
            path: stream.root().to_owned(),
            section: "parts of the elements",
            offset: 0,
            found: format!("{added} parts beyond the {counted} of the control block"),
            expected: format!("at most {}, for files of this size,", control.most_parts),
        });
    }
    let ids = reading.part_ids.as_deref().unwrap_or_default();
    let most = part_indices(&mut reading.geometry).map(|part| *part as usize + 1).max().unwrap_or(0);
    let mut parts: Vec<Part> = (0..counted.max(most))
        .map(|index| Part { id: ids.get(index).copied().unwrap_or(index as u64 + 1), ..Part::default() })
        .collect();

    let by_id: HashMap<u64, &[u8]> = titles.parts.iter().map(|(id, title)| (*id, title.as_slice())).collect();
    // some writers give the titles numbers of their own: then their order is all there is
    let by_place = !parts.iter().any(|part| by_id.contains_key(&part.id)) && titles.parts.len() == parts.len();
    for (index, part) in parts.iter_mut().enumerate() {
        let title = if by_place { Some(titles.parts[index].1.as_slice()) } else { by_id.get(&part.id).copied() };
        part.title_bytes = trim_end(title.unwrap_or_default()).to_vec();
        part.title = decode_text(&part.title_bytes);
        part.material = reading.material_types.get(index).and_then(|&number| u64::try_from(number).ok());
    }

    let geometry = &reading.geometry;
    geometry.solids.iter().for_each(|solid| parts[solid.part as usize].solids += 1);
    geometry.thick_shells.iter().for_each(|solid| parts[solid.part as usize].thick_shells += 1);
    geometry.beams.iter().for_each(|beam| parts[beam.part as usize].beams += 1);
    geometry.shells.iter().for_each(|shell| parts[shell.part as usize].shells += 1);
    geometry.sph.iter().for_each(|particle| parts[particle.part as usize].sph += 1);
    Ok(parts)
}

/// A part number is a word of the file and may be anything up to 2³²: the numbers beyond the count become the next
/// free places, so that no list is as long as such a number.
fn add_missing(geometry: &mut Geometry, counted: usize, warnings: &mut Vec<Warning>) -> usize {
    let beyond: BTreeSet<u32> =
        part_indices(geometry).map(|part| *part).filter(|&part| part as usize >= counted).collect();
    if beyond.is_empty() {
        return 0;
    }
    let places: HashMap<u32, u32> = beyond.iter().copied().zip(counted as u32..).collect();
    for part in part_indices(geometry) {
        if let Some(&place) = places.get(part) {
            *part = place;
        }
    }
    warnings.push(Warning::PartsBeyondCount { count: beyond.len() });
    beyond.len()
}

/// The part of every element of every kind.
fn part_indices(geometry: &mut Geometry) -> impl Iterator<Item = &mut u32> {
    let solids = geometry.solids.iter_mut().map(|solid| &mut solid.part);
    let thick_shells = geometry.thick_shells.iter_mut().map(|solid| &mut solid.part);
    let beams = geometry.beams.iter_mut().map(|beam| &mut beam.part);
    let shells = geometry.shells.iter_mut().map(|shell| &mut shell.part);
    let sph = geometry.sph.iter_mut().map(|particle| &mut particle.part);
    solids.chain(thick_shells).chain(beams).chain(shells).chain(sph)
}
