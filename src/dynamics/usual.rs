//! The values of keys that are omitted.

pub fn segments() -> usize {
    1
}

pub fn still_s() -> f64 {
    2.5
}
