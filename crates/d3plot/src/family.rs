//! A family opened: header, geometry, parts, and the place of every state.

use std::path::{Path, PathBuf};

use crate::airbags::uncertain_airbags;
use crate::control::{Control, Header};
use crate::detect::{self, FileType};
use crate::elements::Geometry;
use crate::error::Error;
use crate::geometry::{Reading, read_geometry};
use crate::members::{Stream, member_number};
use crate::motion::Motion;
use crate::parts::{Part, assemble};
use crate::quantity::{Quantity, quantities};
use crate::rigid::{UNCHECKED, uncertain_rigid_bodies};
use crate::roots::roots;
use crate::state::{Field, Layout, Variant};
use crate::titles::{Titles, read_titles};
use crate::walk::{Walk, Walker};
use crate::warning::Warning;
use crate::words::decode_text;

/// An opened family: header and geometry are known, states are located, nothing of the states has been read but their
/// times. Results of a state are read when they are asked for, and only the bytes they need.
///
/// ```
/// use d3plot::{Family, Layers};
///
/// let root = concat!(env!("CARGO_MANIFEST_DIR"), "/testdata/s01_shells_latin1/d3plot");
/// let family = Family::open(root.as_ref())?;
/// assert_eq!(family.geometry().shells.len(), 35);
/// assert_eq!(family.parts()[0].title, "Längsträger vorn");
///
/// let last = family.times().len() - 1;
/// let positions = family.coordinates(last)?.expect("this family holds coordinates");
/// let strain = family.shell_plastic_strain(last, Layers::Max)?.expect("and plastic strain");
/// assert_eq!((positions.len(), strain.len()), (family.header().nodes, family.header().shells));
/// # Ok::<(), d3plot::Error>(())
/// ```
#[derive(Debug)]
pub struct Family {
    pub(crate) stream: Stream,
    pub(crate) control: Control,
    pub(crate) reading: Reading,
    pub(crate) layout: Layout,
    /// What the words of the elements are.
    pub(crate) quantities: Vec<Quantity>,
    /// Byte of the stream at which each state starts.
    pub(crate) starts: Vec<u64>,
    /// NDIM 8, 9: how nodes of rigid bodies move, which the states leave out.
    pub(crate) motion: Option<Motion>,
    header: Header,
    parts: Vec<Part>,
    times: Vec<f64>,
    members: Vec<Member>,
    warnings: Vec<Warning>,
}

/// How a family is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ReadOptions {
    /// Map the files into memory instead of reading them piece by piece. That spares a copy, and is safe only if no
    /// process cuts or changes the files while the family is open: a map of a file that becomes shorter ends this program by
    /// a signal, where plain reading gives [`Error::Changed`]. Never for a run that is still being written.
    pub map: bool,
}

/// A file of the family.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Member {
    /// The file.
    pub path: PathBuf,
    /// Its size.
    pub bytes: u64,
    /// Whole states that start in it.
    pub states: usize,
}

impl Family {
    /// Opens the family of a root file, or the one family of a folder: the only one, or the only d3plot beside a
    /// d3part, d3drlf or d3eigv.
    ///
    /// A run that was killed, members that are missing and titles that are cut cost only themselves:
    /// see [`Family::warnings`].
    ///
    /// # Errors
    /// Any [`Error`] but [`Error::NoSuchState`] and [`Error::Layer`]: what is there is not a family, or its control
    /// block or geometry cannot be read with certainty.
    pub fn open(path: &Path) -> Result<Family, Error> {
        Family::open_with(path, ReadOptions::default())
    }

    /// As [`Family::open`], with another way of reading.
    ///
    /// # Errors
    /// As [`Family::open`].
    pub fn open_with(path: &Path, options: ReadOptions) -> Result<Family, Error> {
        let data = std::fs::metadata(path).map_err(Error::io(path, "looking at it"))?;
        let root = if data.is_dir() { only_root(path)? } else { path.to_owned() };
        let mut warnings = Vec::new();
        let stream = Stream::find(&root, options.map, &mut warnings)?;
        Family::of_stream(stream, warnings).map_err(|error| state_file(&root, error))
    }

