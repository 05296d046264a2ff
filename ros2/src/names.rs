//! Names of topics and types in DDS, as ROS 2 derives them from its own.

use crate::frame::RosTopic;

/// Prefix of the DDS topics of ROS 2 topics.
const TOPIC_PREFIX: &str = "rt";
/// Namespace of the DDS types of messages, and suffix of their names.
const TYPE_NAMESPACE: &str = "::dds_::";
const TYPE_SUFFIX: char = '_';

/// Names of topic and type in DDS: `/scan` of `sensor_msgs/msg/LaserScan` is `rt/scan` of
/// `sensor_msgs::msg::dds_::LaserScan_`.
pub fn to_dds(topic: &RosTopic) -> (String, String) {
    let kind = topic.type_name.replace('/', "::");
    let (namespace, name) = kind.rsplit_once("::").unwrap_or(("", &kind));
    (format!("{TOPIC_PREFIX}{}", topic.name), format!("{namespace}{TYPE_NAMESPACE}{name}{TYPE_SUFFIX}"))
}

/// The ROS 2 topic of a DDS topic; `None` for other topics, those of services and parameters among them.
pub fn from_dds(topic: &str, type_name: &str) -> Option<RosTopic> {
    let name = topic.strip_prefix(TOPIC_PREFIX).filter(|name| name.starts_with('/'))?;
    let (namespace, kind) = type_name.split_once(TYPE_NAMESPACE)?;
    let kind = kind.strip_suffix(TYPE_SUFFIX)?;
    Some(RosTopic { name: name.to_owned(), type_name: format!("{}/{kind}", namespace.replace("::", "/")) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_names_are_those_of_rmw() {
        let topic = RosTopic { name: "/base/imu".to_owned(), type_name: "sensor_msgs/msg/Imu".to_owned() };
        let (name, type_name) = to_dds(&topic);
        assert_eq!((name.as_str(), type_name.as_str()), ("rt/base/imu", "sensor_msgs::msg::dds_::Imu_"));
        assert_eq!(from_dds(&name, &type_name), Some(topic));
        assert_eq!(
            from_dds("rq/node/get_parametersRequest", "rcl_interfaces::srv::dds_::GetParameters_Request_"),
            None
        );
        assert_eq!(from_dds("HelloWorld", "HelloWorldData::Msg"), None);
    }
}
