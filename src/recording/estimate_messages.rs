//! Messages that publish an estimate while it is computed.

use crate::message::transforms::Transform;
use crate::message::{diagnostics, points, pose, transforms};
use crate::topics::MAP;
use crate::wire::Encoder;
use crate::{CloudPoint, RecordingError};
use zsim_base::geometry::{Kinematics, Pose, PoseCovariance};
use zsim_base::time::Stamp;

pub use crate::message::diagnostics::{Diagnostic, DiagnosticLevel};

/// Topic of a published estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum EstimateTopic {
    /// `/tf`: `map` to the body's frame.
    Tf,
    /// `/odom`: pose with covariance, and velocity.
    Odometry,
    /// `/path`: final poses.
    Path,
    /// `/cloud`: points along the final poses.
    Cloud,
    /// `/diagnostics`: status of the estimate.
    Diagnostics,
}

impl EstimateTopic {
    /// All topics.
    pub const ALL: [Self; 5] = [Self::Tf, Self::Odometry, Self::Path, Self::Cloud, Self::Diagnostics];

    /// Topic name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tf => "/tf",
            Self::Odometry => "/odom",
            Self::Path => "/path",
            Self::Cloud => "/cloud",
            Self::Diagnostics => "/diagnostics",
        }
    }

    /// Type of the messages.
    pub fn type_name(self) -> &'static str {
        match self {
            Self::Tf => "tf2_msgs/msg/TFMessage",
            Self::Odometry => "nav_msgs/msg/Odometry",
            Self::Path => "nav_msgs/msg/Path",
            Self::Cloud => "sensor_msgs/msg/PointCloud2",
            Self::Diagnostics => "diagnostic_msgs/msg/DiagnosticArray",
        }
    }
}

/// Encodes the messages of an estimate, each as CDR with its encapsulation header.
///
/// All methods fail when a stamp or a length does not fit into a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EstimateMessages {
    /// Frame whose pose is estimated.
    pub body_frame: String,
}

impl EstimateMessages {
    /// `tf2_msgs/TFMessage`: the pose at `stamp`.
    pub fn transform(&self, stamp: Stamp, map_from_body: &Pose) -> Result<Vec<u8>, RecordingError> {
        let (parent, child) = (MAP.to_owned(), self.body_frame.clone());
        let transform = Transform { parent, child, parent_from_child: *map_from_body };
        encoded(|out| transforms::encode(out, stamp, &[transform]))
    }

    /// `nav_msgs/Odometry`: the motion in the map at `stamp`, with the covariance of the pose.
    pub fn odometry(
        &self,
        stamp: Stamp,
        body: &Kinematics,
        covariance: &PoseCovariance,
    ) -> Result<Vec<u8>, RecordingError> {
        encoded(|out| pose::encode_odometry(out, MAP, &self.body_frame, stamp, (body, covariance)))
    }

    /// `nav_msgs/Path`: the poses so far.
    pub fn path(&self, stamp: Stamp, map_from_body: &[(Stamp, Pose)]) -> Result<Vec<u8>, RecordingError> {
        let poses = map_from_body.iter().map(|(stamp, pose)| (*stamp, pose));
        encoded(|out| pose::encode_path(out, MAP, stamp, poses))
    }

    /// `sensor_msgs/PointCloud2` of x, y, z, intensity in the map.
    pub fn cloud(&self, stamp: Stamp, cloud: &[CloudPoint]) -> Result<Vec<u8>, RecordingError> {
        let row = |point: &CloudPoint| {
            let p = &point.point_in_map;
            [p.x, p.y, p.z, point.intensity]
        };
        encoded(|out| points::encode_floats(out, MAP, stamp, ["x", "y", "z", "intensity"], cloud.iter().map(row)))
    }

    /// `diagnostic_msgs/DiagnosticArray` with one status.
    pub fn diagnostics(&self, stamp: Stamp, diagnostic: &Diagnostic) -> Result<Vec<u8>, RecordingError> {
        encoded(|out| diagnostics::encode(out, stamp, diagnostic))
    }
}

fn encoded(encode: impl FnOnce(&mut Encoder<'_>) -> Result<(), RecordingError>) -> Result<Vec<u8>, RecordingError> {
    let mut bytes = Vec::new();
    encode(&mut Encoder::new(&mut bytes))?;
    Ok(bytes)
}
