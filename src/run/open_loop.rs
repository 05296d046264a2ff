//! Open-loop estimation from a recording, as it would run online.

use super::beams::{MeasurementStream, read_ahead};
use super::cadence::Cadence;
use super::map_options::MapOptions;
use super::{ProgressMonitor, RunError, Stage, StageData};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::time::Instant;
use zsim_base::geometry::{PoseCovariance, Trajectory};
use zsim_base::measurement::{Calibration, Measurement};
use zsim_base::parallel::Stopped;
use zsim_base::time::{Span, Stamp};
use zsim_estimation::{
    EstimatedPose, Estimator, EstimatorSpec, Evidence, LocalisedPose, OpenLoop, Severity, Timing, covariance_blocks,
    radius_99,
};
use zsim_evaluation::{DeadReckoning, EvaluationError, RestDetection};
use zsim_recording::{ClockStep, Loss, Reader, RecordingError, Selection, TumWriter};
use zsim_report::EventMetrics;

/// Number of measurements between progress reports: about 1 s of data.
const PROGRESS_INTERVAL: usize = 200;

/// Time between stored covariances.
const COVARIANCE_PERIOD: Span = Span::from_nanos(100_000_000);

/// Result of the open-loop estimation.
pub(super) struct OpenLoopRun {
    /// The estimate, without its poses; its clock offsets relate to the recorded stamps, s. Its observed surfels are empty
    /// unless they were wanted.
    pub estimate: OpenLoop,
    /// Covariances of the poses in the map frame, at 10 Hz.
    pub covariances: Vec<(Stamp, PoseCovariance)>,
    /// 99 % radii of the position error relative to the alignment of the first seconds, at the same stamps, m.
    pub radii_m: Vec<f64>,
    /// Missing or unused measurements, and intervals without an estimate.
    pub losses: Vec<EventMetrics>,
    /// Other information for the user.
    pub notes: Vec<EventMetrics>,
    /// Number of IMU samples in the recording.
    pub samples: usize,
    /// First and last stamp of the recording's measurements.
    pub recorded: (Stamp, Stamp),
    /// Number of lidar returns in the recording.
    pub returns: usize,
    /// Duration of the recording, s.
    pub acquisition_s: f64,
    /// Trajectory by IMU dead reckoning, for comparison.
    pub dead_reckoning: Result<Trajectory, EvaluationError>,
    /// Wall-clock time, including reading but not building the observed surfels, s.
    pub wall_s: f64,
    /// Run time of each part of the estimator.
    pub timing: Timing,
}

/// What is estimated, and how.
#[derive(Clone, Copy)]
pub(super) struct LoopInputs<'a> {
    pub reader: &'a Reader,
    pub selection: &'a Selection,
    pub calibration: &'a Calibration,
    pub estimator: &'a EstimatorSpec,
    /// The map in which to localise the head; `None` to start a new map.
    pub map: Option<&'a MapOptions>,
    pub closes_loops: bool,
    /// Whether to keep the observed surfaces also without closing loops, for a map.
    pub keeps_surfels: bool,
    /// Whether the true poses in the recording are those of the estimated frame.
    pub has_truth: bool,
    /// Folder for `open_loop.tum` and `closed_loop.tum`; `None` to write no files.
    pub folder: Option<&'a Path>,
    /// Length of the recording, s, if it is known, for the progress.
    pub expected_s: Option<f64>,
}

