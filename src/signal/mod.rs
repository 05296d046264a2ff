//! Spectra, transfer functions and Allan deviation of sampled signals; no physics.

mod allan;
mod chi_squared;

pub use allan::{AllanPoint, allan_deviation};
pub use chi_squared::chi_squared_quantile;
