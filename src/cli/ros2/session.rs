//! The estimate of `zsim live`: messages in, topics and files out.

use super::bridge::Bridge;
use super::frame::Frame;
use super::publisher::EstimatePublisher;
use super::sources::Sources;
use super::start::Sensors;
use crate::arguments::Global;
use crate::bars::WorkBar;
use crate::completion::Completion;
use crate::{live, output};
use serde_json::json;
use std::fs::File;
use std::io::BufWriter;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};
use zsim_base::files;
use zsim_base::geometry::Vector;
use zsim_base::measurement::{Calibration, Measurement};
use zsim_base::time::Stamp;
use zsim_estimation::{
    EstimatedPose, EstimationError, Estimator, EstimatorSpec, Event, Evidence, Status, WindowReport, findings,
};
use zsim_recording::{Diagnostic, DiagnosticLevel, Incoming, ReceivedWriter, TumWriter};
use zsim_run::{Cadence, MapOptions};

/// Time between looks at the stop flag.
const NAP: Duration = Duration::from_millis(100);
/// Time between messages on the status.
const STATUS_PERIOD: Duration = Duration::from_secs(1);
/// A measurement that is older than the newest by more than this is of another run, s: a player has started again.
const RESTARTED_S: f64 = 10.0;

/// When a session ends.
pub(super) struct Limits {
    pub(super) stop: &'static AtomicBool,
    pub(super) until: Option<Instant>,
    pub(super) idle: Option<Duration>,
}

impl Limits {
    fn are_reached(&self, last_measurement: Instant) -> bool {
        self.stop.load(Ordering::Relaxed)
            || self.until.is_some_and(|until| Instant::now() >= until)
            || self.idle.is_some_and(|idle| last_measurement.elapsed() >= idle)
    }
}

/// Time from the arrival of the measurement that completes a window until the poses are published, s.
#[derive(Debug, Clone, Copy, Default)]
struct Latency {
    windows: usize,
    sum_s: f64,
    largest_s: f64,
}

impl Latency {
    fn add(&mut self, seconds: f64) {
        self.windows += 1;
        self.sum_s += seconds;
        self.largest_s = self.largest_s.max(seconds);
    }

    fn mean_s(&self) -> f64 {
        self.sum_s / self.windows.max(1) as f64
    }
}

/// How to start an estimate.
pub(super) struct Setup {
    pub(super) spec: EstimatorSpec,
    pub(super) calibration: Calibration,
    /// The map in which to localise the head, if any.
    pub(super) map: Option<MapOptions>,
}

impl Setup {
    fn estimator(&self) -> Result<Estimator, EstimationError> {
        let estimator = Estimator::new(&self.spec, &self.calibration)?;
        Ok(match &self.map {
            Some(prior) => estimator.in_map(&prior.map, prior.map_from_head.as_ref()),
            None => estimator,
        })
    }
}

/// An estimate from live topics.
pub(super) struct Session {
    setup: Setup,
    bridge: Bridge,
    incoming: Incoming,
    estimator: Estimator,
    publisher: EstimatePublisher,
    recording: Option<ReceivedWriter<File>>,
    tum: Option<TumWriter<BufWriter<File>>>,
    /// Counts of the current estimate.
    inputs: Inputs,
    known_windows: usize,
    latency: Latency,
    last_measurement: Instant,
    status_published: Option<Instant>,
    /// How often the measurements began again at an earlier time.
    restarts: usize,
}

/// What the current estimate has received and returned.
#[derive(Debug, Clone, Default)]
struct Inputs {
    imu: Cadence,
    lidar: Cadence,
    estimated: Option<(Stamp, Stamp)>,
    length_m: f64,
    last_position: Option<Vector>,
}

impl Inputs {
    fn take(&mut self, measurement: &Measurement) {
        match measurement {
            Measurement::Imu(sample) => self.imu.take(sample.stamp),
            Measurement::Lidar(scan) => self.lidar.take(scan.stamp),
        }
    }

    /// First and last stamp of the measurements.
    fn recorded(&self) -> Option<(Stamp, Stamp)> {
        let spans = [self.imu.span(), self.lidar.span()];
        spans.into_iter().flatten().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }

    /// Sentences on messages that did not arrive.
    fn missing(&self) -> impl Iterator<Item = String> {
        [self.imu.missing("IMU samples"), self.lidar.missing("scans")].into_iter().flatten()
    }

    fn take_final(&mut self, pose: &EstimatedPose) {
        self.estimated.get_or_insert((pose.stamp, pose.stamp)).1 = pose.stamp;
        let position = pose.map_from_head.translation.vector;
        self.length_m += self.last_position.map_or(0.0, |last| (position - last).norm());
        self.last_position = Some(position);
    }

    /// The evidence on the poses so far, as if the measurements ended at the last final pose.
    fn evidence_so_far<'a>(&self, windows: &'a [WindowReport], warnings: &'a [Event]) -> Option<Evidence<'a>> {
        let estimated = self.estimated?;
        Some(Evidence { windows, warnings, samples: self.imu.count(), recorded: estimated, estimated })
    }
}

