//! Where the states are: from time word to time word through every member.
//!
//! A member ends at an end mark, at padding, at its last byte, or where the next word is no later time. The first three
//! confirm the length of a state, the last speaks against it; that is how the right one of several layouts is told.

use crate::error::Error;
use crate::geometry::END_MARK;
use crate::members::Stream;
use crate::titles::is_time;
use crate::warning::Warning;
use crate::words::Words;

/// Bytes read at a time where one word is wanted and states are short.
const WINDOW: u64 = 1 << 16;

/// More states than a few are believed only if each has some results: what is kept of a state is then small beside it.
const FEW_STATES: u64 = 1024;
const BYTES_OF_A_STATE: u64 = 64;

/// The states found with one length of a state.
#[derive(Debug, Clone, Default)]
pub(crate) struct Walk {
    /// Byte of the stream at which each state starts.
    pub(crate) starts: Vec<u64>,
    /// Its time.
    pub(crate) times: Vec<f64>,
    /// Members with states that end where a state of this length ends: at a mark, at padding, at the last byte.
    pub(crate) confirmed: usize,
    /// Those of them that end at a mark.
    marked: usize,
    /// Members that do not.
    pub(crate) doubtful: usize,
    pub(crate) warnings: Vec<Warning>,
}

impl Walk {
    /// Whether most members speak for this length: then no other one can fit better.
    pub(crate) fn is_settled(&self) -> bool {
        self.doubtful == 0 || self.marked > self.doubtful
    }

    /// Whether this length fits the members and `other` does not. Only marks count: a wrong length may well end at the
    /// last byte of a cut member, or in padding.
    pub(crate) fn fits_better_than(&self, other: &Walk) -> bool {
        self.marked > other.marked && self.doubtful < other.doubtful
    }
}

/// What the walks of several lengths share.
pub(crate) struct Walker<'a> {
    stream: &'a Stream,
    words: Words,
    /// Byte of the stream from which on states are looked for.
    from: u64,
    /// A state of nothing but zeros is possible: there are no coordinates in it.
    zeros_are_states: bool,
    /// End of the last byte that is not zero, by member.
    content: Vec<Option<u64>>,
    window: (u64, Vec<u8>),
}

