//! The open loop over a recording, as it would run while recording.

use super::cadence::Cadence;
use super::events::Events;
use super::read_ahead::{Coming, read_ahead};
use super::{MapOptions, Stage, StudyError, Watch};
use crate::estimation::{
    EstimatedPose, Estimator, EstimatorSpec, Located, Survey, TimeSpent, Warning, WindowReport, covariance_blocks,
    radius_99,
};
use crate::geometry::{PoseCovariance, Trajectory};
use crate::measurement::{Calibration, LidarCorrection, Measurement};
use crate::recording::{Reader, RecordingError, Selection, TumWriter};
use crate::time::{Span, Stamp};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::time::Instant;

/// Measurements between two looks at the clock of the progress.
const TELL_EVERY: usize = 200;

/// Time between the covariances that are kept.
const COVARIANCE_PERIOD: Span = Span::from_nanos(100_000_000);

/// What the open loop made of a recording.
pub(super) struct OpenLoopRun {
    /// The estimate.
    pub map_from_head: Trajectory,
    /// How uncertain the estimate is, ten times a second.
    pub covariances: Vec<(Stamp, PoseCovariance)>,
    /// The radius of 99 % that follows from the covariance against the gauge at the same stamps, m.
    pub radii_m: Vec<f64>,
    /// Covariances of poses of the first seconds against the alignment that these give.
    pub gauged: Vec<(Stamp, PoseCovariance)>,
    /// The estimated clock offset over lidar time, s.
    pub clock_offsets: Vec<(Stamp, f64)>,
    /// What was learnt of the lidar beyond its calibration.
    pub lidar: LidarCorrection,
    /// The same along the IMU's axes, as a calibration has it.
    pub calibrated_lidar: LidarCorrection,
    /// What was lost or left out, and what else a user should know.
    pub events: Events,
    /// How many IMU samples the recording has.
    pub samples: usize,
    /// The windows' reports, in order.
    pub windows: Vec<WindowReport>,
    /// What the estimator reported, in order.
    pub warnings: Vec<Warning>,
    /// First and last stamp of the recording's measurements.
    pub recorded: (Stamp, Stamp),
    /// Echoes in the recording.
    pub returns: usize,
    /// From the recording's first stamp to its last, s.
    pub acquisition_s: f64,
    /// What was seen, where that is asked for.
    pub survey: Survey,
    /// Time it took, reading included but not the survey, s.
    pub wall_s: f64,
    /// Of that, what the parts of the estimator took.
    pub spent: TimeSpent,
}

/// How to estimate.
#[derive(Clone, Copy)]
pub(super) struct How<'a> {
    pub estimator: &'a EstimatorSpec,
    pub calibration: &'a Calibration,
    /// Whether what is seen is kept, for the closed loop and the map.
    pub surveying: bool,
    /// The map in which the head is, where there is one.
    pub map: Option<&'a MapOptions>,
}

