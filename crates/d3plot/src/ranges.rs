//! Least, largest, sum of every field of a state: a diagnostic that tells at a glance whether two programs read the same.

use crate::error::Error;
use crate::family::Family;
use crate::values::Rows;

/// The range of a field over everything that the state stores of it: all layers of all elements, deleted ones included,
/// rigid ones that have no words not.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Range {
    /// Name of the field, as in [`Family::fields`].
    pub name: &'static str,
    /// Points an element; 1 for what has none.
    pub points: usize,
    /// One for each component.
    pub components: Vec<Component>,
    /// Words that are NaN or infinite; they are left out.
    pub not_finite: usize,
}

/// The range of one component.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Component {
    /// The smallest finite value; `None` if there is none.
    pub min: Option<f64>,
    /// The largest finite value.
    pub max: Option<f64>,
    /// The sum of the finite values, in the order of the file.
    pub sum: f64,
}

impl Family {
    /// The range of every field of a state, but `time`, `globals` and the tables of elements as a whole, whose quantities are
    /// listed instead. `coordinates` are positions of all nodes, those of rigid bodies that the states leave out too.
    ///
    /// # Errors
    /// As [`Family::coordinates`].
    pub fn ranges(&self, state: usize) -> Result<Vec<Range>, Error> {
        self.start(state)?;
        let mut names: Vec<&'static str> = self.fields().iter().map(|field| field.name).collect();
        names.retain(|name| !matches!(*name, "time" | "globals" | "solid" | "thick_shell" | "beam" | "shell"));
        names.into_iter().map(|name| self.range(state, name)).collect()
    }

    fn range(&self, state: usize, name: &'static str) -> Result<Range, Error> {
        let Some(access) = self.access(name) else {
            return Ok(Range { name, points: 0, components: Vec::new(), not_finite: 0 });
        };
        let width = access.components();
        let points = access.columns() / width.max(1);
        let mut components = vec![Component { min: None, max: None, sum: 0.0 }; width];
        let mut not_finite = 0;
        let mut take = |at: usize, value: f64| {
            let component = &mut components[at % width];
            if value.is_finite() {
                component.min = Some(component.min.map_or(value, |least| least.min(value)));
                component.max = Some(component.max.map_or(value, |most| most.max(value)));
                component.sum += value;
            } else {
                not_finite += 1;
            }
        };
        let mut values: Vec<f64> = Vec::new();
        if name == "coordinates" {
            self.values_into(state, name, Rows::All, &mut values)?;
        } else {
            self.stored_values(state, &access, &mut values)?;
        }
        values.iter().enumerate().for_each(|(at, &value)| take(at, value));
        Ok(Range { name, points, components, not_finite })
    }
}
