//! All tests of the public library and of the command, in one binary: it is linked once, and long tests run beside each other.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod cli;
mod command;
mod dynamics;
mod estimation;
mod evaluation;
mod hostile_scene;
mod motion;
mod recording;
mod recordings;
mod report;
mod sensors;
mod simulation;
mod skip;
mod strapdown;
mod study;
mod world;
