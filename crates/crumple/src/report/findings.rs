//! Everything the report shows, as plain data.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};

use base64::Engine;
use mesh_spectrum::Watch;
use rayon::prelude::*;
use serde::Serialize;

use super::picture::{View, picture};
use super::shapes::{MeshData, plain, shapes, z_displacement};
use super::words::{deck_words, isometry_words, join_words, mode_words, warnings};
use crate::Error;
use crate::descriptor::{self, DescribeOptions, Described, FIRST_M, Rival, Threshold, describe};
use crate::explain::spectrum_words;
use crate::features::Features;
use crate::joints::Join;
use crate::modes::{By, Mode, Modes, Tried};
use crate::reconstruct::Errors;
use crate::select::Kind;
use crate::similarity::{Comparer, Hit, SimilarityOptions, search};
use crate::study::{Loaded, Rows, RunRecord};
use crate::target::Named;

/// What the page gets.
#[derive(Debug, Clone, Serialize)]
pub struct Findings {
    title: String,
    version: &'static str,
    study: StudyFacts,
    warnings: Vec<String>,
    mesh: MeshData,
    shapes: BTreeMap<String, String>,
    cloud: Cloud,
    inputs: Vec<String>,
    runs: Vec<RunData>,
    modes: Vec<ModeData>,
    silhouettes: Vec<Tried>,
    count_chosen_by: &'static str,
    alike_by: By,
}

#[derive(Debug, Clone, Serialize)]
struct StudyFacts {
    reference: String,
    parts: Vec<String>,
    vertices: usize,
    triangles: usize,
    components: usize,
    joined: Option<f64>,
    /// What welds and ties of the deck hold, in words, where they joined the pieces.
    joined_by_deck: Option<String>,
    join_advice: Option<String>,
    eigenpairs: usize,
    operator: String,
    mass: String,
    length_unit: String,
    time_unit: String,
    area: f64,
    residual: f64,
    orthogonality: f64,
    complete: bool,
    states: usize,
    /// Of the run of which the eigenvectors catch least.
    captured_min: f64,
    isometry: Option<String>,
}

#[derive(Debug, Clone, Serialize)]
struct Cloud {
    eigenvector: usize,
    eigenvalue: f64,
    label: String,
}

#[derive(Debug, Clone, Serialize)]
struct RunData {
    id: String,
    mode: Option<String>,
    outlier: bool,
    states: usize,
    /// Times of the points of the cloud.
    times: Vec<f64>,
    cloud: Vec<[f64; 3]>,
    /// To each mode's descriptor: by rotation, and by the paper's kind.
    similarity: BTreeMap<String, [f64; 2]>,
    distance_to_medoid: Option<f64>,
    silhouette: Option<f64>,
    max_displacement: f64,
    rigid_share: f64,
    captured: f64,
    strain: f64,
    inputs: Vec<Option<String>>,
    warnings: Vec<String>,
}

#[derive(Debug, Clone, Serialize)]
struct ModeData {
    name: String,
    medoid: String,
    members: Vec<String>,
    silhouette: f64,
    spread: f64,
    color: usize,
    words: String,
    picture: String,
    descriptor: DescriptorData,
}

#[derive(Debug, Clone, Serialize)]
struct DescriptorData {
    select: &'static str,
    rule: String,
    threshold: f64,
    size: usize,
    numbers: usize,
    eigenvectors: Vec<usize>,
    errors: Option<Errors>,
    rivals: Vec<Rival>,
    spectrum: Vec<[f64; 3]>,
    nearest: Vec<Nearest>,
    nearest_paper: Vec<Nearest>,
    shapes: BTreeMap<&'static str, String>,
}

#[derive(Debug, Clone, Serialize)]
struct Nearest {
    run: String,
    similarity: f64,
}

impl Findings {
    /// The study's name.
    pub fn title(&self) -> &str {
        &self.title
    }
}

/// At most about this many points in the cloud, and the last state of every run.
const POINTS_MAX: usize = 20_000;

/// Runs by their similarity to a mode's descriptor, best first.
struct Similarities {
    mode: String,
    rotation: Vec<Hit>,
    paper: Vec<Hit>,
}

/// Describes the medoid of every mode. Without `asked`, a mode is described as the saved descriptor of its name was, or
/// by the defaults where there is none.
///
/// # Errors
/// Those of [`describe`], [`Error::Stopped`].
pub fn describe_modes(
    loaded: &Loaded,
    modes: &Modes,
    asked: Option<&DescribeOptions>,
    watch: &dyn Watch,
) -> Result<Vec<Described>, Error> {
    let done = AtomicUsize::new(0);
    let describe_mode = |mode: &Mode| {
        if watch.stopped() {
            return Err(Error::Stopped);
        }
        let named = Named { run: mode.medoid.clone(), state: None };
        let options = asked.cloned().or_else(|| as_saved(loaded, mode)).unwrap_or_default();
        let described = describe(loaded, &named, Some(&mode.name), Some(&mode.name), &options)?;
        watch.step("describing modes", done.fetch_add(1, Ordering::Relaxed) + 1, modes.modes.len());
        Ok(described)
    };
    modes.modes.par_iter().map(describe_mode).collect()
}

