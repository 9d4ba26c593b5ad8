//! A family written again: in another precision, byte order or size of its files, or made regular.

use std::path::Path;

use super::{Content, Positions, Thermal, WordsEach, WriteOptions, Writer};
use crate::error::Error;
use crate::family::Family;
use crate::motion::{Motion, leaves_out_rigid_nodes};
use crate::parts::Part;

/// What a copy keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Keep {
    /// What other programs read rightly. Positions are written as such, never as displacements; rigid shells have words
    /// (zeros) and the parts no material numbers; one temperature a node, no heat flux, mass scaling, rates, residual
    /// forces, contact words, thermal words of solids, histories of beams, nor tensors of plastic and thermal strain: of
    /// each there is a reader that loses its way there (lasso-python 2.0.4, VTK 9.7).
    #[default]
    WidelyRead,
    /// Every table that a written family can hold.
    Everything,
}

/// What [`Family::copy`] wrote.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Copied {
    /// Whole states.
    pub states: usize,
    /// What was left out: tables of the states, and parts of them.
    pub left_out: Vec<&'static str>,
}

impl Content {
    /// What of this other programs read rightly: see [`Keep::WidelyRead`].
    fn widely_read(self) -> Content {
        let tensors = 18 * usize::from(self.plastic_strain_tensor) + 6 * usize::from(self.thermal_strain);
        let words = WordsEach {
            shell: self.words.shell.saturating_sub(tensors),
            beam: if self.beam_histories > 0 { 0 } else { self.words.beam },
            ..self.words
        };
        Content {
            positions: if self.positions == Positions::None { Positions::None } else { Positions::Coordinates },
            thermal: if self.thermal == Thermal::None { Thermal::None } else { Thermal::Temperature },
            mass_scaling: false,
            temperature_rate: false,
            residual_forces: false,
            contact_penetration: 0,
            contact_energy: false,
            kinetic_energy: false,
            solid_thermal: 0,
            beam_histories: 0,
            plastic_strain_tensor: false,
            thermal_strain: false,
            words,
            ..self
        }
    }
}

impl Family {
    /// Writes the whole states of this family as a new one with the root `root`. The words of a table are kept, rounded to
    /// the words of the new family; nodes of rigid bodies that the states leave out get their rows; 10-node tetrahedra and
    /// their like keep their corners. `watch` hears of every state written, and stops the copy by `false`; what is written
    /// so far is a whole family.
    ///
    /// # Errors
    /// As [`Family::coordinates`] and [`Writer::create`].
    pub fn copy(
        &self,
        root: &Path,
        keep: Keep,
        options: &WriteOptions,
        mut watch: impl FnMut(usize) -> bool,
    ) -> Result<Copied, Error> {
        let mut content = Content::of(self);
        let mut parts = self.parts().to_vec();
        let mut left_out = Vec::new();
        if keep == Keep::WidelyRead {
            content = content.widely_read();
            if parts.iter().any(|part| part.material.is_some()) {
                left_out.push("material numbers of parts");
            }
            parts = parts.into_iter().map(|part| Part { material: None, ..part }).collect();
        }
        let mut writer = Writer::create(root, self.geometry(), &parts, &content, options)?;
        let mut kept = Vec::new();
        for field in self.layout.fields.iter().filter(|field| field.name != "time") {
            let as_positions = field.name == "displacement" && content.positions == Positions::Coordinates;
            let name = if as_positions { "coordinates" } else { field.name };
            match writer.columns(name) {
                Some(columns) => {
                    kept.push((name, columns));
                    left_out.extend((columns < field.columns as usize).then(|| further_words(name)));
                }
                None => left_out.push(field.name),
            }
        }
        for (index, &time) in self.times().iter().enumerate() {
            let mut state = writer.state(time);
            for &(name, columns) in &kept {
                if let Some(values) = self.rows_to_write(index, name, columns)? {
                    state.set(name, &values)?;
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

    /// A table with a row for everything the geometry has, the first `columns` words of each.
    fn rows_to_write(&self, state: usize, name: &str, columns: usize) -> Result<Option<Vec<f64>>, Error> {
        let rigid_shells = name == "shell" && self.layout.rigid_shells > 0;
        let as_positions = self.layout.field(name).is_none();
        let rebuilt = self.motion.is_some() && leaves_out_rigid_nodes(name);
        let whole = rebuilt || as_positions || rigid_shells;
        let Some(mut table) = (if whole { self.values(state, name)? } else { self.table(state, name)? }) else {
            return Ok(None);
        };
        if rigid_shells {
            let rows = table.values.chunks_exact_mut(table.columns.max(1)).zip(self.rigid_shells());
            rows.filter(|(_, rigid)| *rigid).for_each(|(row, _)| row.fill(0.0));
        }
        Ok(Some(match table.columns > columns {
            true => table.rows().flat_map(|row| &row[..columns]).copied().collect(),
            false => table.values,
        }))
    }

    /// Whether a table has no rows for nodes of rigid bodies and these cannot be rebuilt.
    pub(super) fn is_torn(&self, table: &str) -> bool {
        let rates = self.motion.as_ref().is_none_or(Motion::has_rates);
        !rates && matches!(table, "velocity" | "acceleration")
    }
}

/// What a table loses with the words behind those that are kept.
fn further_words(table: &str) -> &'static str {
    match table {
        "temperature" => "further temperatures",
        "beam" => "histories of beams",
        _ => "tensors of plastic and thermal strain",
    }
}
