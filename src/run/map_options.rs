//! The map that an estimate starts with.

use super::RunError;
use std::path::Path;
use zsim_base::geometry::Pose;
use zsim_base::surfel_map::SurfelMap;
use zsim_recording::read_surfel_map;

/// A map in which to localise the head.
#[derive(Debug, Clone, PartialEq)]
pub struct MapOptions {
    /// The map.
    pub map: SurfelMap,
    /// Approximate initial pose of the head in the map, within 1 m horizontally and 20 degrees in yaw; `None` to search all of
    /// the map.
    pub map_from_head: Option<Pose>,
    /// Whether to extend the map with the recording and write it.
    pub extend: bool,
}

impl MapOptions {
    /// Reads the map at `path`.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn read(path: &Path, map_from_head: Option<Pose>, extend: bool) -> Result<Self, RunError> {
        Ok(Self { map: read_surfel_map(path)?, map_from_head, extend })
    }
}
