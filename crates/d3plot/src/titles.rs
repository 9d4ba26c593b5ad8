//! What stands between the geometry and the first state: an end mark, title records in any order, another end mark.
//!
//! Titles are 72 bytes of any encoding whatever the word size. Nothing here is worth a refusal: a title that is cut
//! or unknown costs itself and a warning, since the states can always be found in the next member.

use crate::control::Control;
use crate::cursor::Cursor;
use crate::error::Error;
use crate::geometry::{END_MARK, Reading};
use crate::members::Stream;
use crate::warning::Warning;

/// Bytes of a title.
const TITLE: u64 = 72;
/// Bytes of a line of keywords.
const KEYWORD_LINE: u64 = 80;

/// The titles, and where states may start.
#[derive(Debug, Clone, Default)]
pub(crate) struct Titles {
    /// User number and title of the parts, in the order of the file.
    pub(crate) parts: Vec<(u64, Vec<u8>)>,
    /// The long title of the run.
    pub(crate) head: Option<Vec<u8>>,
    /// Byte of the stream from which on states are looked for.
    pub(crate) states_from: u64,
}

/// Reads what follows the geometry; believes the geometry only if it is a mark, padding, or a plausible time.
pub(crate) fn read_titles(
    control: &Control,
    stream: &Stream,
    reading: &Reading,
    warnings: &mut Vec<Warning>,
) -> Result<Titles, Error> {
    let size = control.words.size();
    let first = stream.member_at(reading.end);
    let member = &stream.members()[first];
    if !reading.mark {
        let cursor = Cursor::new(stream, control.words, reading.end, member.end());
        if cursor.left() >= size && cursor.at() != member.start {
            let time = peek(control, stream, &cursor)?;
            if !is_time(time.float) || !reading.numbers_agree {
                let found = format!("{:e}", time.float);
                let expected = "an end mark (-999999) or the time of a state".to_owned();
                return Err(cursor.wrong("end of the geometry", reading.end, found, expected));
            }
        }
        return Ok(Titles { states_from: reading.end, ..Titles::default() });
    }
    let (mut titles, end) = read_records(control, stream, reading.end, member.end())?;
    if matches!(end, RecordsEnd::Cut | RecordsEnd::Brim) {
        // a geometry of more than a member may have titles that run on: believed if they come to their mark
        let limit = stream.run_on_limit(first, control.words.size());
        if limit > member.end() {
            let (more, end) = read_records(control, stream, reading.end, limit)?;
            if end == RecordsEnd::Mark {
                return Ok(more);
            }
        }
    }
    match end {
        RecordsEnd::Mark | RecordsEnd::Padding | RecordsEnd::Brim => {}
        RecordsEnd::Cut => {
            let (path, offset) = (member.path.clone(), member.bytes);
            warnings.push(Warning::TitlesCut { member: path, offset });
            titles.states_from = member.end();
        }
        RecordsEnd::Unknown(record) => {
            let (path, offset) = stream.place(titles.states_from);
            warnings.push(Warning::UnknownTitleRecord { member: path, offset, record });
            titles.states_from = member.end();
        }
    }
    Ok(titles)
}

/// How the title records came to their end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum RecordsEnd {
    /// At their end mark.
    Mark,
    /// At padding or the time of a state.
    Padding,
    /// At the last byte, behind a whole record.
    Brim,
    /// In a record that is not whole.
    Cut,
    /// At a record of unknown type.
    Unknown(i64),
}

