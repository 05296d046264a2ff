//! Recordings: round trips, files of other programs, damage, and independent readers.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod damage;
mod drivers;
mod foreign;
mod formats;
mod killed;
mod las;
mod map;
mod points;
mod programs;
mod readers;
#[path = "../recordings/mod.rs"]
mod recordings;
mod result;
mod round_trip;
#[path = "../skip/mod.rs"]
mod skip;
