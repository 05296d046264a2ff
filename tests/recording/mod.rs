//! Recordings: round trips, files of other programs, damage, and independent readers.

mod bags;
mod damage;
mod databases;
mod drivers;
pub mod foreign;
mod formats;
mod frames;
mod hostile;
mod killed;
mod las;
mod live;
mod map;
mod points;
mod programs;
pub mod readers;
mod result;
mod round_trip;
mod sensors;
mod stamps;

use proptest::test_runner::{Config, FileFailurePersistence};

/// Cases of the property tests; the failed ones are kept in a file beside the test, which later runs repeat first.
///
/// The default needs a `main.rs` or `lib.rs` in a folder above the test, and finds no file without it.
fn property_test() -> Config {
    Config {
        failure_persistence: Some(Box::new(FileFailurePersistence::WithSource("regressions"))),
        ..Config::with_cases(64)
    }
}
