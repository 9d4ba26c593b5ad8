//! `crumple init`: make a study.

use std::path::PathBuf;

use clap::Args;
use crumple::bundle;
use crumple::joints::{Join, Source};
use crumple::run::Run;
use crumple::study::{Loaded, Study};
use crumple::{Error, Watch};
use serde_json::{Value, json};

use super::Answer;
use crate::options::BasisArgs;
use crate::output::Output;

#[derive(Args)]
#[command(
    after_help = "A keyword deck may be the reference: its mesh, titles and welds; the states come from the runs that are added.\n\nExample, in the repository:\n  crumple init study --reference examples/hat-section/runs/run_001 --join 2.5\n  crumple init by-welds --reference examples/hat-section/decks/run_001.k --join deck"
)]
pub(crate) struct Init {
    /// Folder of the study; must not exist yet
    study: PathBuf,
    /// Run whose undeformed shells are the surface: root file or folder; or a keyword deck
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
        let (options, fields) = (self.basis.options()?, self.basis.fields()?);
        let run = self.basis.with_deck(Run::open(&only.id, &only.path)?, None)?;
        let study = Study::create(&self.study, &run, &self.basis.parts, &fields, &options, watch)?;
        let loaded = Loaded::of(study)?;
        let facts = facts(&loaded)?;
        output.print(&facts, || words(&loaded));
        advise(&loaded, output)?;
        Ok(Answer::Done)
    }
}

/// What `init` tells a script.
pub(crate) fn facts(loaded: &Loaded) -> Result<Value, Error> {
    let facts = &loaded.basis.facts;
    let joints = loaded.study.joints()?;
    Ok(json!({
        "study": loaded.study.folder(),
        "reference": loaded.study.settings().reference,
        "parts": loaded.reference.parts,
        "vertices": loaded.reference.vertices(),
        "triangles": loaded.reference.mesh.triangles().len(),
        "area": facts.area,
        "components": facts.components,
        "null_space": facts.null_space,
        "operator": facts.operator,
        "mass": facts.mass,
        "tufted_advice": facts.tufted_advice,
        "join": facts.join,
        "joined_pairs": facts.joined_pairs,
        "joints": joints.map(|joints| json!({
            "deck": joints.deck, "ties": joints.ties.len(), "idle": facts.idle_ties, "followers": facts.followers,
            "sources": joints.sources, "notes": joints.notes,
        })),
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
    }))
}

fn words(loaded: &Loaded) -> String {
    let facts = &loaded.basis.facts;
    let join = match facts.join {
        None => String::new(),
        Some(Join::Distance(distance)) => format!(", {} pairs joined at {distance}", facts.joined_pairs),
        Some(Join::Deck(_)) => format!(", {} ties of the deck", facts.joined_pairs - facts.idle_ties),
    };
    format!(
        "study      {}\nsurface    {} vertices, {} triangles, {} piece{}{join}; parts: {}\noperator   {}, {} mass\nbasis      {} eigenpairs, none missing: {}; residual {:.1e}, orthogonality {:.1e}",
        loaded.study.folder().display(),
        loaded.reference.vertices(),
        loaded.reference.mesh.triangles().len(),
        facts.components,
        if facts.components == 1 { "" } else { "s" },
        loaded.reference.parts.join(", "),
        facts.operator,
        facts.mass,
        loaded.basis.eigenpairs(),
        if facts.complete { "certified" } else { "not certified" },
        facts.residual,
        facts.orthogonality,
    )
}

/// Says what the mesh brings with it and what helps.
pub(crate) fn advise(loaded: &Loaded, output: &Output) -> Result<(), Error> {
    let basis = &loaded.basis;
    let facts = &basis.facts;
    if let Some(joints) = loaded.study.joints()? {
        for (keyword, source) in &joints.sources {
            let Source { defined, used, ties, out_of_reach } = source;
            let reach = match out_of_reach {
                0 => String::new(),
                count => format!("; {count} places are out of reach of the faces they should be tied to"),
            };
            output.note(&format!("*{keyword}: {used} of {defined} hold the surface, {ties} ties{reach}"));
        }
        joints.notes.iter().for_each(|note| output.note(note));
        if joints.ties.is_empty() {
            output
                .note("the deck has no weld, rigid body or tied contact that holds the surface; the pieces stay apart");
        }
    }
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
    if facts.join.and_then(Join::distance).is_some() && facts.joined_pairs == 0 {
        output.note("the join found no pair of vertices within its distance; the pieces stay apart");
    }
    tufted(&facts.tufted_advice, output);
    if facts.flat_triangles > 0 {
        output.note(&format!("{} triangles have no area and are left out of the operator", facts.flat_triangles));
    }
    Ok(())
}

/// Recommends the tufted operator where there are reasons for it.
pub(crate) fn tufted(reasons: &[String], output: &Output) {
    if !reasons.is_empty() {
        let reasons = reasons.join("; ");
        output.note(&format!("{reasons}. The operator made for such meshes: --operator tufted"));
    }
}
