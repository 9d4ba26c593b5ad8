//! `crumple eigen`: eigenpairs of any mesh or result file, alone.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use crumple::eigen::{self, Precision, Solved};
use crumple::surface::{Surface, state_named};
use crumple::{Certificate, EigenOptions, Error, Kind, OperatorOptions, Watch};
use serde_json::{Map, Value, json};

use super::{Answer, init};
use crate::options::OperatorArgs;
use crate::output::Output;

/// What the solver did and where its time went: seconds of all threads together.
fn solver(certificate: &Certificate) -> Value {
    let seconds = &certificate.seconds;
    json!({
        "factorisations": certificate.factorisations,
        "solves": certificate.solves,
        "peak_bytes_expected": certificate.peak_bytes,
        "thread_seconds": {
            "order": seconds.order,
            "factor": seconds.factor,
            "solve": seconds.solve,
            "orthogonalise": seconds.orthogonalise,
            "project": seconds.project,
            "vectors": seconds.vectors,
            "certify": seconds.certify,
            "output": seconds.output,
        },
    })
}

#[derive(Args)]
#[command(
    after_help = "The file holds eigenvalues [K], eigenvectors [K, N], mass [N], points, triangles and vertex_ids: safetensors.numpy.load_file opens it.\n\nExample, in the repository:\n  crumple eigen examples/hat-section/runs/run_001 -K 100 --join 2.5 -o basis.safetensors\n  crumple eigen examples/hat-section/runs/run_001@last -K 50"
)]
pub(crate) struct Eigen {
    /// Mesh file (.obj .ply .stl .off .vtu .vtp) or result file or folder (d3plot: its undeformed shells; @N or @last behind
    /// it: those of a state, how far its spectrum is from that of the undeformed part)
    mesh: PathBuf,
    /// Eigenpairs K, 1 or more; a mesh with fewer vertices gives as many as it has [default: 500]
    #[arg(short = 'K', long, value_name = "K", allow_negative_numbers = true)]
    eigenpairs: Option<usize>,
    /// File for the basis (safetensors); without it only the table or JSON is printed
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Store eigenvectors in single precision: half the size
    #[arg(long)]
    f32: bool,
    /// Part whose shells are the surface, by id or title, of a result file; may be given several times [default: all]
    #[arg(long = "part", value_name = "PART")]
    parts: Vec<String>,
    #[command(flatten)]
    operator: OperatorArgs,
    /// Treat separate sheets as one: mutually nearest vertices of different pieces of the mesh that are closer than this
    /// (length unit of the model) share one degree of freedom. A distance is recommended where sheets lie close
    #[arg(long, value_name = "DISTANCE", allow_negative_numbers = true)]
    join: Option<f64>,
    /// A pair is accepted when its residual is below this share of the largest eigenvalue, above 0 and below 0.01
    /// [default: 1e-10]
    #[arg(long, value_name = "T", allow_hyphen_values = true)]
    tolerance: Option<f64>,
    /// Seed of the random start; another one gives the same spectrum with other rounding [default: 1]
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    seed: Option<u64>,
}

impl Eigen {
    pub(crate) fn run(&self, output: &Output, watch: &dyn Watch) -> Result<Answer, Error> {
        let start = Instant::now();
        let (kind, mass) = self.operator.kinds()?;
        let operator_options = OperatorOptions { join: self.join, kind, mass, ..OperatorOptions::default() };
        let default = EigenOptions::default();
        let options = EigenOptions {
            count: self.eigenpairs.unwrap_or(default.count),
            tolerance: self.tolerance.unwrap_or(default.tolerance),
            seed: self.seed.unwrap_or(default.seed),
            ..default
        };
        self.check(&options)?;
        let surface = Surface::read(&self.mesh, &self.parts)?;
        let read = start.elapsed().as_secs_f64();
        if let Some(path) = &self.output {
            eigen::check_writable(path)?;
        }
        let solved = eigen::solve(&surface, &operator_options, &options, watch)?;
        let mut seconds = Map::from_iter([("read".to_owned(), json!(read))]);
        seconds.extend(solved.seconds.iter().map(|(step, seconds)| ((*step).to_owned(), json!(seconds))));
        let facts = self.facts(&surface, &solved, &operator_options);
        if let Some(path) = &self.output {
            let before = Instant::now();
            let precision = if self.f32 { Precision::F32 } else { Precision::F64 };
            eigen::write(path, &surface, &solved, precision, &facts)?;
            seconds.insert("write".into(), json!(before.elapsed().as_secs_f64()));
        }
        seconds.insert("total".into(), json!(start.elapsed().as_secs_f64()));
        self.advise(&surface, &solved, &options, output);
        let words = self.words(&surface, &solved, &seconds);
        let mut all = facts;
        all["eigenvalues"] = json!(solved.basis.eigenvalues);
        all["seconds"] = Value::Object(seconds);
        all["peak_bytes"] = json!(eigen::peak_bytes());
        all["solver"] = solver(&solved.basis.certificate);
        all["output"] = json!(self.output);
        output.print(&all, || words);
        Ok(Answer::Done)
    }

