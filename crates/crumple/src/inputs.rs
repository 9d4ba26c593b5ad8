//! Tables that say something about each run: design variables, responses, labels.
//!
//! A table is CSV (comma, semicolon or tab) with one header line; the first column is the key. A key is a run's id;
//! a key that is a number joins by the number in the run's folder name, where every name has exactly one number and
//! no two names share it.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

use crate::Error;
use crate::error::io;

/// A table as it was read: texts, nothing interpreted.
#[derive(Debug, Clone)]
pub struct Table {
    /// Where it was read.
    pub path: PathBuf,
    /// Name of the key column.
    pub key: String,
    /// Names of the other columns.
    pub columns: Vec<String>,
    /// Key and values of each row.
    pub rows: Vec<(String, Vec<String>)>,
}

/// Which row belongs to which run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Joined {
    /// One entry a run: the row, or `None`.
    pub row_of_run: Vec<Option<usize>>,
    /// How the rows were found and what was left over, for the user; empty when ids matched and nothing was missing.
    pub notes: Vec<String>,
}

impl Table {
    /// Reads a table. UTF-8, with or without a byte-order mark; other bytes are taken as Latin-1.
    ///
    /// # Errors
    /// [`Error::Io`], or [`Error::Table`] naming the line.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let bytes = std::fs::read(path).map_err(io("read the table", path))?;
        let fault = |what: String| Error::Table { path: path.to_owned(), what };
        let text = match String::from_utf8(bytes) {
            Ok(text) => text,
            Err(error) => error.into_bytes().iter().map(|&byte| char::from(byte)).collect(),
        };
        let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
        let head = text.lines().next().unwrap_or_default();
        let delimiter =
            [b',', b';', b'\t'].into_iter().max_by_key(|&d| head.bytes().filter(|&b| b == d).count()).unwrap_or(b',');
        let mut reader =
            csv::ReaderBuilder::new().delimiter(delimiter).trim(csv::Trim::All).from_reader(text.as_bytes());
        let header = reader.headers().map_err(|error| fault(error.to_string()))?.clone();
        let mut names = header.iter().map(str::to_owned);
        let key = names
            .next()
            .filter(|key| !key.is_empty())
            .ok_or_else(|| fault("the first line has no column names".into()))?;
        let columns: Vec<String> = names.collect();
        if columns.is_empty() {
            return Err(fault(format!("only one column ('{key}'); expected the run and at least one value")));
        }
        let mut names: Vec<&str> = header.iter().collect();
        names.sort_unstable();
        if let Some(twice) = names.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(fault(format!("two columns are called '{}'", twice[0])));
        }
        let mut rows = Vec::new();
        let mut line_of_key = HashMap::new();
        for record in reader.records() {
            let record = record.map_err(|error| fault(error.to_string()))?;
            let line = record.position().map_or(0, csv::Position::line);
            let key = record.get(0).unwrap_or_default().to_owned();
            if key.is_empty() {
                return Err(fault(format!("line {line}: no run in the first column")));
            }
            if let Some(first) = line_of_key.insert(key.clone(), line) {
                return Err(fault(format!("line {line}: run '{key}' stands in line {first} already")));
            }
            rows.push((key, record.iter().skip(1).map(str::to_owned).collect()));
        }
        if rows.is_empty() {
            return Err(fault("no rows below the header".into()));
        }
        Ok(Self { path: path.to_owned(), key, columns, rows })
    }

    /// Finds the row of each run.
    ///
    /// # Errors
    /// [`Error::NoMatch`] if no run has a row.
    pub fn join(&self, runs: &[&str]) -> Result<Joined, Error> {
        let by_key: HashMap<&str, usize> =
            self.rows.iter().enumerate().map(|(row, (key, _))| (key.as_str(), row)).collect();
        let mut notes = Vec::new();
        let mut names: HashMap<&str, usize> = HashMap::new();
        runs.iter().for_each(|run| *names.entry(last_component(run)).or_default() += 1);
        let by_name = |run: &str| by_key.get(last_component(run)).filter(|_| names[last_component(run)] == 1);
        let mut row_of_run: Vec<Option<usize>> =
            runs.iter().map(|run| by_key.get(run).or_else(|| by_name(run)).copied()).collect();
        if row_of_run.iter().all(Option::is_none)
            && let Some(by_number) = self.rows_by_number(runs)
        {
            row_of_run = by_number;
            notes.push(format!(
                "{}: rows joined by the number in the run's folder name ('{}' = {})",
                self.path.display(),
                self.key,
                example(runs)
            ));
        }
        let found = row_of_run.iter().flatten().count();
        if found == 0 {
            return Err(Error::NoMatch {
                path: self.path.clone(),
                column: self.key.clone(),
                keys: some(self.rows.iter().map(|(key, _)| key.as_str())),
                runs: some(runs.iter().copied()),
            });
        }
        if found < runs.len() {
            let without = runs.iter().zip(&row_of_run).filter(|(_, row)| row.is_none()).map(|(run, _)| *run);
            notes.push(format!(
                "{}: {} of {} runs have no row: {}",
                self.path.display(),
                runs.len() - found,
                runs.len(),
                some(without)
            ));
        }
        Ok(Joined { row_of_run, notes })
    }

    /// Joins by number; `None` unless every key is a whole number and the runs' numbers are unambiguous.
    fn rows_by_number(&self, runs: &[&str]) -> Option<Vec<Option<usize>>> {
        let by_number: HashMap<u64, usize> = self
            .rows
            .iter()
            .enumerate()
            .map(|(row, (key, _))| key.parse().map(|number| (number, row)))
            .collect::<Result<_, _>>()
            .ok()?;
        let numbers: Vec<u64> = runs.iter().map(|run| only_number(last_component(run))).collect::<Option<_>>()?;
        let distinct: std::collections::HashSet<_> = numbers.iter().collect();
        if distinct.len() < numbers.len() || by_number.len() < self.rows.len() {
            return None;
        }
        Some(numbers.iter().map(|number| by_number.get(number).copied()).collect())
    }

    /// The cell of a column for each of the runs that has one, by run id.
    ///
    /// # Errors
    /// [`Error::Table`] without such a column, [`Error::NoMatch`] where no row belongs to a run.
    pub fn values_of<'a>(
        &self,
        column: &str,
        runs: impl Iterator<Item = &'a str>,
    ) -> Result<BTreeMap<String, String>, Error> {
        let runs: Vec<&str> = runs.collect();
        let joined = self.join(&runs)?;
        let at = self
            .columns
            .iter()
            .position(|name| name == column)
            .ok_or_else(|| Error::Table { path: self.path.clone(), what: format!("no column '{column}'") })?;
        let cell = |row: usize| self.rows[row].1.get(at).filter(|cell| !cell.is_empty()).cloned();
        let with_cell = |(run, row): (&&str, Option<usize>)| Some(((*run).to_owned(), cell(row?)?));
        Ok(runs.iter().zip(joined.row_of_run).filter_map(with_cell).collect())
    }
}

