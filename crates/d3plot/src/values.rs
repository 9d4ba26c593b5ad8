//! Values by name: tables of a state and quantities of its elements, of all rows or of those of one part, layer by layer
//! or reduced over the layers, in the precision that the caller wants.
//!
//! Only the bytes that hold the rows are read; blocks are decoded piece by piece.

use std::ops::Range;

use crate::error::Error;
use crate::family::Family;
use crate::motion::leaves_out_rigid_nodes;
use crate::quantity::Quantity;
use crate::results::Table;
use crate::state::Field;
use crate::words::Words;

/// Rows that lie closer together than this are read in one go: a page of the file system.
const GAP: u64 = 4096;

/// Which of the points of an element a value is taken from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Layers {
    /// The largest value; independent of the order of the layers.
    Max,
    /// The smallest value.
    Min,
    /// The mean over the words that are there. An element with one or two layers is written as three by the solver,
    /// so this is not an integral through the thickness.
    Mean,
    /// The inner surface: the second of three or more layers.
    Inner,
    /// The outer surface: the third of three or more layers.
    Outer,
    /// The mid surface: the first of three or more layers.
    Mid,
}

/// Rows of a field that are wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Rows<'a> {
    /// All nodes, elements, particles …
    #[default]
    All,
    /// These, from 0, in this order; see [`Family::nodes_of_part`] and [`Family::shells_of_part`].
    These(&'a [u32]),
}

/// Numbers that values can be had as: `f32` and `f64`.
pub trait Real: Copy + Send + Sync + 'static + sealed::Sealed {
    /// What stands where the states hold nothing.
    const NAN: Self;
    /// Adds the floats of `bytes`.
    #[doc(hidden)]
    fn extend(into: &mut Vec<Self>, words: sealed::Form, bytes: &[u8]);
    /// One float.
    #[doc(hidden)]
    fn of(value: f64) -> Self;
    /// As `f64`.
    fn get(self) -> f64;
}

mod sealed {
    /// Word size and byte order, not to be named outside.
    #[derive(Debug, Clone, Copy)]
    pub struct Form(pub(crate) crate::words::Words);
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}
use sealed::Form;

macro_rules! real {
    ($real:ty) => {
        impl Real for $real {
            const NAN: Self = <$real>::NAN;

            fn extend(into: &mut Vec<Self>, Form(words): Form, bytes: &[u8]) {
                use crate::words::{
                    ByteOrder::{Big, Little},
                    Precision::{Double, Single},
                };
                // one loop for each form, so that each is a copy or a conversion without a branch inside
                match (words.precision, words.order) {
                    (Single, Little) => {
                        into.extend(bytes.as_chunks().0.iter().map(|word| f32::from_le_bytes(*word) as $real))
                    }
                    (Single, Big) => {
                        into.extend(bytes.as_chunks().0.iter().map(|word| f32::from_be_bytes(*word) as $real))
                    }
                    (Double, Little) => {
                        into.extend(bytes.as_chunks().0.iter().map(|word| f64::from_le_bytes(*word) as $real))
                    }
                    (Double, Big) => {
                        into.extend(bytes.as_chunks().0.iter().map(|word| f64::from_be_bytes(*word) as $real))
                    }
                }
            }

            fn of(value: f64) -> Self {
                value as $real
            }

            fn get(self) -> f64 {
                self as f64
            }
        }
    };
}
real!(f32);
real!(f64);

/// A name found: the table, and which words of its rows.
#[derive(Debug, Clone)]
pub(crate) struct Access {
    field: Field,
    pick: Quantity,
    /// Displacements that are to become positions.
    from_start: bool,
}

impl Access {
    pub(crate) fn columns(&self) -> usize {
        self.pick.columns()
    }

