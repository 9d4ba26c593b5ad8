//! What is printed: results to standard output, as a table or as JSON; words to standard error.

use std::io::Write;

use comfy_table::{CellAlignment, LineStyle, Table, TableStyle};

/// How to print.
pub(crate) struct Output {
    pub(crate) json: bool,
    pub(crate) quiet: bool,
}

impl Output {
    /// Prints JSON where that was asked for, else what `words` makes.
    pub(crate) fn print(&self, json: &serde_json::Value, words: impl FnOnce() -> String) {
        let text = if self.json { serde_json::to_string_pretty(json).unwrap_or_default() } else { words() };
        let mut out = std::io::stdout().lock();
        // A reader that has seen enough (`head`) is no failure of ours.
        let _ = out.write_all(text.trim_end().as_bytes()).and_then(|()| out.write_all(b"\n"));
    }

    /// One line of a result that comes little by little; it is there at once, in a pipe too.
    pub(crate) fn line(&self, text: &str) {
        let mut out = std::io::stdout().lock();
        let _ = writeln!(out, "{text}").and_then(|()| out.flush());
    }

    /// A word to the person; not in the way of a script.
    pub(crate) fn note(&self, text: &str) {
        if !self.quiet {
            let _ = writeln!(std::io::stderr(), "note: {text}");
        }
    }

    /// What was noticed about a run, a line each.
    pub(crate) fn notes_on(&self, run: &str, warnings: &[String]) {
        warnings.iter().for_each(|warning| self.note(&format!("{run}: {warning}")));
    }
}

/// A line under the header and one at the end: a table that can be pasted into a mail.
const STYLE: TableStyle = TableStyle::new()
    .header_separator(LineStyle::new('─', '─', '─', '─'))
    .bottom_border(LineStyle::new('─', '─', '─', '─'));

/// A table: names of columns, and rows of cells. Columns whose name starts with `#` are numbers, set to the right.
pub(crate) fn table(names: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut table = Table::new();
    table.load_style(STYLE);
    table.set_header(names.iter().map(|name| name.trim_start_matches('#')));
    for row in rows {
        table.add_row(row);
    }
    for (index, _) in names.iter().enumerate().filter(|(_, name)| name.starts_with('#')) {
        if let Some(column) = table.column_mut(index) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table.lines().map(|line| line.trim_end().to_owned()).collect::<Vec<_>>().join("\n")
}

/// What is wrong, and what to do.
pub(crate) fn print_error(error: &crumple::Error) {
    let mut err = std::io::stderr().lock();
    let _ = writeln!(err, "error: {error}");
    if let Some(remedy) = error.remedy() {
        let _ = writeln!(err, "hint: {remedy}");
    }
}

/// Names in a line, the first few of many.
pub(crate) fn some<'a>(names: impl ExactSizeIterator<Item = &'a str>, most: usize) -> String {
    let count = names.len();
    let shown: Vec<&str> = names.take(most).collect();
    if count > most { format!("{} … ({count} in all)", shown.join(" ")) } else { shown.join(" ") }
}

/// A fraction as a percentage.
pub(crate) fn percent(fraction: Option<f64>) -> String {
    fraction.map_or_else(|| "–".into(), |fraction| format!("{:.1} %", 100.0 * fraction))
}

/// A judgement with two decimals, or a dash.
pub(crate) fn two(value: Option<f64>) -> String {
    value.map_or_else(|| "–".into(), |value| format!("{value:.2}"))
}

/// A time as a person reads it: with the digits that its file has, single precision or double.
pub(crate) fn time(time: f64) -> String {
    let single = time as f32;
    if f64::from(single) == time { single.to_string() } else { time.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_the_digits_of_their_precision() {
        assert_eq!(time(f64::from(0.1_f32)), "0.1");
        let (one, next) = (1e-3_f32, f32::from_bits(1e-3_f32.to_bits() + 1));
        assert_ne!(time(f64::from(one)), time(f64::from(next)));
        // Two states of a double-precision file, a tenth of a microsecond apart after a second.
        assert_eq!([1.0000001, 1.00000015].map(time), ["1.0000001", "1.00000015"]);
        assert_eq!(time(0.0), "0");
    }
}
