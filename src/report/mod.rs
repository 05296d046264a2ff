//! Results for people: figures of a run ([`Metrics`]), tables, plots, a page. It knows results, not how they came.

mod figures;
mod integrity;
mod metrics;
mod page;
pub mod plot;
mod profile;
mod quantity;
mod rows;
mod table;

pub use figures::{
    bound_over_time, clock_offset, errors_over_time, head_pitch, open_and_closed_loop_errors, trajectory_top_view,
};
pub use integrity::{CauseMetrics, EventMetrics, IntegrityMetrics};
pub use metrics::{
    ClockMetrics, ClosedLoopMetrics, CloudMetrics, FilterMetrics, LidarMetrics, LoopMetrics, Metrics, OpenLoopMetrics,
    SimulationMetrics,
};
pub use page::{Section, page};
pub use profile::time_spent;
pub use table::{markdown, summary, table};
