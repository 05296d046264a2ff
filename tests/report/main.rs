//! The report in a browser.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "../command/mod.rs"]
mod command;
#[path = "../hostile_scene/mod.rs"]
mod hostile_scene;
mod live;
mod page;
#[path = "../skip/mod.rs"]
mod skip;
