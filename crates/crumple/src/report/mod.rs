//! The report: one self-contained page for a person.
//!
//! [`findings`] gathers everything that the page shows as plain data; [`page`] is a pure function of it. The page and
//! any other reader of the findings cannot disagree.

mod findings;
mod page;
pub mod picture;
mod shapes;
mod thin;
mod words;

pub use findings::{Findings, describe_modes, findings};
pub use page::{page, save, write};
pub use words::early_words;