/// Reads marks and title records from the end of the geometry on, to where something else stands.
fn read_records(control: &Control, stream: &Stream, start: u64, limit: u64) -> Result<(Titles, RecordsEnd), Error> {
    let size = control.words.size();
    let mut cursor = Cursor::new(stream, control.words, start, limit);
    let mut titles = Titles::default();
    let mut last_was_mark = false;
    let end = loop {
        if cursor.left() < size {
            break match cursor.left() {
                _ if last_was_mark => RecordsEnd::Mark,
                0 => RecordsEnd::Brim,
                _ => RecordsEnd::Cut,
            };
        }
        let word = peek(control, stream, &cursor)?;
        if word.float == END_MARK {
            cursor.skip(1, 1, "end mark")?;
            last_was_mark = true;
            continue;
        }
        let whole = match word.int {
            90000 => match cursor.skip(1, 1, "title").and_then(|_| cursor.skip_bytes(1, TITLE, "title")) {
                Ok(section) => {
                    titles.head = Some(cursor.bytes_of(section)?);
                    true
                }
                Err(_) => false,
            },
            90001 => part_titles(control, stream, &mut cursor, &mut titles)?,
            90002 | 90020 | 90021 => {
                cursor.skip(1, 1, "titles").is_ok() && pass_list(&mut cursor, size + TITLE).is_ok()
            }
            900_100 | 90_100 => cursor.skip(1, 1, "keywords").is_ok() && pass_list(&mut cursor, KEYWORD_LINE).is_ok(),
            // zeros are padding, or the time of a first state in the root
            _ if is_time(word.float) && last_was_mark => break RecordsEnd::Mark,
            _ if is_time(word.float) => break RecordsEnd::Padding,
            record => break RecordsEnd::Unknown(record),
        };
        if !whole {
            break RecordsEnd::Cut;
        }
        last_was_mark = false;
    };
    titles.states_from = cursor.at();
    Ok((titles, end))
}

/// Whether a word can be the time of a state. Small integers read as floats are below 10⁻³⁷ and are not.
pub(crate) fn is_time(word: f64) -> bool {
    word == 0.0 || (1e-37..1e37).contains(&word.abs())
}

/// The next word in both readings.
struct Peeked {
    int: i64,
    float: f64,
}

fn peek(control: &Control, stream: &Stream, cursor: &Cursor) -> Result<Peeked, Error> {
    let bytes = stream.read(cursor.at(), control.words.size())?;
    let int = control.words.ints(&bytes).next().unwrap_or(0);
    let float = control.words.floats(&bytes).next().unwrap_or(0.0);
    Ok(Peeked { int, float })
}

/// Passes a record whose first word counts entries of a known length.
fn pass_list(cursor: &mut Cursor, entry: u64) -> Result<(), Error> {
    let count = cursor.count("titles")?;
    cursor.skip_bytes(count, entry, "titles").map(drop)
}

/// Record 90001: user number and title of each part. False if it is cut.
fn part_titles(control: &Control, stream: &Stream, cursor: &mut Cursor, titles: &mut Titles) -> Result<bool, Error> {
    if cursor.skip(1, 1, "part titles").is_err() {
        return Ok(false);
    }
    let Ok(count) = cursor.count("part titles") else {
        return Ok(false);
    };
    let size = control.words.size();
    // with 8-byte user numbers in a single precision file the manual leaves open how long the number is here
    let mut id_words = control.words;
    if control.wide_numbers && size == 4 {
        let ends_well = |id: u64| -> Result<bool, Error> {
            let entries = count.saturating_mul(id + TITLE);
            if entries.saturating_add(size) > cursor.left() {
                return Ok(false);
            }
            let bytes = stream.read(cursor.at() + entries, size)?;
            let record = control.words.ints(&bytes).next().unwrap_or(0);
            let mark = control.words.floats(&bytes).next() == Some(END_MARK);
            Ok(mark || matches!(record, 90_000..91_000 | 900_000..901_000))
        };
        if !ends_well(4)? && ends_well(8)? {
            id_words = control.words.wide();
        }
    }
    let entry = id_words.size() + TITLE;
    let there = count.min(cursor.left() / entry);
    let section = cursor.skip_bytes(there, entry, "part titles")?;
    let bytes = cursor.bytes_of(section)?;
    // titles of more parts than there can be are of no use
    for entry in bytes.chunks_exact(entry as usize).take(control.most_parts as usize) {
        let (id, title) = entry.split_at(id_words.size() as usize);
        let id = id_words.ints(id).next().unwrap_or(0);
        let id = if id_words.size() == 4 { u64::from(id as u32) } else { id as u64 };
        titles.parts.push((id, title.to_vec()));
    }
    Ok(there == count)
}
