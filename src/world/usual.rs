//! The values of keys that are omitted.

pub fn seed() -> u64 {
    1
}

pub fn repeats() -> bool {
    true
}
