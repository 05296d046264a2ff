//! Spectra, transfer functions and Allan deviation of sampled signals, and period and jitter of time stamps.

mod allan;
mod chi_squared;
mod error;
mod regularity;
mod segments;
mod spectrum;
mod transfer;

pub use allan::{AllanPoint, allan_deviation};
pub use chi_squared::chi_squared_quantile;
pub use error::SignalError;
pub use regularity::{Regularity, StampPattern, first_on_time_s, lost_before};
pub use segments::{Segments, Window};
pub use spectrum::{Spectrum, power_density};
pub use transfer::{TransferPoint, transfer_function};