/// Runs the estimator over a recording.
///
/// Poses are written to `open_loop.tum`, if files are wanted, as they become final.
pub(super) fn run_open_loop(options: &LoopInputs, watch: &mut ProgressMonitor) -> Result<OpenLoopRun, RunError> {
    let started = Instant::now();
    let selection = options.selection;
    let mut estimator = Estimator::new(options.estimator, options.calibration)?;
    if options.closes_loops || options.keeps_surfels {
        estimator = estimator.recording_surfels();
    }
    if let Some(prior) = options.map {
        estimator = estimator.in_map(&prior.map, prior.map_from_head.as_ref());
    }
    watch.data(StageData::Start { stage: Stage::Estimating, calibration: options.calibration });
    let tum = options.folder.map(|folder| TumWriter::create(&folder.join("open_loop.tum"))).transpose()?;
    let mut poses = PoseOutput { tum, map_from_head: Trajectory::new(), covariances: Vec::new(), radii_m: Vec::new() };
    let mut inputs = InputSummary::new(options.calibration);
    let (pushed, loss) = read_ahead(options.reader, selection, |measurements| {
        push_all(measurements, &mut estimator, &mut inputs, &mut poses, options.expected_s, watch)
    });
    if let Err(RunError::Stopped(_)) = pushed {
        poses.close()?;
        return Err(Stopped.into());
    }
    pushed?;
    let mut result = estimator.finish()?;
    poses.take(&result.poses)?;
    poses.close()?;
    watch.data(StageData::Poses(&result.poses));
    let PoseOutput { map_from_head, covariances, radii_m, .. } = poses;
    (result.trajectory, result.poses) = (map_from_head, Vec::new());

    // The reported offsets relate to the recorded stamps, without the shift that the selection applies and with the steps of
    // the clocks, which the reader removes.
    let shift_s = selection.imu_shift().seconds();
    let stepped_s = |at: Stamp| {
        let before = loss.clock_steps.iter().filter(|step| step.at <= at);
        before
            .map(|step| if step.topic == selection.imu_topic { step.by } else { Span::ZERO - step.by }.seconds())
            .sum::<f64>()
    };
    result.clock_offsets.iter_mut().for_each(|(at, offset_s)| *offset_s = *offset_s - shift_s + stepped_s(*at));
    let start = inputs.start();
    let (losses, notes) = losses_and_notes(&result, &loss, &inputs);
    Ok(OpenLoopRun {
        covariances,
        radii_m,
        timing: result.windows.iter().map(|window| window.timing).sum(),
        losses,
        notes,
        samples: inputs.imu.count(),
        recorded: (start, start + Span::from_seconds(inputs.seconds())),
        returns: inputs.returns,
        acquisition_s: inputs.seconds(),
        dead_reckoning: inputs.dead_reckoning.finish(),
        wall_s: started.elapsed().as_secs_f64() - result.observed.elapsed_s(),
        estimate: result,
    })
}

/// Pushes all measurements into `estimator` and writes the poses that become final.
fn push_all(
    measurements: &mut MeasurementStream,
    estimator: &mut Estimator,
    inputs: &mut InputSummary,
    poses: &mut PoseOutput,
    expected_s: Option<f64>,
    watch: &mut ProgressMonitor,
) -> Result<(), RunError> {
    for (index, measurement) in measurements.enumerate() {
        let measurement = measurement?;
        inputs.take(&measurement);
        if let Measurement::Lidar(scan) = &measurement {
            watch.data(StageData::Scan(scan));
        }
        estimator.push(measurement)?;
        if index % PROGRESS_INTERVAL == 0 {
            let newest = estimator.take_poses();
            poses.take(&newest)?;
            watch.data(StageData::Poses(&newest));
            if let Some(evidence) = poses.evidence(estimator, inputs) {
                watch.data(StageData::Evidence(evidence));
            }
            watch.progress(Stage::Estimating, inputs.seconds(), expected_s);
            watch.check_stop()?;
        }
    }
    Ok(())
}

/// Message on the localisation in the map.
fn located_message(located: &LocalisedPose) -> String {
    format!(
        "localised in the map: {:.0} % of the surfels of the first window match, residual {:.1} mm RMS",
        100.0 * located.inlier_ratio,
        1e3 * located.residual_rms_m
    )
}