fn stamp_of(measurement: &Measurement) -> Stamp {
    match measurement {
        Measurement::Imu(sample) => sample.stamp,
        Measurement::Lidar(scan) => scan.stamp,
    }
}

/// The time now, as the messages' times of arrival.
#[expect(clippy::disallowed_methods, reason = "the latency after the arrival of a message; no estimate depends on it")]
fn now() -> Stamp {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    Stamp::from_nanos(i64::try_from(since.as_nanos()).unwrap_or(i64::MAX))
}

impl Session {
    /// Announces the topics of the estimate, and creates the files in `folder`.
    pub(super) fn new(
        setup: Setup,
        sensors: &Sensors,
        folder: Option<&Path>,
        mut bridge: Bridge,
    ) -> anyhow::Result<Self> {
        let head_from_laser = setup.calibration.head_from_laser;
        let publisher = EstimatePublisher::new(&sensors.found.body_frame, head_from_laser, &mut bridge)?;
        let recording = folder.map(|folder| files::create(&folder.join("recording.mcap"))).transpose()?;
        Ok(Self {
            estimator: setup.estimator()?,
            setup,
            bridge,
            incoming: Incoming::new(&sensors.selection),
            publisher,
            recording: recording.map(ReceivedWriter::new).transpose()?,
            tum: folder.map(|folder| TumWriter::create(&folder.join("open_loop.tum"))).transpose()?,
            inputs: Inputs::default(),
            known_windows: 0,
            latency: Latency::default(),
            last_measurement: Instant::now(),
            status_published: None,
            restarts: 0,
        })
    }

    /// Takes in the first seconds, which are not new any more.
    ///
    /// They are sorted by stamp, as in an estimate from the file: the time axis starts with the first measurement, and a scan
    /// arrives after the IMU samples of its time.
    pub(super) fn take_start(&mut self, sensors: &Sensors) -> anyhow::Result<()> {
        let topics = sensors.reader.cdr_topics();
        let (mut outcome, mut first) = (Ok(()), Vec::new());
        sensors.reader.play(&topics, |message| {
            let type_name = topics.get(message.topic).map(String::as_str).unwrap_or_default();
            outcome = self.record(message.topic, type_name, message.log_time, message.cdr);
            first.extend(self.incoming.message(message.topic, message.cdr));
            if outcome.is_ok() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        })?;
        outcome?;
        first.sort_by_key(stamp_of);
        for measurement in first {
            self.push(measurement, now())?;
        }
        self.latency = Latency::default();
        Ok(())
    }

    /// Takes in messages until a limit is reached.
    pub(super) fn follow(&mut self, sources: &mut Sources, limits: &Limits, bar: &WorkBar) -> anyhow::Result<()> {
        while !limits.are_reached(self.last_measurement) {
            match self.bridge.receive(NAP)? {
                Some(Frame::Discovered(topic, quality)) => sources.discover(topic, quality, &mut self.bridge)?,
                Some(Frame::Received(id, arrival_ns, message)) => {
                    let Some((topic, _)) = sources.of(id) else { continue };
                    let restarts = self.restarts;
                    self.take(&topic.name, &topic.type_name, Stamp::from_nanos(arrival_ns), &message)?;
                    if self.restarts > restarts {
                        bar.note("the measurements began again at an earlier time: a new estimate and map");
                    }
                }
                _ => {}
            }
            self.publish_status(bar)?;
        }
        Ok(())
    }

    /// Takes in a message that arrived at `arrival`.
    fn take(&mut self, topic: &str, type_name: &str, arrival: Stamp, message: &[u8]) -> anyhow::Result<()> {
        self.record(topic, type_name, arrival, message)?;
        for measurement in self.incoming.message(topic, message) {
            self.last_measurement = Instant::now();
            self.push(measurement, arrival)?;
        }
        Ok(())
    }

    fn record(&mut self, topic: &str, type_name: &str, arrival: Stamp, message: &[u8]) -> anyhow::Result<()> {
        match &mut self.recording {
            Some(recording) => Ok(recording.message(topic, type_name, arrival, message)?),
            None => Ok(()),
        }
    }

    /// Adds a measurement, which arrived at `arrival`, and publishes the poses of the windows that it completes.
    fn push(&mut self, measurement: Measurement, arrival: Stamp) -> anyhow::Result<()> {
        self.restart_if_earlier(&measurement)?;
        self.inputs.take(&measurement);
        self.publisher.keep(&measurement);
        self.estimator.push(measurement)?;
        let windows = self.estimator.windows().len();
        if windows == self.known_windows {
            return Ok(());
        }
        self.known_windows = windows;
        let newest = self.estimator.newest_poses(self.publisher.newest());
        self.publisher.publish_newest(&newest, &mut self.bridge)?;
        self.latency.add(now().seconds_since(arrival));
        let poses = self.estimator.take_poses();
        self.output(&poses)
    }

    /// Publishes and writes final poses.
    fn output(&mut self, poses: &[EstimatedPose]) -> anyhow::Result<()> {
        for pose in poses {
            self.inputs.take_final(pose);
            // After a restart the stamps start again; a trajectory file has one run.
            if let Some(tum) = self.tum.as_mut().filter(|_| self.restarts == 0) {
                tum.pose(pose.stamp, &pose.map_from_head)?;
            }
        }
        self.publisher.publish_final(poses, &mut self.bridge)
    }

