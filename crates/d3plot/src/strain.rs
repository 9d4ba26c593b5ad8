//! Effective plastic strain of shells, thick shells and solids: one word of every point of an element.
//!
//! A point holds stress (6 words, if written), plastic strain, then history; points of an element follow one another.
//! Whatever else an element has comes behind them and is passed over by the words that the control block gives it.

use crate::error::Error;
use crate::family::Family;
use crate::results::Table;
use crate::state::Field;

/// Bytes read at a time.
const PIECE: u64 = 1 << 22;

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

/// How plastic strain lies in the words of an element kind.
struct Strain {
    field: &'static str,
    name: &'static str,
    points: usize,
    /// Words a point, and the place of the strain among them.
    each: usize,
    at: usize,
}

impl Family {
    /// Effective plastic strain of the shells, one value each, in the order of the geometry; `None` if the states have
    /// none. The format calls the word "effective plastic strain *or material dependent variable*": it may be negative.
    ///
    /// NaN for rigid shells without words in the states. Deleted elements hold zeros: see [`Family::deletion`].
    ///
    /// # Errors
    /// As [`Family::coordinates`], and [`Error::Layer`] for a surface that the file does not tell (two layers, or
    /// several points in the plane).
    pub fn shell_plastic_strain(&self, state: usize, layers: Layers) -> Result<Option<Vec<f64>>, Error> {
        self.strain_of(state, self.shell_strain(), layers)
    }

    /// Plastic strain of the shells, all layers: rows are shells (NaN for rigid ones), columns layers. With three
    /// layers their order is mid, inner, outer surface. `None` if the states have none.
    ///
    /// # Errors
    /// As [`Family::coordinates`].
    pub fn shell_plastic_strain_layers(&self, state: usize) -> Result<Option<Table>, Error> {
        self.strain_table(state, self.shell_strain())
    }

    /// Plastic strain of the thick shells, one value each: as [`Family::shell_plastic_strain`].
    ///
    /// # Errors
    /// As [`Family::shell_plastic_strain`].
    pub fn thick_shell_plastic_strain(&self, state: usize, layers: Layers) -> Result<Option<Vec<f64>>, Error> {
        self.strain_of(state, self.thick_shell_strain(), layers)
    }

    /// Plastic strain of the thick shells, all layers: rows are thick shells, columns layers.
    ///
    /// # Errors
    /// As [`Family::coordinates`].
    pub fn thick_shell_plastic_strain_layers(&self, state: usize) -> Result<Option<Table>, Error> {
        self.strain_table(state, self.thick_shell_strain())
    }

    /// Plastic strain of the solids, one value each, over their one or eight integration points; `None` if the states
    /// have none.
    ///
    /// # Errors
    /// As [`Family::coordinates`], and [`Error::Layer`] for a surface of solids with eight points.
    pub fn solid_plastic_strain(&self, state: usize, points: Layers) -> Result<Option<Vec<f64>>, Error> {
        self.strain_of(state, self.solid_strain(), points)
    }

    /// Plastic strain of the solids, all integration points: rows are solids, columns points (1 or 8).
    ///
    /// # Errors
    /// As [`Family::coordinates`].
    pub fn solid_plastic_strain_points(&self, state: usize) -> Result<Option<Table>, Error> {
        self.strain_table(state, self.solid_strain())
    }

    /// Fields of plastic strain, for [`Family::fields`].
    pub(crate) fn strain_fields(&self) -> Vec<Field> {
        let kinds = [
            (self.shell_strain(), self.control.shells),
            (self.thick_shell_strain(), self.control.thick_shells),
            (self.solid_strain(), self.control.solids),
        ];
        let field = |(strain, rows): (Option<Strain>, u64)| {
            let strain = strain?;
            Some(Field { name: strain.name, rows, columns: strain.points as u64, offset: 0 })
        };
        kinds.into_iter().filter_map(field).collect()
    }

    fn shell_strain(&self) -> Option<Strain> {
        self.layered("shell", "shell_plastic_strain")
    }

    fn thick_shell_strain(&self) -> Option<Strain> {
        self.layered("thick_shell", "thick_shell_plastic_strain")
    }

    fn layered(&self, field: &'static str, name: &'static str) -> Option<Strain> {
        let words = self.layout.field(field)?.columns;
        let at = if self.control.shell_stress { 6 } else { 0 };
        let each = at + 1 + self.control.neips;
        let fits = self.control.layers.checked_mul(each).is_some_and(|all| (1..=words).contains(&all));
        let points = self.control.layers as usize;
        (self.control.shell_strain && fits).then_some(Strain {
            field,
            name,
            points,
            each: each as usize,
            at: at as usize,
        })
    }

