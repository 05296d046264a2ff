//! Persistent maps: written after an estimate, used for localisation, merged.

use super::RunError;
use super::loops::BestEstimate;
use super::map_options::MapOptions;
use super::open_loop::OpenLoopRun;
use std::path::Path;
use zsim_base::files::AtomicFile;
use zsim_base::geometry::Pose;
use zsim_base::surfel_map::SurfelMap;
use zsim_estimation::{EstimatorSpec, LocalisedPose, locate_map, map_of, merge_maps};
use zsim_recording::{read_surfel_map, write_surfel_map};

/// Result of merging two maps.
#[derive(Debug, Clone, PartialEq)]
pub struct MergedMap {
    /// Number of surfels of the first map, the second map and the merged map.
    pub surfels: [usize; 3],
    /// Pose of the second map in the first.
    pub located: LocalisedPose,
}

/// Merges the maps `first` and `second` in the frame of the first, and writes the result to `out`.
///
/// `start` is the approximate pose of the second map in the first; without it the whole first map is searched.
///
/// # Errors
/// When a map cannot be read, the maps cannot be registered, or the file cannot be written.
pub fn merge_map_files(
    first: &Path,
    second: &Path,
    start: Option<&Pose>,
    estimator: &EstimatorSpec,
    out: &Path,
) -> Result<MergedMap, RunError> {
    let (first, second) = (read_surfel_map(first)?, read_surfel_map(second)?);
    let located = locate_map(&first, &second, start, estimator)?;
    let both = merge_maps(&first, &second, &located.map_from_query)?;
    write(&both, out)?;
    Ok(MergedMap { surfels: [&first, &second, &both].map(|map| map.surfels().len()), located })
}

/// Writes the map of an estimate, merged into the given map if there is one, to `map.ply` in `folder`.
pub(super) fn write_map(
    run: &OpenLoopRun,
    best: &BestEstimate,
    estimator: &EstimatorSpec,
    within: Option<&MapOptions>,
    folder: &Path,
) -> Result<(), RunError> {
    let (open_loop, corrected) = (best.observed_trajectory, best.map_from_head);
    let from_run = map_of(&run.estimate.observed, open_loop, corrected, &run.covariances, estimator)?;
    let map = match within {
        Some(within) => merge_maps(&within.map, &from_run, &Pose::identity())?,
        None => from_run,
    };
    write(&map, &folder.join("map.ply"))
}

fn write(map: &SurfelMap, path: &Path) -> Result<(), RunError> {
    let folder = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut file = AtomicFile::new(folder, path)?;
    write_surfel_map(&mut file, map)?;
    Ok(file.finish()?)
}