    /// Starts a new estimate if the measurements have begun again, as those of a player that was started again.
    fn restart_if_earlier(&mut self, measurement: &Measurement) -> anyhow::Result<()> {
        let Some((_, last)) = self.inputs.recorded() else { return Ok(()) };
        if last.seconds_since(stamp_of(measurement)) < RESTARTED_S {
            return Ok(());
        }
        let frame = self.publisher.body_frame().to_owned();
        self.estimator = self.setup.estimator()?;
        self.publisher = EstimatePublisher::again(&frame, self.setup.calibration.head_from_laser);
        (self.inputs, self.known_windows) = (Inputs::default(), 0);
        self.restarts += 1;
        Ok(())
    }

    /// Publishes the status once a second.
    fn publish_status(&mut self, bar: &WorkBar) -> anyhow::Result<()> {
        if self.status_published.is_some_and(|last| last.elapsed() < STATUS_PERIOD) {
            return Ok(());
        }
        self.status_published = Some(Instant::now());
        let Some(evidence) = self.inputs.evidence_so_far(self.estimator.windows(), self.estimator.warnings()) else {
            return Ok(());
        };
        let found = findings(&evidence);
        let verdict = live::verdict(&found, evidence.estimated.0);
        let seconds = evidence.estimated.1.seconds_since(evidence.estimated.0);
        bar.set_task(format!("{seconds:.0} s, {:.1} m, {}: {}", self.inputs.length_m, verdict.status, verdict.reason));
        let value = |name: &str, value: String| (name.to_owned(), value);
        let diagnostic = Diagnostic {
            level: match Status::of(&found) {
                Status::Good => DiagnosticLevel::Ok,
                Status::Degraded => DiagnosticLevel::Warn,
                Status::Lost => DiagnosticLevel::Error,
            },
            name: "zsim: estimate".to_owned(),
            message: format!("{}: {}", verdict.status, verdict.reason),
            values: vec![
                value("scans", self.inputs.lidar.count().to_string()),
                value("imu_samples", self.inputs.imu.count().to_string()),
                value("latency_mean_s", format!("{:.4}", self.latency.mean_s())),
                value("latency_largest_s", format!("{:.4}", self.latency.largest_s)),
                value("restarts", self.restarts.to_string()),
            ],
        };
        self.publisher.publish_status(now(), &diagnostic, &mut self.bridge)
    }

    /// Completes the estimate and prints what it is worth.
    pub(super) fn finish(mut self, global: &Global, folder: Option<&Path>) -> anyhow::Result<Completion> {
        let spare = self.setup.estimator()?;
        let result = std::mem::replace(&mut self.estimator, spare).finish();
        if let Ok(result) = &result {
            self.output(&result.poses)?;
        }
        // The files are complete also if the last measurements were too few for an estimate.
        self.recording.take().map_or(Ok(()), ReceivedWriter::finish)?;
        self.tum.take().map_or(Ok(()), TumWriter::finish)?;
        self.bridge.finish()?;
        let result = result?;
        let (inputs, latency) = (&self.inputs, &self.latency);
        let recorded = inputs.recorded().unwrap_or_default();
        let evidence = inputs.evidence_so_far(&result.windows, &result.warnings);
        let found = evidence.map(|so_far| findings(&Evidence { recorded, ..so_far })).unwrap_or_default();
        let verdict = live::verdict(&found, recorded.0);
        let reason = verdict.reason.trim_end_matches(" (so far)").trim_end_matches(" so far");
        let seconds = recorded.1.seconds_since(recorded.0);
        let losses: Vec<String> = self.incoming.loss().sentences().into_iter().chain(inputs.missing()).collect();
        let mut text = format!(
            "status        {}: {}\nmeasurements  {} scans, {} IMU samples in {seconds:.1} s\ntravelled     {:.1} m\n\
             latency       {:.1} ms mean, {:.1} ms at most, behind the window\n",
            verdict.status,
            reason,
            inputs.lidar.count(),
            inputs.imu.count(),
            inputs.length_m,
            1e3 * latency.mean_s(),
            1e3 * latency.largest_s
        );
        losses.iter().for_each(|sentence| text += &format!("loss          {sentence}\n"));
        if self.restarts > 0 {
            text += &format!("restarts      {}: the figures are those of the last estimate\n", self.restarts);
        }
        let json = json!({
            "status": verdict.status,
            "reason": reason,
            "scans": inputs.lidar.count(),
            "imu_samples": inputs.imu.count(),
            "duration_s": seconds,
            "travelled_m": inputs.length_m,
            "latency": { "mean_s": latency.mean_s(), "largest_s": latency.largest_s, "windows": latency.windows },
            "losses": losses,
            "restarts": self.restarts,
        });
        output::print_result(global, &text, json, folder)?;
        let is_good = Status::of(&found) == Status::Good && losses.is_empty();
        Ok(if is_good { Completion::Done } else { Completion::WithLoss })
    }
}
