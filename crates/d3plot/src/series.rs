//! A field over all states: an iterator, one state in memory at a time.

use crate::error::Error;
use crate::family::Family;
use crate::results::Table;
use crate::values::{Access, Layers, Real, Rows};

/// A field of every state, in the order of time; made by [`Family::series`].
#[derive(Debug, Clone)]
pub struct Series<'a> {
    family: &'a Family,
    access: Option<Access>,
    rows: Option<Vec<u32>>,
    layers: Option<Layers>,
    next: usize,
}

/// A field in one state.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct StateValues {
    /// Index of the state, from 0.
    pub state: usize,
    /// Its time.
    pub time: f64,
    /// The values, a row for each node or element asked for.
    pub values: Table,
}

impl Family {
    /// The named field of every state, as [`Family::values`] has it of one.
    ///
    /// ```
    /// use d3plot::{Family, Layers};
    /// # let root = concat!(env!("CARGO_MANIFEST_DIR"), "/testdata/s01_shells_latin1/d3plot");
    ///
    /// let family = Family::open(root.as_ref())?;
    /// // the largest plastic strain in the shells of the second part, state by state
    /// for state in family.series("shell_plastic_strain").of_part(1).layer(Layers::Max) {
    ///     let state = state?;
    ///     let most = state.values.values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    ///     println!("{} {most}", state.time);
    /// }
    /// # Ok::<(), d3plot::Error>(())
    /// ```
    ///
    /// Of a field that the states do not have, nothing comes: [`Family::fields`] lists those that they have.
    pub fn series(&self, field: &str) -> Series<'_> {
        Series { family: self, access: self.access(field), rows: None, layers: None, next: 0 }
    }

    /// Nodes of a part (by its index), from 0, rising: those of all its elements. The orientation nodes of beams are not
    /// among them.
    pub fn nodes_of_part(&self, part: usize) -> Vec<u32> {
        let geometry = self.geometry();
        let mut nodes: Vec<u32> = Vec::new();
        let is = |of: u32| of as usize == part;
        let solids = geometry.solids.iter().chain(&geometry.thick_shells);
        nodes.extend(solids.filter(|solid| is(solid.part)).flat_map(|solid| solid.nodes));
        nodes.extend(geometry.beams.iter().filter(|beam| is(beam.part)).flat_map(|beam| beam.nodes));
        nodes.extend(geometry.shells.iter().filter(|shell| is(shell.part)).flat_map(|shell| shell.nodes));
        nodes.extend(geometry.sph.iter().filter(|particle| is(particle.part)).map(|particle| particle.node));
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Shells of a part (by its index), from 0, rising.
    pub fn shells_of_part(&self, part: usize) -> Vec<u32> {
        places(self.geometry().shells.iter().map(|shell| shell.part), part)
    }

    /// Solids of a part.
    pub fn solids_of_part(&self, part: usize) -> Vec<u32> {
        places(self.geometry().solids.iter().map(|solid| solid.part), part)
    }

    /// Thick shells of a part.
    pub fn thick_shells_of_part(&self, part: usize) -> Vec<u32> {
        places(self.geometry().thick_shells.iter().map(|solid| solid.part), part)
    }

    /// Beams of a part.
    pub fn beams_of_part(&self, part: usize) -> Vec<u32> {
        places(self.geometry().beams.iter().map(|beam| beam.part), part)
    }
}

fn places(parts: impl Iterator<Item = u32>, part: usize) -> Vec<u32> {
    (0_u32..).zip(parts).filter(|(_, of)| *of as usize == part).map(|(place, _)| place).collect()
}

impl Series<'_> {
    /// Only nodes and elements of one part, by its index; all rows of fields that have none, such as `globals`.
    pub fn of_part(mut self, part: usize) -> Self {
        let family = self.family;
        self.rows = match self.access.as_ref().map(Access::table) {
            Some("shell") => Some(family.shells_of_part(part)),
            Some("solid" | "solid_thermal") => Some(family.solids_of_part(part)),
            Some("thick_shell") => Some(family.thick_shells_of_part(part)),
            Some("beam") => Some(family.beams_of_part(part)),
            Some("sph") => Some(places(family.geometry().sph.iter().map(|particle| particle.part), part)),
            Some(table) if is_nodal(table) => Some(family.nodes_of_part(part)),
            _ => None,
        };
        self
    }

    /// Only these rows, from 0.
    pub fn of_rows(mut self, rows: Vec<u32>) -> Self {
        self.rows = Some(rows);
        self
    }

    /// Reduced over the points of an element, each component for itself.
    pub fn layer(mut self, layers: Layers) -> Self {
        self.layers = Some(layers);
        self
    }

    /// Reads the next state into `values`, in place of what it holds, in the precision of the caller's choice: no memory is
    /// allocated from the second state on. Returns its index and the values a row.
    ///
    /// # Errors
    /// As [`Family::values_into`] and [`Family::values_of_layer`].
    pub fn read_next<T: Real>(&mut self, values: &mut Vec<T>) -> Result<Option<(usize, usize)>, Error> {
        values.clear();
        let Some(access) = self.access.as_ref().filter(|_| self.next < self.family.times().len()) else {
            return Ok(None);
        };
        let state = self.next;
        self.next += 1;
        let rows = self.rows.as_deref().map_or(Rows::All, Rows::These);
        self.family.read_rows(state, access, rows, values)?;
        match self.layers {
            Some(layers) => {
                self.family.reduce(access, layers, values)?;
                Ok(Some((state, access.components())))
            }
            None => Ok(Some((state, access.columns()))),
        }
    }
}

impl Iterator for Series<'_> {
    type Item = Result<StateValues, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        let mut values = Vec::new();
        let read = self.read_next(&mut values).transpose()?;
        let state_values = |(state, columns): (usize, usize)| {
            let time = self.family.times()[state];
            StateValues { state, time, values: Table { values, columns } }
        };
        Some(read.map(state_values))
    }
}

/// Whether a table has a row for each node.
fn is_nodal(table: &str) -> bool {
    matches!(
        table,
        "coordinates"
            | "displacement"
            | "temperature"
            | "heat_flux"
            | "mass_scaling"
            | "temperature_rate"
            | "residual_force"
            | "residual_moment"
            | "contact_penetration"
            | "contact_energy"
            | "kinetic_energy"
            | "velocity"
            | "acceleration"
            | "node_deletion"
    )
}