    /// The table that holds it.
    pub(crate) fn table(&self) -> &'static str {
        self.field.name
    }

    /// Values a row once its points are reduced to one.
    pub(crate) fn components(&self) -> usize {
        self.pick.width
    }

    /// Every word of a row, in order.
    fn is_whole(&self) -> bool {
        self.pick.at == 0 && self.pick.points == 1 && self.pick.width as u64 == self.field.columns
    }
}

impl Family {
    /// Values of a field of [`Family::fields`] in a state: a table of the state, or a quantity of elements such as
    /// `shell_stress`, all its points. One row a node or element of the geometry: NaN for rigid shells. Nodes of
    /// rigid bodies that the states leave out are put where their bodies are. `coordinates` are positions also where the file has displacements. `None` if
    /// the states have no field of that name.
    ///
    /// ```
    /// # let root = concat!(env!("CARGO_MANIFEST_DIR"), "/testdata/s01_shells_latin1/d3plot");
    /// let family = d3plot::Family::open(root.as_ref())?;
    /// let stress = family.values(1, "shell_stress")?.expect("three layers of six components");
    /// assert_eq!((stress.rows().len(), stress.columns), (35, 18));
    /// assert!(family.values(1, "no_such_field")?.is_none());
    /// # Ok::<(), d3plot::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`Family::coordinates`].
    pub fn values(&self, state: usize, field: &str) -> Result<Option<Table>, Error> {
        let mut values = Vec::new();
        let columns = self.values_into(state, field, Rows::All, &mut values)?;
        Ok(columns.map(|columns| Table { values, columns }))
    }

    /// As [`Family::values`], reduced over the points of an element, each component for itself. The rows of `shell_stress`
    /// then have 6 columns, those of `shell_plastic_strain` one. A field without points stays as it is.
    ///
    /// # Errors
    /// As [`Family::coordinates`], and [`Error::Layer`] for a surface that the file does not tell.
    pub fn values_of_layer(&self, state: usize, field: &str, layers: Layers) -> Result<Option<Table>, Error> {
        let Some(access) = self.access(field) else {
            return self.start(state).map(|_| None);
        };
        let mut values: Vec<f64> = Vec::new();
        self.read_rows(state, &access, Rows::All, &mut values)?;
        self.reduce(&access, layers, &mut values)?;
        Ok(Some(Table { values, columns: access.pick.width }))
    }

    /// Values of some rows of a field, put into `into` in place of what it holds; returns the values a row, or `None` if the
    /// states have no such field. For going over many states with one buffer, in the file's own precision: of a
    /// single-precision file, `f32` is exact. Only what holds these rows is read.
    ///
    /// # Errors
    /// As [`Family::coordinates`]; [`Error::NoSuchRow`] for a row that the field does not have.
    pub fn values_into<T: Real>(
        &self,
        state: usize,
        field: &str,
        rows: Rows,
        into: &mut Vec<T>,
    ) -> Result<Option<usize>, Error> {
        into.clear();
        let Some(access) = self.access(field) else {
            return self.start(state).map(|_| None);
        };
        self.read_rows(state, &access, rows, into)?;
        Ok(Some(access.columns()))
    }

    /// Finds a field by its name.
    pub(crate) fn access(&self, name: &str) -> Option<Access> {
        let whole = |field: &Field| Quantity {
            table: field.name,
            name: field.name,
            points: 1,
            each: 0,
            at: 0,
            width: field.columns as usize,
        };
        if let Some(field) = self.layout.field(name) {
            return Some(Access { field: field.clone(), pick: whole(field), from_start: false });
        }
        if name == "coordinates" {
            let field = self.layout.field("displacement")?;
            return Some(Access { field: field.clone(), pick: whole(field), from_start: true });
        }
        let pick = *self.quantities.iter().find(|quantity| quantity.name == name)?;
        let field = self.layout.field(pick.table)?.clone();
        Some(Access { field, pick, from_start: false })
    }