    /// What is wrong with the options, before anything is read.
    fn check(&self, options: &EigenOptions) -> Result<(), Error> {
        if options.count == 0 {
            let expected = "at least one eigenpair".into();
            return Err(Error::Value { name: "--eigenpairs", value: "0".into(), expected });
        }
        if !(options.tolerance > 0.0 && options.tolerance < 1e-2) {
            let (value, expected) = (options.tolerance.to_string(), "above 0 and below 0.01".into());
            return Err(Error::Value { name: "--tolerance", value, expected });
        }
        if let (Some(distance), Some(_)) = (self.join, state_named(&self.mesh)) {
            let expected = "an undeformed mesh: in a fold, sheets that touch would be joined".into();
            return Err(Error::Value { name: "--join", value: distance.to_string(), expected });
        }
        Ok(())
    }

    fn facts(&self, surface: &Surface, solved: &Solved, operator: &OperatorOptions) -> Value {
        let (seen, built, basis) = (&solved.inspection, &solved.operator, &solved.basis);
        let certificate = &basis.certificate;
        json!({
            "mesh": self.mesh,
            "pairs": basis.eigenvalues.len(),
            "residual": certificate.residual_max,
            "residual_floor": certificate.residual_floor,
            "orthogonality": certificate.orthogonality,
            "certified": certificate.complete,
            "components": certificate.components,
            "clusters": basis.clusters.iter().map(|range| [range.start + 1, range.end]).collect::<Vec<_>>(),
            "sensitive": basis.sensitive.iter().map(|range| [range.start + 1, range.end]).collect::<Vec<_>>(),
            "next_eigenvalue": certificate.next_eigenvalue,
            "cluster_cut": certificate.cluster_cut,
            "operator": operator.kind.to_string(),
            "mass": operator.mass.to_string(),
            "join": operator.join,
            "joined_pairs": built.pairs_joined,
            "join_advice": seen.gap.filter(|_| operator.join.is_none()),
            "flips": built.flips,
            "vertices": basis.vertices,
            "triangles": surface.mesh.triangles().len(),
            "faces": surface.mesh.faces(),
            "area": seen.area,
            "boundary_length": seen.boundary_length,
            "unused_vertices": surface.unused_vertices,
            "faces_left_out": seen.faces_left_out,
            "triangles_without_area": seen.triangles_without_area,
            "non_manifold_edges": seen.non_manifold_edges,
            "negative_edges": seen.negative_edges,
            "angle_min_degrees": seen.angle_min.to_degrees(),
            "angle_max_degrees": seen.angle_max.to_degrees(),
            "recommended_operator": seen.recommended().to_string(),
            "reasons": seen.reasons.iter().map(ToString::to_string).collect::<Vec<_>>(),
            "notes": surface.notes,
        })
    }

    fn words(&self, surface: &Surface, solved: &Solved, seconds: &Map<String, Value>) -> String {
        let (basis, certificate) = (&solved.basis, &solved.basis.certificate);
        let first: Vec<String> = basis.eigenvalues.iter().take(6).map(|e| format!("{e:.6e}")).collect();
        let steps: Vec<String> =
            seconds.iter().map(|(step, s)| format!("{step} {:.2}", s.as_f64().unwrap_or_default())).collect();
        let file = self.output.as_ref().map_or_else(String::new, |path| format!("\nfile         {}", path.display()));
        let dots = if basis.eigenvalues.len() > 6 { " …" } else { "" };
        format!(
            "mesh         {} vertices, {} triangles, {} piece{}\npairs        {}, none missing: {}\nresidual     {:.1e} of the largest eigenvalue, rounding alone {:.1e}\northogonal   to {:.1e}\neigenvalues  {}{dots}\nlargest      {:.6e}\nseconds      {}{file}",
            basis.vertices,
            surface.mesh.triangles().len(),
            certificate.components,
            if certificate.components == 1 { "" } else { "s" },
            basis.eigenvalues.len(),
            if certificate.complete { "certified" } else { "not certified" },
            certificate.residual_max,
            certificate.residual_floor,
            certificate.orthogonality,
            first.join(" "),
            basis.eigenvalues.last().copied().unwrap_or_default(),
            steps.join(", "),
        )
    }

    fn advise(&self, surface: &Surface, solved: &Solved, options: &EigenOptions, output: &Output) {
        let (seen, built) = (&solved.inspection, &solved.operator);
        surface.notes.iter().for_each(|note| output.note(note));
        if surface.unused_vertices > 0 {
            output.note(&format!(
                "{} vertices that no face uses are dropped; vertex_ids says which are there",
                surface.unused_vertices
            ));
        }
        if solved.basis.eigenvalues.len() < options.count {
            let all = solved.basis.eigenvalues.len();
            output.note(&format!(
                "the mesh has {all} degrees of freedom, so there are {all} eigenpairs, not {}",
                options.count
            ));
        }
        if solved.basis.certificate.cluster_cut {
            output.note(
                "the last eigenvalue is one of several equal ones of which not all are there; ask for a few pairs more",
            );
        }
        if let Some(distance) = seen.gap.filter(|_| built.pairs_joined == 0) {
            output.note(&format!(
                "the mesh is {} pieces that share no vertices but lie close together. To treat them as one: --join {distance}",
                seen.components
            ));
        }
        if built.triangles_without_area > 0 {
            output.note(&format!(
                "{} triangles have no area and are left out of the operator",
                built.triangles_without_area
            ));
        }
        let reasons: Vec<String> = seen.reasons.iter().map(ToString::to_string).collect();
        let tufted = self.operator.kinds().is_ok_and(|(kind, _)| kind == Kind::Tufted);
        init::tufted(if tufted { &[] } else { &reasons }, output);
    }
}
