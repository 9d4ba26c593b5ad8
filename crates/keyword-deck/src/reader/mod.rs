//! The walk through a deck and its includes: lines become cards, cards blocks, blocks the deck.

mod includes;

use std::collections::HashMap;
use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::cards::elements::{self, Elements};
use crate::cards::{self, Block, Frame, small};
use crate::deck::{Deck, DeckFile, place};
use crate::error::Error;
use crate::files::Files;
use crate::include::Include;
use crate::keyword::{format_of_file, is_keyword, keyword_of};
use crate::lines::{LINE_MAX, Lines, Stop};
use crate::parameter::Parameters;
use crate::row::{At, Card, Format, short};
use crate::transform::Step;
use crate::warning::Warning;

/// Lines of something else that may stand in front of the first keyword.
const JUNK_MAX: u64 = 100;

/// Reads the deck whose main file is at `root`.
pub(crate) fn read(files: &dyn Files, root: &Path) -> Result<Deck, Error> {
    let mut reader = Reader {
        files,
        folder: root.parent().unwrap_or(Path::new("")).to_owned(),
        deck: Deck::default(),
        parameters: Parameters::default(),
        paths: Vec::new(),
        transformations: HashMap::new(),
        moves: Vec::new(),
        stack: Vec::new(),
        includes: 0,
        arena: Vec::new(),
        spans: Vec::new(),
    };
    reader.file(root, &Frame::default(), Format::Standard)?;
    reader.finish()
}

/// Where the nodes of an include go: a factor, then a transformation.
#[derive(Debug, Clone)]
struct Move {
    nodes: Range<usize>,
    length: f64,
    transformation: u64,
    include: crate::Place,
}

struct Reader<'a> {
    files: &'a dyn Files,
    /// Folder of the main file.
    folder: PathBuf,
    deck: Deck,
    parameters: Parameters,
    /// *INCLUDE_PATH.
    paths: Vec<PathBuf>,
    transformations: HashMap<u64, Vec<Step>>,
    /// In the order in which they are to be done: inner includes before outer ones.
    moves: Vec<Move>,
    /// Files being read, outermost first: identity and path.
    stack: Vec<(PathBuf, PathBuf)>,
    includes: usize,
    /// Text and spans of a block that is being collected.
    arena: Vec<u8>,
    spans: Vec<(Range<usize>, u64)>,
}

/// What becomes of the cards of a block.
enum Now {
    /// No keyword yet.
    Before,
    Nodes,
    Elements(Box<Elements>),
    Collect,
    Skip,
}

/// The block at hand.
struct Current {
    now: Now,
    keyword: String,
    format: Format,
    line: u64,
    cards: u64,
}