    /// Quantities of elements as fields, for [`Family::fields`].
    pub(crate) fn quantity_fields(&self) -> Vec<Field> {
        let rows = |quantity: &Quantity| match quantity.table {
            "shell" => self.control.shells,
            table => self.layout.field(table).map_or(0, |field| field.rows),
        };
        let there = self.quantities.iter().filter(|quantity| self.layout.field(quantity.table).is_some());
        there.map(|of| Field { name: of.name, rows: rows(of), columns: of.columns() as u64, offset: 0 }).collect()
    }

    /// Reads rows: those of the whole field as one block, others in the runs that they make.
    pub(crate) fn read_rows<T: Real>(
        &self,
        state: usize,
        access: &Access,
        rows: Rows,
        into: &mut Vec<T>,
    ) -> Result<(), Error> {
        let start = self.start(state)?;
        let stored = self.stored_rows(&access.field)?;
        let count = stored.as_ref().map_or(access.field.rows, |stored| stored.len() as u64);
        let columns = access.columns();
        match (rows, &stored) {
            (Rows::All, None) => {
                into.reserve_exact((access.field.rows as usize).saturating_mul(columns));
                self.decode(start, access, 0..access.field.rows, into)?;
            }
            (Rows::All, Some(stored)) => self.scattered(start, access, stored.iter().copied(), into)?,
            (Rows::These(rows), stored) => {
                if let Some(row) = rows.iter().find(|&&row| u64::from(row) >= count) {
                    let path = self.root().to_owned();
                    return Err(Error::NoSuchRow { path, field: access.pick.name, row: u64::from(*row), rows: count });
                }
                let place = |&row: &u32| stored.as_ref().map_or(Some(row), |stored| stored[row as usize]);
                self.scattered(start, access, rows.iter().map(place), into)?;
            }
        }
        if let Some(motion) =
            self.motion.as_ref().filter(|_| stored.is_some() && leaves_out_rigid_nodes(access.table()))
        {
            motion.fill(self, state, access.table(), rows, into)?;
        }
        if access.from_start {
            self.add_starts(rows, columns, into);
        }
        Ok(())
    }

    /// Values of all rows that the state stores, none for those it leaves out.
    pub(crate) fn stored_values(&self, state: usize, access: &Access, into: &mut Vec<f64>) -> Result<(), Error> {
        let start = self.start(state)?;
        into.reserve_exact((access.field.rows as usize).saturating_mul(access.columns()));
        self.decode(start, access, 0..access.field.rows, into)
    }

    /// Rows that are not all of the block in order: those close together are read in one go.
    fn scattered<T: Real>(
        &self,
        start: u64,
        access: &Access,
        rows: impl Iterator<Item = Option<u32>>,
        into: &mut Vec<T>,
    ) -> Result<(), Error> {
        let columns = access.columns();
        let mut wanted: Vec<(u32, u32)> = Vec::new();
        for (place, row) in (0_u32..).zip(rows) {
            into.extend(std::iter::repeat_n(T::NAN, columns));
            wanted.extend(row.map(|row| (row, place)));
        }
        wanted.sort_unstable();
        let gap = (GAP / (access.field.columns * self.control.words.size())).max(1);
        let mut block = Vec::new();
        for run in wanted.chunk_by(|a, b| u64::from(b.0 - a.0) <= gap) {
            let (first, last) = (u64::from(run[0].0), u64::from(run[run.len() - 1].0));
            block.clear();
            self.decode(start, access, first..last + 1, &mut block)?;
            for &(row, place) in run {
                let from = (u64::from(row) - first) as usize * columns;
                let to = place as usize * columns;
                into[to..to + columns].copy_from_slice(&block[from..from + columns]);
            }
        }
        Ok(())
    }

    /// Decodes rows of a block that stand one after the other in the file.
    fn decode<T: Real>(&self, start: u64, access: &Access, rows: Range<u64>, into: &mut Vec<T>) -> Result<(), Error> {
        let words = self.control.words;
        let row = access.field.columns * words.size();
        let at = start + access.field.offset * words.size() + rows.start * row;
        let whole = access.is_whole();
        self.stream.pieces(at, (rows.end - rows.start) * row, row, |bytes| {
            if whole {
                T::extend(into, Form(words), bytes);
            } else {
                bytes.chunks_exact(row as usize).for_each(|element| pick(words, &access.pick, element, into));
            }
        })
    }

