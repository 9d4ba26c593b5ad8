//! One file a command.

mod add;
mod analyze;
mod check;
mod classify;
mod compare;
mod convert;
mod describe;
mod distance;
mod eigen;
mod explain;
mod export;
mod features;
mod info;
mod init;
mod interactive;
mod isometry;
mod modes;
mod monitor;
mod reconstruct;
mod report;
mod search;
mod verify;

use clap::Subcommand;
use crumple::{Error, Watch};

use crate::output::Output;

/// What a command has to say besides what it printed.
pub(crate) enum Answer {
    /// It is done.
    Done,
    /// The answer is "no".
    No,
}

/// The commands, in the order in which they are used.
#[derive(Subcommand)]
// Made once, from the command line.
#[allow(clippy::large_enum_variant)]
pub(crate) enum Command {
    /// All of it: find the runs, make the study, find the modes, describe them, write the report
    Analyze(analyze::Analyze),
    /// What a result file or a study holds
    Info(info::Info),
    /// Eigenpairs of any mesh or result file, alone
    Eigen(eigen::Eigen),
    /// Make a study: the reference mesh and its eigenbasis
    Init(init::Init),
    /// Add runs to a study: project each of their states
    Add(add::Add),
    /// Find the deformation modes of a study
    Modes(modes::Modes),
    /// Build and save the descriptor of a run or of a mode
    Describe(describe::Describe),
    /// Find the runs that deform as a descriptor says
    Search(search::Search),
    /// Does each run deform as the descriptor says? Exit code 1 if one does not
    Verify(verify::Verify),
    /// Which mode each run belongs to, with a margin, or none. Exit code 1 if one has none
    Classify(classify::Classify),
    /// Why two runs are alike or different: at which wavelengths, which way, and where on the part
    Explain(explain::Explain),
    /// Does the surface stretch, which the method assumes it hardly does? Strains of every state of a run
    Isometry(isometry::Isometry),
    /// One number for an optimiser: how far a run is from a descriptor
    Distance(distance::Distance),
    /// The numbers that are compared, one row a run, for optimisers and meta-models
    Features(features::Features),
    /// Follow a run that is being computed; exit code 1, or a stop request to the solver, once it leaves the path
    Monitor(monitor::Monitor),
    /// The shape from a descriptor, from the first M eigenvectors or from principal components, as a file
    Reconstruct(reconstruct::Reconstruct),
    /// Arrays and tables for other tools
    Export(export::Export),
    /// A run as another d3plot family: other precision, byte order, size of the files
    Convert(convert::Convert),
    /// The descriptor against its rivals: size, errors, and, given labels, quality of the ranking
    Compare(compare::Compare),
    /// One self-contained page for a person
    Report(report::Report),
    /// Is the study whole? Exit code 1 if not
    Check(check::Check),
}

impl Command {
    pub(crate) fn run(&self, output: &Output, watch: &dyn Watch) -> Result<Answer, Error> {
        match self {
            Self::Analyze(command) => command.run(output, watch),
            Self::Info(command) => command.run(output),
            Self::Eigen(command) => command.run(output, watch),
            Self::Init(command) => command.run(output, watch),
            Self::Add(command) => command.run(output, watch),
            Self::Modes(command) => command.run(output, watch),
            Self::Describe(command) => command.run(output),
            Self::Search(command) => command.run(output),
            Self::Verify(command) => command.run(output),
            Self::Classify(command) => command.run(output),
            Self::Explain(command) => command.run(output),
            Self::Isometry(command) => command.run(output, watch),
            Self::Distance(command) => command.run(output),
            Self::Features(command) => command.run(output),
            Self::Monitor(command) => command.run(output, watch),
            Self::Reconstruct(command) => command.run(output),
            Self::Export(command) => command.run(output),
            Self::Convert(command) => command.run(output, watch),
            Self::Compare(command) => command.run(output),
            Self::Report(command) => command.run(output, watch),
            Self::Check(command) => command.run(output),
        }
    }
}
