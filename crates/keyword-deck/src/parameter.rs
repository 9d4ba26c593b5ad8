//! *PARAMETER: names for values, seen from their definition on, in the file or (LOCAL) only below it.

use std::collections::HashMap;

use crate::expression::evaluate;

/// A parameter's value.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Value {
    /// Type I.
    Integer(i64),
    /// Type R.
    Real(f64),
    /// Type C.
    Text(String),
}

/// What becomes of a second definition of a name (*PARAMETER_DUPLICATION).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Duplication {
    /// The first counts, with a warning (1, and 3, which the solver takes for an error at the end).
    #[default]
    WarnFirst,
    /// The new one counts, with a warning (2).
    WarnNew,
    /// The new one counts (4).
    New,
    /// The first counts (5).
    First,
}

impl Duplication {
    pub(crate) fn of(flag: i64) -> Self {
        match flag {
            2 => Self::WarnNew,
            4 => Self::New,
            5 => Self::First,
            _ => Self::WarnFirst,
        }
    }
}

/// All parameters at one place of a deck.
#[derive(Debug, Clone, Default)]
pub(crate) struct Parameters {
    pub(crate) duplication: Duplication,
    global: HashMap<String, (Value, bool)>,
    /// LOCAL ones of the files that are being read, outermost first.
    local: Vec<HashMap<String, Value>>,
}

impl Parameters {
    pub(crate) fn enter_file(&mut self) {
        self.local.push(HashMap::new());
    }

    pub(crate) fn leave_file(&mut self) {
        self.local.pop();
    }

    /// The value of a name, whatever its case.
    pub(crate) fn get(&self, name: &str) -> Option<Value> {
        let name = name.to_ascii_uppercase();
        let local = self.local.iter().rev().find_map(|level| level.get(&name));
        local.or_else(|| self.global.get(&name).map(|(value, _)| value)).cloned()
    }

    /// Defines a name. Says whether the new value counts when the name was there and the user should know.
    pub(crate) fn set(&mut self, name: &str, value: Value, local: bool, mutable: bool) -> Option<bool> {
        let name = name.to_ascii_uppercase();
        if local && let Some(level) = self.local.last_mut() {
            level.insert(name, value);
            return None;
        }
        match self.global.get_mut(&name) {
            None => {
                self.global.insert(name, (value, mutable));
                None
            }
            Some((there, _)) if *there == value => None,
            Some((there, was_mutable)) => {
                let new = *was_mutable || matches!(self.duplication, Duplication::New | Duplication::WarnNew);
                let quiet = *was_mutable || matches!(self.duplication, Duplication::New | Duplication::First);
                if new {
                    *there = value;
                }
                (!quiet).then_some(new)
            }
        }
    }

    /// Evaluates an expression with these parameters.
    ///
    /// # Errors
    /// What is wrong, in words.
    pub(crate) fn evaluate(&self, text: &str) -> Result<Value, String> {
        evaluate(text, &|name| self.get(name))
    }

    /// How many global ones there are.
    pub(crate) fn len(&self) -> usize {
        self.global.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn second_definitions() {
        let mut parameters = Parameters::default();
        assert_eq!(parameters.set("a", Value::Integer(1), false, false), None);
        assert_eq!(parameters.set("A", Value::Integer(1), false, false), None, "the same value again is no matter");
        assert_eq!(parameters.set("A", Value::Integer(2), false, false), Some(false));
        assert_eq!(parameters.get("a"), Some(Value::Integer(1)));
        parameters.duplication = Duplication::of(2);
        assert_eq!(parameters.set("A", Value::Integer(3), false, false), Some(true));
        assert_eq!(parameters.get("a"), Some(Value::Integer(3)));
    }

    #[test]
    fn local_ones_end_with_their_file() {
        let mut parameters = Parameters::default();
        parameters.set("a", Value::Integer(1), false, false);
        parameters.enter_file();
        parameters.set("a", Value::Integer(2), true, false);
        assert_eq!(parameters.get("A"), Some(Value::Integer(2)));
        parameters.leave_file();
        assert_eq!(parameters.get("A"), Some(Value::Integer(1)));
    }
}
