//! One state on its way to the file: filled table by table, then written in one piece.

use super::Writer;
use crate::error::Error;
use crate::quantity::Quantity;
use crate::results::Deletion;
use crate::state::Field;

/// A state that is being filled. Nothing of it is in the file before [`StateWriter::write`].
#[derive(Debug)]
pub struct StateWriter<'a> {
    writer: &'a mut Writer,
    bytes: Vec<u8>,
}

impl<'a> StateWriter<'a> {
    pub(super) fn new(writer: &'a mut Writer, time: f64) -> StateWriter<'a> {
        let mut bytes = writer.blank.clone();
        writer.control.words.put_float(&mut bytes, time);
        StateWriter { writer, bytes }
    }

    /// Positions of the nodes, N × 3. Where the content says displacements, these are what is stored.
    ///
    /// # Errors
    /// [`Error::Content`] for another number of nodes, or if the states hold no positions.
    pub fn coordinates(&mut self, positions: &[[f64; 3]]) -> Result<&mut Self, Error> {
        if self.writer.layout.field("displacement").is_none() {
            return self.set("coordinates", positions.as_flattened());
        }
        let starts = &self.writer.start;
        let moved = |(to, from): (&[f64; 3], &[f64; 3])| [to[0] - from[0], to[1] - from[1], to[2] - from[2]];
        let displacements: Vec<[f64; 3]> = positions.iter().zip(starts).map(moved).collect();
        match positions.len() == starts.len() {
            true => self.set("displacement", displacements.as_flattened()),
            false => Err(self.count("coordinates", 3 * positions.len(), 3 * starts.len())),
        }
    }

    /// A table or a quantity of elements by its name (see [`Field`] and [`Family::fields`](crate::Family::fields)): all
    /// rows one after the other. A quantity of shells has a row for each shell; those of rigid shells without words are
    /// passed over. Of a table `shell` they may be there or not.
    ///
    /// # Errors
    /// [`Error::Content`] if the states hold no such thing, or another number of values.
    pub fn set(&mut self, name: &str, values: &[f64]) -> Result<&mut Self, Error> {
        if let Some(field) = self.writer.layout.field(name).cloned() {
            let whole = Quantity { table: "", name: "", points: 1, each: 0, at: 0, width: field.columns as usize };
            return self.fill(&field, &whole, name, values);
        }
        let quantity = self.writer.quantities.iter().find(|quantity| quantity.name == name).copied();
        let field = quantity.and_then(|quantity| self.writer.layout.field(quantity.table).cloned());
        match (quantity, field) {
            (Some(quantity), Some(field)) => self.fill(&field, &quantity, name, values),
            _ => Err(Error::Content {
                path: self.writer.members.path().to_owned(),
                what: format!("the states of this family hold no '{name}'"),
            }),
        }
    }

    /// What is deleted. A table of nodes takes the nodes' flags, a table of elements those of the elements.
    ///
    /// # Errors
    /// [`Error::Content`] if there is no such table, or another number of flags.
    pub fn deletion(&mut self, deletion: &Deletion) -> Result<&mut Self, Error> {
        let by_nodes = self.writer.layout.field("node_deletion").is_some();
        let name = if by_nodes { "node_deletion" } else { "element_deletion" };
        let flags: Vec<bool> = match by_nodes {
            true => deletion.nodes.clone(),
            // the order of this table
            false => {
                [&deletion.solids, &deletion.thick_shells, &deletion.shells, &deletion.beams].map(|of| &of[..]).concat()
            }
        };
        let Some(field) = self.writer.layout.field(name).cloned() else {
            return self.set(name, &[]);
        };
        if field.rows != flags.len() as u64 {
            return Err(self.count(name, flags.len(), field.rows as usize));
        }
        let words = self.writer.control.words;
        let at = (field.offset * words.size()) as usize;
        for (word, _) in self.bytes[at..].chunks_exact_mut(words.size() as usize).zip(flags).filter(|(_, flag)| *flag) {
            words.put_float(word, 0.0);
        }
        Ok(self)
    }

    /// Appends the state to the family.
    ///
    /// # Errors
    /// [`Error::Io`]; the state may then be there in part, which a reader reports as cut.
    pub fn write(self) -> Result<(), Error> {
        self.writer.put_state(&self.bytes)
    }

    fn fill(&mut self, field: &Field, quantity: &Quantity, name: &str, values: &[f64]) -> Result<&mut Self, Error> {
        let columns = quantity.columns();
        let shells = field.name == "shell" && !self.writer.rigid.is_empty();
        let rows = if shells { self.writer.rigid.len() } else { field.rows as usize };
        let stored_alone = values.len() == field.rows as usize * columns;
        if values.len() != rows * columns && !stored_alone {
            return Err(self.count(name, values.len(), rows * columns));
        }
        let words = self.writer.control.words;
        let size = words.size() as usize;
        let at = field.offset as usize * size;
        let rigid = &self.writer.rigid;
        let is_stored = |row: usize| !shells || stored_alone || !rigid[row];
        let stored = values.chunks_exact(columns).enumerate().filter(|(row, _)| is_stored(*row)).map(|(_, row)| row);
        for (element, row) in self.bytes[at..].chunks_exact_mut(field.columns as usize * size).zip(stored) {
            for (point, values) in row.chunks_exact(quantity.width).enumerate() {
                let start = (quantity.at + point * quantity.each) * size;
                for (word, value) in element[start..].chunks_exact_mut(size).zip(values) {
                    words.put_float(word, *value);
                }
            }
        }
        Ok(self)
    }

    fn count(&self, name: &str, found: usize, expected: usize) -> Error {
        let what = format!("{found} values given for '{name}', {expected} expected");
        Error::Content { path: self.writer.members.path().to_owned(), what }
    }
}