    fn solid_strain(&self) -> Option<Strain> {
        let words = self.layout.field("solid")?.columns;
        let at = if self.control.solid_stress { 6 } else { 0 };
        let each = at + 1 + self.control.neiph;
        let points = if words / 8 >= each { 8 } else { 1 };
        // the words there are, not those there should be
        let each = words / points;
        let (field, name) = ("solid", "solid_plastic_strain");
        let strain = Strain { field, name, points: points as usize, each: each as usize, at: at as usize };
        (self.control.solid_strain && at < each).then_some(strain)
    }

    /// Plastic strain at all points: one row an element of the geometry.
    fn strain_table(&self, state: usize, strain: Option<Strain>) -> Result<Option<Table>, Error> {
        let start = self.start(state)?;
        let Some(strain) = strain else { return Ok(None) };
        let Some(field) = self.layout.field(strain.field) else { return Ok(None) };
        let mut values = self.strain_rows(start, field, &strain)?;
        if strain.field == "shell" && self.layout.rigid_shells > 0 {
            values = self.with_rigid_shells(&values, strain.points)?;
        }
        Ok(Some(Table { values, columns: strain.points }))
    }

    /// The strains of the rows that the file has. A shell with histories may have hundreds of words of which few are
    /// wanted, so the block is read in pieces.
    fn strain_rows(&self, start: u64, field: &Field, strain: &Strain) -> Result<Vec<f64>, Error> {
        let size = self.control.words.size();
        let at_once = (PIECE / (field.columns * size)).max(1);
        let mut values = Vec::new();
        let mut row = 0;
        while row < field.rows {
            let rows = at_once.min(field.rows - row);
            let offset = field.offset + row * field.columns;
            let bytes = self.bytes_of(start, &Field { rows, offset, ..field.clone() })?;
            for element in bytes.chunks_exact((field.columns * size) as usize) {
                values.extend((0..strain.points).map(|point| {
                    let at = (point * strain.each + strain.at) * size as usize;
                    self.control.words.float(&element[at..at + size as usize])
                }));
            }
            row += rows;
        }
        Ok(values)
    }

    /// Puts NaN between the rows of the file where a shell is rigid.
    fn with_rigid_shells(&self, values: &[f64], points: usize) -> Result<Vec<f64>, Error> {
        let listed = self.rigid_shells().filter(|rigid| *rigid).count() as u64;
        if listed != self.layout.rigid_shells {
            let what = format!("{} rigid shells without words, {listed} of a rigid material", self.layout.rigid_shells);
            return Err(Error::Unsupported { path: self.root().to_owned(), what });
        }
        let mut rows = values.chunks_exact(points);
        let missing = vec![f64::NAN; points];
        let row = |rigid| if rigid { &missing[..] } else { rows.next().unwrap_or(&missing) };
        Ok(self.rigid_shells().map(row).collect::<Vec<&[f64]>>().concat())
    }

    fn strain_of(&self, state: usize, strain: Option<Strain>, layers: Layers) -> Result<Option<Vec<f64>>, Error> {
        let solids = strain.as_ref().is_some_and(|strain| strain.field == "solid");
        let Some(table) = self.strain_table(state, strain)? else {
            return Ok(None);
        };
        let told = !solids && !self.control.in_plane_points && table.columns >= 3;
        let place = |place: usize, what: &'static str| match (table.columns, told) {
            (1, _) => Ok(0),
            (_, true) => Ok(place),
            (layers, false) => Err(Error::Layer { path: self.root().to_owned(), what, layers: layers as u64 }),
        };
        let count = table.columns as f64;
        Ok(Some(match layers {
            Layers::Max => table.rows().map(|row| row.iter().copied().fold(f64::NAN, f64::max)).collect(),
            Layers::Min => table.rows().map(|row| row.iter().copied().fold(f64::NAN, f64::min)).collect(),
            Layers::Mean => table.rows().map(|row| row.iter().sum::<f64>() / count).collect(),
            Layers::Mid => column(&table, place(0, "the mid surface")?),
            Layers::Inner => column(&table, place(1, "the inner surface")?),
            Layers::Outer => column(&table, place(2, "the outer surface")?),
        }))
    }
}

fn column(table: &Table, at: usize) -> Vec<f64> {
    table.rows().map(|row| row[at]).collect()
}
