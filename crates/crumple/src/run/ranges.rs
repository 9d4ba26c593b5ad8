//! Ranges of every field of the first and last state, for `crumple info --ranges`.
//!
//! The names are those that the tables of the project's test families use: a field that the run does not have is null.

use serde_json::{Map, Value, json};

use super::{Run, Source};
use crate::Error;

/// Fields that are always named.
const ALWAYS: [&str; 9] = [
    "coordinates",
    "velocity",
    "acceleration",
    "temperature",
    "solid_plastic_strain",
    "thick_shell_plastic_strain",
    "tshell_plastic_strain",
    "shell_plastic_strain",
    "deletion_table",
];

impl Run {
    /// Ranges of the first and of the last whole state; `None` if there is none. Each holds `time` and, for each field,
    /// `min`, `max` and `sum` over all finite words: numbers for plastic strains, with the `points` an element; a list over
    /// the components for everything else. `not_finite` counts the other words where there are any.
    ///
    /// # Errors
    /// [`Error::Read`] if a state cannot be read.
    pub fn ranges(&self) -> Result<Option<[Value; 2]>, Error> {
        let Source::D3plot(family) = &self.source else { return Ok(None) };
        match family.times().len() {
            0 => Ok(None),
            states => Ok(Some([ranges_of(family, 0)?, ranges_of(family, states - 1)?])),
        }
    }
}

fn ranges_of(family: &d3plot::Family, state: usize) -> Result<Value, Error> {
    let mut all = Map::new();
    all.insert("time".into(), json!(family.times()[state]));
    all.extend(ALWAYS.map(|name| (name.to_owned(), Value::Null)));
    for range in family.ranges(state)? {
        let mut found = Map::new();
        let mut add = |name: &str, value: &dyn Fn(&d3plot::Component) -> Option<f64>| {
            let values: Vec<Option<f64>> = range.components.iter().map(value).collect();
            // plastic strain is one number however many points an element has
            let one = range.name.ends_with("_plastic_strain");
            found.insert(name.to_owned(), if one { json!(values.first()) } else { json!(values) });
        };
        add("min", &|component| component.min);
        add("max", &|component| component.max);
        add("sum", &|component| Some(component.sum));
        if range.points > 1 || range.name.ends_with("_plastic_strain") {
            found.insert("points".into(), json!(range.points));
        }
        if range.not_finite > 0 {
            found.insert("not_finite".into(), json!(range.not_finite));
        }
        if range.name == "thick_shell_plastic_strain" {
            all.insert("tshell_plastic_strain".into(), json!(found));
        }
        all.insert(range.name.to_owned(), json!(found));
    }
    for (kind, field) in [("node", "node_deletion"), ("element", "element_deletion")] {
        if let Some(table) = family.table(state, field)? {
            let zeros = table.values.iter().filter(|word| **word == 0.0).count();
            all.insert("deletion_table".into(), json!({ "kind": kind, "entries": table.values.len(), "zeros": zeros }));
        }
    }
    Ok(Value::Object(all))
}
