//! Closed-form recordings: a head that walks and nods through rooms of boxes.
//!
//! Rays use the slab method, the motion has analytic derivatives. Independent of the simulator, so that the tests of
//! the estimator do not depend on it.

#![allow(dead_code, unused_imports, reason = "each test uses only a part of it")]

mod jet;
mod motion;
mod room;
mod score;
mod sensors;

pub use motion::Walk;
pub use room::Room;
pub use score::{Score, growth_m};
pub use sensors::{Run, Scanner, calibration};
