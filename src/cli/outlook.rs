//! What `zsim estimate` would do with a recording.

use serde::Serialize;
use zsim_estimation::EstimatorSpec;
use zsim_recording::{Reader, RecordingInfo, Selection, TopicInfo, TopicPreference, UnusedTopic};
use zsim_report::wrapped;
use zsim_run::{CalibrationSpec, recording_calibration};

/// What an estimate without options would do with a recording.
#[derive(Debug, Serialize)]
pub(super) struct Outlook {
    /// The lidar that is used.
    lidar: Option<Sensor>,
    /// The IMU that is used.
    imu: Option<Sensor>,
    /// Other topics of these sensors.
    unused: Vec<UnusedTopic>,
    /// Notes on the sensors.
    notes: Vec<String>,
    /// Why the recording is refused, and the remedy; `None` if it is not.
    refused: Option<String>,
}

/// Topic and frame of a sensor.
#[derive(Debug, Serialize)]
struct Sensor {
    topic: String,
    frame: String,
}

impl Outlook {
    /// Selects the sensors of `reader`, whose summary is `info`.
    ///
    /// # Errors
    /// When the shipped settings of the estimator cannot be read.
    pub fn new(reader: &Reader, info: &RecordingInfo) -> anyhow::Result<Self> {
        let selection = match reader.select(&TopicPreference::default()) {
            Ok(selection) => selection,
            Err(error) => {
                let refused = Some(problem_of(reader, &error));
                return Ok(Self { lidar: None, imu: None, unused: Vec::new(), notes: Vec::new(), refused });
            }
        };
        let calibration = recording_calibration(reader, &selection, &CalibrationSpec::default());
        let mut notes = selection.notes.clone();
        let refused = match &calibration {
            Ok(found) => {
                notes.extend(found.notes.iter().cloned());
                if !found.from_recording {
                    notes.push(
                        "No transforms join lidar and IMU: they are assumed to coincide and to have the same axes; pass the \
                         extrinsics with --calibration."
                            .to_owned(),
                    );
                }
                let needed_s = zsim_estimation::load("default").map(|spec: EstimatorSpec| 2.0 * spec.step_s)?;
                too_short(info, &selection, needed_s)
            }
            Err(error) => Some(problem_of(reader, error)),
        };
        let Selection { lidar_topic, lidar_frame, imu_topic, imu_frame, unused, .. } = selection;
        let lidar = Some(Sensor { topic: lidar_topic, frame: lidar_frame });
        let imu = Some(Sensor { topic: imu_topic, frame: imu_frame });
        Ok(Self { lidar, imu, unused, notes, refused })
    }

    /// Returns the sensors, the notes, and last whether the recording can be used.
    pub fn text(&self) -> String {
        let sensor = |name: &str, sensor: &Option<Sensor>| {
            sensor.as_ref().map(|Sensor { topic, frame }| format!("{name}: {topic}, frame {frame}"))
        };
        let unused = self.unused.iter().map(|unused| format!("not used: {unused}"));
        let notes = self.notes.iter().map(|note| format!("note: {note}"));
        let end = match &self.refused {
            Some(problem) => format!("zsim estimate: refused: {problem}"),
            None => "zsim estimate: ready".to_owned(),
        };
        let sensors = sensor("lidar", &self.lidar).into_iter().chain(sensor("IMU", &self.imu));
        sensors.chain(unused).chain(notes).chain([end]).map(|line| wrapped(&cut(&line), "  ")).collect()
    }
}

/// Returns the text of an error without the recording's name, printed above.
fn problem_of(reader: &Reader, error: &dyn std::error::Error) -> String {
    let text = error.to_string();
    text.strip_prefix(&format!("{}: ", reader.name())).unwrap_or(&text).to_owned()
}

/// Maximum length of a word, characters: longer names are cut.
const MAX_WORD: usize = 200;

/// Cuts the words of a line that are too long.
fn cut(line: &str) -> String {
    let words = line.split(' ').map(|word| match word.char_indices().nth(MAX_WORD) {
        Some((end, _)) => format!("{}\u{2026}", &word[..end]),
        None => word.to_owned(),
    });
    words.collect::<Vec<_>>().join(" ")
}

/// States that the sensors have too little time in common, if so.
///
/// The stamps of their first and last messages decide.
fn too_short(info: &RecordingInfo, selection: &Selection, needed_s: f64) -> Option<String> {
    let topic = |name: &str| info.topics.iter().find(|topic| topic.topic == name);
    let (lidar, imu) = (topic(&selection.lidar_topic)?, topic(&selection.imu_topic)?);
    // Too few messages have no clock: the log times then decide.
    let offsets_s = lidar.clock.zip(imu.clock).map_or((0.0, 0.0), |(lidar, imu)| (lidar.offset_s, imu.offset_s));
    let imu_offset_s = offsets_s.1 + if offsets_s == (0.0, 0.0) { 0.0 } else { selection.imu_shift().seconds() };
    let (lidar, imu) = (span_s(lidar, offsets_s.0)?, span_s(imu, imu_offset_s)?);
    let common_s = (lidar.1.min(imu.1) - lidar.0.max(imu.0)).max(0.0);
    (common_s < needed_s).then(|| {
        format!(
            "{} and {} have {common_s:.1} s in common; at least {needed_s:.1} s are needed: record both sensors at the same time, with \
             synchronised clocks",
            selection.lidar_topic, selection.imu_topic
        )
    })
}

/// Returns the first and the last stamp of a topic, s.
///
/// They differ from the log times by `offset_s`.
fn span_s(topic: &TopicInfo, offset_s: f64) -> Option<(f64, f64)> {
    let stamp_s = |log_ns: i64| log_ns as f64 * 1e-9 + offset_s;
    Some((stamp_s(topic.first_log_ns?), stamp_s(topic.last_log_ns?)))
}
