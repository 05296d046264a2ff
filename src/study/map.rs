//! Maps that last: written behind an estimate, given to the next, put together.

use super::StudyError;
use super::atomic_file::AtomicFile;
use super::estimate::BestEstimate;
use super::open_loop::OpenLoopRun;
use crate::estimation::{EstimatorSpec, Located, locate_map, map_of, merge_maps};
use crate::geometry::Pose;
use crate::recording::{read_surfel_map, write_surfel_map};
use crate::surfel_map::SurfelMap;
use std::path::Path;

/// A map in which a recording's head is to be found.
#[derive(Debug, Clone, PartialEq)]
pub struct MapOptions {
    /// The map.
    pub map: SurfelMap,
    /// Where the head begins in it, to a metre on the level and twenty degrees about the vertical.
    pub map_from_head: Pose,
    /// Whether what the recording shows is put into the map, which is written then.
    pub extend: bool,
}

impl MapOptions {
    /// The map at `path`.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn read(path: &Path, map_from_head: Pose, extend: bool) -> Result<Self, StudyError> {
        Ok(Self { map: read_surfel_map(path)?, map_from_head, extend })
    }
}

/// What came of putting two maps together.
#[derive(Debug, Clone, PartialEq)]
pub struct Merged {
    /// Surfels of the first map, of the second, and of both together.
    pub surfels: [usize; 3],
    /// Where the second is in the first.
    pub located: Located,
}

/// Puts the maps `first` and `second` together, in the frame of the first, and writes the file `out`; the second's
/// origin is about at `start` in the first.
///
/// # Errors
/// When a map cannot be read, they cannot be brought together, or the file cannot be written.
pub fn merge_map_files(
    (first, second): (&Path, &Path),
    start: &Pose,
    estimator: &EstimatorSpec,
    out: &Path,
) -> Result<Merged, StudyError> {
    let (first, second) = (read_surfel_map(first)?, read_surfel_map(second)?);
    let located = locate_map(&first, &second, start, estimator)?;
    let both = merge_maps(&first, &second, &located.map_from_query)?;
    write(&both, out)?;
    Ok(Merged { surfels: [&first, &second, &both].map(|map| map.surfels().len()), located })
}

/// Writes the map that an estimate makes, or adds to, to `map.ply` in `folder`; whether there is one.
pub(super) fn write_map_of(
    run: &OpenLoopRun,
    best: &BestEstimate,
    (estimator, within): (&EstimatorSpec, Option<&MapOptions>),
    folder: &Path,
) -> Result<(), StudyError> {
    let trajectories = (best.seen_from, best.map_from_head);
    let seen = map_of(&run.survey, trajectories, &run.covariances, &estimator.registration)?;
    let map = match within {
        Some(within) => merge_maps(&within.map, &seen, &Pose::identity())?,
        None => seen,
    };
    write(&map, &folder.join("map.ply"))
}

fn write(map: &SurfelMap, place: &Path) -> Result<(), StudyError> {
    let folder = place.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut beside = AtomicFile::new(folder, place)?;
    write_surfel_map(&mut beside, map)?;
    beside.finish()
}
