//! Descriptors on disk: `descriptors/NAME.json` in a study, or any file that was copied from there.

use std::path::{Path, PathBuf};

use super::{Descriptor, Selected};
use crate::Error;
use crate::error::io;
use crate::modes::Modes;
use crate::rotation::OCTAVES;
use crate::study::{DESCRIPTORS, Study, store};

/// Saves a descriptor in its study; one of the same name is replaced.
///
/// # Errors
/// [`Error::Value`] for a name that is no file name, [`Error::Io`].
pub fn save(study: &Study, descriptor: &Descriptor) -> Result<PathBuf, Error> {
    let name = &descriptor.name;
    if name.is_empty() || name.starts_with('.') || name.contains(['/', '\\', '\0']) {
        return Err(Error::Value {
            name: "--name",
            value: name.clone(),
            expected: "a name that can be a file name".into(),
        });
    }
    let _writing = study.writing()?;
    let folder = study.folder().join(DESCRIPTORS);
    std::fs::create_dir_all(&folder).map_err(io("make the folder", &folder))?;
    let path = folder.join(format!("{name}.json"));
    let text = serde_json::to_string_pretty(descriptor).map_err(|error| Error::Internal(error.to_string()))?;
    store::write_bytes(&path, text.as_bytes())?;
    Ok(path)
}

/// Loads a descriptor by its name in the study, or by the path of its file.
///
/// # Errors
/// [`Error::UnknownDescriptor`], [`Error::BadDescriptor`], [`Error::OtherBasis`].
pub fn load(study: &Study, name: &str) -> Result<Descriptor, Error> {
    let inside = study.folder().join(DESCRIPTORS).join(format!("{name}.json"));
    let path = if inside.is_file() { inside } else { PathBuf::from(name) };
    if !path.is_file() || path.extension().is_none_or(|extension| extension != "json") {
        let names = list(study)?;
        let available = if names.is_empty() { "none yet".to_owned() } else { names.join(", ") };
        return Err(Error::UnknownDescriptor { asked: name.to_owned(), available });
    }
    read(&path, study)
}

fn read(path: &Path, study: &Study) -> Result<Descriptor, Error> {
    let text = std::fs::read_to_string(path).map_err(io("read", path))?;
    let unusable = |what: String| Error::BadDescriptor { path: path.to_owned(), what };
    let descriptor: Descriptor = serde_json::from_str(&text).map_err(|error| unusable(error.to_string()))?;
    let expected = &study.manifest().basis;
    if descriptor.basis != *expected {
        return Err(Error::OtherBasis { name: descriptor.name, found: descriptor.basis, expected: expected.clone() });
    }
    for selected in descriptor.blocks() {
        check(selected, study.manifest().eigenpairs).map_err(unusable)?;
    }
    let spectrum = &descriptor.spectrum;
    if !spectrum.numbers().iter().all(|x| x.is_finite()) || spectrum.kind.len() != OCTAVES {
        return Err(unusable(format!("its rotation spectrum is not {OCTAVES} numbers of its kind and a direction")));
    }
    Ok(descriptor)
}

/// Says what is wrong with a selection.
fn check(selected: &Selected, eigenpairs: usize) -> Result<(), String> {
    let (j, values) = (&selected.eigenvectors, &selected.values);
    if j.is_empty() || j.len() != values.len() {
        return Err(format!("{} eigenvectors and {} values", j.len(), values.len()));
    }
    if let Some(outside) = j.iter().find(|j| !(1..=eigenpairs).contains(*j)) {
        return Err(format!("eigenvector {outside}; the study has 1 to {eigenpairs}"));
    }
    if !j.windows(2).all(|pair| pair[0] < pair[1]) {
        return Err("its eigenvectors do not rise".into());
    }
    let components = selected.function().components();
    if let Some(value) = values.iter().find(|value| value.len() != components) {
        return Err(format!("a value has {} numbers, expected {components}", value.len()));
    }
    if !values.iter().flatten().chain([&selected.scale]).all(|x| x.is_finite()) {
        return Err("a value is not a number".into());
    }
    Ok(())
}

/// Removes descriptors that were made for a mode which is gone or has another typical run now: a search by the name of
/// a mode must not rank by what the name meant before.
///
/// # Errors
/// [`Error::Io`].
pub fn forget_modes(study: &Study, modes: &Modes) -> Result<(), Error> {
    let _writing = study.writing()?;
    for name in list(study)? {
        let Ok(saved) = load(study, &name) else { continue };
        let holds = modes.modes.iter().any(|mode| mode.name == name && mode.medoid == saved.run);
        if saved.mode.as_deref() == Some(name.as_str()) && !holds {
            let path = study.folder().join(DESCRIPTORS).join(format!("{name}.json"));
            std::fs::remove_file(&path).map_err(io("remove", &path))?;
        }
    }
    Ok(())
}

/// Names of the study's descriptors, sorted.
///
/// # Errors
/// [`Error::Io`].
pub fn list(study: &Study) -> Result<Vec<String>, Error> {
    let folder = study.folder().join(DESCRIPTORS);
    if !folder.exists() {
        return Ok(Vec::new());
    }
    let entries = std::fs::read_dir(&folder).map_err(io("read the folder", &folder))?;
    let name = |entry: std::fs::DirEntry| {
        entry.file_name().to_str()?.strip_suffix(".json").filter(|name| !name.starts_with('.')).map(str::to_owned)
    };
    let mut names: Vec<String> = entries.flatten().filter_map(name).collect();
    names.sort();
    Ok(names)
}