fn last_component(id: &str) -> &str {
    id.rsplit('/').next().unwrap_or(id)
}

/// The number in a name that has exactly one: `run_007` is 7, `t2_run_007` is none.
fn only_number(name: &str) -> Option<u64> {
    let mut groups = name.split(|c: char| !c.is_ascii_digit()).filter(|group| !group.is_empty());
    let number = groups.next()?.parse().ok()?;
    groups.next().is_none().then_some(number)
}

fn example(runs: &[&str]) -> String {
    runs.first()
        .and_then(|run| only_number(last_component(run)).map(|number| format!("{number} is {run}")))
        .unwrap_or_default()
}

fn some<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let mut shown: Vec<&str> = names.take(6).collect();
    if shown.len() == 6 {
        shown[5] = "…";
    }
    shown.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> Result<Table, Error> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("table.csv");
        std::fs::write(&path, text).unwrap();
        Table::read(&path)
    }

    #[test]
    fn numbers_join_folder_names_and_say_so() {
        let table = table("run,thickness\n1,2.0\n7,3.5\n").unwrap();
        let joined = table.join(&["run_007", "run_001"]).unwrap();
        assert_eq!(joined.row_of_run, [Some(1), Some(0)]);
        assert!(joined.notes[0].contains("joined by the number"), "{:?}", joined.notes);
    }

    #[test]
    fn ambiguous_numbers_do_not_join() {
        let table = table("run,thickness\n1,2.0\n7,3.5\n").unwrap();
        assert!(matches!(table.join(&["a/run_007", "b/run_007"]), Err(Error::NoMatch { .. })));
        assert!(matches!(table.join(&["t2_run_007"]), Err(Error::NoMatch { .. })));
    }

    #[test]
    fn semicolons_tabs_marks_and_latin1_are_read() {
        assert_eq!(table("\u{feff}run;t;u\na;1,5;2\n").unwrap().rows[0].1, ["1,5", "2"]);
        assert_eq!(table("run\tt\na\tx y\n").unwrap().rows[0].1, ["x y"]);
    }

    #[test]
    fn faults_name_the_line() {
        let message = |text| table(text).unwrap_err().to_string();
        assert!(message("run,t\na,1\na,2\n").contains("line 3: run 'a' stands in line 2"));
        assert!(message("run,t\na,1,2\n").contains("line"));
        assert!(message("run\na\n").contains("only one column"));
        assert!(message("run,t\n").contains("no rows"));
    }
}
