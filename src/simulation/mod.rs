//! From a checked scenario to measurements and truth.
//!
//! [`simulate`] is the one function: a [`Rig`] (sensors on a head, in some scenery), a [`HeadMotion`] (physics, as a rule)
//! and a sink; measurements and truth go into the sink in the order of true time.

mod deliver;
mod error;
mod measure;
mod motion;
mod rig;
mod run;
mod schedule;
mod summary;

pub use error::SimulationError;
pub use motion::{HeadMotion, Moved, STEP_S};
pub use rig::{EPOCH, Rig};
pub use run::simulate;
pub use summary::SimulationSummary;
