//! Lines of a file, one window at a time: nothing is allocated for a line, and memory does not grow with the file.
//!
//! A line ends with LF, CR LF or CR alone; the last one may end with the file.

use std::io::{self, Read};

/// The longest line that is read. Cards have 80 to 200 columns; free-format lines a few hundred.
pub(crate) const LINE_MAX: usize = 1 << 20;
const WINDOW: usize = 1 << 18;

pub(crate) struct Lines<R> {
    reader: R,
    /// Bytes read and not given out yet: `window[start..end]`.
    window: Vec<u8>,
    start: usize,
    end: usize,
    at_end: bool,
    /// The line last given out, from 1.
    pub(crate) number: u64,
    /// The last line ended with CR; an LF that follows belongs to it.
    swallow_lf: bool,
}

/// What stops a walk through lines.
#[derive(Debug)]
pub(crate) enum Stop {
    Io(io::Error),
    TooLong,
}

impl<R: Read> Lines<R> {
    pub(crate) fn new(reader: R) -> Self {
        Self { reader, window: vec![0; WINDOW], start: 0, end: 0, at_end: false, number: 0, swallow_lf: false }
    }

    /// The first bytes of the file, at most as many as asked for; none is taken.
    pub(crate) fn peek(&mut self, bytes: usize) -> io::Result<&[u8]> {
        while !self.at_end && self.end - self.start < bytes {
            self.fill()?;
        }
        Ok(&self.window[self.start..self.end.min(self.start + bytes)])
    }

    pub(crate) fn skip(&mut self, bytes: usize) {
        self.start = (self.start + bytes).min(self.end);
    }

    /// The next line without its end; `None` at the end of the file.
    pub(crate) fn next(&mut self) -> Result<Option<&[u8]>, Stop> {
        let mut looked = 0;
        loop {
            if self.swallow_lf && self.start < self.end {
                self.swallow_lf = false;
                if self.window[self.start] == b'\n' {
                    self.start += 1;
                }
            }
            let rest = &self.window[self.start + looked..self.end];
            if let Some(found) = memchr::memchr2(b'\n', b'\r', rest) {
                let (first, last) = (self.start, self.start + looked + found);
                self.swallow_lf = self.window[last] == b'\r';
                self.start = last + 1;
                self.number += 1;
                return Ok(Some(&self.window[first..last]));
            }
            looked = self.end - self.start;
            if looked > LINE_MAX {
                return Err(Stop::TooLong);
            }
            if self.at_end {
                if looked == 0 {
                    return Ok(None);
                }
                let first = self.start;
                self.start = self.end;
                self.number += 1;
                return Ok(Some(&self.window[first..self.end]));
            }
            self.fill().map_err(Stop::Io)?;
        }
    }

    fn fill(&mut self) -> io::Result<()> {
        if self.start > 0 {
            self.window.copy_within(self.start..self.end, 0);
            self.end -= self.start;
            self.start = 0;
        }
        if self.end == self.window.len() {
            self.window.resize(2 * self.end, 0);
        }
        let read = loop {
            match self.reader.read(&mut self.window[self.end..]) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                other => break other?,
            }
        };
        self.at_end = read == 0;
        self.end += read;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gives out one byte a call.
    struct Slow<'a>(&'a [u8]);

    impl Read for Slow<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            let Some((&first, rest)) = self.0.split_first() else { return Ok(0) };
            buffer[0] = first;
            self.0 = rest;
            Ok(1)
        }
    }

    fn all(bytes: &[u8]) -> Vec<Vec<u8>> {
        let mut lines = Lines::new(Slow(bytes));
        let mut found = Vec::new();
        while let Some(line) = lines.next().unwrap() {
            found.push(line.to_vec());
        }
        assert_eq!(lines.number, found.len() as u64);
        found
    }

    #[test]
    fn every_kind_of_line_end() {
        let expected: Vec<&[u8]> = vec![b"a", b"", b"b", b"c", b"d"];
        assert_eq!(all(b"a\n\nb\r\nc\rd"), expected);
        assert_eq!(all(b"a\r\r\nb\n"), vec![b"a".to_vec(), vec![], b"b".to_vec()]);
        assert!(all(b"").is_empty());
    }

    #[test]
    fn a_line_without_end_is_refused() {
        let mut lines = Lines::new(io::repeat(b'x'));
        assert!(matches!(lines.next(), Err(Stop::TooLong)));
    }
}
