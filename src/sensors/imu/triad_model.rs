//! Error model of the three axes of a gyroscope or an accelerometer.

/// Error model of three axes of the same kind, in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TriadModel {
    pub density: f64,
    pub turn_on: f64,
    pub walk: f64,
    pub gauss_markov: Option<GaussMarkov>,
    pub scale: f64,
    pub misalignment: f64,
    pub limit: f64,
    pub resolution: f64,
}

/// A first-order Gauss-Markov process in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct GaussMarkov {
    pub sigma: f64,
    pub time_s: f64,
}
