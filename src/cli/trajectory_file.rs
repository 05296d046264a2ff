//! Reads trajectories from TUM files, and the true trajectory from a recording.

use anyhow::{bail, ensure};
use std::path::Path;
use zsim_base::geometry::Trajectory;
use zsim_recording::{Reader, read_tum};

/// Maximum coordinate of a position, m; sums of squares of larger values could overflow.
const MAX_COORDINATE_M: f64 = 1e12;

/// Extensions of recordings; every other file is read as TUM.
const RECORDINGS: [&str; 4] = ["mcap", "bag", "db3", "zstd"];

/// Reads an estimated trajectory, TUM.
///
/// # Errors
/// When the file cannot be read, has no pose, or has a position that is out of range.
pub(super) fn estimate(path: &Path) -> anyhow::Result<Trajectory> {
    checked(path, read_tum(path)?)
}

/// Reads a true trajectory: a TUM file, or the ground truth of a recording (head, lidar time).
///
/// # Errors
/// As [`estimate`], or when the recording has no ground truth.
pub(super) fn truth(path: &Path) -> anyhow::Result<Trajectory> {
    let is_named = |ending: &std::ffi::OsStr| RECORDINGS.iter().any(|known| ending.eq_ignore_ascii_case(known));
    if !(path.is_dir() || path.extension().is_some_and(is_named)) {
        return checked(path, read_tum(path)?);
    }
    let trajectory = Reader::open(path)?.truth_trajectory()?;
    ensure!(
        !trajectory.is_empty(),
        "{}: the recording has no ground truth (topic /ground_truth/pose): pass the true trajectory as a TUM file",
        path.display()
    );
    checked(path, trajectory)
}

fn checked(path: &Path, trajectory: Trajectory) -> anyhow::Result<Trajectory> {
    ensure!(!trajectory.is_empty(), "{}: the file has no pose", path.display());
    let out_of_range = trajectory.iter().find(|(_, pose)| pose.translation.vector.amax() > MAX_COORDINATE_M);
    let Some((stamp, pose)) = out_of_range else { return Ok(trajectory) };
    bail!(
        "{}: the pose at t = {:.9} s has a coordinate of {:e} m (maximum {MAX_COORDINATE_M:e} m): is the file in another format?",
        path.display(),
        stamp.nanos() as f64 * 1e-9,
        pose.translation.vector.amax()
    );
}
