//! The values of keys that are omitted in motions: those of `specs/motions/hand.ron`.

/// Time at rest at the start, s: the estimator needs it.
pub fn still_s() -> f64 {
    2.5
}

pub fn onset_s() -> f64 {
    2.0
}

pub fn grip_s() -> f64 {
    0.5
}

pub fn wander_hz() -> f64 {
    0.15
}

pub fn corner_reach_m() -> f64 {
    0.7
}

pub fn smoothing_s() -> f64 {
    0.8
}

pub fn turn_s() -> f64 {
    0.9
}

pub fn turn_rate_deg_per_s() -> f64 {
    110.0
}

pub fn turn_lag_s() -> f64 {
    0.15
}

/// Peak enhancement of a growing wind sea.
pub fn peakedness() -> f64 {
    3.3
}

pub fn from_route() -> bool {
    true
}

pub fn ease_s() -> f64 {
    1.0
}