/// Estimates from what `reader` reads; poses go to the TUM file `tum`, if one is wanted, as they become final.
/// `expected_s` is the recording's length, where it is known, for the progress.
pub(super) fn run_open_loop(
    reader: &Reader,
    selection: &Selection,
    how: How,
    tum: Option<&Path>,
    expected_s: Option<f64>,
    watch: &mut Watch,
) -> Result<OpenLoopRun, StudyError> {
    let started = Instant::now();
    let estimator = Estimator::new(how.estimator, how.calibration)?;
    let estimator = if how.surveying { estimator.surveying() } else { estimator };
    let mut estimator = match how.map {
        Some(within) => estimator.in_map(&within.map, &within.map_from_head),
        None => estimator,
    };
    let tum = tum.map(TumWriter::create).transpose()?;
    let mut written = Written { tum, map_from_head: Trajectory::new(), covariances: Vec::new(), radii_m: Vec::new() };
    let mut heard = Heard::default();
    let (pushed, loss) = read_ahead(reader, selection, |measurements| {
        push_all(measurements, &mut estimator, (&mut heard, &mut written), expected_s, watch)
    });
    if let Err(StudyError::Stopped) = pushed {
        written.close()?;
        return Err(StudyError::Stopped);
    }
    pushed?;
    let result = estimator.finish()?;
    written.take(&result.poses)?;
    written.close()?;
    let Written { map_from_head, covariances, radii_m, .. } = written;

    // Offsets are those of the stamps as they were recorded.
    let shift_s = selection.imu_shift().seconds();
    let mut events = Events::default();
    loss.sentences().into_iter().for_each(|sentence| events.add_loss("recording", sentence));
    heard.imu.missing("IMU samples").into_iter().for_each(|sentence| events.add_loss("missing_samples", sentence));
    heard.lidar.missing("scans").into_iter().for_each(|sentence| events.add_loss("missing_scans", sentence));
    result.located.iter().for_each(|located| events.add_note("located", found(located)));
    loss.notes().into_iter().for_each(|sentence| events.add_note("recording", sentence));
    let start = heard.start();
    events.add_warnings(&result.warnings, start);
    Ok(OpenLoopRun {
        map_from_head,
        covariances,
        radii_m,
        gauged: result.gauged,
        spent: result.windows.iter().map(|window| window.spent).sum(),
        clock_offsets: result.clock_offsets.into_iter().map(|(at, offset_s)| (at, offset_s - shift_s)).collect(),
        lidar: result.lidar,
        calibrated_lidar: result.calibrated_lidar,
        events,
        samples: heard.imu.count(),
        recorded: (start, start + Span::from_seconds(heard.seconds())),
        windows: result.windows,
        warnings: result.warnings,
        returns: heard.returns,
        acquisition_s: heard.seconds(),
        wall_s: started.elapsed().as_secs_f64() - result.survey.took_s(),
        survey: result.survey,
    })
}

/// Gives `estimator` all that comes; what it hands out is written as it becomes final.
fn push_all(
    measurements: &mut Coming,
    estimator: &mut Estimator,
    (heard, written): (&mut Heard, &mut Written),
    expected_s: Option<f64>,
    watch: &mut Watch,
) -> Result<(), StudyError> {
    for (index, measurement) in measurements.enumerate() {
        let measurement = measurement?;
        heard.take(&measurement);
        estimator.push(measurement)?;
        if index % TELL_EVERY == 0 {
            written.take(&estimator.take_poses())?;
            watch.progress(Stage::Estimating, heard.seconds(), expected_s);
            if watch.is_stopped() {
                return Err(StudyError::Stopped);
            }
        }
    }
    Ok(())
}

/// Where in the map the head was found.
fn found(located: &Located) -> String {
    format!(
        "found in the map: {:.0} % of what the first window shows lies on it, to {:.1} mm",
        100.0 * located.share,
        1e3 * located.residual_rms_m
    )
}

/// Poses in memory, and on disk where that is wanted.
struct Written {
    tum: Option<TumWriter<BufWriter<File>>>,
    map_from_head: Trajectory,
    covariances: Vec<(Stamp, PoseCovariance)>,
    radii_m: Vec<f64>,
}

impl Written {
    fn take(&mut self, poses: &[EstimatedPose]) -> Result<(), RecordingError> {
        for pose in poses {
            if let Some(tum) = &mut self.tum {
                tum.pose(pose.stamp, &pose.map_from_head)?;
            }
            let name = "the estimate".to_owned();
            let kept = self.map_from_head.push(pose.stamp, pose.map_from_head);
            kept.map_err(|source| RecordingError::Trajectory { name, source })?;
            if self.covariances.last().is_none_or(|(last, _)| pose.stamp - *last >= COVARIANCE_PERIOD) {
                self.covariances.push((pose.stamp, pose.covariance));
                self.radii_m.push(radius_99(&covariance_blocks(&pose.covariance_against_gauge).0));
            }
        }
        Ok(())
    }

    /// Closes the file.
    fn close(&mut self) -> Result<(), RecordingError> {
        self.tum.take().map_or(Ok(()), TumWriter::finish)
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

    fn start(&self) -> Stamp {
        let spans = [self.imu.span(), self.lidar.span()];
        spans.into_iter().flatten().map(|(first, _)| first).min().unwrap_or_default()
    }

    fn seconds(&self) -> f64 {
        let longest = |cadence: &Cadence| cadence.span().map_or(0.0, |(first, last)| last.seconds_since(first));
        longest(&self.imu).max(longest(&self.lidar))
    }
}
