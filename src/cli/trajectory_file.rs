//! Reads estimated and true trajectories.

use super::message;
use super::usage::Usage;
use anyhow::{bail, ensure};
use clap::Args;
use std::path::{Path, PathBuf};
use zsim_base::geometry::Trajectory;
use zsim_base::time::Span;
use zsim_evaluation::{EvaluationError, Pairs};
use zsim_recording::{PoseTimes, Reader, TrajectoryFile, read_tum};

/// Maximum coordinate of a position, m; sums of squares of larger values could overflow.
const MAX_COORDINATE_M: f64 = 1e12;
/// Interval over which linear interpolation is accurate to a millimetre or two: at 2 m/s^2, 0.05 s make 2 / 8 * 0.05^2 m.
const MAX_INTERPOLATED_S: f64 = 0.05;
/// Range of the rate of true poses, Hz.
const RATES_HZ: std::ops::RangeInclusive<f64> = 1e-3..=1e6;

/// Extensions of recordings; every other file is read as text.
const RECORDINGS: [&str; 4] = ["mcap", "bag", "db3", "zstd"];

/// Stamps of a truth in the KITTI format.
#[derive(Args, Default)]
pub(super) struct TruthTimes {
    /// Times of a truth in the KITTI format, which has none: a file with one time in seconds per line, as times.txt of KITTI
    #[arg(long, value_name = "TIMES.txt", requires = "truth", conflicts_with = "truth_rate")]
    truth_times: Option<PathBuf>,
    /// Poses per second of a truth in the KITTI format, from 0 s on, instead of --truth-times
    #[arg(long, value_name = "HZ", requires = "truth", value_parser = super::quantity::hertz, allow_hyphen_values = true)]
    truth_rate: Option<f64>,
}

impl TruthTimes {
    fn given(&self) -> Result<Option<PoseTimes>, Usage> {
        if let Some(rate_hz) = self.truth_rate {
            let is_valid = RATES_HZ.contains(&rate_hz);
            let wrong = || Usage(format!("--truth-rate {rate_hz}: expected 0.001 to 1000000 Hz"));
            return is_valid.then_some(Some(PoseTimes::Rate(rate_hz))).ok_or_else(wrong);
        }
        Ok(self.truth_times.clone().map(PoseTimes::File))
    }
}

/// A true trajectory.
pub(super) struct Truth {
    pub(super) trajectory: Trajectory,
    /// Whether it has attitudes, or positions only.
    has_attitudes: bool,
}

impl Truth {
    /// Reads a text file (TUM, positions only, EuRoC, KITTI), or the ground truth of a recording (head, lidar time).
    ///
    /// # Errors
    /// As [`estimate`], or when the recording has no ground truth.
    pub(super) fn read(path: &Path, times: &TruthTimes) -> anyhow::Result<Self> {
        let times = times.given()?;
        let is_named = |ending: &std::ffi::OsStr| RECORDINGS.iter().any(|known| ending.eq_ignore_ascii_case(known));
        if !(path.is_dir() || path.extension().is_some_and(is_named)) {
            let TrajectoryFile { trajectory, has_attitudes } = TrajectoryFile::read(path, times.as_ref())?;
            return Ok(Self { trajectory: checked(path, trajectory)?, has_attitudes });
        }
        if times.is_some() {
            return Err(Usage(format!("{}: a recording has its own times", path.display())).into());
        }
        let trajectory = Reader::open(path)?.truth_trajectory()?;
        ensure!(
            !trajectory.is_empty(),
            "{}: the recording has no ground truth (topic /ground_truth/pose): pass the true trajectory as a TUM file",
            path.display()
        );
        Ok(Self { trajectory: checked(path, trajectory)?, has_attitudes: true })
    }

    /// Pairs an estimate with the truth.
    pub(super) fn pairs(&self, estimate: &Trajectory) -> Result<Pairs, EvaluationError> {
        let pairs = Pairs::associate(estimate, &self.trajectory)?;
        Ok(if self.has_attitudes { pairs } else { pairs.with_positions_only() })
    }

    /// Notes what cannot be evaluated.
    pub(super) fn note(&self, path: &Path) {
        if !self.has_attitudes {
            message::note(&format!(
                "{} has positions without attitudes: angles, yaw drift and relative errors are not evaluated",
                path.display()
            ));
        }
    }
}

/// Notes that the errors of the estimate in `path` include those of a long interpolation.
pub(super) fn note_interpolation(path: &Path, pairs: &Pairs) {
    let interval_s = pairs.interpolated_over().map_or(0.0, Span::seconds);
    if interval_s > MAX_INTERPOLATED_S {
        message::note(&format!(
            "{} and the truth have different stamps, and neither has intervals below {interval_s:.2} s: the errors include \
             those of a linear interpolation",
            path.display()
        ));
    }
}

/// Reads an estimated trajectory, TUM.
///
/// # Errors
/// When the file cannot be read, has no pose, or has a position that is out of range.
pub(super) fn estimate(path: &Path) -> anyhow::Result<Trajectory> {
    checked(path, read_tum(path)?)
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
