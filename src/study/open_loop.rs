//! The open loop over a recording, as it would run while recording.

use super::cadence::Cadence;
use super::{Stage, StudyError, Watch};
use crate::estimation::{EstimatedPose, Estimator, EstimatorSpec, Warning, WarningKind};
use crate::geometry::Trajectory;
use crate::measurement::{Calibration, Measurement};
use crate::recording::{Reader, RecordingError, Selection, TumWriter};
use crate::time::Stamp;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::time::Instant;

/// Measurements between two looks at the clock of the progress.
const TELL_EVERY: usize = 200;

/// What the open loop made of a recording.
pub(super) struct OpenLoopRun {
    /// The estimate.
    pub map_from_head: Trajectory,
    /// The estimated clock offset over lidar time, s.
    pub clock_offsets: Vec<(Stamp, f64)>,
    /// What the estimator has to say of it.
    pub warnings: Vec<Warning>,
    /// What of the recording was lost or left out, a sentence each.
    pub losses: Vec<String>,
    /// Echoes in the recording.
    pub returns: usize,
    /// From the recording's first stamp to its last, s.
    pub acquisition_s: f64,
    /// Time it took, reading included, s.
    pub wall_s: f64,
}

/// Estimates from what `reader` reads; poses go to the TUM file `tum` as they become final.
pub(super) fn run_open_loop(
    reader: &Reader,
    selection: &Selection,
    how: (&EstimatorSpec, &Calibration),
    tum: &Path,
    watch: &mut Watch,
) -> Result<OpenLoopRun, StudyError> {
    let started = Instant::now();
    let mut estimator = Estimator::new(how.0, how.1)?;
    let mut written = Written { tum: TumWriter::create(tum)?, map_from_head: Trajectory::new() };
    let mut heard = Heard::default();
    let mut measurements = reader.measurements(selection);
    for (index, measurement) in measurements.by_ref().enumerate() {
        let measurement = measurement?;
        heard.take(&measurement);
        estimator.push(measurement)?;
        if index % TELL_EVERY == 0 {
            written.take(&estimator.take_poses())?;
            watch.progress(Stage::Estimating, heard.seconds(), None);
            if watch.is_stopped() {
                written.tum.finish()?;
                return Err(StudyError::Stopped);
            }
        }
    }
    let result = estimator.finish()?;
    written.take(&result.poses)?;
    written.tum.finish()?;

    let mut losses = measurements.loss().sentences();
    losses.extend(heard.imu.missing("IMU samples"));
    losses.extend(heard.lidar.missing("scans"));
    losses.extend(result.warnings.iter().filter(|warning| is_loss(&warning.kind)).map(Warning::to_string));
    Ok(OpenLoopRun {
        map_from_head: written.map_from_head,
        clock_offsets: result.clock_offsets,
        warnings: result.warnings,
        losses,
        returns: heard.returns,
        acquisition_s: heard.seconds(),
        wall_s: started.elapsed().as_secs_f64(),
    })
}

/// Whether a warning says that measurements were not there, or not used: an estimate with loss.
pub(super) fn is_loss(kind: &WarningKind) -> bool {
    matches!(
        kind,
        WarningKind::ImuGap { .. }
            | WarningKind::LidarGap { .. }
            | WarningKind::Ended { .. }
            | WarningKind::LeftOut { .. }
    )
}

/// Poses on disk and in memory.
struct Written {
    tum: TumWriter<BufWriter<File>>,
    map_from_head: Trajectory,
}

impl Written {
    fn take(&mut self, poses: &[EstimatedPose]) -> Result<(), RecordingError> {
        for pose in poses {
            self.tum.pose(pose.stamp, &pose.map_from_head)?;
            let name = "the estimate".to_owned();
            let kept = self.map_from_head.push(pose.stamp, pose.map_from_head);
            kept.map_err(|source| RecordingError::Trajectory { name, source })?;
        }
        Ok(())
    }
}

/// What went by.
#[derive(Default)]
struct Heard {
    imu: Cadence,
    lidar: Cadence,
    returns: usize,
}

impl Heard {
    fn take(&mut self, measurement: &Measurement) {
        match measurement {
            Measurement::Imu(sample) => self.imu.take(sample.stamp),
            Measurement::Lidar(scan) => {
                self.lidar.take(scan.stamp);
                self.returns += scan.returns.len();
            }
        }
    }

    fn seconds(&self) -> f64 {
        let longest = |cadence: &Cadence| cadence.span().map_or(0.0, |(first, last)| last.seconds_since(first));
        longest(&self.imu).max(longest(&self.lidar))
    }
}