fn as_saved(loaded: &Loaded, mode: &Mode) -> Option<DescribeOptions> {
    let saved = descriptor::load(&loaded.study, &mode.name).ok().filter(|saved| saved.run == mode.medoid)?;
    let selected = &saved.selected;
    Some(DescribeOptions {
        kind: saved.kind,
        select: selected.select,
        threshold: selected.rule.parse().ok()?,
        signed: selected.signed,
        ..Default::default()
    })
}

/// Gathers the findings of a study from its modes and the description of each.
///
/// # Errors
/// Reading errors.
pub fn findings(loaded: &Loaded, modes: &Modes, described: &[Described]) -> Result<Findings, Error> {
    let study = &loaded.study;
    let manifest = study.manifest();
    let cloud = (loaded.basis.facts.null_space + 1).min(loaded.basis.eigenpairs());
    let similarity = similarities(loaded, described)?;
    let runs = run_data(loaded, modes, cloud, &similarity)?;
    let range =
        described.iter().flat_map(|d| z_displacement(loaded, &d.original)).fold(0.0, |most: f64, z| most.max(z.abs()));
    let range = plain(range);
    let (mesh, shapes) = shapes(loaded, modes, described, range)?;
    let modes_data = modes
        .modes
        .par_iter()
        .zip(described)
        .enumerate()
        .map(|(color, (mode, described))| mode_data(loaded, mode, described, color, range, &similarity))
        .collect();
    Ok(Findings {
        title: study
            .folder()
            .canonicalize()
            .unwrap_or_else(|_| study.folder().to_owned())
            .file_name()
            .map_or_else(|| "study".into(), |name| name.to_string_lossy().into_owned()),
        version: env!("CARGO_PKG_VERSION"),
        study: study_facts(loaded),
        warnings: warnings(loaded, modes),
        mesh,
        shapes,
        cloud: Cloud {
            eigenvector: cloud,
            eigenvalue: loaded.basis.eigenvalues[cloud - 1],
            label: if cloud > loaded.basis.facts.null_space {
                "the first that is not constant"
            } else {
                "constant on each piece"
            }
            .to_owned(),
        },
        inputs: manifest.inputs.clone(),
        runs,
        modes: modes_data,
        silhouettes: modes.tried.clone(),
        count_chosen_by: if modes.given { "given" } else { "silhouette" },
        alike_by: modes.by,
    })
}

fn study_facts(loaded: &Loaded) -> StudyFacts {
    let Loaded { study, reference, basis, .. } = loaded;
    let (settings, facts) = (study.settings(), &basis.facts);
    let records: Vec<&RunRecord> = study.manifest().runs.values().collect();
    let unit = &settings.length_unit;
    StudyFacts {
        reference: settings.reference.clone(),
        parts: settings.parts.clone(),
        vertices: reference.vertices(),
        triangles: reference.mesh.triangles().len(),
        components: facts.components,
        joined: facts.join.and_then(Join::distance),
        joined_by_deck: (facts.join == Some(Join::DECK)).then(|| deck_words(facts)),
        join_advice: facts.join_advice.map(|distance| join_words(facts.components, distance, unit)),
        eigenpairs: basis.eigenpairs(),
        operator: facts.operator.clone(),
        mass: facts.mass.clone(),
        length_unit: unit.clone(),
        time_unit: settings.time_unit.clone(),
        area: facts.area,
        residual: facts.residual_stored,
        orthogonality: facts.orthogonality,
        complete: facts.complete,
        states: records.iter().map(|run| run.times.len()).sum(),
        captured_min: records.iter().map(|run| run.last.captured).fold(1.0, f64::min),
        isometry: isometry_words(&records),
    }
}

/// Every run's similarity to every mode's descriptor, best first, by rotation and by the paper's kind.
fn similarities(loaded: &Loaded, described: &[Described]) -> Result<Vec<Similarities>, Error> {
    // Every descriptor compares the whole rotation spectrum: it is read once.
    let turned = Features::rotation(&loaded.basis).read(&loaded.study, Rows::Last)?;
    let of = |described: &Described| {
        let options = |kind| SimilarityOptions { kind: Some(kind), ..Default::default() };
        Ok(Similarities {
            mode: described.descriptor.name.clone(),
            rotation: Comparer::new(loaded, &described.descriptor, options(Kind::Rotation))?.rank(&turned),
            paper: search(loaded, &described.descriptor, options(Kind::Paper), Rows::Last)?,
        })
    };
    described.iter().map(of).collect()
}

