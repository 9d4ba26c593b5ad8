//! The files of a family, seen as one stream of bytes: root, root01, root02 … one after the other.
//!
//! A section or a state that is longer than a member runs on into the next one, so everything above this room
//! counts bytes from the start of the root. Reads are positioned and bounded by the sizes seen at opening.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use crate::detect;
use crate::error::Error;
use crate::map::Map;
use crate::warning::Warning;

/// One file of the family.
#[derive(Debug, Clone)]
pub(crate) struct MemberFile {
    pub(crate) path: PathBuf,
    /// Its number, 0 for the root.
    pub(crate) number: u32,
    /// Where it starts in the stream.
    pub(crate) start: u64,
    pub(crate) bytes: u64,
}

impl MemberFile {
    pub(crate) fn end(&self) -> u64 {
        self.start + self.bytes
    }
}

/// The members of a family in order, and where their bytes come from.
#[derive(Debug)]
pub(crate) struct Stream {
    members: Vec<MemberFile>,
    source: Source,
}

/// Where bytes come from.
#[derive(Debug)]
enum Source {
    /// Positioned reads; the file read last is kept open.
    Files(Latest),
    /// Files mapped into memory when they are first needed.
    Maps(Vec<OnceLock<Map>>),
    /// Bytes that the caller has.
    Memory(Vec<Vec<u8>>),
}

/// Bytes read at a time where they are decoded at once: a buffer of this size stays in the processor's cache.
const PIECE: u64 = 1 << 17;

impl Stream {
    /// Finds the members of the family of `root` in its folder: names are compared as strings of bytes, so that no
    /// character of a name means anything.
    pub(crate) fn find(root: &Path, map: bool, warnings: &mut Vec<Warning>) -> Result<Stream, Error> {
        let bytes = fs::metadata(root).map_err(Error::io(root, "looking at it"))?.len();
        let mut found = vec![(0, root.to_owned(), bytes)];
        let mut levels = Vec::new();
        let root_name = root.file_name().unwrap_or_default().as_encoded_bytes();
        // the base of a level of an adaptive mesh: d3plot beside d3plotaa
        let is_base = |name: &[u8]| root_name.strip_prefix(name).is_some_and(is_level);
        let is_kin = |name: &[u8]| {
            is_base(name)
                || name
                    .strip_prefix(root_name)
                    .is_some_and(|suffix| is_level(suffix) || member_number(suffix).is_some())
        };
        for (path, bytes) in files_in(folder_of(root), is_kin)? {
            let file_name = path.file_name().unwrap_or_default().as_encoded_bytes();
            let number = file_name.strip_prefix(root_name).and_then(member_number);
            // the folder as the caller wrote it
            let path = root.with_file_name(path.file_name().unwrap_or_default());
            match (number, detect::is_surely_root(&path, bytes)) {
                (Some(number), false) => found.push((number, path, bytes)),
                (Some(_), true) => warnings.push(Warning::AnotherRoot { path }),
                (None, true) => levels.push(path),
                (None, false) => {}
            }
        }
        // d3plot01 and d3plot001 have one number: the shorter name is the solver's
        found.sort_by(|a, b| (a.0, a.1.as_os_str().len(), &a.1).cmp(&(b.0, b.1.as_os_str().len(), &b.1)));
        found.dedup_by_key(|member| member.0);
        if !levels.is_empty() {
            levels.sort();
            warnings.push(Warning::AdaptiveLevels { levels });
        }
        let source = match map {
            true => Source::Maps(found.iter().map(|_| OnceLock::new()).collect()),
            false => Source::Files(Mutex::new(None)),
        };
        Ok(Stream { members: in_a_row(found, warnings), source })
    }

    /// A family whose bytes the caller has: the root first, then the members with their numbers, rising.
    pub(crate) fn of_memory(files: Vec<(u32, PathBuf, Vec<u8>)>, warnings: &mut Vec<Warning>) -> Stream {
        let found = files.iter().map(|(number, path, bytes)| (*number, path.clone(), bytes.len() as u64)).collect();
        let source = Source::Memory(files.into_iter().map(|(_, _, bytes)| bytes).collect());
        Stream { members: in_a_row(found, warnings), source }
    }

    pub(crate) fn members(&self) -> &[MemberFile] {
        &self.members
    }

    pub(crate) fn root(&self) -> &Path {
        &self.members[0].path
    }

    /// Bytes of all members together.
    pub(crate) fn total(&self) -> u64 {
        self.members.last().map_or(0, MemberFile::end)
    }

    /// Index of the member that holds byte `at` of the stream; the last one for a byte behind the end.
    pub(crate) fn member_at(&self, at: u64) -> usize {
        self.members.partition_point(|member| member.end() <= at).min(self.members.len() - 1)
    }

