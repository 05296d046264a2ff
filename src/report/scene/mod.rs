//! Views of a scene: a page with its surfaces in three dimensions, and a floor plan with an elevation.

mod page;
mod plan;

pub use page::page;
pub use plan::{DEFAULT_CUT_M, plan};
