//! `crumple reconstruct`: a shape from coefficients, as a file.

use std::path::PathBuf;

use clap::Args;
use crumple::Error;
use crumple::descriptor;
use crumple::export::{write_obj, write_stl};
use crumple::reconstruct::{errors, reconstruct};
use crumple::rivals::Pca;
use crumple::study::{Loaded, write_shape};
use crumple::target::{self, Named, resolve};
use serde_json::json;

use super::Answer;
use crate::options::select;
use crate::output::{Output, percent};

#[derive(Args)]
#[command(
    after_help = "Example:\n  crumple reconstruct study run_007 --descriptor mode-1 -o run_007-descriptor.vtu\n  crumple reconstruct study run_007@2 --first 14 -o first-14.stl"
)]
pub(crate) struct Reconstruct {
    /// Folder of the study
    study: PathBuf,
    /// Run to reconstruct, by id or path; @N for a state, counted from 0 [default state: the last]
    #[arg(value_name = "RUN[@STATE]")]
    run: String,
    /// From the eigenvectors of this descriptor
    #[arg(long, value_name = "DESCRIPTOR", group = "method")]
    descriptor: Option<String>,
    /// From the M eigenvectors of lowest frequency [default: all of them]
    #[arg(long, value_name = "M", allow_negative_numbers = true, group = "method")]
    first: Option<usize>,
    /// What --first rebuilds: the `coordinates` from their own coefficients, or the `difference` added to the undeformed
    /// part [default: coordinates]
    #[arg(long, value_name = "WHAT", conflicts_with_all = ["descriptor", "pca"])]
    select: Option<String>,
    /// From M principal components of the displacements of all runs
    #[arg(long, value_name = "M", allow_negative_numbers = true, group = "method")]
    pca: Option<usize>,
    /// File to write: .vtu (with displacements), .obj or .stl
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

impl Reconstruct {
    pub(crate) fn run(&self, output: &Output) -> Result<Answer, Error> {
        let loaded = Loaded::open(&self.study)?;
        let named = Named::in_study(&loaded.study, &self.run);
        let target = resolve(&loaded, &named)?;
        let original = target::shape(&loaded, &named, &target)?;
        let (method, size, shape) = self.shape(&loaded, &target.delta)?;
        let errors = errors(&loaded.reference, &loaded.basis, &original, &shape);
        self.write(&loaded, &shape, &original)?;
        let facts = json!({ "file": self.output, "run": target.run, "state": target.state, "time": target.time, "method": method, "size": size, "errors": errors });
        let unit = &loaded.study.settings().length_unit;
        output.print(&facts, || {
            format!("{}: {} state {} from {method} ({size}), RMS error {:.3} {unit} ({} of the displacement), largest {:.2} {unit}", self.output.display(), target.run, target.state, errors.rms, percent(errors.relative), errors.max)
        });
        Ok(Answer::Done)
    }

    fn shape(&self, loaded: &Loaded, delta: &[[f64; 3]]) -> Result<(String, usize, Vec<[f64; 3]>), Error> {
        let Loaded { reference, basis, study, .. } = loaded;
        if let Some(name) = &self.descriptor {
            let descriptor = descriptor::load(study, name)?;
            let Some(selected) = descriptor.blocks().find(|selected| selected.field.is_none()) else {
                return Err(Error::Value {
                    name: "--descriptor",
                    value: name.clone(),
                    expected: "a descriptor of the shape; this one is of a field".into(),
                });
            };
            let shape = reconstruct(reference, basis, selected.select, &selected.eigenvectors, delta);
            return Ok((format!("descriptor '{name}'"), selected.eigenvectors.len(), shape));
        }
        if let Some(components) = self.pca {
            if components == 0 {
                return Err(Error::Value { name: "--pca", value: "0".into(), expected: "1 or more".into() });
            }
            let rows = loaded.last_states()?;
            let pca = Pca::of(&rows, components);
            return Ok(("principal components".into(), pca.components(), pca.shape(loaded, delta)));
        }
        let count = self.first.unwrap_or(basis.eigenpairs());
        if count == 0 || count > basis.eigenpairs() {
            return Err(Error::Value {
                name: "--first",
                value: count.to_string(),
                expected: format!("1 to {}", basis.eigenpairs()),
            });
        }
        let first: Vec<usize> = (1..=count).collect();
        let select = select(self.select.as_deref())?;
        let method = format!("first eigenvectors ({})", select.word());
        Ok((method, count, reconstruct(reference, basis, select, &first, delta)))
    }

    fn write(&self, loaded: &Loaded, shape: &[[f64; 3]], original: &[[f64; 3]]) -> Result<(), Error> {
        let mesh = &loaded.reference.mesh;
        let difference = |from: &[[f64; 3]]| -> Vec<[f64; 3]> {
            shape.iter().zip(from).map(|(p, q)| [p[0] - q[0], p[1] - q[1], p[2] - q[2]]).collect()
        };
        match self.output.extension().and_then(|extension| extension.to_str()) {
            Some("vtu") => {
                let (displacement, error) = (difference(mesh.vertices()), difference(original));
                write_shape(
                    &self.output,
                    &loaded.reference,
                    shape,
                    &[("displacement", displacement.as_flattened()), ("error", error.as_flattened())],
                )
            }
            Some("obj") => write_obj(&self.output, shape, mesh.triangles()),
            Some("stl") => write_stl(&self.output, shape, mesh.triangles()),
            _ => Err(Error::Value {
                name: "--output",
                value: self.output.display().to_string(),
                expected: "a name that ends in .vtu, .obj or .stl".into(),
            }),
        }
    }
}
