//! The evaluation compared with evo and with closed forms.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod bound;
mod evo;
#[path = "../skip/mod.rs"]
mod skip;
