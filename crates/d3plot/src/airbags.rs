//! Airbags of particles: three sections that are passed over, and how long their blocks in a state are.
//!
//! No real file was at hand, so a family with airbags is believed only if its end marks confirm what is read here.

use crate::control::Control;
use crate::cursor::Cursor;
use crate::error::Error;
use crate::members::Stream;

/// Lengths of what particles have in the geometry and in a state.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Airbags {
    /// Words a bag in the geometry.
    words_in_geometry: u64,
    /// Words a bag in a state.
    pub(crate) words_in_state: u64,
    pub(crate) particles: u64,
    /// Words a particle in a state.
    pub(crate) words_of_particle: u64,
}

/// Reads the section in front of the coordinates: five counts at most, then type and name (8 words) of every variable.
pub(crate) fn read_airbags(control: &Control, cursor: &mut Cursor) -> Result<Airbags, Error> {
    if control.airbags == 0 {
        return Ok(Airbags::default());
    }
    let airbags = Airbags {
        words_in_geometry: cursor.count("airbags")?,
        words_of_particle: cursor.count("airbags")?,
        particles: cursor.count("airbags")?,
        words_in_state: cursor.count("airbags")?,
    };
    if control.airbag_version == 4 {
        cursor.skip(1, 1, "airbags")?;
    }
    let variables =
        airbags.words_in_geometry.saturating_add(airbags.words_of_particle).saturating_add(airbags.words_in_state);
    cursor.skip(variables, 9, "airbag variables")?;
    Ok(airbags)
}

impl Airbags {
    /// Passes over the section behind the SPH particles.
    pub(crate) fn skip_geometry(self, control: &Control, cursor: &mut Cursor) -> Result<(), Error> {
        cursor.skip(control.airbags, self.words_in_geometry, "airbag geometry").map(drop)
    }
}

/// The refusal of a family whose airbags cannot be told.
pub(crate) fn uncertain_airbags(stream: &Stream) -> Error {
    let what = "airbag particles (NPEFG), in no layout that checks".to_owned();
    Error::Unsupported { path: stream.root().to_owned(), what }
}
