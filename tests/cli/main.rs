//! The commands: output, files and errors.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod benchmark;
#[path = "../command/mod.rs"]
mod command;
mod commands;
mod compare;
mod documents;
mod examples;
mod gains;
mod hostile;
#[path = "../hostile_scene/mod.rs"]
mod hostile_scene;
mod live;
mod live_run;
mod maps;
mod scene;
mod sensor_models;
#[path = "../skip/mod.rs"]
mod skip;
mod specs;
mod summary;
mod terminal;