impl<'a> Walker<'a> {
    pub(crate) fn new(stream: &'a Stream, words: Words, from: u64, zeros_are_states: bool) -> Walker<'a> {
        let content = vec![None; stream.members().len()];
        Walker { stream, words, from, zeros_are_states, content, window: (0, Vec::new()) }
    }

    /// Finds the states of `state_words` words.
    pub(crate) fn walk(&mut self, state_words: u64) -> Result<Walk, Error> {
        let members = self.stream.members();
        let longest = members.iter().map(|member| member.bytes).max().unwrap_or(0);
        let state = state_words.saturating_mul(self.words.size());
        let mut walk = Walk::default();
        // states may start right behind the geometry, which may itself have run on
        let mut at = self.from;
        let mut index = self.stream.member_at(at);
        if at >= self.stream.total() {
            return Ok(walk);
        }
        // where the next state starts if states are longer than members
        let mut next_start = members[index].number;
        while let Some(member) = members.get(index) {
            at = at.max(member.start);
            if state > longest && at == member.start {
                // behind a gap a member may start inside a state: all states take as many members
                let span = state.div_ceil(longest.max(1));
                let behind = u64::from(member.number.saturating_sub(next_start)) % span;
                if behind != 0 {
                    index += 1;
                    continue;
                }
            }
            let before = walk.starts.len();
            let stop = self.walk_member(index, &mut at, state, longest, &mut walk)?;
            let has_states = walk.starts.len() > before || at > member.start && index > 0;
            match stop {
                Stop::Mark | Stop::End if has_states => {
                    walk.confirmed += 1;
                    walk.marked += usize::from(matches!(stop, Stop::Mark));
                }
                Stop::Mark | Stop::End => {}
                Stop::Doubt | Stop::Cut => walk.doubtful += 1,
                Stop::RanOn => {}
            }
            match stop {
                Stop::RanOn => {
                    index = if at < self.stream.total() { self.stream.member_at(at) } else { members.len() };
                    next_start = members.get(index).map_or(next_start, |member| member.number);
                }
                Stop::Cut if state > longest => {
                    let spans = ((at - member.start).saturating_add(state)).div_ceil(longest.max(1));
                    next_start = member.number.saturating_add(u32::try_from(spans).unwrap_or(u32::MAX));
                    index += members[index..].iter().take_while(|member| member.number < next_start).count();
                }
                Stop::Mark | Stop::End | Stop::Doubt | Stop::Cut => {
                    next_start = member.number + 1;
                    index += 1;
                }
            }
        }
        Ok(walk)
    }

    /// Finds the states that start in member `index` from byte `at` on, which is left where the search stopped.
    fn walk_member(
        &mut self,
        index: usize,
        at: &mut u64,
        state: u64,
        longest: u64,
        walk: &mut Walk,
    ) -> Result<Stop, Error> {
        let member = &self.stream.members()[index];
        let size = self.words.size();
        loop {
            let left = member.end() - *at;
            if left < size {
                if left > 0 {
                    walk.warnings.push(Warning::OddBytes { member: member.path.clone(), bytes: left });
                }
                return Ok(Stop::End);
            }
            let time = self.word(*at, state)?;
            if time == END_MARK {
                return Ok(Stop::Mark);
            }
            let empty = time == 0.0 && *at >= self.content_end(index)?;
            let at_start = index > 0 && *at == member.start;
            if empty && !at_start {
                return Ok(Stop::End);
            }
            let (path, offset) = (member.path.clone(), *at - member.start);
            // a member of nothing but zeros: a first state without coordinates, or nothing was written into it
            let nothing = empty && left >= state && !(self.zeros_are_states && walk.starts.is_empty());
            if nothing || !is_time(time) || walk.times.last().is_some_and(|last| time < *last) {
                walk.warnings.push(Warning::UnreadTail { member: path, offset, word: time });
                return Ok(Stop::Doubt);
            }
            let runs_on = left < state && state > longest && self.runs_on(index, *at, state, longest);
            if left < state && !runs_on {
                let words_missing = (state - left).div_ceil(size);
                walk.warnings.push(Warning::CutState { member: path, offset, time, words_missing });
                return Ok(Stop::Cut);
            }
            if walk.starts.len() as u64 > FEW_STATES + self.stream.total() / BYTES_OF_A_STATE {
                let what = format!("more than {} states of {state} bytes", walk.starts.len());
                return Err(Error::Unsupported { path: self.stream.root().to_owned(), what });
            }
            walk.starts.push(*at);
            walk.times.push(time);
            *at += state;
            if runs_on {
                return Ok(Stop::RanOn);
            }
        }
    }

    /// Whether the state that starts in member `index` lies in it and the next ones: they must be numbered without a
    /// gap, and all but the last be full, or words of another state would be taken for this one's.
    fn runs_on(&self, index: usize, at: u64, state: u64, longest: u64) -> bool {
        let Some(end) = at.checked_add(state) else {
            return false;
        };
        // the length limit of members is a whole number of 512-word blocks; another length is that of a cut file
        if !longest.is_multiple_of(512 * self.words.size()) {
            return false;
        }
        for pair in self.stream.members()[index..].windows(2) {
            if pair[0].bytes != longest || pair[1].number != pair[0].number + 1 {
                return false;
            }
            if end <= pair[1].end() {
                return true;
            }
        }
        false
    }

    /// The float at byte `at`. Short states are read by the window, long ones word by word.
    fn word(&mut self, at: u64, state: u64) -> Result<f64, Error> {
        let size = self.words.size();
        let (start, bytes) = &self.window;
        if at < *start || at + size > *start + bytes.len() as u64 {
            let count = if state < WINDOW / 8 { WINDOW } else { size };
            self.window = (at, self.stream.read(at, count.min(self.stream.total() - at))?);
        }
        let (start, bytes) = &self.window;
        let offset = (at - start) as usize;
        Ok(self.words.float(&bytes[offset..offset + size as usize]))
    }

    /// Byte of the stream behind which member `index` holds nothing but zeros.
    fn content_end(&mut self, index: usize) -> Result<u64, Error> {
        if let Some(end) = self.content[index] {
            return Ok(end);
        }
        let member = &self.stream.members()[index];
        let mut end = member.end();
        while end > member.start {
            let count = (end - member.start).min(WINDOW);
            let bytes = self.stream.read(end - count, count)?;
            if let Some(last) = bytes.iter().rposition(|&byte| byte != 0) {
                end = end - count + last as u64 + 1;
                break;
            }
            end -= count;
        }
        self.content[index] = Some(end);
        Ok(end)
    }
}

/// How a member came to its end.
enum Stop {
    /// At a mark.
    Mark,
    /// At padding, or at the last byte.
    End,
    /// At a word that is no time.
    Doubt,
    /// In a state that is not whole.
    Cut,
    /// In a state that ends in a later member.
    RanOn,
}
