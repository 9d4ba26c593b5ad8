//! `crumple init`: make a study.

use std::path::PathBuf;

use clap::Args;
use crumple::basis::Basis;
use crumple::bundle;
use crumple::run::Run;
use crumple::study::{Loaded, Study};
use crumple::{Error, Watch};
use serde_json::{Value, json};

use super::Answer;
use crate::options::BasisArgs;
use crate::output::Output;

#[derive(Args)]
#[command(
    after_help = "Example, in the repository:\n  crumple init study --reference examples/hat-section/runs/run_001 --join 2.5"
)]
pub(crate) struct Init {
    /// Folder of the study; must not exist yet
    study: PathBuf,
    /// Run whose undeformed shells are the surface: root file or folder
    #[arg(long, value_name = "RUN")]
    reference: PathBuf,
    #[command(flatten)]
    basis: BasisArgs,
}

impl Init {
    pub(crate) fn run(&self, output: &Output, watch: &dyn Watch) -> Result<Answer, Error> {
        let found = bundle::find(std::slice::from_ref(&self.reference))?;
        let [only] = &found[..] else {
            return Err(Error::Value {
                name: "--reference",
                value: self.reference.display().to_string(),
                expected: format!("one run; this folder holds {}", found.len()),
            });
        };
        let run = Run::open(&only.id, &only.path)?;
        let basis = &self.basis;
        let study =
            Study::create(&self.study, &run, &basis.parts, &basis.fields()?, &basis.options(), watch)?;
        let loaded = Loaded::of(study)?;
        let facts = facts(&loaded);
        output.print(&facts, || words(&loaded));
        advise(&loaded.basis, output);
        Ok(Answer::Done)
    }
}

/// What `init` tells a script.
pub(crate) fn facts(loaded: &Loaded) -> Value {
    let facts = &loaded.basis.facts;
    json!({
        "study": loaded.study.folder(),
        "reference": loaded.study.settings().reference,
        "parts": loaded.reference.parts,
        "vertices": loaded.reference.vertices(),
        "triangles": loaded.reference.mesh.triangles().len(),
        "area": facts.area,
        "components": facts.components,
        "null_space": facts.null_space,
        "join": facts.join,
        "joined_pairs": facts.joined_pairs,
        "join_advice": facts.join_advice,
        "non_manifold_edges": facts.non_manifold_edges,
        "eigenpairs": loaded.basis.eigenpairs(),
        "eigenvalue_max": loaded.basis.eigenvalues.last(),
        "residual": facts.residual,
        "residual_stored": facts.residual_stored,
        "orthogonality": facts.orthogonality,
        "complete": facts.complete,
        "clusters": facts.clusters,
        "close": facts.close,
    })
}

fn words(loaded: &Loaded) -> String {
    let facts = &loaded.basis.facts;
    let join =
        facts.join.map_or_else(String::new, |distance| format!(", {} pairs joined at {distance}", facts.joined_pairs));
    format!(
        "study      {}\nsurface    {} vertices, {} triangles, {} piece{}{join}; parts: {}\nbasis      {} eigenpairs, none missing: {}; residual {:.1e}, orthogonality {:.1e}",
        loaded.study.folder().display(),
        loaded.reference.vertices(),
        loaded.reference.mesh.triangles().len(),
        facts.components,
        if facts.components == 1 { "" } else { "s" },
        loaded.reference.parts.join(", "),
        loaded.basis.eigenpairs(),
        if facts.complete { "certified" } else { "not certified" },
        facts.residual,
        facts.orthogonality,
    )
}

/// Says what the mesh brings with it and what helps.
pub(crate) fn advise(basis: &Basis, output: &Output) {
    let facts = &basis.facts;
    if basis.eigenpairs() < facts.asked {
        output.note(&format!(
            "the mesh has {} degrees of freedom, so the basis has {} eigenpairs, not {}",
            basis.eigenpairs(),
            basis.eigenpairs(),
            facts.asked
        ));
    }
    if let Some(distance) = facts.join_advice {
        output.note(&format!(
            "the mesh is {} pieces that share no nodes but lie close together; equal pieces bring nearly equal eigenvalues in pairs. To treat them as one part: --join {distance}",
            facts.components
        ));
    } else if facts.null_space > 1 {
        output.note(&format!("the mesh is {} pieces; each has a spectrum of its own", facts.null_space));
    }
    if facts.join.is_some() && facts.joined_pairs == 0 {
        output.note("the join found no pair of vertices within its distance; the pieces stay apart");
    }
    if facts.non_manifold_edges > 0 {
        output.note(&format!("{} edges have more than two faces; all of them are summed", facts.non_manifold_edges));
    }
    if facts.flat_triangles > 0 {
        output.note(&format!("{} triangles have no area and are left out of the operator", facts.flat_triangles));
    }
}
