//! The report in a browser.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "../command/mod.rs"]
mod command;
mod live;
#[path = "../live_run/mod.rs"]
mod live_run;
mod page;
#[path = "../skip/mod.rs"]
mod skip;
