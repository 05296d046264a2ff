//! Results for people: tables, plots, a page.

mod figures;
pub mod plot;

pub use figures::{clock_offset, errors_over_time, head_pitch, trajectory_from_above};
