//! The first seconds of live topics: they show which topics to use, and how to read them.

use super::bridge::Bridge;
use super::frame::{Frame, RosTopic};
use super::sources::{Purpose, Sources};
use crate::bars::WorkBar;
use anyhow::{bail, ensure};
use std::fs::File;
use std::io::{Seek, SeekFrom};
use std::time::{Duration, Instant};
use zsim_base::time::Stamp;
use zsim_recording::{FoundCalibration, Reader, ReceivedWriter, Selection, TopicPreference};
use zsim_run::{CalibrationSpec, recording_calibration};

/// Time of both sensors that shows how to read them, s: some periods of each, and the rest in which the estimator starts.
const ENOUGH_S: f64 = 3.0;
/// Maximum size of the messages that wait while a sensor is missing, bytes; then they are gathered anew.
const MAX_WAITING_BYTES: usize = 512 << 20;
/// Name of the recording of these seconds, in messages.
const NAME: &str = "the live topics";

/// The messages of the first seconds, in a temporary file.
pub(super) struct Start {
    file: File,
    writer: ReceivedWriter<File>,
    /// First and last arrival of the messages of lidars and IMUs.
    spans: [Option<(Stamp, Stamp)>; 2],
    /// The messages on extrinsics, which are published once, with their arrival.
    extrinsics: Vec<(RosTopic, Stamp, Vec<u8>)>,
    bytes: usize,
}

impl Start {
    pub(super) fn new() -> anyhow::Result<Self> {
        let file = tempfile::tempfile()?;
        let writer = ReceivedWriter::new(file.try_clone()?)?;
        Ok(Self { file, writer, spans: [None; 2], extrinsics: Vec::new(), bytes: 0 })
    }

    /// Begins again, with the extrinsics only.
    fn again(self) -> anyhow::Result<Self> {
        let mut again = Self::new()?;
        for (topic, arrival, message) in &self.extrinsics {
            again.add(topic, Purpose::Extrinsics, *arrival, message)?;
        }
        Ok(again)
    }

    /// Adds a message.
    pub(super) fn add(
        &mut self,
        topic: &RosTopic,
        purpose: Purpose,
        arrival: Stamp,
        message: &[u8],
    ) -> anyhow::Result<()> {
        self.writer.message(&topic.name, &topic.type_name, arrival, message)?;
        self.bytes += message.len();
        let span = match purpose {
            Purpose::Lidar => &mut self.spans[0],
            Purpose::Imu => &mut self.spans[1],
            Purpose::Extrinsics => {
                self.extrinsics.push((topic.clone(), arrival, message.to_vec()));
                return Ok(());
            }
        };
        span.get_or_insert((arrival, arrival)).1 = arrival;
        Ok(())
    }

    /// Whether there are enough messages of both sensors.
    pub(super) fn is_complete(&self) -> bool {
        let is_long =
            |span: &Option<(Stamp, Stamp)>| span.is_some_and(|(first, last)| last.seconds_since(first) >= ENOUGH_S);
        self.spans.iter().all(is_long)
    }

    /// What is still missing, for the progress.
    fn missing(&self) -> &'static str {
        match self.spans {
            [None, None] => "a lidar and an IMU",
            [None, _] => "a lidar",
            [_, None] => "an IMU",
            _ => "the first seconds",
        }
    }

    /// Reads the messages as a recording, and selects the sensors.
    pub(super) fn finish(
        mut self,
        preference: &TopicPreference,
        calibration: &CalibrationSpec,
    ) -> anyhow::Result<Sensors> {
        self.writer.finish()?;
        self.file.seek(SeekFrom::Start(0))?;
        let reader = Reader::new(NAME, self.file)?;
        let selection = reader.select(preference)?;
        let found = recording_calibration(&reader, &selection, calibration)?;
        Ok(Sensors { reader, selection, found })
    }
}

/// The sensors of live topics.
pub(super) struct Sensors {
    /// The messages of the first seconds.
    pub(super) reader: Reader,
    pub(super) selection: Selection,
    pub(super) found: FoundCalibration,
}

/// Waits for both sensors, and gathers their first seconds; fails when `is_stopped`, or after `until`, with a `hint` at the
/// end of the error.
pub(super) fn gather(
    bridge: &mut Bridge,
    sources: &mut Sources,
    until: Option<Instant>,
    is_stopped: impl Fn() -> bool,
    hint: &str,
    bar: &WorkBar,
) -> anyhow::Result<Start> {
    let mut start = Start::new()?;
    let started = Instant::now();
    while !start.is_complete() {
        let missing = start.missing();
        bar.set_task(format!("waiting for {missing}"));
        if is_stopped() || until.is_some_and(|until| Instant::now() >= until) {
            let waited_s = started.elapsed().as_secs_f64();
            bail!(
                "no estimate: {missing} did not arrive in {waited_s:.0} s; other programs publish {}{hint}",
                sources.seen()
            );
        }
        match bridge.receive(Duration::from_millis(100))? {
            Some(Frame::Discovered(topic, quality)) => sources.discover(topic, quality, bridge)?,
            Some(Frame::Received(id, arrival_ns, message)) => {
                if let Some((topic, purpose)) = sources.of(id) {
                    ensure!(arrival_ns > 0, "the clock of this machine is before 1970");
                    start.add(topic, purpose, Stamp::from_nanos(arrival_ns), &message)?;
                }
            }
            _ => {}
        }
        if start.bytes > MAX_WAITING_BYTES && !start.is_complete() {
            start = start.again()?;
        }
    }
    Ok(start)
}
