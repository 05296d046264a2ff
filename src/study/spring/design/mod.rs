//! The search for a spring.
//!
//! A design in the space (a coil's geometry within bounds, or the springs of a catalogue) is judged by its closed form
//! in a fraction of a millisecond. A catalogue is tried through. A geometry is sampled evenly first; then CMA-ES
//! (Hansen 2016, crate `cmaes`) descends on the goals weighed in several ways (Chebyshev's scalarisation, so that
//! hollow fronts are found too), and whatever it meets is kept. What no other design beats in every goal is the Pareto
//! set; some of it, spread evenly, is verified by a full simulation each.

mod catalogue;
mod output;
mod pareto;
mod search;
mod spec;

pub use catalogue::{STOCK, catalogue};
pub use output::{csv, pareto_figure};
pub use pareto::{pareto_set, spread};
pub use search::{Candidate, DesignStudy, Search, Verified};
pub use spec::{Aim, CoilDesign, DesignSpec, FigureName, GoalSpec, LimitSpec, SpaceSpec};