    /// A family of bytes that are in memory: out of an archive, or from another machine. The first file is the root; the
    /// others are its members if their names are the root's with a number behind it, and are passed over if not.
    ///
    /// # Errors
    /// As [`Family::open`]; [`Error::NotFound`] if there is no file.
    pub fn of_bytes(files: Vec<(PathBuf, Vec<u8>)>) -> Result<Family, Error> {
        let Some(root) = files.first().map(|(path, _)| path.clone()) else {
            return Err(Error::NotFound { path: PathBuf::new() });
        };
        let number = |path: &Path| {
            let suffix = path.as_os_str().as_encoded_bytes().strip_prefix(root.as_os_str().as_encoded_bytes())?;
            if suffix.is_empty() { Some(0) } else { member_number(suffix) }
        };
        let mut files: Vec<(u32, PathBuf, Vec<u8>)> =
            files.into_iter().filter_map(|(path, bytes)| Some((number(&path)?, path, bytes))).collect();
        files.sort_by_key(|file| file.0);
        files.dedup_by_key(|file| file.0);
        let mut warnings = Vec::new();
        let stream = Stream::of_memory(files, &mut warnings);
        Family::of_stream(stream, warnings)
    }

    fn of_stream(stream: Stream, mut warnings: Vec<Warning>) -> Result<Family, Error> {
        let control = Control::read(&stream)?;
        let mut reading = read_geometry(&control, &stream)?;
        if !reading.numbers_agree {
            warnings.push(Warning::UserNumbers { path: stream.root().to_owned() });
        }
        let titles = read_titles(&control, &stream, &reading, &mut warnings)?;
        let parts = assemble(&control, &mut reading, &titles, &stream, &mut warnings)?;
        let (layout, walk) = locate(&control, &stream, &reading, &titles, &mut warnings)?;
        let Walk { starts, times, .. } = walk;
        if starts.is_empty() {
            warnings.push(Warning::NoStates);
        }
        let mut members: Vec<Member> = stream
            .members()
            .iter()
            .map(|member| Member { path: member.path.clone(), bytes: member.bytes, states: 0 })
            .collect();
        for &start in &starts {
            members[stream.member_at(start)].states += 1;
        }
        let header = header(&control, &titles, &layout);
        let quantities = quantities(&control);
        let motion = None;
        let mut family = Family {
            stream,
            control,
            reading,
            layout,
            quantities,
            starts,
            motion,
            header,
            parts,
            times,
            members,
            warnings,
        };
        family.motion = Motion::of(&family)?;
        if let Some(motion) = &family.motion {
            let active = family.reading.active.as_ref().map_or(0, Vec::len) as u64;
            let count = family.control.nodes.saturating_sub(active);
            family.warnings.insert(0, Warning::RigidNodes { count, rates: motion.has_rates() });
        }
        Ok(family)
    }

    /// The root file.
    pub fn root(&self) -> &Path {
        self.stream.root()
    }

    /// What the control block says.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The mesh before the first state.
    pub fn geometry(&self) -> &Geometry {
        &self.reading.geometry
    }

    /// The parts in internal order, those without elements too. Elements name them by index.
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// Times of the whole states, in the file's time unit, never decreasing.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// The files in order, the root first.
    pub fn members(&self) -> &[Member] {
        &self.members
    }

    /// What is missing or odd although the family was read.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// The tables that every state holds, in the order of the file, and behind them what is taken out of them:
    /// `coordinates` where the file has `displacement`, and quantities of elements such as `shell_stress` (columns: points
    /// times components). [`Family::values`] reads each of them.
    pub fn fields(&self) -> Vec<Field> {
        let mut fields = self.layout.fields.clone();
        if let Some(displacement) = self.layout.field("displacement") {
            fields.push(Field { name: "coordinates", ..displacement.clone() });
        }
        fields.extend(self.quantity_fields());
        fields
    }
}

/// The root that a folder stands for.
fn only_root(folder: &Path) -> Result<PathBuf, Error> {
    let found = roots(folder)?;
    let d3plots: Vec<PathBuf> =
        found.families.iter().filter(|root| root.file_type == FileType::D3plot).map(|root| root.path.clone()).collect();
    let all: Vec<PathBuf> = found.families.iter().map(|root| root.path.clone()).collect();
    let mut refused = found.refused;
    match (all.as_slice(), d3plots.as_slice()) {
        ([only], _) | (_, [only]) => Ok(only.clone()),
        // one file that cannot be read says more by its own error
        ([], _) if refused.len() == 1 => Err(refused.remove(0).error),
        ([], _) => Err(Error::NoFamily {
            folder: folder.to_owned(),
            refused: refused.into_iter().map(|refused| refused.path).collect(),
        }),
        _ => Err(Error::SeveralFamilies { folder: folder.to_owned(), roots: all }),
    }
}

