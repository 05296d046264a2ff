//! Surfels: small planar patches of surface, each observed in one pass of the lidar beams.
//!
//! A surfel is built once, when the points are first projected by the trajectory. From then on it moves as a rigid body with
//! the trajectory at the mean time of the points: these span a fraction of a second, over which only the IMU
//! determines the shape of the trajectory.

mod build;
mod element;
mod flatness;
mod moments;
mod principal;

pub(super) use build::{Detail, SurfelBuilder};
pub(super) use element::{FINE, Patch, PlacedSurfel, PlacementState, Sighting, Surfel, TimedReturn, voxel_edge_m};
