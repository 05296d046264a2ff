//! Design of the spring under a head: metrics of a given spring, and the search for one that meets goals.

mod document;
mod export;
mod fatigue;
mod margins;
mod metrics;
mod mode_figure;
mod model;
mod modes;
mod outline;
mod report;
mod tables;
mod wire;

pub use document::document;
pub use export::{ExportError, HeadExport};
pub use fatigue::{MISSION_HOURS, StressCycle};
pub use margins::SpringMargins;
pub use metrics::{DesignMetrics, Shake, closed_form, simulated};
pub use mode_figure::mode_figure;
pub use modes::mode_name;
pub use report::{CoilReport, ModeReport, RestReport, ShakeResponse, SpringReport, spring_report};
pub use wire::{SpringMounting, Wire, WireLoad};