/// Lists the losses and the notes of the reader and of the estimator.
fn losses_and_notes(result: &OpenLoop, loss: &Loss, inputs: &InputSummary) -> (Vec<EventMetrics>, Vec<EventMetrics>) {
    let start = inputs.start();
    let all = |kind, sentences: Vec<String>| sentences.into_iter().map(move |s| EventMetrics::without_time(kind, s));
    let losses = all("recording", loss.sentences())
        .chain(all("missing_samples", inputs.imu.missing("IMU samples").into_iter().collect()))
        .chain(all("missing_scans", inputs.lidar.missing("scans").into_iter().collect()))
        .chain(EventMetrics::of(&result.warnings, Severity::Loss, start));
    let notes = all("located", result.located.iter().map(located_message).collect())
        .chain(all("recording", loss.notes()))
        .chain(clock_steps(&loss.clock_steps, start))
        .chain(EventMetrics::of(&result.warnings, Severity::Note, start));
    (losses.collect(), notes.collect())
}

/// Describes the steps of the sensors' clocks, with times relative to `start`.
fn clock_steps(steps: &[ClockStep], start: Stamp) -> Option<EventMetrics> {
    // Two sensors of one clock step once.
    let mut counts = BTreeMap::<&str, u64>::new();
    steps.iter().for_each(|step| *counts.entry(&step.topic).or_default() += 1);
    let times_s = || steps.iter().map(|step| step.at.seconds_since(start));
    Some(EventMetrics {
        kind: "clock_step".to_owned(),
        count: counts.into_values().max()?,
        first_s: times_s().min_by(f64::total_cmp),
        last_s: times_s().max_by(f64::total_cmp),
        worst: Some(ClockStep::largest(steps)?.by.seconds().abs()),
        sentence: ClockStep::sentence(steps)?,
    })
}

/// Poses in memory, and in a TUM file if requested.
struct PoseOutput {
    tum: Option<TumWriter<BufWriter<File>>>,
    map_from_head: Trajectory,
    covariances: Vec<(Stamp, PoseCovariance)>,
    radii_m: Vec<f64>,
}

impl PoseOutput {
    fn take(&mut self, poses: &[EstimatedPose]) -> Result<(), RecordingError> {
        for pose in poses {
            if let Some(tum) = &mut self.tum {
                tum.pose(pose.stamp, &pose.map_from_head)?;
            }
            let name = "the estimate".to_owned();
            let pushed = self.map_from_head.push(pose.stamp, pose.map_from_head);
            pushed.map_err(|source| RecordingError::Trajectory { name, source })?;
            if self.covariances.last().is_none_or(|(last, _)| pose.stamp - *last >= COVARIANCE_PERIOD) {
                self.covariances.push((pose.stamp, pose.covariance));
                self.radii_m.push(radius_99(&covariance_blocks(&pose.covariance_against_gauge).0));
            }
        }
        Ok(())
    }

    /// The evidence on the poses so far; `None` without poses.
    fn evidence<'a>(&self, estimator: &'a Estimator, inputs: &InputSummary) -> Option<Evidence<'a>> {
        let estimated = self.map_from_head.span()?;
        let (windows, warnings) = (estimator.windows(), estimator.warnings());
        Some(Evidence { windows, warnings, samples: inputs.imu.count(), recorded: estimated, estimated })
    }

    /// Completes the TUM file.
    fn close(&mut self) -> Result<(), RecordingError> {
        self.tum.take().map_or(Ok(()), TumWriter::finish)
    }
}

/// Counts, time spans and dead reckoning of the measurements.
struct InputSummary {
    imu: Cadence,
    lidar: Cadence,
    returns: usize,
    dead_reckoning: DeadReckoning,
}

impl InputSummary {
    fn new(calibration: &Calibration) -> Self {
        let dead_reckoning = DeadReckoning::new(&calibration.head_from_imu, RestDetection::default());
        Self { imu: Cadence::default(), lidar: Cadence::default(), returns: 0, dead_reckoning }
    }

    fn take(&mut self, measurement: &Measurement) {
        match measurement {
            Measurement::Imu(sample) => {
                self.imu.take(sample.stamp);
                self.dead_reckoning.push(sample);
            }
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
