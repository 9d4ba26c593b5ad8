//! A compact spectral descriptor for shape deformations.
//!
//! The method of Sible, Iza-Teran, Garcke, Aulig and Wollstadt, one module a stage, in the order in which data
//! flows. Every stage has one main function whose arguments and result are plain data; nothing flows back.
//!
//! | stage | module | from | to |
//! | --- | --- | --- | --- |
//! | keyword decks | [`deck`] | a path | mesh, titles, welds |
//! | open result files, find and name them | [`run`], [`bundle`] | paths | [`run::Run`] |
//! | input tables | [`inputs`] | CSV | a row a run |
//! | the surface all runs share | [`mod@reference`] | a run, parts | [`reference::Reference`] |
//! | the surface of any file | [`surface`] | a mesh file or a run | [`surface::Surface`] |
//! | what welds and ties hold of it | [`joints`] | a deck | [`joints::Joints`] |
//! | eigenbasis | [`basis`] | the reference | [`basis::Basis`] |
//! | how each place has turned | [`rotation`] | a shape | sin θ × axis |
//! | other quantities on it: plastic strain | [`field`] | a run, a state | a function on the surface |
//! | how far edges and triangles stretch | [`strain`] | a shape | strains |
//! | coefficients of every state | [`project`] | a run | [`project::Projected`] |
//! | what is kept on disk | [`study`] | all of it | [`study::Study`] |
//! | eigenpairs of a surface, alone | [`eigen`] | a surface | [`eigen::Solved`], a file |
//! | a state that the user names | [`target`] | `run_007@3` | [`target::Target`] |
//! | deformation modes | [`modes`] | coefficients | [`modes::Modes`] |
//! | which coefficients are looked at | [`select`] | α or δ | values |
//! | shape from coefficients | [`reconstruct`] | coefficients | a shape, its errors |
//! | other methods on the same data | [`rivals`] | displacements | PCA |
//! | the coefficients that matter | [`descriptor`] | one state | [`descriptor::Descriptor`] |
//! | the numbers that are compared | [`features`] | a descriptor, coefficients | a few numbers |
//! | the same as a table | [`feature_table`] | a study or a run | a row a run |
//! | a descriptor of another study | [`transfer`] | two studies | a descriptor, its direction carried over |
//! | how alike | [`similarity`] | a descriptor, coefficients | a ranking |
//! | from which similarity on | [`calibrate`] | a descriptor, known runs | a threshold, its error rates |
//! | which mode, or none | [`classify`] | modes, a state | [`classify::Verdict`] |
//! | does the surface stretch | [`isometry`] | a state | strains, shift of the eigenvalues |
//! | why they are alike | [`explain`] | two states | terms, regions, words |
//! | a run that is being computed | [`monitor`] | states as they come | on the target's path or not |
//! | judged against labels | [`compare`] | labels | precision, average precision |
//! | tables and arrays for others | [`export`] | a study | npy, CSV, Parquet, OBJ, STL |
//! | one page for a person | [`report`] | a study | HTML |
//!
//! Libraries print nothing: progress and cancellation come in as a [`Watch`], warnings go out as values.

pub mod basis;
pub mod bundle;
pub mod calibrate;
pub mod classify;
pub mod compare;
pub mod deck;
pub mod descriptor;
pub mod eigen;
mod error;
pub mod explain;
pub mod export;
pub mod feature_table;
pub mod features;
pub mod field;
pub mod inputs;
pub mod isometry;
pub mod joints;
pub mod modes;
pub mod monitor;
pub mod project;
pub mod reconstruct;
pub mod reference;
pub mod report;
pub mod rivals;
pub mod rotation;
pub mod run;
pub mod select;
pub mod similarity;
pub mod strain;
pub mod study;
pub mod surface;
pub mod target;
pub mod transfer;
mod vector;

pub use error::Error;
pub use mesh_spectrum::{Certificate, EigenOptions, Kind, Mass, OperatorOptions, UnknownName, Watch};