fn run_data(loaded: &Loaded, modes: &Modes, cloud: usize, similarity: &[Similarities]) -> Result<Vec<RunData>, Error> {
    let manifest = loaded.study.manifest();
    let rows = loaded.study.coefficients(Some(&[cloud]), Rows::All)?;
    let mut clouds: BTreeMap<&str, Vec<[f64; 3]>> = BTreeMap::new();
    let baseline = loaded.basis.baseline[cloud - 1];
    // A cloud of more points than this is neither seen nor carried; the last state of each run always stays.
    let stride = rows.rows().div_ceil(POINTS_MAX).max(1);
    let last = |run: &str| manifest.runs.get(run).map_or(0, |record| record.times.len().saturating_sub(1));
    let drawn = |run: &str, state: usize| last(run).abs_diff(state).is_multiple_of(stride);
    for row in (0..rows.rows()).filter(|&row| drawn(&rows.runs[row], rows.states[row] as usize)) {
        let delta = rows.row(row);
        clouds.entry(&rows.runs[row]).or_default().push(std::array::from_fn(|c| baseline[c] + f64::from(delta[c])));
    }
    let membership: BTreeMap<&str, _> = modes.runs.iter().map(|run| (run.run.as_str(), run)).collect();
    let mut by_run: BTreeMap<&str, BTreeMap<String, [f64; 2]>> = BTreeMap::new();
    for found in similarity {
        for (place, hits) in [&found.rotation, &found.paper].into_iter().enumerate() {
            for hit in hits {
                let of_run = by_run.entry(&hit.run).or_default();
                of_run.entry(found.mode.clone()).or_default()[place] = hit.score.similarity;
            }
        }
    }
    let data = manifest.runs.iter().map(|(id, record)| {
        let member = membership.get(id.as_str());
        RunData {
            id: id.clone(),
            mode: member.and_then(|member| member.mode.clone()),
            outlier: member.is_some_and(|member| member.outlier),
            states: record.times.len(),
            times: record
                .times
                .iter()
                .enumerate()
                .filter(|(state, _)| drawn(id, *state))
                .map(|(_, time)| *time)
                .collect(),
            cloud: clouds.remove(id.as_str()).unwrap_or_default(),
            similarity: by_run.get(id.as_str()).cloned().unwrap_or_default(),
            distance_to_medoid: member.and_then(|member| member.distance),
            silhouette: member.and_then(|member| member.silhouette),
            max_displacement: record.last.max,
            rigid_share: record.last.rigid_share,
            captured: record.last.captured,
            strain: record.last.strain_p95,
            inputs: manifest.inputs.iter().map(|column| record.inputs.get(column).cloned()).collect(),
            warnings: record.warnings.clone(),
        }
    });
    Ok(data.collect())
}

fn mode_data(
    loaded: &Loaded,
    mode: &Mode,
    described: &Described,
    color: usize,
    range: f64,
    similarity: &[Similarities],
) -> ModeData {
    let descriptor = &described.descriptor;
    let values = z_displacement(loaded, &described.original);
    let png = picture(
        &described.original,
        loaded.reference.mesh.triangles(),
        &values,
        range,
        &View::of(loaded.reference.mesh.vertices()),
    );
    let nearest = |hits: &[Hit]| -> Vec<Nearest> {
        let others = hits.iter().filter(|hit| hit.run != mode.medoid).take(9);
        others.map(|hit| Nearest { run: hit.run.clone(), similarity: hit.score.similarity }).collect()
    };
    let found = similarity.iter().find(|found| found.mode == mode.name);
    let selected = &descriptor.selected;
    let shape = |what: &str| format!("{}:{what}", mode.name);
    ModeData {
        name: mode.name.clone(),
        medoid: mode.medoid.clone(),
        members: mode.members.clone(),
        silhouette: mode.silhouette,
        spread: mode.spread,
        color,
        words: format!(
            "{}; {}",
            mode_words(loaded, &described.original),
            spectrum_words(&loaded.basis, &descriptor.spectrum, &loaded.study.settings().length_unit)
        ),
        picture: format!("data:image/png;base64,{}", base64::engine::general_purpose::STANDARD.encode(png)),
        descriptor: DescriptorData {
            select: selected.select.word(),
            rule: selected.rule.parse::<Threshold>().map_or_else(|_| selected.rule.clone(), |rule| rule.words()),
            threshold: selected.threshold,
            size: descriptor.size(),
            numbers: descriptor.numbers(),
            eigenvectors: selected.eigenvectors.clone(),
            errors: selected.errors,
            rivals: selected.rivals.iter().map(named_for_the_page).collect(),
            spectrum: described.values.iter().map(|triple| triple.map(f64::abs)).collect(),
            nearest: found.map(|found| nearest(&found.rotation)).unwrap_or_default(),
            nearest_paper: found.map(|found| nearest(&found.paper)).unwrap_or_default(),
            shapes: BTreeMap::from([
                ("original", format!("run:{}", mode.medoid)),
                ("first_k", shape("first_k")),
                ("descriptor", shape("descriptor")),
                ("first_m", shape("first_m")),
            ]),
        },
    }
}

/// `first M` with its number: the page tells its pictures apart by it.
fn named_for_the_page(rival: &Rival) -> Rival {
    let method = if rival.method == FIRST_M { format!("first {}", rival.size) } else { rival.method.clone() };
    Rival { method, ..rival.clone() }
}
