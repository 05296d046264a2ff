//! The evaluation compared with evo and with closed forms.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod bound;
mod evo;
mod shaft_bound;
#[path = "../skip/mod.rs"]
mod skip;
mod slam_bound;
