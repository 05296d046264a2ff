//! Errors of the analysis of signals.

/// Errors of signal analysis.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum SignalError {
    /// The record is shorter than one segment.
    #[error("{samples} samples are fewer than one segment of {segment}: record longer or use shorter segments")]
    TooShort {
        /// Number of samples in the record.
        samples: usize,
        /// Number of samples in a segment.
        segment: usize,
    },
    /// The segment length or overlap is invalid.
    #[error(
        "segments of {length} samples with an overlap of {overlap}: the length must be at least 2 and above the overlap"
    )]
    Segments {
        /// Length of a segment, samples.
        length: usize,
        /// Overlap with the next segment, samples.
        overlap: usize,
    },
    /// Input and output differ in length.
    #[error("the input has {input} samples, the output {output}: both must have the same number")]
    Mismatch {
        /// Number of input samples.
        input: usize,
        /// Number of output samples.
        output: usize,
    },
    /// A sample is NaN or infinite.
    #[error("sample {index} is not finite")]
    NotFinite {
        /// Index of the sample, from 0.
        index: usize,
    },
}