/// A file without control block whose name ends in digits may be a member of a family beside it: say so.
fn state_file(path: &Path, error: Error) -> Error {
    let file_name = path.file_name().unwrap_or_default().as_encoded_bytes();
    let digits = file_name.iter().rev().take_while(|byte| byte.is_ascii_digit()).count();
    if !matches!(error, Error::NotD3plot { .. }) || digits < 2 {
        return error;
    }
    for count in 2..=digits {
        let (name, number) = file_name.split_at(file_name.len() - count);
        let Ok(name) = std::str::from_utf8(name) else {
            break;
        };
        let root = path.with_file_name(name);
        let bytes = std::fs::metadata(&root).map_or(0, |data| data.len());
        if member_number(number).is_some() && detect::is_root(&root, bytes) {
            return Error::NotRoot { path: path.to_owned(), root };
        }
    }
    error
}

/// Finds the states. If the end marks contradict the layout by the manual, the alternatives are tried and the one that
/// fits is taken; if none does, the manual's stands and the warnings of its walk tell what was not read.
fn locate(
    control: &Control,
    stream: &Stream,
    reading: &Reading,
    titles: &Titles,
    warnings: &mut Vec<Warning>,
) -> Result<(Layout, Walk), Error> {
    let manual = Variant::by_the_manual(control, reading);
    let too_long =
        || Error::Unsupported { path: stream.root().to_owned(), what: "a state of more than 2⁶⁴ bytes".to_owned() };
    let declared = manual.layout(control, reading).ok_or_else(too_long)?;
    let mut walker = Walker::new(stream, control.words, titles.states_from, control.iu == 0);
    let walk = walker.walk(declared.words)?;
    let mut best: Option<(Layout, Walk, String)> = None;
    if !walk.is_settled() {
        for (variant, reason) in manual.alternatives(reading) {
            let Some(layout) = variant.layout(control, reading).filter(|layout| layout.words != declared.words) else {
                continue;
            };
            if let Some((_, _, reasons)) = best.as_mut().filter(|(best, ..)| best.words == layout.words) {
                // the marks cannot tell these apart; what stands behind the words in doubt is right in both
                if !reason.contains(',') {
                    *reasons = format!("{reasons} or {reason}");
                }
                continue;
            }
            let other = walker.walk(layout.words)?;
            if other.fits_better_than(best.as_ref().map_or(&walk, |(_, walk, _)| walk)) {
                best = Some((layout, other, reason));
            }
        }
    }
    let (layout, mut walk) = match best {
        Some((layout, walk, reason)) => {
            warnings.push(Warning::StateSize { declared: declared.words, used: layout.words, reason });
            (layout, walk)
        }
        None => (declared, walk),
    };
    refuse_uncertain(control, stream, reading, &layout, &walk)?;
    warnings.append(&mut walk.warnings);
    Ok((layout, walk))
}

/// Layouts of which no real file was at hand are believed only if the members confirm them.
fn refuse_uncertain(
    control: &Control,
    stream: &Stream,
    reading: &Reading,
    layout: &Layout,
    walk: &Walk,
) -> Result<(), Error> {
    let contradicted = walk.warnings.iter().any(|warning| matches!(warning, Warning::UnreadTail { .. }));
    let confirmed = walk.confirmed > 0 || walk.starts.is_empty();
    if reading.rigid_bodies > 0 && (contradicted || !confirmed) {
        return Err(uncertain_rigid_bodies(control, stream, UNCHECKED));
    }
    if control.airbags > 0 && (contradicted || !confirmed) {
        return Err(uncertain_airbags(stream));
    }
    if control.reduced && contradicted && !confirmed {
        let words = layout.words;
        let what = format!("reduced output (INUM < 0) whose states do not have the {words} words of the control block");
        return Err(Error::Unsupported { path: stream.root().to_owned(), what });
    }
    Ok(())
}

fn header(control: &Control, titles: &Titles, layout: &Layout) -> Header {
    let title = decode_text(&control.title);
    let long = titles.head.as_deref().map(decode_text).filter(|head| head.len() > title.len());
    Header {
        title: long.unwrap_or(title),
        precision: control.words.precision,
        byte_order: control.words.order,
        file_type: control.file_type,
        release: control.release.clone(),
        run_time: control.run_time,
        nodes: control.nodes as usize,
        solids: control.solids as usize,
        thick_shells: control.thick_shells as usize,
        beams: control.beams as usize,
        shells: control.shells as usize,
        rigid_shells: layout.rigid_shells as usize,
        sph: control.sph as usize,
        parts: control.parts as usize,
        layers: control.layers as usize,
        words_per_state: layout.words,
    }
}
