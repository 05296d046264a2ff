//! Multi-objective search for a spring.
//!
//! The design space is the geometry of a coil within bounds, or a catalogue of springs. A design is evaluated in closed
//! form, in less than 1 ms. A catalogue is evaluated exhaustively. A geometry is sampled uniformly first; then several
//! runs of CMA-ES (Hansen 2016) minimise the goals with different weights. The scalarisation is that of
//! Chebyshev, which also finds concave fronts. The Pareto set is taken from all evaluated designs; an evenly distributed
//! selection of it is verified by full simulations. Designs that cannot be made, clash or break are rejected.
//!
//! Goals without a closed form need a journey: an evenly distributed selection of the feasible designs is simulated and
//! estimated, and the Pareto set of all goals is taken from it.

mod catalogue;
mod document;
mod evaluation;
mod journey;
mod limits;
mod optimise;
mod outcome;
mod search;
mod space;
mod spec;
mod verified;

pub use catalogue::catalogue;
pub use document::{csv, document, pareto_figure, rejected_csv};
pub use evaluation::Candidate;
pub use limits::{BuildLimitsSpec, Violation, WireStock};
pub use search::{DesignSearch, DesignStudy, Exploration};
pub use spec::{CoilDesign, DesignJourneySpec, DesignSpec, SpaceSpec};
pub use verified::{Rejection, VerifiedDesign};
