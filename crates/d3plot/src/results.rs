//! What a state holds, read when it is asked for: positions, velocities, temperatures, deletion, any table.
//! Plastic strain has a room of its own.

use crate::error::Error;
use crate::family::Family;

/// A table of a state: row after row.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Table {
    /// Rows × columns values, row-major.
    pub values: Vec<f64>,
    /// Values a row.
    pub columns: usize,
}

impl Table {
    /// The rows one after the other, each of `columns` values.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = &[f64]> {
        self.values.chunks_exact(self.columns.max(1))
    }
}

/// Which elements were deleted (failed) up to a state; true = deleted. Each list is as long as that kind of element
/// in the geometry, rigid shells included.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Deletion {
    /// One flag a solid.
    pub solids: Vec<bool>,
    /// One flag a thick shell.
    pub thick_shells: Vec<bool>,
    /// One flag a shell.
    pub shells: Vec<bool>,
    /// One flag a beam.
    pub beams: Vec<bool>,
    /// One flag a node where the file keeps the table by nodes (MDLOPT 1; an element is deleted when all its nodes
    /// are), else empty.
    pub nodes: Vec<bool>,
}

impl Family {
    /// Positions of the nodes in a state, N × 3 in the model's length unit: always positions, also where the file holds
    /// displacements. `None` if the states have neither (IU = 0). Nodes of rigid bodies that the states leave
    /// out (NDIM 8, 9) are where the motion of their body puts them.
    ///
    /// # Errors
    /// [`Error::NoSuchState`], [`Error::Changed`], [`Error::Io`]: as every read of a state.
    pub fn coordinates(&self, state: usize) -> Result<Option<Vec<[f64; 3]>>, Error> {
        self.vectors(state, "coordinates")
    }

    /// Velocities of the nodes, N × 3 in length per time of the file's units; `None` if the states have none.
    ///
    /// # Errors
    /// As [`Family::coordinates`].
    pub fn velocity(&self, state: usize) -> Result<Option<Vec<[f64; 3]>>, Error> {
        self.vectors(state, "velocity")
    }

    /// Accelerations of the nodes, N × 3 in length per time² of the file's units; `None` if the states have none.
    ///
    /// # Errors
    /// As [`Family::coordinates`].
    pub fn acceleration(&self, state: usize) -> Result<Option<Vec<[f64; 3]>>, Error> {
        self.vectors(state, "acceleration")
    }

    /// Temperatures of the nodes, N values in the file's unit; `None` if the states have none. Where a node has three
    /// temperatures (IT = 3), the first; [`Family::table`] has them all.
    ///
    /// # Errors
    /// As [`Family::coordinates`].
    pub fn temperature(&self, state: usize) -> Result<Option<Vec<f64>>, Error> {
        let table = self.table(state, "temperature")?;
        Ok(table.map(|table| table.rows().map(|row| row[0]).collect()))
    }

    /// A table of a state as it is in the file: rows × columns, every word. For what has no name of its own; other fields
    /// are to be had by [`Family::values`]. `None` if the states have no table of that name. Rigid shells have no row in
    /// `shell`, nodes of rigid bodies none in `coordinates` where the states leave them out.
    ///
    /// # Errors
    /// As [`Family::coordinates`].
    pub fn table(&self, state: usize, field: &str) -> Result<Option<Table>, Error> {
        let start = self.start(state)?;
        let Some(field) = self.layout.field(field) else {
            return Ok(None);
        };
        let words = self.control.words;
        let row = field.columns * words.size();
        let mut values = Vec::with_capacity((field.rows * field.columns) as usize);
        self.stream.pieces(start + field.offset * words.size(), field.rows * row, row, |bytes| {
            values.extend(words.floats(bytes));
        })?;
        Ok(Some(Table { values, columns: field.columns as usize }))
    }

    /// Which elements are deleted in a state; `None` if the states hold no deletion table.
    ///
    /// # Errors
    /// As [`Family::coordinates`].
    pub fn deletion(&self, state: usize) -> Result<Option<Deletion>, Error> {
        if let Some(table) = self.table(state, "node_deletion")? {
            return Ok(Some(self.deletion_by_nodes(&table.values)));
        }
        let Some(table) = self.table(state, "element_deletion")? else {
            return Ok(None);
        };
        let geometry = self.geometry();
        let mut deleted = table.values.iter().map(|&word| word == 0.0);
        // this table has an order of its own: solids, thick shells, shells, beams
        let solids = deleted.by_ref().take(geometry.solids.len()).collect();
        let thick_shells = deleted.by_ref().take(geometry.thick_shells.len()).collect();
        let full = table.values.len() as u64
            == self.control.solids + self.control.thick_shells + self.control.shells + self.control.beams;
        let shells = match full {
            true => deleted.by_ref().take(geometry.shells.len()).collect(),
            // rigid shells are never deleted
            false => self.rigid_shells().map(|rigid| !rigid && deleted.next() == Some(true)).collect(),
        };
        Ok(Some(Deletion { solids, thick_shells, shells, beams: deleted.collect(), nodes: Vec::new() }))
    }

    /// Which shells are deleted in a state, one flag each; `None` if the states hold no deletion table.
    ///
    /// # Errors
    /// As [`Family::coordinates`].
    pub fn deleted_shells(&self, state: usize) -> Result<Option<Vec<bool>>, Error> {
        Ok(self.deletion(state)?.map(|deletion| deletion.shells))
    }

    pub(crate) fn start(&self, state: usize) -> Result<u64, Error> {
        self.starts.get(state).copied().ok_or_else(|| Error::NoSuchState {
            path: self.root().to_owned(),
            state,
            states: self.starts.len(),
        })
    }

    /// A field of vectors; plane models have no z.
    fn vectors(&self, state: usize, field: &str) -> Result<Option<Vec<[f64; 3]>>, Error> {
        let Some(table) = self.values(state, field)? else { return Ok(None) };
        Ok(Some(match table.columns {
            3 => table.values.as_chunks().0.to_vec(),
            _ => table.rows().map(|row| [row[0], row.get(1).copied().unwrap_or(0.0), 0.0]).collect(),
        }))
    }

    /// One flag a shell: without words in the states.
    pub(crate) fn rigid_shells(&self) -> impl Iterator<Item = bool> + '_ {
        let rigid = &self.geometry().rigid_shells;
        let known = self.layout.rigid_shells > 0;
        (0..self.geometry().shells.len()).map(move |shell| known && rigid.get(shell) == Some(&true))
    }

    fn deletion_by_nodes(&self, words: &[f64]) -> Deletion {
        let nodes: Vec<bool> = words.iter().map(|&word| word == 0.0).collect();
        let all = |element: &[u32]| element.iter().all(|&node| nodes.get(node as usize) == Some(&true));
        let geometry = self.geometry();
        Deletion {
            solids: geometry.solids.iter().map(|solid| all(&solid.nodes)).collect(),
            thick_shells: geometry.thick_shells.iter().map(|solid| all(&solid.nodes)).collect(),
            shells: geometry.shells.iter().map(|shell| all(&shell.nodes)).collect(),
            beams: geometry.beams.iter().map(|beam| all(&beam.nodes)).collect(),
            nodes,
        }
    }
}
