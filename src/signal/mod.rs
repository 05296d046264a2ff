//! Spectra, transfer functions and Allan deviation of sampled signals, and the regularity of their stamps; no physics.

mod allan;
mod chi_squared;
mod regularity;
mod segments;
mod spectrum;
mod transfer;

pub use allan::{AllanPoint, allan_deviation};
pub use chi_squared::chi_squared_quantile;
pub use regularity::{Regularity, StampPattern};
pub use segments::{Segments, Window};
pub use spectrum::{Spectrum, power_density};
pub use transfer::{TransferPoint, transfer_function};

/// Why a signal cannot be analysed.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum SignalError {
    /// Fewer samples than one segment takes.
    #[error("{samples} samples do not fill one segment of {segment}; record longer, or take shorter segments")]
    TooShort {
        /// How many samples there are.
        samples: usize,
        /// How many a segment takes.
        segment: usize,
    },
    /// Segments that cannot be made.
    #[error(
        "segments of {length} samples that overlap by {overlap}: a segment has at least 2, and overlaps by less than itself"
    )]
    Segments {
        /// The segment's length.
        length: usize,
        /// Its overlap with the next.
        overlap: usize,
    },
    /// An input and an output that do not belong together.
    #[error("the input has {input} samples, the output {output}; they must be sampled together")]
    Mismatch {
        /// Samples of the input.
        input: usize,
        /// Samples of the output.
        output: usize,
    },
    /// A NaN or an infinity in the signal.
    #[error("sample {index} is not finite")]
    NotFinite {
        /// Which sample, from 0.
        index: usize,
    },
}
