//! User numbers of nodes, elements and parts: the section of exactly NARBS words behind the connectivity.
//!
//! Its kinds stand in an order of their own: solids, beams, shells, thick shells.

use crate::control::Control;
use crate::cursor::{Cursor, Section};
use crate::error::Error;
use crate::words::Words;

/// User numbers of everything that has one; empty lists where the file has none.
#[derive(Default)]
pub(crate) struct Numbers {
    /// Whether the section repeats the counts of the control block, or there is no section.
    pub(crate) agree: bool,
    pub(crate) nodes: Vec<u64>,
    pub(crate) solids: Vec<u64>,
    pub(crate) beams: Vec<u64>,
    pub(crate) shells: Vec<u64>,
    pub(crate) thick_shells: Vec<u64>,
    /// Numbers of the parts in internal order; `None` where parts are numbered 1, 2, 3 …
    pub(crate) parts: Option<Vec<u64>>,
}

/// Words of the header, without and with the six words on parts.
const SHORT_HEADER: u64 = 10;
const LONG_HEADER: u64 = 16;

/// Reads the section and leaves the cursor behind it, whatever its lists say. Without `keep`, only the header.
pub(crate) fn read_numbers(control: &Control, cursor: &mut Cursor, keep: bool) -> Result<Numbers, Error> {
    if control.narbs == 0 {
        return Ok(Numbers { agree: true, ..Numbers::default() });
    }
    let words = if control.wide_numbers { control.words.wide() } else { control.words };
    let section = cursor.skip_bytes(control.narbs, words.size(), "user numbers")?;
    let mut lists = Lists { cursor, words, section, at: 0, single: words.size() == 4 };
    let counts = [control.nodes, control.solids, control.beams, control.shells, control.thick_shells];
    Ok(split(&mut lists, counts, keep)?.unwrap_or_default())
}

/// Takes the lists apart; `None` if the header does not repeat the counts or a list is cut off.
fn split(lists: &mut Lists, counts: [u64; 5], keep: bool) -> Result<Option<Numbers>, Error> {
    let Some(header) = lists.next(SHORT_HEADER, |word| word)? else { return Ok(None) };
    if !counts.iter().zip(&header[5..]).all(|(&count, &word)| u64::try_from(word) == Ok(count)) {
        return Ok(None);
    }
    // NSORT < 0: parts have numbers of their own
    let on_parts = match header[0] < 0 {
        true => lists.next(LONG_HEADER - SHORT_HEADER, |word| word)?,
        false => Some(Vec::new()),
    };
    let Some(on_parts) = on_parts else { return Ok(None) };
    if !keep {
        return Ok(Some(Numbers { agree: true, ..Numbers::default() }));
    }
    let mut read = [const { Vec::new() }; 5];
    for (list, count) in read.iter_mut().zip(counts) {
        let Some(numbers) = lists.numbers(count)? else { return Ok(None) };
        *list = numbers;
    }
    let [nodes, solids, beams, shells, thick_shells] = read;
    let parts = match on_parts.last().map(|&count| u64::try_from(count).unwrap_or(u64::MAX)) {
        None => None,
        Some(count) => match (lists.numbers(count)?, lists.numbers(count)?) {
            (Some(first), second) => Some(by_internal_order(first, second)),
            (None, _) => None,
        },
    };
    Ok(Some(Numbers { agree: true, nodes, solids, beams, shells, thick_shells, parts }))
}

/// The lists of the section, one after the other.
struct Lists<'a, 'b> {
    cursor: &'a Cursor<'b>,
    words: Words,
    section: Section,
    /// Bytes of the section that are passed.
    at: u64,
    single: bool,
}

impl Lists<'_, '_> {
    /// The next `count` words; `None` if the section does not have them.
    fn next<T>(&mut self, count: u64, convert: impl Fn(i64) -> T) -> Result<Option<Vec<T>>, Error> {
        let size = self.words.size();
        let Some(bytes) = count.checked_mul(size).filter(|&bytes| bytes <= self.section.bytes - self.at) else {
            return Ok(None);
        };
        let section = Section { start: self.section.start + self.at, bytes, ..self.section };
        self.at += bytes;
        let mut list = Vec::with_capacity(count as usize);
        self.cursor.pieces(section, size, |piece| list.extend(self.words.ints(piece).map(&convert)))?;
        Ok(Some(list))
    }

    fn numbers(&mut self, count: u64) -> Result<Option<Vec<u64>>, Error> {
        let single = self.single;
        self.next(count, |word| user_number(word, single))
    }
}

/// Two lists name the parts: one sorted, for looking numbers up, and one in internal order, by which elements name their
/// part. The manual calls the first the sorted one; in a family of R14 it is the second, and lasso-python writes zeros
/// there. So the first is taken unless it is sorted and the second holds the same numbers in another order.
fn by_internal_order(first: Vec<u64>, second: Option<Vec<u64>>) -> Vec<u64> {
    let Some(second) = second.filter(|second| first.is_sorted() && !second.is_sorted()) else {
        return first;
    };
    let mut sorted = second.clone();
    sorted.sort_unstable();
    if sorted == first { second } else { first }
}

/// A 4-byte number beyond 2³¹ comes as a negative word.
fn user_number(word: i64, single: bool) -> u64 {
    if single { u64::from(word as u32) } else { word as u64 }
}

#[cfg(test)]
mod tests {
    use super::by_internal_order;

    #[test]
    fn the_list_that_is_not_sorted_names_the_parts() {
        let (sorted, internal) = (vec![1, 5, 9], vec![5, 9, 1]);
        assert_eq!(by_internal_order(sorted.clone(), Some(internal.clone())), internal);
        assert_eq!(by_internal_order(internal.clone(), Some(sorted.clone())), internal);
        assert_eq!(by_internal_order(sorted.clone(), Some(vec![0, 0, 0])), sorted);
        assert_eq!(by_internal_order(sorted.clone(), Some(vec![3, 2, 1])), sorted);
        assert_eq!(by_internal_order(sorted.clone(), None), sorted);
    }
}
