//! `crumple describe --interactive`: the loop of the paper's workflow figure, by hand. Build a descriptor, look at what
//! it rebuilds, raise or lower t, look again.
//!
//! Keys are read one at a time from a terminal; from a pipe they are its characters, so that the loop can be scripted.

use std::io::{IsTerminal, Read};

use console::{Key, Term};
use crumple::Error;
use crumple::descriptor::{self, DescribeOptions, Described, Threshold};
use crumple::report::picture::{Frame, View, pixels};
use crumple::study::Loaded;
use crumple::target::Named;

use super::Answer;
use super::describe::words;
use crate::output::Output;

/// One key changes t by this factor.
const STEP: f64 = 1.1;

/// Characters of a picture: 64 wide, 16 high, two pixels in each.
const PICTURE: (u32, u32) = (64, 32);

const KEYS: &str = "+ raises t   - lowers t   s saves   q quits";

/// Runs the loop until the user quits or the input ends.
pub(super) fn search(
    loaded: &Loaded,
    named: &Named,
    mode: Option<&str>,
    name: Option<&str>,
    options: &DescribeOptions,
    output: &Output,
) -> Result<Answer, Error> {
    if output.json {
        return Err(Error::Value {
            name: "--json",
            value: "with --interactive".into(),
            expected: "one of the two: the loop is for a person".into(),
        });
    }
    let build = |threshold: Threshold| {
        descriptor::describe(loaded, named, mode, name, &DescribeOptions { threshold, ..options.clone() })
    };
    let unit = &loaded.study.settings().length_unit;
    let mut now = build(options.threshold)?;
    let mut keys = Keys::open();
    let screen = keys.is_terminal() && std::io::stdout().is_terminal();
    let colours = screen && console::colors_enabled();
    let mut word = None;
    loop {
        if screen {
            // A screen that cannot be cleared is written below what stands there.
            let _ = Term::stdout().clear_screen();
        }
        output.line(&picture(loaded, &now, colours));
        output.line(words(&now.descriptor, unit).trim_end());
        output.line(&word.take().unwrap_or_else(|| KEYS.to_owned()));
        let t = now.descriptor.selected.threshold;
        let changed = match keys.next()? {
            None | Some('q') => return Ok(Answer::Done),
            Some('s') => {
                let path = descriptor::save(&loaded.study, &now.descriptor)?;
                word = Some(format!("saved in {}   {KEYS}", path.display()));
                continue;
            }
            Some('+' | '=') => build(Threshold::Value(t * STEP)),
            Some('-' | '_') => build(Threshold::Value(t / STEP)),
            Some(other) => {
                word = Some(format!("no key '{}'   {KEYS}", other.escape_default()));
                continue;
            }
        };
        match changed {
            Ok(described) => now = described,
            // A t that selects nothing is a place to turn back from, not the end.
            Err(error @ Error::Threshold { .. }) => word = Some(format!("{error}   {KEYS}")),
            Err(other) => return Err(other),
        }
    }
}

/// Where keys come from.
enum Keys {
    Terminal(Term),
    Pipe(std::io::Stdin),
}

impl Keys {
    fn open() -> Self {
        let stdin = std::io::stdin();
        if stdin.is_terminal() { Self::Terminal(Term::stdout()) } else { Self::Pipe(stdin) }
    }

    fn is_terminal(&self) -> bool {
        matches!(self, Self::Terminal(_))
    }