    /// Path of the member that holds byte `at`, and the byte's place in it: for messages.
    pub(crate) fn place(&self, at: u64) -> (PathBuf, u64) {
        let member = &self.members[self.member_at(at)];
        (member.path.clone(), at - member.start)
    }

    /// Byte to which a section that starts in member `first` may reach. It runs on only out of members that are a whole
    /// number of 512-word blocks, all of one length but the last, and numbered without a gap: words of another member
    /// must not complete a file that was cut.
    pub(crate) fn run_on_limit(&self, first: usize, word_size: u64) -> u64 {
        let full = self.members[0].bytes;
        let mut limit = self.members[first].end();
        if !full.is_multiple_of(512 * word_size) {
            return limit;
        }
        for pair in self.members[first..].windows(2) {
            if pair[0].bytes != full || pair[1].number != pair[0].number + 1 {
                break;
            }
            limit = pair[1].end();
        }
        limit
    }

    /// `count` bytes from byte `at` on. Nothing is allocated before the members are known to hold them.
    pub(crate) fn read(&self, at: u64, count: u64) -> Result<Vec<u8>, Error> {
        let length = self.check(at, count)?;
        let mut bytes = vec![0; length];
        self.fill(at, &mut bytes)?;
        Ok(bytes)
    }

    /// Hands `count` bytes from byte `at` on to `take`, piece by piece, each a whole number of rows of `row` bytes.
    pub(crate) fn pieces(&self, at: u64, count: u64, row: u64, mut take: impl FnMut(&[u8])) -> Result<(), Error> {
        self.check(at, count)?;
        let row = row.max(1);
        let piece = (PIECE / row).max(1).saturating_mul(row).min(count);
        let mut buffer = Vec::new();
        let mut done = 0;
        while done < count {
            let here = piece.min(count - done);
            if let Some(bytes) = self.borrowed(at + done, here)? {
                take(bytes);
            } else {
                buffer.resize(here as usize, 0);
                self.fill(at + done, &mut buffer)?;
                take(&buffer);
            }
            done += here;
        }
        Ok(())
    }

    /// The bytes where they lie, if they are in memory and in one member.
    fn borrowed(&self, at: u64, count: u64) -> Result<Option<&[u8]>, Error> {
        let index = self.member_at(at);
        let member = &self.members[index];
        let bytes = match &self.source {
            Source::Files(_) => return Ok(None),
            Source::Maps(maps) => self.map(maps, index)?,
            Source::Memory(files) => &files[index],
        };
        let start = usize::try_from(at - member.start).unwrap_or(usize::MAX);
        Ok(start.checked_add(count as usize).and_then(|end| bytes.get(start..end)))
    }

    /// Whether the members hold these bytes; their number for an allocation.
    fn check(&self, at: u64, count: u64) -> Result<usize, Error> {
        let fits = at.checked_add(count).is_some_and(|end| end <= self.total());
        usize::try_from(count).ok().filter(|_| fits).ok_or_else(|| {
            let (path, offset) = self.place(at);
            let left = self.total().saturating_sub(at);
            Error::Truncated { path, section: "data", offset, need: count, left }
        })
    }

    fn fill(&self, at: u64, into: &mut [u8]) -> Result<(), Error> {
        let mut filled = 0;
        while filled < into.len() {
            let from = at + filled as u64;
            let index = self.member_at(from);
            let member = &self.members[index];
            let here = (member.end() - from).min((into.len() - filled) as u64) as usize;
            self.read_member(index, from - member.start, &mut into[filled..filled + here])?;
            filled += here;
        }
        Ok(())
    }

    fn read_member(&self, index: usize, offset: u64, into: &mut [u8]) -> Result<(), Error> {
        let member = &self.members[index];
        let bytes = match &self.source {
            Source::Files(latest) => return self.read_file(latest, index, offset, into),
            Source::Maps(maps) => self.map(maps, index)?,
            Source::Memory(files) => &files[index],
        };
        let start = usize::try_from(offset).unwrap_or(usize::MAX);
        match start.checked_add(into.len()).and_then(|end| bytes.get(start..end)) {
            Some(bytes) => into.copy_from_slice(bytes),
            None => {
                let (path, found) = (member.path.clone(), bytes.len() as u64);
                return Err(Error::Changed { path, expected: member.bytes, found });
            }
        }
        Ok(())
    }

    fn read_file(&self, latest: &Latest, index: usize, offset: u64, into: &mut [u8]) -> Result<(), Error> {
        let member = &self.members[index];
        let file = self.open(latest, index)?;
        let mut filled = 0;
        while filled < into.len() {
            match read_at(&file, &mut into[filled..], offset + filled as u64) {
                Ok(0) => {
                    let found = offset + filled as u64;
                    return Err(Error::Changed { path: member.path.clone(), expected: member.bytes, found });
                }
                Ok(count) => filled += count,
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                Err(error) => return Err(Error::io(&member.path, "reading")(error)),
            }
        }
        Ok(())
    }

