//! Reads all poses of one topic.

use crate::container::Channel;
use crate::message::pose;
use crate::schema::MessageType;
use crate::topics::Topic;
use crate::{Reader, RecordingError};
use zsim_base::geometry::Trajectory;

/// Message types with a pose that are supported.
const POSE_TYPES: [MessageType; 2] = [MessageType::Odometry, MessageType::PoseStamped];

impl Reader {
    /// Reads the poses of `topic`, of type `nav_msgs/Odometry` or `geometry_msgs/PoseStamped`.
    ///
    /// Frame and stamps are those of the messages. The default topic is `/ground_truth/odom`, or else the first pose
    /// topic by name.
    ///
    /// # Errors
    /// When there is no such topic, its stamps do not increase, or the file is not completely readable: a trajectory
    /// with gaps would be a different one.
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

    /// The requested or default topic of poses, and the message type.
    fn pose_topic(&self, requested: Option<&str>) -> Result<(&str, MessageType), RecordingError> {
        let kind_of = |channel: &Channel| POSE_TYPES.into_iter().find(|kind| kind.is_named(&channel.type_name));
        let readable = self.channels().iter().filter(|channel| channel.wire.is_some());
        let mut topics: Vec<_> =
            readable.filter_map(|channel| Some((channel.topic.as_str(), kind_of(channel)?))).collect();
        topics.sort_unstable();
        topics.dedup();
        let named = |name: &str| topics.iter().find(|(topic, _)| *topic == name);
        let found = match requested {
            Some(name) => named(name),
            None => named(Topic::TruthOdometry.name()).or(topics.first()),
        };
        found.copied().ok_or_else(|| {
            let kinds = POSE_TYPES.map(MessageType::name).join(" or ");
            let (name, has) = (self.name().to_owned(), self.topic_list());
            let (topic, problem) = match requested {
                Some(requested) => (requested.to_owned(), format!("is missing or not of type {kinds}")),
                None => ("of poses".to_owned(), format!("({kinds}) is missing")),
            };
            RecordingError::Topic { name, topic, problem, has }
        })
    }
}