    /// The next key; `None` at the end of the input. Blanks and line ends of a pipe are no keys.
    fn next(&mut self) -> Result<Option<char>, Error> {
        match self {
            Self::Terminal(term) => match term.read_key() {
                Ok(Key::ArrowUp) => Ok(Some('+')),
                Ok(Key::ArrowDown) => Ok(Some('-')),
                Ok(Key::Escape) => Ok(Some('q')),
                Ok(Key::Char(key)) => Ok(Some(key)),
                Ok(_) => Ok(Some('?')),
                // Ctrl-C, which a terminal that waits for a key hands on as an error; and a terminal that is gone.
                Err(_) => Err(Error::Stopped),
            },
            Self::Pipe(stdin) => {
                for byte in std::io::BufReader::with_capacity(1, stdin).bytes() {
                    match byte {
                        Ok(byte) if byte.is_ascii_whitespace() => {}
                        Ok(byte) => return Ok(Some(char::from(byte))),
                        Err(_) => return Ok(None),
                    }
                }
                Ok(None)
            }
        }
    }
}

/// The reconstruction in half-block characters: the shape, coloured by its displacement along z, or the part as it was,
/// coloured by the field.
fn picture(loaded: &Loaded, described: &Described, colours: bool) -> String {
    let before = loaded.reference.mesh.vertices();
    let view = View { width: PICTURE.0, height: PICTURE.1, ..View::of(before) };
    let is_shape = described.descriptor.selected.field.is_none();
    let (shape, values): (&[[f64; 3]], Vec<f64>) = if is_shape {
        let values = described.reconstruction.iter().zip(before).map(|(p, q)| p[2] - q[2]).collect();
        (&described.reconstruction, values)
    } else {
        (before, described.reconstruction.iter().map(|value| value[0]).collect())
    };
    // One frame and one range for all steps, so that pictures can be compared.
    let original: &[[f64; 3]] = if is_shape { &described.original } else { before };
    let frame = Frame::of(&[before, original], view.direction);
    let own = |(p, q): (&[f64; 3], &[f64; 3])| if is_shape { (p[2] - q[2]).abs() } else { p[0].abs() };
    let range = described.original.iter().zip(before).map(own).fold(f64::MIN_POSITIVE, f64::max);
    let rgba = pixels(shape, loaded.reference.mesh.triangles(), &values, range, &View { frame, ..view });
    half_blocks(&rgba, PICTURE.0 as usize, colours)
}

/// Two rows of pixels in one row of characters. Without colours a pixel is there or not.
fn half_blocks(rgba: &[u8], width: usize, colours: bool) -> String {
    let (pixels, _) = rgba.as_chunks::<4>();
    let rows: Vec<&[[u8; 4]]> = pixels.chunks(width).collect();
    let line = |pair: &[&[[u8; 4]]]| {
        let below = |at: usize| pair.get(1).map_or([0; 4], |row| row[at]);
        let cells: String = (0..width).map(|at| cell(pair[0][at], below(at), colours)).collect();
        cells.trim_end().to_owned()
    };
    rows.chunks(2).map(line).collect::<Vec<_>>().join("\n")
}

fn cell(above: [u8; 4], below: [u8; 4], colours: bool) -> String {
    let there = |pixel: [u8; 4]| pixel[3] > 127;
    let paint = |code: u8, [red, green, blue, _]: [u8; 4]| format!("\x1b[{code};2;{red};{green};{blue}m");
    let (block, ink) = match (there(above), there(below)) {
        (false, false) => return " ".into(),
        (true, false) => ('▀', paint(38, above)),
        (false, true) => ('▄', paint(38, below)),
        (true, true) if colours => ('▀', paint(38, above) + &paint(48, below)),
        (true, true) => ('█', String::new()),
    };
    if colours { format!("{ink}{block}\x1b[0m") } else { block.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_blocks_hold_two_rows() {
        let (on, off) = ([200, 100, 50, 255], [0; 4]);
        let rgba = [on, off, on, off, on, off, on, off].concat();
        // Two wide: rows (on, off), (on, off), (on, off), (on, off).
        assert_eq!(half_blocks(&rgba, 2, false), "█\n█");
        let rgba = [on, off, off, off, off, on].concat();
        assert_eq!(half_blocks(&rgba, 2, false), "▀\n ▀");
        assert_eq!(half_blocks(&rgba[..8], 2, true), "\x1b[38;2;200;100;50m▀\x1b[0m");
    }
}
