//! A card cut into fields: fixed columns in three widths, or commas; numbers, `&parameters` and `<expressions>` in them.

use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;

use crate::error::{Error, Place};
use crate::number;
use crate::parameter::{Parameters, Value};

/// How wide the fields are (manual, volume I, "General card format").
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Format {
    /// As the manual draws the cards.
    Standard,
    /// Fields below 10 columns have 10 (`I10=Y`, `%`).
    I10,
    /// Fields below 20 columns have 20 (`LONG=Y`, `+`).
    Long,
    /// `LONG=S`: standard by the manual, but seen on long cards too. A card that is longer than 80 columns, or whose
    /// first ten are blank, is long.
    Guess,
}

impl Format {
    fn of_card(self, text: &[u8]) -> Format {
        if self != Format::Guess {
            return self;
        }
        let long =
            text.trim_ascii_end().len() > 80 || text.get(..10).is_some_and(|first| first.trim_ascii().is_empty());
        if long { Format::Long } else { Format::Standard }
    }

    fn width(self, standard: u8) -> usize {
        let least = match self {
            Format::Standard | Format::Guess => 0,
            Format::I10 => 10,
            Format::Long => 20,
        };
        usize::from(standard).max(least)
    }
}

/// Most fields that a card has.
const FIELDS_MAX: usize = 16;
/// Ten fields of eight columns: element cards.
pub(crate) const EIGHTS: &[u8] = &[8; 10];
/// Eight fields of ten columns: most other cards.
pub(crate) const TENS: &[u8] = &[10; 8];
/// Five fields of sixteen columns: thickness cards.
pub(crate) const SIXTEENS: &[u8] = &[16; 5];

/// A card's text and its line.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Card<'a> {
    pub(crate) text: &'a [u8],
    pub(crate) line: u64,
}

impl<'a> Card<'a> {
    pub(crate) fn is_blank(&self) -> bool {
        self.text.trim_ascii().is_empty()
    }

    /// Cuts the card into fields of these standard widths, or at its commas.
    pub(crate) fn row(self, widths: &[u8], at: &'a At<'a>) -> Row<'a> {
        let mut fields: [&[u8]; FIELDS_MAX] = [&[]; FIELDS_MAX];
        if memchr::memchr(b',', self.text).is_some() {
            for (field, text) in fields.iter_mut().zip(Commas(Some(self.text))) {
                *field = text.trim_ascii();
            }
        } else {
            let format = at.format.of_card(self.text);
            let mut rest = self.text;
            for (field, &width) in fields.iter_mut().zip(widths) {
                if rest.is_empty() {
                    break;
                }
                let (text, after) = rest.split_at(format.width(width).min(rest.len()));
                *field = text.trim_ascii();
                rest = after;
            }
        }
        Row { fields, line: self.line, at }
    }

    /// The card as a text: a title, a name.
    pub(crate) fn title(self) -> String {
        decode(self.text.trim_ascii())
    }
}

/// Bytes as text, whatever their encoding: UTF-8 where they are, Latin-1 (every byte a character) else, so that no
/// byte is lost.
pub(crate) fn decode(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|&byte| char::from(byte)).collect(),
    }
}

/// Fields between commas; those inside `<…>` do not separate.
struct Commas<'a>(Option<&'a [u8]>);

impl<'a> Iterator for Commas<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let text = self.0?;
        let mut inside = false;
        for (at, byte) in text.iter().enumerate() {
            match byte {
                b'<' => inside = true,
                b'>' => inside = false,
                b',' if !inside => {
                    self.0 = Some(&text[at + 1..]);
                    return Some(&text[..at]);
                }
                _ => {}
            }
        }
        self.0 = None;
        Some(text)
    }
}

/// Where cards are: what a number needs to be understood, and an error to be found.
pub(crate) struct At<'a> {
    pub(crate) file: &'a Arc<Path>,
    pub(crate) keyword: &'a str,
    pub(crate) format: Format,
    pub(crate) parameters: &'a Parameters,
}

impl At<'_> {
    pub(crate) fn place(&self, line: u64) -> Place {
        Place { file: self.file.clone(), line }
    }

    pub(crate) fn card_missing(&self, line: u64, what: &'static str) -> Error {
        Error::CardMissing { place: self.place(line), keyword: self.keyword.to_owned(), what }
    }
}

/// The fields of a card.
pub(crate) struct Row<'a> {
    fields: [&'a [u8]; FIELDS_MAX],
    pub(crate) line: u64,
    pub(crate) at: &'a At<'a>,
}

impl<'a> Row<'a> {
    pub(crate) fn place(&self) -> Place {
        self.at.place(self.line)
    }

    /// How many fields have something in them.
    pub(crate) fn filled(&self) -> usize {
        self.fields.iter().filter(|field| !field.is_empty()).count()
    }

