//! A window on untrusted bytes: sections are taken one after the other, length first, memory second.

use crate::error::Error;
use crate::members::Stream;
use crate::words::Words;

/// Where the words of a section are taken from. Invariant: `at <= limit <= stream.total()`.
pub(crate) struct Cursor<'a> {
    stream: &'a Stream,
    words: Words,
    at: u64,
    limit: u64,
    crossed: Option<Section>,
}

/// A section by its place.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Section {
    pub(crate) name: &'static str,
    pub(crate) start: u64,
    pub(crate) bytes: u64,
}

impl<'a> Cursor<'a> {
    /// A cursor at byte `at` of the stream that never passes byte `limit`.
    pub(crate) fn new(stream: &'a Stream, words: Words, at: u64, limit: u64) -> Cursor<'a> {
        let limit = limit.min(stream.total());
        Cursor { stream, words, at: at.min(limit), limit, crossed: None }
    }

    pub(crate) fn at(&self) -> u64 {
        self.at
    }

    pub(crate) fn left(&self) -> u64 {
        self.limit - self.at
    }

    /// The first section that ran on from the root into the next member.
    pub(crate) fn crossed(&self) -> Option<Section> {
        self.crossed
    }

    /// Passes over `count` times `each` bytes and returns their place.
    pub(crate) fn skip_bytes(&mut self, count: u64, each: u64, name: &'static str) -> Result<Section, Error> {
        let bytes = count.saturating_mul(each);
        if bytes > self.left() {
            return Err(self.truncated(Section { name, start: self.at, bytes }));
        }
        let section = Section { name, start: self.at, bytes };
        let root = self.stream.members()[0].end();
        self.at += bytes;
        if section.start <= root && self.at > root && self.crossed.is_none() {
            self.crossed = Some(section);
        }
        Ok(section)
    }

    /// Passes over `count` things of `each` words.
    pub(crate) fn skip(&mut self, count: u64, each: u64, name: &'static str) -> Result<Section, Error> {
        self.skip_bytes(count, each.saturating_mul(self.words.size()), name)
    }

    /// The bytes of a section that was passed.
    pub(crate) fn bytes_of(&self, section: Section) -> Result<Vec<u8>, Error> {
        self.stream.read(section.start, section.bytes)
    }

    /// Hands the bytes of a section that was passed to `take`, some rows of `row` bytes at a time.
    pub(crate) fn pieces(&self, section: Section, row: u64, take: impl FnMut(&[u8])) -> Result<(), Error> {
        self.stream.pieces(section.start, section.bytes, row, take)
    }

    /// `count` integers.
    pub(crate) fn ints(&mut self, count: u64, name: &'static str) -> Result<Vec<i64>, Error> {
        let section = self.skip(count, 1, name)?;
        let mut ints = Vec::with_capacity((section.bytes / self.words.size()) as usize);
        self.pieces(section, self.words.size(), |bytes| ints.extend(self.words.ints(bytes)))?;
        Ok(ints)
    }

    /// One integer.
    pub(crate) fn int(&mut self, name: &'static str) -> Result<i64, Error> {
        Ok(self.ints(1, name)?[0])
    }

    /// One integer that counts things: not negative, and no more than there are bytes left.
    pub(crate) fn count(&mut self, name: &'static str) -> Result<u64, Error> {
        let start = self.at;
        let value = self.int(name)?;
        match u64::try_from(value).ok().filter(|&count| count <= self.left()) {
            Some(count) => Ok(count),
            None => {
                Err(self.wrong(name, start, format!("a count of {value}"), "a count that fits the file".to_owned()))
            }
        }
    }

    /// An error about what stands at byte `start` of the stream.
    pub(crate) fn wrong(&self, section: &'static str, start: u64, found: String, expected: String) -> Error {
        let (path, offset) = self.stream.place(start);
        Error::Geometry { path, section, offset, found, expected }
    }

    /// The file ends inside `section`.
    pub(crate) fn truncated(&self, section: Section) -> Error {
        let member = &self.stream.members()[self.stream.member_at(section.start)];
        // at the very end of a member the stream's next byte is another file's: the message is about this one
        let member = if section.start == self.limit && member.start == section.start && member.number > 0 {
            &self.stream.members()[self.stream.member_at(section.start.saturating_sub(1))]
        } else {
            member
        };
        let end = if self.limit > member.end() { self.limit } else { member.end().min(self.limit) };
        Error::Truncated {
            path: member.path.clone(),
            section: section.name,
            offset: section.start - member.start,
            need: section.bytes,
            left: end.saturating_sub(section.start),
        }
    }

    /// The root ends inside `section`, and what follows in the next member is not its rest.
    pub(crate) fn cut_in_root(&self, section: Section) -> Error {
        let root = &self.stream.members()[0];
        let left = root.bytes.saturating_sub(section.start);
        Error::Truncated {
            path: root.path.clone(),
            section: section.name,
            offset: section.start,
            need: section.bytes,
            left,
        }
    }
}
