//! Signals without physics: spectra, Allan deviation, filters.
