//! `geometry_msgs/PoseStamped`, `nav_msgs/Odometry` and `nav_msgs/Path`.

use crate::geometry::{Kinematics, Pose};
use crate::recording::RecordingError;
use crate::recording::cdr::{DecodeError, Decoder, Encoder};
use crate::time::Stamp;

/// Writes a `PoseStamped` in `frame`.
///
/// # Errors
/// When the stamp does not fit a message.
pub fn encode(out: &mut Encoder<'_>, frame: &str, stamp: Stamp, pose: &Pose) -> Result<(), RecordingError> {
    out.header(stamp, frame)?;
    out.pose(pose);
    Ok(())
}

/// Reads a `PoseStamped`.
///
/// # Errors
/// When the bytes are not such a message, or the pose is not a rigid one.
pub fn decode(message: &[u8]) -> Result<(Stamp, Pose), DecodeError> {
    let mut input = Decoder::new(message)?;
    let (stamp, _) = input.header()?;
    Ok((stamp, input.pose()?))
}

/// Writes an `Odometry`: the pose in `frame`, the twist in the moving frame `child`.
///
/// # Errors
/// When the stamp does not fit a message.
pub fn encode_odometry(
    out: &mut Encoder<'_>,
    (frame, child): (&str, &str),
    stamp: Stamp,
    body: &Kinematics,
) -> Result<(), RecordingError> {
    out.header(stamp, frame)?;
    out.string(child)?;
    out.pose(&body.world_from_body);
    out.f64s(&[0.0; 36]);
    out.vector(&(body.world_from_body.rotation.inverse() * body.velocity_in_world));
    out.vector(&body.angular_velocity_in_body());
    out.f64s(&[0.0; 36]);
    Ok(())
}

/// Writes a `Path` in `frame`.
///
/// # Errors
/// When a stamp does not fit a message.
pub fn encode_path<'p>(
    out: &mut Encoder<'_>,
    frame: &str,
    stamp: Stamp,
    poses: impl ExactSizeIterator<Item = (Stamp, &'p Pose)>,
) -> Result<(), RecordingError> {
    out.header(stamp, frame)?;
    out.length(poses.len())?;
    for (stamp, pose) in poses {
        out.header(stamp, frame)?;
        out.pose(pose);
    }
    Ok(())
}
