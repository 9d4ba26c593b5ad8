//! Other files: where they are found, what may not happen with them, and where their nodes go in the end.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::{Current, Move, Reader};
use crate::cards::Frame;
use crate::deck::{Deck, place};
use crate::error::{Error, Place};
use crate::include::{Change, Include};
use crate::keyword::native;
use crate::row::Format;
use crate::transform::{Affine, affine};
use crate::warning::Warning;

/// Includes inside each other.
const DEPTH_MAX: usize = 64;
/// Includes in all: two files that include each other's neighbours many times must not run for ever.
const INCLUDES_MAX: usize = 10_000;
impl Reader<'_> {
    pub(super) fn include(
        &mut self,
        include: Include,
        block: &Current,
        file: &Arc<Path>,
        frame: &Frame,
    ) -> Result<(), Error> {
        let beside = file.parent().unwrap_or(Path::new(""));
        match include {
            Include::Paths { folders, relative } => {
                let from = if relative { beside } else { &self.folder };
                let folders: Vec<PathBuf> = folders.iter().map(|folder| from.join(native(folder))).collect();
                self.paths.extend(folders);
                Ok(())
            }
            Include::NotFollowed => {
                self.deck.warnings.push(Warning::NotFollowed {
                    place: place(file, block.line),
                    keyword: block.keyword.clone(),
                    what: "what the file holds is not in the mesh",
                });
                Ok(())
            }
            Include::Files { names, change } => {
                for (name, line) in names {
                    let name = name.trim_matches('"').to_owned();
                    let found = self.find(&name, beside);
                    let here = place(file, line);
                    match found {
                        Err(searched) => {
                            self.deck.warnings.push(Warning::MissingInclude { place: here, name, searched })
                        }
                        Ok(path) => self.included(&path, name, here, change.as_ref(), block.format, frame)?,
                    }
                }
                Ok(())
            }
        }
    }

    /// Looks for an included file: beside the main file, beside the file that includes it, then along *INCLUDE_PATH.
    fn find(&self, name: &str, beside: &Path) -> Result<PathBuf, Vec<PathBuf>> {
        let name = native(name);
        let mut searched = Vec::new();
        let folders = [self.folder.as_path(), beside].into_iter().chain(self.paths.iter().map(PathBuf::as_path));
        for folder in folders {
            let path = folder.join(&name);
            if self.files.exists(&path) {
                return Ok(path);
            }
            if !searched.contains(&path) {
                searched.push(path);
            }
        }
        Err(searched)
    }

    fn included(
        &mut self,
        path: &Path,
        name: String,
        here: Place,
        change: Option<&Change>,
        format: Format,
        frame: &Frame,
    ) -> Result<(), Error> {
        let identity = self.files.identity(path);
        if let Some(first) = self.stack.iter().position(|(there, _)| *there == identity) {
            let mut chain: Vec<PathBuf> = self.stack[first..].iter().map(|(_, path)| path.clone()).collect();
            chain.push(path.to_owned());
            return Err(Error::IncludesItself { place: here, chain });
        }
        self.includes += 1;
        if self.includes > INCLUDES_MAX || self.stack.len() >= DEPTH_MAX {
            return Err(Error::TooManyIncludes { place: here, most: INCLUDES_MAX });
        }
        let inner = change.map_or_else(|| frame.clone(), |change| change.inside(frame));
        let first = self.deck.node_ids.len();
        // A file says by its own *KEYWORD how wide its fields are; one of a long deck that says nothing may be long.
        let inherited = if format == Format::Long { Format::Guess } else { Format::Standard };
        match self.file(path, &inner, inherited) {
            Err(
                error @ (Error::NotADeck { .. } | Error::Packed { .. } | Error::Io { .. } | Error::LineTooLong { .. }),
            ) => {
                let why = error.to_string();
                self.deck.warnings.push(Warning::UnreadableInclude { place: here.clone(), name, why });
            }
            other => other?,
        }
        let nodes = first..self.deck.node_ids.len();
        if let Some(change) = change
            && (change.own.length != 1.0 || change.transformation != 0)
        {
            let transformation = change.transformation;
            self.moves.push(Move { nodes, length: change.own.length, transformation, include: here });
        }
        Ok(())
    }

    /// Puts the nodes of includes where they belong, and looks the whole deck over.
    pub(super) fn finish(mut self) -> Result<Deck, Error> {
        let needs_nodes = self.moves.iter().any(|step| step.transformation != 0);
        let place_of: HashMap<u64, usize> = match needs_nodes {
            true => self.deck.node_ids.iter().copied().zip(0..).collect(),
            false => HashMap::new(),
        };
        for step in std::mem::take(&mut self.moves) {
            let scale = Affine::scale([step.length; 3]);
            let nodes = |id: u64| place_of.get(&id).map(|&at| self.deck.coordinates[at]);
            let found = match step.transformation {
                0 => Ok(Affine::IDENTITY),
                id => match self.transformations.get(&id) {
                    Some(steps) => affine(steps, &nodes),
                    None => Err(format!("the transformation {id} is not defined")),
                },
            };
            match found {
                Ok(map) => {
                    let map = scale.then(&map);
                    self.deck.coordinates[step.nodes].iter_mut().for_each(|point| *point = map.apply(*point));
                }
                Err(what) => self.deck.warnings.push(Warning::NotTransformed { place: step.include, what }),
            }
        }
        self.deck.parameters = self.parameters.len();
        crate::check::look_over(&mut self.deck);
        Ok(self.deck)
    }
}
