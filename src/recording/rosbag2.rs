//! Writes the metadata that makes a recording of zsim a folder of rosbag2.

use crate::folder::METADATA_FILE;
use crate::topics::Topic;
use crate::{Reader, RecordingError, TopicInfo};
use std::io::Write;
use std::path::{Path, PathBuf};
use zsim_base::files;
use zsim_base::time::Span;

/// Version of the format: that of ROS 2 Humble, which later distributions read too.
const VERSION: u32 = 5;

/// Writes `metadata.yaml` next to the MCAP file `recording`, for `ros2 bag play` and `ros2 bag info`; returns its path.
///
/// After an interruption the file is complete or missing.
///
/// # Errors
/// When the recording cannot be read, or the file cannot be written.
pub fn write_rosbag2_metadata(recording: &Path) -> Result<PathBuf, RecordingError> {
    let info = Reader::open(recording)?.info(Span::from_seconds(1.0))?;
    let name = recording.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let path = recording.with_file_name(METADATA_FILE);
    let text = metadata(&name, info.messages, &info.topics);
    let part = path.with_extension("yaml.part");
    let written = files::create(&part)
        .and_then(|mut file| file.write_all(text.as_bytes()))
        .and_then(|()| std::fs::rename(&part, &path));
    written.map_err(|source| RecordingError::File { path: path.clone(), source })?;
    Ok(path)
}

fn metadata(file: &str, messages: u64, topics: &[TopicInfo]) -> String {
    let first_ns = topics.iter().filter_map(|topic| topic.first_log_ns).min().unwrap_or_default();
    let last_ns = topics.iter().filter_map(|topic| topic.last_log_ns).max().unwrap_or_default();
    let duration_ns = last_ns - first_ns;
    let topics: String = topics.iter().map(topic_entry).collect();
    let file = quoted(file);
    format!(
        "rosbag2_bagfile_information:
  version: {VERSION}
  storage_identifier: mcap
  duration:
    nanoseconds: {duration_ns}
  starting_time:
    nanoseconds_since_epoch: {first_ns}
  message_count: {messages}
  topics_with_message_count:
{topics}  compression_format: \"\"
  compression_mode: \"\"
  relative_file_paths:
    - {file}
  files:
    - path: {file}
      starting_time:
        nanoseconds_since_epoch: {first_ns}
      duration:
        nanoseconds: {duration_ns}
      message_count: {messages}
"
    )
}

fn topic_entry(topic: &TopicInfo) -> String {
    let qos = Topic::named(&topic.topic).map(Topic::qos).unwrap_or_default();
    format!(
        "    - topic_metadata:
        name: {}
        type: {}
        serialization_format: {}
        offered_qos_profiles: {}
      message_count: {}
",
        quoted(&topic.topic),
        quoted(&topic.type_name),
        quoted(&topic.encoding),
        quoted(&qos),
        topic.messages
    )
}

/// A scalar of YAML in double quotes, which has the escapes of JSON (YAML 1.2, section 1.3).
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}