impl Reader<'_> {
    /// Reads one file to its end or *END.
    fn file(&mut self, path: &Path, frame: &Frame, format: Format) -> Result<(), Error> {
        let root = self.stack.is_empty();
        let opened = self.files.open(path);
        let io = |source| Error::Io { path: path.to_owned(), source };
        let mut lines = Lines::new(opened.map_err(io)?);
        skip_mark(&mut lines, path, root)?;
        let at = self.deck.files.len();
        self.deck.files.push(DeckFile { path: path.to_owned(), lines: 0, depth: self.stack.len() });
        self.stack.push((self.files.identity(path), path.to_owned()));
        self.parameters.enter_file();
        let result = self.lines(&mut lines, &path.into(), frame, format, root);
        self.parameters.leave_file();
        self.stack.pop();
        self.deck.files[at].lines = lines.number;
        result
    }

    fn lines(
        &mut self,
        lines: &mut Lines<Box<dyn Read + '_>>,
        file: &Arc<Path>,
        frame: &Frame,
        mut format: Format,
        root: bool,
    ) -> Result<(), Error> {
        let mut block = Current { now: Now::Before, keyword: String::new(), format, line: 0, cards: 0 };
        let mut junk: Option<(u64, String, u64)> = None;
        let mut encrypted = false;
        loop {
            let number = lines.number + 1;
            let line = match lines.next() {
                Ok(Some(line)) => line,
                Ok(None) => break,
                Err(Stop::Io(source)) => return Err(Error::Io { path: file.to_path_buf(), source }),
                Err(Stop::TooLong) => {
                    let place = place(file, number);
                    if matches!(block.now, Now::Before) {
                        return Err(Error::NotADeck { place, found: "a line without end".into() });
                    }
                    return Err(Error::LineTooLong { place, most: LINE_MAX });
                }
            };
            if encrypted {
                encrypted = !line.starts_with(b"-----END PGP");
                continue;
            }
            match line.first() {
                Some(b'$') => {}
                Some(b'-') if line.starts_with(b"-----BEGIN PGP") => {
                    encrypted = true;
                    self.deck.warnings.push(Warning::Encrypted { place: place(file, number) });
                }
                Some(b'*') if !matches!(block.now, Now::Before) || is_keyword(line) => {
                    let (keyword, suffix) = keyword_of(line);
                    let line = line.to_ascii_uppercase();
                    self.end(&mut block, file, frame)?;
                    if let Some((first, _, count)) = junk.take() {
                        self.deck
                            .warnings
                            .push(Warning::BeforeFirstKeyword { place: place(file, first), lines: count });
                    }
                    if keyword == "END" {
                        return Ok(());
                    }
                    if keyword == "KEYWORD" {
                        format = format_of_file(&line, format);
                    }
                    block = self.begin(keyword, cards::format_of(suffix, format), file, number);
                }
                _ if matches!(block.now, Now::Before) => {
                    if !line.trim_ascii().is_empty() {
                        let (first, found, count) = junk.get_or_insert_with(|| (number, short(line.trim_ascii()), 0));
                        *count += 1;
                        if *count > JUNK_MAX || line.contains(&0) {
                            return Err(Error::NotADeck { place: place(file, *first), found: std::mem::take(found) });
                        }
                    }
                }
                _ => self.card(&mut block, Card { text: line, line: number }, file, frame)?,
            }
        }
        if matches!(block.now, Now::Before) && (root || junk.is_some()) {
            let (line, found, _) = junk.unwrap_or((lines.number.max(1), String::new(), 0));
            return Err(Error::NotADeck { place: place(file, line), found });
        }
        self.end(&mut block, file, frame)
    }

    fn begin(&mut self, keyword: String, format: Format, file: &Arc<Path>, line: u64) -> Current {
        self.arena.clear();
        self.spans.clear();
        let words: Vec<&str> = keyword.split('_').collect();
        let now = match words[..] {
            ["NODE"] => Now::Nodes,
            ["KEYWORD", ..] => Now::Skip,
            ["ELEMENT", ..] => Elements::of(&words).map_or(Now::Skip, |elements| Now::Elements(Box::new(elements))),
            _ if cards::is_read(&words) => Now::Collect,
            _ => Now::Skip,
        };
        let changes = match words[..] {
            ["NODE", "TRANSFORM", ..] => Some("nodes stay where they are"),
            ["ELEMENT", _, "NURBS" | "SOURCE", ..] | ["ELEMENT", "GENERALIZED" | "INTERPOLATION", ..] => {
                Some("its elements are not in the mesh")
            }
            _ => None,
        };
        if let Some(what) = changes {
            self.deck.warnings.push(Warning::NotFollowed { place: place(file, line), keyword: keyword.clone(), what });
        }
        Current { now, keyword, format, line, cards: 0 }
    }

    fn card(&mut self, block: &mut Current, card: Card<'_>, file: &Arc<Path>, frame: &Frame) -> Result<(), Error> {
        block.cards += u64::from(!card.is_blank());
        let at = At { file, keyword: &block.keyword, format: block.format, parameters: &self.parameters };
        match &mut block.now {
            Now::Nodes if card.is_blank() => Ok(()),
            Now::Nodes => elements::node(card, &at, frame, &mut self.deck),
            Now::Elements(elements) => elements.card(card, &at, frame, &mut self.deck),
            Now::Collect => {
                let start = self.arena.len();
                self.arena.extend_from_slice(card.text);
                self.spans.push((start..self.arena.len(), card.line));
                Ok(())
            }
            Now::Skip | Now::Before => Ok(()),
        }
    }

    /// The block is over: what was collected is read.
    fn end(&mut self, block: &mut Current, file: &Arc<Path>, frame: &Frame) -> Result<(), Error> {
        let keyword = std::mem::take(&mut block.keyword);
        match std::mem::replace(&mut block.now, Now::Skip) {
            Now::Before | Now::Nodes => Ok(()),
            Now::Skip => {
                if keyword != "KEYWORD" {
                    self.deck.skip(&keyword, block.cards);
                }
                Ok(())
            }
            Now::Elements(elements) => {
                let at = At { file, keyword: &keyword, format: block.format, parameters: &self.parameters };
                elements.end(&at, block.line + block.cards)
            }
            Now::Collect => {
                let (arena, spans) = (std::mem::take(&mut self.arena), std::mem::take(&mut self.spans));
                let cards: Vec<Card<'_>> =
                    spans.iter().map(|(span, line)| Card { text: &arena[span.clone()], line: *line }).collect();
                let result = self.collected(&keyword, &cards, block, file, frame);
                drop(cards);
                (self.arena, self.spans) = (arena, spans);
                result
            }
        }
    }

    fn collected(
        &mut self,
        keyword: &str,
        cards: &[Card<'_>],
        block: &Current,
        file: &Arc<Path>,
        frame: &Frame,
    ) -> Result<(), Error> {
        let words: Vec<&str> = keyword.split('_').collect();
        let mut parameters = std::mem::take(&mut self.parameters);
        let mut include = None;
        let done = if words[0] == "PARAMETER" {
            // Its cards see the definitions before them, which `small::parameter` hands on.
            let at = At { file, keyword, format: block.format, parameters: &Parameters::default() };
            let whole = Block { keyword, words, cards, at: &at, frame, line: block.line };
            small::parameter(&whole, &mut parameters, &mut self.deck.warnings).map(|()| true)
        } else {
            let at = At { file, keyword, format: block.format, parameters: &parameters };
            let whole = Block { keyword, words, cards, at: &at, frame, line: block.line };
            match whole.words[..] {
                ["DEFINE", "TRANSFORMATION", ..] => small::transformation(&whole).map(|(id, steps)| {
                    self.transformations.entry(id).or_insert(steps);
                    true
                }),
                ["INCLUDE", ..] => Include::of(&whole).map(|found| {
                    include = found;
                    include.is_some()
                }),
                _ => cards::read(&whole, &mut self.deck),
            }
        };
        self.parameters = parameters;
        match done {
            Ok(true) => {}
            Ok(false) => self.deck.skip(keyword, block.cards),
            // The mesh does not hang on these blocks: each costs itself and a warning.
            Err(error) => {
                let what = error.to_string();
                self.deck.warnings.push(Warning::BadCard {
                    place: place(file, block.line),
                    keyword: keyword.to_owned(),
                    what,
                });
            }
        }
        include.map_or(Ok(()), |include| self.include(include, block, file, frame))
    }
}

/// Passes a byte order mark of UTF-8; refuses what is no text.
fn skip_mark(lines: &mut Lines<Box<dyn Read + '_>>, path: &Path, root: bool) -> Result<(), Error> {
    let head = lines.peek(4).map_err(|source| Error::Io { path: path.to_owned(), source })?;
    let what = match head {
        [] if root => return Err(Error::Empty { path: path.to_owned() }),
        [0x1f, 0x8b, ..] => "compressed with gzip",
        [b'P', b'K', 3, 4] => "a zip archive",
        [b'B', b'Z', b'h', ..] => "compressed with bzip2",
        [0xfd, b'7', b'z', b'X'] => "compressed with xz",
        [0x28, 0xb5, 0x2f, 0xfd] => "compressed with zstd",
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => "text in UTF-16",
        [0xef, 0xbb, 0xbf, ..] => {
            lines.skip(3);
            return Ok(());
        }
        _ => return Ok(()),
    };
    Err(Error::Packed { path: path.to_owned(), what })
}
