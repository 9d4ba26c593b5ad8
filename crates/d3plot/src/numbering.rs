//! User numbers of nodes, elements and parts: the section of exactly NARBS words behind the connectivity.
//!
//! Its kinds stand in an order of their own: solids, beams, shells, thick shells.

use crate::control::Control;
use crate::cursor::Cursor;
use crate::error::Error;

/// User numbers of everything that has one; 1, 2, 3 … where the file has none.
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
const SHORT_HEADER: usize = 10;
const LONG_HEADER: usize = 16;

/// Reads the section and leaves the cursor behind it, whatever its lists say.
pub(crate) fn read_numbers(control: &Control, cursor: &mut Cursor) -> Result<Numbers, Error> {
    let counts = [control.nodes, control.solids, control.beams, control.shells, control.thick_shells];
    let in_sequence = |agree: bool| {
        let [nodes, solids, beams, shells, thick_shells] = counts.map(|count| (1..=count).collect());
        Numbers { agree, nodes, solids, beams, shells, thick_shells, parts: None }
    };
    if control.narbs == 0 {
        return Ok(in_sequence(true));
    }
    let words = if control.wide_numbers { control.words.wide() } else { control.words };
    let section = cursor.skip_bytes(control.narbs, words.size(), "user numbers")?;
    let bytes = cursor.bytes_of(section)?;
    let numbers: Vec<i64> = words.ints(&bytes).collect();
    drop(bytes);
    Ok(split(&numbers, counts, words.size() == 4).unwrap_or_else(|| in_sequence(false)))
}

/// Takes the lists apart; `None` if the header does not repeat the counts or a list is cut off.
fn split(numbers: &[i64], counts: [u64; 5], single: bool) -> Option<Numbers> {
    let repeated = numbers.get(5..SHORT_HEADER)?;
    if !counts.iter().zip(repeated).all(|(&count, &word)| u64::try_from(word) == Ok(count)) {
        return None;
    }
    // NSORT < 0: parts have numbers of their own
    let long = numbers[0] < 0;
    let mut rest = numbers.get(if long { LONG_HEADER } else { SHORT_HEADER }..)?;
    let mut next = |count: u64| {
        let (list, behind) = rest.split_at_checked(usize::try_from(count).ok()?)?;
        rest = behind;
        Some(list.iter().map(|&number| user_number(number, single)).collect::<Vec<u64>>())
    };
    let [nodes, solids, beams, shells, thick_shells] = counts.map(&mut next);
    let parts = match long {
        true => u64::try_from(numbers[15]).ok().and_then(|count| Some(by_internal_order(next(count)?, next(count)))),
        false => None,
    };
    Some(Numbers {
        agree: true,
        nodes: nodes?,
        solids: solids?,
        beams: beams?,
        shells: shells?,
        thick_shells: thick_shells?,
        parts,
    })
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
