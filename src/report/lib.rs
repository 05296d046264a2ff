//! Reports of a run: metrics ([`Metrics`]), tables, plots and the HTML page.
//!
//! This module formats results; it does not compute them.

mod brief;
mod comparison;
mod document;
mod figures;
mod integrity;
mod metrics;
mod names;
pub mod page;
pub mod plot;
mod profile;
mod quantity;
mod rows;
pub mod scene;
mod sensors;
mod table;
mod verdict;
mod wrap;

pub use brief::brief;
pub use comparison::{
    compared_errors, compared_trajectories, comparison_details, comparison_table, trajectory_figures,
};
pub use document::{Content, Document, Plot};
pub use figures::{
    LengthUnit, bound_over_time, clock_offset, errors_over_time, head_pitch, open_and_closed_loop_errors,
    trajectory_views,
};
pub use integrity::{CauseMetrics, EventMetrics, IntegrityMetrics};
pub use metrics::{
    ClockMetrics, ClosedLoopMetrics, CloudMetrics, FilterMetrics, LidarMetrics, LoopMetrics, Metrics, OpenLoopMetrics,
    SimulationMetrics,
};
pub use names::{axis_label, quantity_name};
pub use profile::timing_table;
pub use quantity::{digits, length};
pub use sensors::{NoiseMetrics, SensorMetrics, noise_sources};
pub use table::{Table, summary, table};
pub use wrap::wrapped;
