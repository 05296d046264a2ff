//! The statement of integrity: `integrity.csv`, `windows.csv`, and what the truth says of them.

use super::StudyError;
use super::beside::Beside;
use super::open_loop::OpenLoopRun;
use crate::estimation::{GAUGED_S, WindowReport, blocks, doubt};
use crate::geometry::{PoseCovariance, Trajectory};
use crate::time::Stamp;
use std::io::{BufWriter, Write};
use std::path::Path;

/// The bound of a position whose covariance says nothing is wrong is at least this, m: what a voxel's content adds.
const LEAST_BOUND_M: f64 = 0.003;

/// A pose's bound and standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PoseBound {
    pub stamp: Stamp,
    /// The position error is below this with a probability of 99 %, m.
    pub bound_m_99: f64,
    /// Standard deviations of the position in the map, m, and of the attitude, degrees.
    pub sigmas: [f64; 6],
}

/// The bounds of the poses of `trajectory`.
pub(super) fn bounds(run: &OpenLoopRun, trajectory: &Trajectory) -> Vec<PoseBound> {
    let doubts = doubt(&run.windows);
    let radii_m = radii(run);
    let mut covariances = run.covariances.iter().zip(&radii_m).peekable();
    let mut current: Option<(&PoseCovariance, f64)> = None;
    let bound = |stamp: Stamp| {
        while let Some(((_, covariance), radius_m)) = covariances.next_if(|((at, _), _)| *at <= stamp) {
            current = Some((covariance, *radius_m));
        }
        let (covariance, radius_m) = current?;
        let (position, attitude) = blocks(covariance);
        let after = doubts.partition_point(|(at, _)| *at < stamp).min(doubts.len().saturating_sub(1));
        let factor = doubts.get(after).map_or(1.0, |(_, factor)| *factor);
        let sigma = |k: usize| {
            if k < 3 { position[(k, k)].sqrt() } else { attitude[(k - 3, k - 3)].sqrt().to_degrees() }
        };
        let sigmas = std::array::from_fn(sigma);
        Some(PoseBound { stamp, bound_m_99: LEAST_BOUND_M.hypot(radius_m * factor), sigmas })
    };
    trajectory.iter().map(|(stamp, _)| stamp).filter_map(bound).collect()
}

/// The radii that follow from the covariances; over the seconds of the alignment, whose mean is known only at their
/// end, the largest of them.
fn radii(run: &OpenLoopRun) -> Vec<f64> {
    let mut radii_m = run.radii_m.clone();
    let Some((first, _)) = run.covariances.first() else { return radii_m };
    let aligned = run.covariances.partition_point(|(stamp, _)| stamp.seconds_since(*first) < GAUGED_S);
    let largest_m = radii_m[..aligned].iter().copied().fold(0.0, f64::max);
    radii_m[..aligned].fill(largest_m);
    radii_m
}

/// Writes `integrity.csv` to `folder`.
pub(super) fn write_integrity(folder: &Path, bounds: &[PoseBound]) -> Result<(), StudyError> {
    let header = "stamp_s,bound_m_99,sigma_x_m,sigma_y_m,sigma_z_m,sigma_roll_deg,sigma_pitch_deg,sigma_yaw_deg";
    let rows = bounds.iter().map(|PoseBound { stamp, bound_m_99, sigmas }| {
        let [x, y, z, roll, pitch, yaw] = sigmas;
        format!("{},{bound_m_99:.6},{x:.6},{y:.6},{z:.6},{roll:.6},{pitch:.6},{yaw:.6}", seconds(*stamp))
    });
    write(folder, "integrity.csv", header, rows)
}

/// Writes `windows.csv` to `folder`.
pub(super) fn write_windows(folder: &Path, windows: &[WindowReport]) -> Result<(), StudyError> {
    let header = "stamp_s,surfels,matches,view_matches,views,residual_rms_m,iterations,conditioning,imu_contradiction,\
                  clock_offset_s,clock_rate,range_correction_m,imu_matrix,moving,trouble";
    let rows = windows.iter().map(|w| {
        let trouble = w.trouble.as_ref().map_or("", |kind| kind.name());
        format!(
            "{},{},{},{},{},{:.6},{},{:.3e},{:.4},{:.9},{:.3e},{:.6},{:.3e},{},{trouble}",
            seconds(w.stamp),
            w.surfels,
            w.matches,
            w.view_matches,
            w.views,
            w.residual_rms_m,
            w.iterations,
            w.conditioning,
            w.imu_contradiction,
            w.clock_offset_s,
            w.clock_rate,
            w.range_correction_m,
            w.imu_matrix,
            u8::from(w.moving),
        )
    });
    write(folder, "windows.csv", header, rows)
}

/// Seconds with nine decimals, as in TUM files.
fn seconds(stamp: Stamp) -> String {
    let nanos = stamp.nanos();
    let sign = if nanos < 0 { "-" } else { "" };
    format!("{sign}{}.{:09}", nanos.unsigned_abs() / 1_000_000_000, nanos.unsigned_abs() % 1_000_000_000)
}

fn write(folder: &Path, name: &str, header: &str, mut rows: impl Iterator<Item = String>) -> Result<(), StudyError> {
    let path = folder.join(name);
    let mut file = BufWriter::new(Beside::new(folder, &path)?);
    let written = writeln!(file, "{header}").and_then(|()| rows.try_for_each(|row| writeln!(file, "{row}")));
    written.map_err(StudyError::file(&path))?;
    let file = file.into_inner().map_err(|error| StudyError::file(&path)(error.into_error()))?;
    file.finish()
}