    pub(crate) fn bytes(&self, index: usize) -> &'a [u8] {
        self.fields.get(index).copied().unwrap_or_default()
    }

    /// A field as text.
    pub(crate) fn text(&self, index: usize) -> String {
        decode(self.bytes(index))
    }

    /// A field as an id: a whole number from 0; blank is 0.
    ///
    /// # Errors
    /// [`Error::Field`], [`Error::Parameter`], [`Error::Expression`].
    pub(crate) fn id(&self, index: usize, name: &'static str) -> Result<u64, Error> {
        let value = self.integer(index, name)?;
        u64::try_from(value).map_err(|_| self.wrong(index, name, "an id, a whole number from 0"))
    }

    /// A field as a whole number; blank is 0.
    ///
    /// # Errors
    /// As [`Row::id`].
    pub(crate) fn integer(&self, index: usize, name: &'static str) -> Result<i64, Error> {
        let text = self.bytes(index);
        if text.is_empty() {
            return Ok(0);
        }
        if let Some(value) = number::integer(text) {
            return Ok(value);
        }
        match self.value(text)? {
            Some(Value::Integer(value)) => Ok(value),
            Some(Value::Real(value)) if value.fract() == 0.0 && value.abs() < 9e15 => Ok(value as i64),
            _ => Err(self.wrong(index, name, "a whole number")),
        }
    }

    /// A field as a finite real number; blank is 0.
    ///
    /// # Errors
    /// As [`Row::id`].
    pub(crate) fn real(&self, index: usize, name: &'static str) -> Result<f64, Error> {
        let text = self.bytes(index);
        if text.is_empty() {
            return Ok(0.0);
        }
        if let Some(value) = number::real(text) {
            return Ok(value);
        }
        match self.value(text)? {
            Some(Value::Integer(value)) => Ok(value as f64),
            Some(Value::Real(value)) if value.is_finite() => Ok(value),
            _ => Err(self.wrong(index, name, "a finite number")),
        }
    }

    /// `&name`, `-&name` or `<expression>`; `None` if it is none of them.
    fn value(&self, text: &[u8]) -> Result<Option<Value>, Error> {
        let (negative, name) = match text {
            [b'-', b'&', name @ ..] | [b'&', b'-', name @ ..] => (true, name),
            [b'+', b'&', name @ ..] | [b'&', name @ ..] => (false, name),
            [b'<', inner @ ..] => {
                let inner = String::from_utf8_lossy(inner.strip_suffix(b">").unwrap_or(inner));
                return self.at.parameters.evaluate(&inner).map(Some).map_err(|what| Error::Expression {
                    place: self.place(),
                    keyword: self.at.keyword.to_owned(),
                    text: short(inner.as_bytes()),
                    what,
                });
            }
            _ => return Ok(None),
        };
        let name: Cow<'_, str> = String::from_utf8_lossy(name.trim_ascii());
        let missing = || Error::Parameter {
            place: self.place(),
            keyword: self.at.keyword.to_owned(),
            name: short(name.as_bytes()),
        };
        let value = self.at.parameters.get(&name).ok_or_else(missing)?;
        Ok(Some(match value {
            Value::Integer(value) if negative => Value::Integer(value.saturating_neg()),
            Value::Real(value) if negative => Value::Real(-value),
            other => other,
        }))
    }

    pub(crate) fn wrong(&self, index: usize, field: &'static str, expected: &'static str) -> Error {
        Error::Field {
            place: self.place(),
            keyword: self.at.keyword.to_owned(),
            field,
            expected,
            found: short(self.bytes(index)),
        }
    }
}

/// The first characters of a text, without control characters: what a message can show.
pub(crate) fn short(bytes: &[u8]) -> String {
    const MOST: usize = 40;
    let text = decode(bytes);
    let clean = |c: char| if c.is_control() { '\u{fffd}' } else { c };
    let mut shown: String = text.chars().take(MOST).map(clean).collect();
    if text.chars().nth(MOST).is_some() {
        shown.push('…');
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with<T>(format: Format, text: &str, widths: &[u8], test: impl FnOnce(&Row<'_>) -> T) -> T {
        let mut parameters = Parameters::default();
        parameters.set("n", Value::Integer(7), false, false);
        let file: Arc<Path> = Path::new("a.k").into();
        let at = At { file: &file, keyword: "NODE", format, parameters: &parameters };
        test(&Card { text: text.as_bytes(), line: 3 }.row(widths, &at))
    }

    #[test]
    fn fixed_columns_in_every_width() {
        const NODE: &[u8] = &[8, 16, 16, 16];
        let read = |row: &Row<'_>| (row.id(0, "NID").unwrap(), row.real(1, "X").unwrap(), row.real(2, "Y").unwrap());
        let standard = "10000001-1.086602500E+02-2.086602500E+02";
        assert_eq!(with(Format::Standard, standard, NODE, read), (10000001, -108.66025, -208.66025));
        assert_eq!(with(Format::I10, "1234567890             1.5             2.5", NODE, read), (1234567890, 1.5, 2.5));
        let long = "                  12                 1.5                 2.5";
        assert_eq!(with(Format::Long, long, NODE, read), (12, 1.5, 2.5));
        assert_eq!(with(Format::Guess, long, NODE, read), (12, 1.5, 2.5));
        assert_eq!(with(Format::Guess, standard, NODE, read), (10000001, -108.66025, -208.66025));
        assert_eq!(with(Format::Long, " 12, 1.5,2.5", NODE, read), (12, 1.5, 2.5));
    }

    #[test]
    fn parameters_and_expressions_in_fields() {
        with(Format::Standard, "&n,-&N,<max(&n,9)+1>,<2*n", TENS, |row| {
            assert_eq!(row.integer(0, "A").unwrap(), 7);
            assert_eq!(row.integer(1, "B").unwrap(), -7);
            assert_eq!(row.real(2, "C").unwrap(), 10.0);
            assert_eq!(row.integer(3, "D").unwrap(), 14);
            assert_eq!(row.integer(4, "E").unwrap(), 0);
        });
        with(Format::Standard, "       x      -1      &m", EIGHTS, |row| {
            let words = |error: Error| error.to_string();
            assert_eq!(
                words(row.id(0, "NID").unwrap_err()),
                "a.k:3: *NODE, NID: a whole number was expected, 'x' is there"
            );
            assert!(words(row.id(1, "NID").unwrap_err()).contains("a whole number from 0"));
            assert!(words(row.id(2, "NID").unwrap_err()).contains("'&m' has no definition"));
        });
    }
}
