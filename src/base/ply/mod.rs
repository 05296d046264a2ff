//! Reads PLY files (Turk 1994): a text header that declares elements and their properties, followed by the elements.
//!
//! All three encodings are read element by element, so memory does not depend on the numbers that a header declares.

mod header;
mod lines;
mod reader;

pub use header::{Element, Header, PlyFormat, Property, PropertyKind, Scalar};
pub use reader::{Failure, MAX_LIST_ITEMS, PlyReader, Row};

/// Line number and description of a problem.
pub type Problem = (usize, String);
