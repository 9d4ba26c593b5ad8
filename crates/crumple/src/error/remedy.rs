//! What the user can do about an error.

use super::Error;

impl Error {
    /// What the user can do about it, where there is something.
    pub fn remedy(&self) -> Option<String> {
        let text = match self {
            Self::Read(error) => return error.remedy(),
            Self::Deck(error) => return error.remedy().map(str::to_owned),
            Self::NoDeck { .. } => "give the deck with --deck FILE, or join by --join DISTANCE",
            Self::OtherDeck { .. } => "give the deck that the runs were made from; ids of nodes must be the same",
            Self::Refused { remedy, .. } => return remedy.clone(),
            Self::NoSuchPath(_) => "check the spelling; a run is the root file of a family or its folder",
            Self::NoRuns { .. } => "give the folder that holds the runs, or a run's root file (d3plot)",
            Self::BadRuns { .. } => {
                "mend or remove these runs, go on without them (--skip-bad), or let changed ones take their place (--replace)"
            }
            Self::SameId { .. } => "give the folder above both, so that the ids differ",
            Self::NoSurface { .. } => "solids are not read as a surface yet; choose a run with shells",
            Self::UnknownPart { .. } => "name a part by its id or its title, or leave --part out to take all shells",
            Self::OtherMesh { .. } => "a study compares runs on one mesh; make a study of its own for this run",
            Self::NotFinite { .. } | Self::TooLarge { .. } => {
                "the run broke down there; `add --skip-bad` leaves it out"
            }
            Self::NoField { .. } => "leave the run out (--skip-bad), or make the study without this --field",
            Self::FieldNotFinite { .. } => {
                "rigid shells carry no such values: choose parts without them (--part), or make the study without this --field"
            }
            Self::UnknownField { .. } => "fields are named when the study is made: `crumple init --field NAME`",
            Self::NoCoordinates { .. } => "write coordinates into the result file (*DATABASE_EXTENT_BINARY: IU = 1)",
            Self::NoStates { .. } => {
                "the run may not have started, or may have been cut short; copy it again, or leave it out with `add --skip-bad`"
            }
            Self::Mesh { .. } => "choose another reference run, or parts without the fault, with --part",
            Self::MeshFile(mesh_files::Error::Io { .. }) => return None,
            Self::MeshFile(mesh_files::Error::Unknown { .. }) => {
                "give the file the ending of its format; a result file is a d3plot root file or its folder"
            }
            Self::MeshFile(_) | Self::BadMesh { .. } => "write it again with the program that made it",
            Self::Join(_) => "give a distance in the model's length unit, a little above the gap between the sheets",
            Self::Operator(_) => "choose other parts with --part, or mend the mesh",
            Self::Eigen(_) => "ask for fewer eigenpairs (-K), or report this mesh",
            Self::NotAStudy { .. } => "make one with `crumple init` or `crumple analyze`",
            Self::StudyExists { .. } => "give another folder",
            Self::OtherLayout { .. } => "use the version of crumple that wrote it, or make the study again",
            Self::Damaged { .. } => "run `crumple check` on the study; make it again from the runs if files are lost",
            Self::Io { source, .. } => match source.kind() {
                std::io::ErrorKind::StorageFull | std::io::ErrorKind::QuotaExceeded => {
                    "free some space and repeat; the study is as it was"
                }
                std::io::ErrorKind::PermissionDenied | std::io::ErrorKind::ReadOnlyFilesystem => {
                    "choose a place that can be written"
                }
                _ => return None,
            },
            Self::UnknownRun { .. } => {
                "`crumple info STUDY` lists the ids; a run's id is its path below the folder that was added"
            }
            Self::UnknownState { .. } => "states count from @0; @last is the last one",
            Self::RunChanged { .. } => "replace it with `crumple add --replace`, or give it another name",
            Self::TooFewRuns { .. } => "add more runs",
            Self::UnknownMode { .. } | Self::NoModes => "`crumple modes STUDY` finds and names them",
            Self::UnknownDescriptor { .. } => {
                "`crumple describe STUDY RUN`, or `--mode NAME` for the typical run of a mode, makes one"
            }
            Self::OtherBasis { .. } | Self::BadDescriptor { .. } => {
                "make it again in this study with `crumple describe`"
            }
            Self::Threshold { .. } => "rules: std:C  mean:C  value:T  top:M  energy:SHARE  error:MM",
            Self::Table { .. } => "a table is CSV with one header line and one row a run, the run in the first column",
            Self::NoMatch { .. } => "the first column must hold the runs' ids, or their numbers",
            Self::Silent { seen: 0, .. } => {
                "check the path: the root file (d3plot) or its folder; --timeout waits longer for the solver to start"
            }
            Self::Silent { .. } => "the solver may have ended or failed: see its messages; --timeout waits longer",
            Self::Restarted { .. } => "start monitor again with the new run",
            Self::Stopped => "repeat the command to go on; runs that were added stay",
            Self::Value { .. } | Self::Internal(_) => return None,
        };
        Some(text.to_owned())
    }
}
