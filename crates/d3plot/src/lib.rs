//! LS-DYNA result files: d3plot families, whatever a killed run, a full disk or another solver made of them.
//!
//! The way through the crate is the way through the file: the **control** block (word size and byte order by content,
//! every count checked), the **geometry** with its numbering and titles, the layout of a **state** and the walk that
//! finds all states in the members, and the **family** that hands them out. Bytes become numbers in one type behind a
//! length check; any bytes give an answer or an [`Error`], never a panic, and no more memory than a few times the file.
//!
//! Nothing here knows of meshes or spectra: what comes out is arrays, node and part indices from 0, in the units of the
//! file (d3plots do not say which).
//!
//! ```
//! use d3plot::{Family, roots};
//!
//! let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/testdata/s09_cut_in_state");
//! assert_eq!(roots(folder.as_ref())?.families.len(), 1);
//!
//! let family = Family::open(folder.as_ref())?;
//! assert_eq!(family.times().len(), 5); // the sixth state is cut
//! assert_eq!(family.warnings()[0].kind(), "cut-state");
//! # Ok::<(), d3plot::Error>(())
//! ```

// bytes and files
mod cursor;
mod error;
mod map;
mod members;
mod warning;
mod words;

// the control block
mod control;
mod detect;

// the geometry
mod airbags;
mod elements;
mod geometry;
mod numbering;
mod parts;
mod rigid;
mod titles;

// the states
mod motion;
mod quantity;
mod ranges;
mod results;
mod rotation;
mod series;
mod state;
mod strain;
mod values;
mod walk;

// the family
mod family;
mod roots;
mod write;

pub use control::Header;
pub use detect::FileType;
pub use elements::{Beam, Geometry, Particle, Shell, Solid};
pub use error::{Error, LooksLike};
pub use family::{Family, Member, ReadOptions};
pub use parts::Part;
pub use ranges::{Component, Range};
pub use results::{Deletion, Table};
pub use roots::{Refused, Root, Roots, roots};
pub use series::{Series, StateValues};
pub use state::Field;
pub use values::{Layers, Real, Rows};
pub use warning::Warning;
pub use words::{ByteOrder, Precision};
pub use write::{
    Content, Copied, DeletionTable, Keep, Positions, StateWriter, Stored, Thermal, WordsEach, WriteOptions, Writer,
};
