//! A recording's poses over time: those of one topic, all of them.

use crate::geometry::Trajectory;
use crate::recording::container::Channel;
use crate::recording::message::pose;
use crate::recording::schema::MessageType;
use crate::recording::topics::Topic;
use crate::recording::{Reader, RecordingError};

/// The types of messages that carry a pose.
const TYPES: [MessageType; 2] = [MessageType::Odometry, MessageType::PoseStamped];

impl Reader {
    /// The poses of `topic`, `nav_msgs/Odometry` or `geometry_msgs/PoseStamped`, in the frame and at the stamps that
    /// its messages tell; unless one is named those of `/ground_truth/odom`, or where that is not, of the first such
    /// topic by name.
    ///
    /// # Errors
    /// When there is no such topic, its stamps do not increase, or not all of the file could be read: a trajectory with
    /// gaps would be another one.
    pub fn poses(&self, topic: Option<&str>) -> Result<Trajectory, RecordingError> {
        let (topic, kind) = self.pose_topic(topic)?;
        let ids = self.ids_of(topic);
        let mut messages = self.messages();
        let mut trajectory = Trajectory::new();
        let mut loss = self.loss().clone();
        while let Some(message) = messages.next()? {
            if !ids.contains(&message.channel) {
                continue;
            }
            let read = match kind {
                MessageType::Odometry => pose::decode_odometry(message.data),
                _ => pose::decode(message.data),
            };
            let Ok((stamp, pose)) = read else {
                loss.unreadable_messages += 1;
                continue;
            };
            let name = || format!("{} {topic}", self.name());
            trajectory.push(stamp, pose).map_err(|source| RecordingError::Trajectory { name: name(), source })?;
        }
        loss.add_pass(&messages, self.expected_messages());
        if loss.is_none() { Ok(trajectory) } else { Err(RecordingError::NotWhole { name: self.name().to_owned() }) }
    }

    /// The topic of poses that is asked for, or else taken, and what its messages are.
    fn pose_topic(&self, asked: Option<&str>) -> Result<(&str, MessageType), RecordingError> {
        let kind_of = |channel: &Channel| TYPES.into_iter().find(|kind| kind.is_named(&channel.type_name));
        let readable = self.channels().iter().filter(|channel| channel.wire.is_some());
        let mut topics: Vec<_> =
            readable.filter_map(|channel| Some((channel.topic.as_str(), kind_of(channel)?))).collect();
        topics.sort_unstable();
        topics.dedup();
        let named = |name: &str| topics.iter().find(|(topic, _)| *topic == name);
        let found = match asked {
            Some(name) => named(name),
            None => named(Topic::TruthOdometry.name()).or(topics.first()),
        };
        found.copied().ok_or_else(|| {
            let kinds = TYPES.map(MessageType::name).join(" or ");
            let (name, has) = (self.name().to_owned(), self.what_it_has());
            let (topic, problem) = match asked {
                Some(asked) => (asked.to_owned(), format!("is not there as {kinds}")),
                None => ("of poses".to_owned(), format!("({kinds}) is not there")),
            };
            RecordingError::Topic { name, topic, problem, has }
        })
    }
}