    /// For each row of the geometry its row in the block, where the two differ: the states leave out nodes of rigid bodies
    /// and rigid shells.
    fn stored_rows(&self, field: &Field) -> Result<Option<Vec<Option<u32>>>, Error> {
        match (field.name, &self.reading.active) {
            (name, Some(active)) if leaves_out_rigid_nodes(name) && field.rows != self.control.nodes => {
                let mut places = vec![None; self.geometry().coordinates.len()];
                for (place, &node) in (0_u32..).zip(active) {
                    places[node as usize] = Some(place);
                }
                Ok(Some(places))
            }
            ("shell", _) if self.layout.rigid_shells > 0 => {
                let listed = self.rigid_shells().filter(|rigid| *rigid).count() as u64;
                if listed != self.layout.rigid_shells {
                    let without = self.layout.rigid_shells;
                    let what = format!("{without} rigid shells without words, {listed} of a rigid material");
                    return Err(Error::Unsupported { path: self.root().to_owned(), what });
                }
                let mut next = 0_u32;
                let place = |rigid: bool| {
                    next += u32::from(!rigid);
                    (!rigid).then(|| next - 1)
                };
                Ok(Some(self.rigid_shells().map(place).collect()))
            }
            _ => Ok(None),
        }
    }

    fn add_starts<T: Real>(&self, rows: Rows, columns: usize, values: &mut [T]) {
        let starts = &self.geometry().coordinates;
        let node = |place: usize| match rows {
            Rows::All => place,
            Rows::These(rows) => rows[place] as usize,
        };
        for (place, moved) in values.chunks_exact_mut(columns).enumerate() {
            for (value, start) in moved.iter_mut().zip(starts[node(place)]) {
                *value = T::of(value.get() + start);
            }
        }
    }

    /// Reduces the points of each row to one, in place.
    pub(crate) fn reduce<T: Real>(&self, access: &Access, layers: Layers, values: &mut Vec<T>) -> Result<(), Error> {
        let Quantity { points, width, .. } = access.pick;
        if points <= 1 {
            return Ok(());
        }
        let solids = matches!(access.field.name, "solid" | "beam");
        let told = !solids && !self.control.in_plane_points && points >= 3;
        let surface = match layers {
            Layers::Mid => Some((0, "the mid surface")),
            Layers::Inner => Some((1, "the inner surface")),
            Layers::Outer => Some((2, "the outer surface")),
            Layers::Max | Layers::Min | Layers::Mean => None,
        };
        if let Some((_, what)) = surface.filter(|_| !told) {
            return Err(Error::Layer { path: self.root().to_owned(), what, layers: points as u64 });
        }
        let rows = values.len() / (points * width);
        for row in 0..rows {
            for component in 0..width {
                let at = |point: usize| values[(row * points + point) * width + component].get();
                let all = (0..points).map(at);
                let value = match (layers, surface) {
                    (_, Some((point, _))) => at(point),
                    (Layers::Max, _) => all.fold(f64::NAN, f64::max),
                    (Layers::Min, _) => all.fold(f64::NAN, f64::min),
                    _ => all.sum::<f64>() / points as f64,
                };
                values[row * width + component] = T::of(value);
            }
        }
        values.truncate(rows * width);
        Ok(())
    }
}

/// The words of a quantity out of those of an element.
fn pick<T: Real>(words: Words, quantity: &Quantity, element: &[u8], into: &mut Vec<T>) {
    let size = words.size() as usize;
    for point in 0..quantity.points {
        let at = (quantity.at + point * quantity.each) * size;
        T::extend(into, Form(words), &element[at..at + quantity.width * size]);
    }
}
