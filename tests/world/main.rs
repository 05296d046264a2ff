//! Worlds: scenes, meshes, movers, ray casts, and invalid files.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod casts;
mod exports;
mod includes;
mod meshes;
mod planes;
mod plants;
mod scenes;
mod specs;
mod traffic;
