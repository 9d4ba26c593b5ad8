//! Lines and words of text formats. Bytes, not characters: a comment may be in any encoding.

use crate::error::{Fault, Place, shown};

/// Lines with their numbers from 1, without their ends (`\n`, `\r\n`, or `\r` alone).
pub(crate) fn lines(bytes: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
    let only_returns = !bytes.contains(&b'\n');
    let lines = bytes.split(move |&byte| byte == b'\n' || (only_returns && byte == b'\r'));
    (1..).zip(lines.map(|line| line.strip_suffix(b"\r").unwrap_or(line)))
}

/// Words between blanks.
pub(crate) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// A number as text.
pub(crate) fn number<T: std::str::FromStr>(
    word: Option<&[u8]>,
    place: Place,
    expected: &'static str,
) -> Result<T, Fault> {
    let parsed = word.and_then(|word| std::str::from_utf8(word).ok()).and_then(|word| word.parse().ok());
    parsed.ok_or_else(|| Fault::Expected { place, expected, found: shown(word.unwrap_or_default()) })
}

/// Three coordinates.
pub(crate) fn point<'a>(words: &mut impl Iterator<Item = &'a [u8]>, place: Place) -> Result<[f64; 3], Fault> {
    let mut point = [0.0; 3];
    for x in &mut point {
        *x = number(words.next(), place, "three coordinates")?;
    }
    Ok(point)
}
