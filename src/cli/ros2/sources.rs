//! The topics of sensors that other programs publish, and the subscriptions to them.

use super::bridge::Bridge;
use super::depth_of;
use super::frame::{Frame, Quality, RosTopic, TopicId};
use std::collections::BTreeMap;
use zsim_recording::TopicPreference;

/// Types of lidars' messages.
const LIDARS: [&str; 5] = [
    "sensor_msgs/msg/LaserScan",
    "sensor_msgs/msg/MultiEchoLaserScan",
    "sensor_msgs/msg/PointCloud2",
    "livox_ros_driver/msg/CustomMsg",
    "livox_ros_driver2/msg/CustomMsg",
];
/// Type of the IMU's messages.
const IMU: &str = "sensor_msgs/msg/Imu";
/// The topic of the extrinsics.
const EXTRINSICS: &str = "/tf_static";

/// What a topic is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    Lidar,
    Imu,
    Extrinsics,
}

/// A topic with a subscription.
struct Source {
    id: TopicId,
    topic: RosTopic,
    quality: Quality,
    purpose: Purpose,
}

/// The topics that are subscribed, as they are discovered.
pub(super) struct Sources {
    preference: TopicPreference,
    sources: Vec<Source>,
    /// All topics seen, with their types, for messages.
    seen: BTreeMap<String, String>,
}

impl Sources {
    /// Subscribes to the preferred topics, and to all of a sensor without a preference.
    pub(super) fn new(preference: TopicPreference) -> Self {
        Self { preference, sources: Vec::new(), seen: BTreeMap::new() }
    }

    /// Subscribes to a topic that was discovered, if it is needed. A publisher that offers less than the earlier ones lowers
    /// what the subscription requires, because else it would not be heard.
    pub(super) fn discover(&mut self, topic: RosTopic, offered: Quality, bridge: &mut Bridge) -> anyhow::Result<()> {
        self.seen.insert(topic.name.clone(), topic.type_name.clone());
        let Some(purpose) = self.purpose(&topic) else { return Ok(()) };
        let Some(known) = self.sources.iter_mut().find(|source| source.topic == topic) else {
            let id = TopicId::try_from(self.sources.len())?;
            let quality = Quality { depth: depth_of(&topic.type_name), ..offered };
            bridge.send(&Frame::Subscribe(id, topic.clone(), quality))?;
            self.sources.push(Source { id, topic, quality, purpose });
            return Ok(());
        };
        let common = Quality {
            reliable: known.quality.reliable && offered.reliable,
            transient_local: known.quality.transient_local && offered.transient_local,
            ..known.quality
        };
        if common != known.quality {
            known.quality = common;
            bridge.send(&Frame::Subscribe(known.id, topic, common))?;
        }
        Ok(())
    }

    fn purpose(&self, topic: &RosTopic) -> Option<Purpose> {
        let fits = |preferred: &Option<String>| preferred.as_ref().is_none_or(|name| *name == topic.name);
        if topic.name == EXTRINSICS {
            return Some(Purpose::Extrinsics);
        }
        if topic.type_name == IMU && fits(&self.preference.imu_topic) {
            return Some(Purpose::Imu);
        }
        let is_lidar = LIDARS.contains(&topic.type_name.as_str()) && fits(&self.preference.lidar_topic);
        is_lidar.then_some(Purpose::Lidar)
    }

    /// Topic and purpose of a subscription.
    pub(super) fn of(&self, id: TopicId) -> Option<(&RosTopic, Purpose)> {
        self.sources.iter().find(|source| source.id == id).map(|source| (&source.topic, source.purpose))
    }

    /// Ends the subscriptions to all sensors but those of `used` topics.
    pub(super) fn keep(&mut self, used: &TopicPreference, bridge: &mut Bridge) -> anyhow::Result<()> {
        self.preference = used.clone();
        for source in &self.sources {
            if self.purpose(&source.topic).is_none() {
                bridge.send(&Frame::Unsubscribe(source.id))?;
            }
        }
        Ok(())
    }

    /// The topics seen, for messages.
    pub(super) fn seen(&self) -> String {
        let topics: Vec<String> = self.seen.iter().map(|(name, kind)| format!("{name} ({kind})")).collect();
        if topics.is_empty() { "no topics at all".to_owned() } else { topics.join(", ") }
    }
}
