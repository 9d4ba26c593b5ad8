//! Effective plastic strain of shells, thick shells and solids: one word of every point of an element.

use crate::error::Error;
use crate::family::Family;
use crate::results::Table;
use crate::values::Layers;

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
        self.strain(state, "shell_plastic_strain", layers)
    }

    /// Plastic strain of the shells, all layers: rows are shells (NaN for rigid ones), columns layers. With three
    /// layers their order is mid, inner, outer surface. `None` if the states have none.
    ///
    /// # Errors
    /// As [`Family::coordinates`].
    pub fn shell_plastic_strain_layers(&self, state: usize) -> Result<Option<Table>, Error> {
        self.values(state, "shell_plastic_strain")
    }

    /// Plastic strain of the thick shells, one value each: as [`Family::shell_plastic_strain`].
    ///
    /// # Errors
    /// As [`Family::shell_plastic_strain`].
    pub fn thick_shell_plastic_strain(&self, state: usize, layers: Layers) -> Result<Option<Vec<f64>>, Error> {
        self.strain(state, "thick_shell_plastic_strain", layers)
    }

    /// Plastic strain of the thick shells, all layers: rows are thick shells, columns layers.
    ///
    /// # Errors
    /// As [`Family::coordinates`].
    pub fn thick_shell_plastic_strain_layers(&self, state: usize) -> Result<Option<Table>, Error> {
        self.values(state, "thick_shell_plastic_strain")
    }

    /// Plastic strain of the solids, one value each, over their one or eight integration points; `None` if the states
    /// have none.
    ///
    /// # Errors
    /// As [`Family::coordinates`], and [`Error::Layer`] for a surface of solids with eight points.
    pub fn solid_plastic_strain(&self, state: usize, points: Layers) -> Result<Option<Vec<f64>>, Error> {
        self.strain(state, "solid_plastic_strain", points)
    }

    /// Plastic strain of the solids, all integration points: rows are solids, columns points (1 or 8).
    ///
    /// # Errors
    /// As [`Family::coordinates`].
    pub fn solid_plastic_strain_points(&self, state: usize) -> Result<Option<Table>, Error> {
        self.values(state, "solid_plastic_strain")
    }

    fn strain(&self, state: usize, field: &str, layers: Layers) -> Result<Option<Vec<f64>>, Error> {
        Ok(self.values_of_layer(state, field, layers)?.map(|table| table.values))
    }
}
