//! A family written again: in another precision, byte order or size of its files, or made regular.

use std::path::Path;

use super::{Content, WriteOptions, Writer};
use crate::error::Error;
use crate::family::Family;
use crate::motion::{Motion, leaves_out_rigid_nodes};

/// What [`Family::copy`] wrote.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Copied {
    /// Whole states.
    pub states: usize,
    /// Tables of the states that were left out: a written family cannot hold them.
    pub left_out: Vec<&'static str>,
}

/// Tables whose sections of the geometry are passed over in reading, so that they cannot be written again.
const LEFT_OUT: [&str; 4] = ["airbag", "airbag_particle", "road", "rigid_motion"];

impl Family {
    /// Writes the whole states of this family as a new one with the root `root`. Every word of a table is kept, rounded to
    /// the words of the new family; nodes of rigid bodies that the states leave out get their rows; 10-node tetrahedra and their like keep their corners. `watch` hears of every state
    /// written, and stops the copy by `false`; what is written so far is a whole family.
    ///
    /// # Errors
    /// As [`Family::coordinates`] and [`Writer::create`].
    pub fn copy(
        &self,
        root: &Path,
        options: &WriteOptions,
        mut watch: impl FnMut(usize) -> bool,
    ) -> Result<Copied, Error> {
        let tables = self.layout.fields.iter().map(|field| field.name);
        let (left_out, kept): (Vec<_>, Vec<_>) =
            tables.filter(|name| *name != "time").partition(|name| LEFT_OUT.contains(name) || self.is_torn(name));
        let mut writer = Writer::create(root, self.geometry(), self.parts(), &Content::of(self), options)?;
        for (index, &time) in self.times().iter().enumerate() {
            let mut state = writer.state(time);
            for name in &kept {
                // rows for the nodes of rigid bodies, too, where the table has none
                let rebuilt = self.motion.is_some() && leaves_out_rigid_nodes(name);
                let table = if rebuilt { self.values(index, name)? } else { self.table(index, name)? };
                if let Some(table) = table {
                    state.set(name, &table.values)?;
                }
            }
            state.write()?;
            if !watch(index + 1) {
                break;
            }
        }
        let states = writer.states();
        writer.finish()?;
        Ok(Copied { states, left_out })
    }

    /// Whether a table has no rows for nodes of rigid bodies and these cannot be rebuilt.
    pub(super) fn is_torn(&self, table: &str) -> bool {
        let rates = self.motion.as_ref().is_none_or(Motion::has_rates);
        !rates && matches!(table, "velocity" | "acceleration")
    }
}