    /// Only the file read last stays open: families of a thousand members would use up the file handles.
    fn open(&self, latest: &Latest, index: usize) -> Result<Arc<File>, Error> {
        let mut latest = latest.lock().unwrap_or_else(PoisonError::into_inner);
        match &*latest {
            Some((open, file)) if *open == index => Ok(Arc::clone(file)),
            _ => {
                let path = &self.members[index].path;
                let file = Arc::new(File::open(path).map_err(Error::io(path, "opening"))?);
                *latest = Some((index, Arc::clone(&file)));
                Ok(file)
            }
        }
    }

    /// The bytes of a member that is mapped; they may be fewer than there were when the family was opened.
    fn map<'a>(&self, maps: &'a [OnceLock<Map>], index: usize) -> Result<&'a [u8], Error> {
        let map = match maps[index].get() {
            Some(map) => map,
            None => {
                let path = &self.members[index].path;
                let map = Map::of(path).map_err(Error::io(path, "mapping"))?;
                maps[index].get_or_init(|| map)
            }
        };
        Ok(map.bytes())
    }
}

/// The file read last, with its place among the members.
type Latest = Mutex<Option<(usize, Arc<File>)>>;

/// The members one after the other in the stream; tells about numbers that are missing.
fn in_a_row(found: Vec<(u32, PathBuf, u64)>, warnings: &mut Vec<Warning>) -> Vec<MemberFile> {
    let mut members: Vec<MemberFile> = Vec::with_capacity(found.len());
    for (number, path, bytes) in found {
        let start = members.last().map_or(0, MemberFile::end);
        if let Some(last) = members.last().filter(|last| number > last.number + 1) {
            let count = number - last.number - 1;
            warnings.push(Warning::MissingMembers { after: last.path.clone(), before: path.clone(), count });
        }
        members.push(MemberFile { path, number, start, bytes });
    }
    members
}

#[cfg(unix)]
fn read_at(file: &File, into: &mut [u8], offset: u64) -> std::io::Result<usize> {
    std::os::unix::fs::FileExt::read_at(file, into, offset)
}

#[cfg(windows)]
fn read_at(file: &File, into: &mut [u8], offset: u64) -> std::io::Result<usize> {
    std::os::windows::fs::FileExt::seek_read(file, into, offset)
}

/// Elsewhere a handle has one position that all its users share: one reader at a time.
#[cfg(not(any(unix, windows)))]
fn read_at(mut file: &File, into: &mut [u8], offset: u64) -> std::io::Result<usize> {
    use std::io::{Read, Seek, SeekFrom};
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    let _guard = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    file.seek(SeekFrom::Start(offset))?;
    file.read(into)
}

/// The first bytes of a file, at most `count`. One read where the file has them: a folder may hold thousands.
pub(crate) fn read_head(path: &Path, count: u64) -> Result<Vec<u8>, Error> {
    let file = File::open(path).map_err(Error::io(path, "opening"))?;
    let mut head = vec![0; count as usize];
    let mut filled = 0;
    while filled < head.len() {
        match read_at(&file, &mut head[filled..], filled as u64) {
            Ok(0) => break,
            Ok(count) => filled += count,
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
            Err(error) => return Err(Error::io(path, "reading")(error)),
        }
    }
    head.truncate(filled);
    Ok(head)
}

/// The ordinary files of a folder whose name is `wanted`, with their sizes, sorted by name.
pub(crate) fn files_in(folder: &Path, wanted: impl Fn(&[u8]) -> bool) -> Result<Vec<(PathBuf, u64)>, Error> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(Error::io(folder, "listing the folder"))? {
        let entry = entry.map_err(Error::io(folder, "listing the folder"))?;
        if !wanted(entry.file_name().as_encoded_bytes()) {
            continue;
        }
        let path = entry.path();
        // a link that leads nowhere is not a file of the family
        if let Some(data) = fs::metadata(&path).ok().filter(fs::Metadata::is_file) {
            files.push((path, data.len()));
        }
    }
    files.sort();
    Ok(files)
}

/// The folder of a file, for listing.
pub(crate) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The number behind the root's name: two digits or more.
pub(crate) fn member_number(suffix: &[u8]) -> Option<u32> {
    let digits = (2..=6).contains(&suffix.len()) && suffix.iter().all(u8::is_ascii_digit);
    let number = std::str::from_utf8(suffix).ok().filter(|_| digits)?.parse().ok()?;
    (number > 0).then_some(number)
}

/// Whether a suffix is that of an adaptive level: two letters, `aa` to `zz`.
pub(crate) fn is_level(suffix: &[u8]) -> bool {
    suffix.len() == 2 && suffix.iter().all(u8::is_ascii_lowercase)
}
