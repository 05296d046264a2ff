//! A head that walks and nods through rooms of boxes, in closed form: rays by slabs, motion by analytic derivatives.
//! Independent of the simulator, so that the estimator's tests do not rest on it.

#![allow(dead_code, unused_imports, reason = "each test uses its part")]

mod jet;
mod motion;
mod room;
mod score;
mod sensors;

pub use motion::Walk;
pub use room::Room;
pub use score::{Score, growth_m};
pub use sensors::{Run, Scanner, calibration};
