//! Design of the spring under a head: metrics of a given spring, and the search for one that meets goals.

pub mod design;
mod metrics;
mod mode_figure;
mod outline;
mod report;
mod shake;
mod view_plane;
mod wire;

pub use metrics::{DesignMetrics, closed_form, simulated};
pub use mode_figure::mode_figure;
pub use report::{CoilReport, ModeReport, RestReport, ShakeResponse, SpringReport, spring_report};
pub use shake::Shake;
pub use wire::{SpringMounting, Wire, WireLoad};
