//! Base motions: properties of all, each kind, and the swing of the head that they cause.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod hand;
mod kinds;
mod properties;
mod recorded;
mod swing;
