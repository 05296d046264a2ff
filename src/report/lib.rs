//! Reports of a run: metrics ([`Metrics`]), tables, plots and the HTML page.
//!
//! This module formats results; it does not compute them.

mod brief;
mod comparison;
mod document;
mod figures;
mod integrity;
mod metrics;
pub mod page;
pub mod plot;
mod quantity;
mod rows;
pub mod scene;
mod table;

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
    ClockMetrics, ClosedLoopMetrics, CloudMetrics, FilterMetrics, LidarMetrics, LoopMetrics, Metrics, NoiseMetrics,
    OpenLoopMetrics, SensorMetrics, SimulationMetrics, noise_sources,
};
pub use quantity::{axis_label, capitalised, digits, length, quantity_name};
pub use table::{Table, summary, table, timing_table, wrapped};
