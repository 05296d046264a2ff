//! `geometry_msgs/PoseStamped`, `geometry_msgs/PoseWithCovarianceStamped`, `nav_msgs/Odometry` and `nav_msgs/Path`.

use crate::RecordingError;
use crate::wire::{DecodeError, Decoder, Encoder, Payload};
use zsim_base::geometry::{Kinematics, Pose, PoseCovariance};
use zsim_base::time::Stamp;

/// Encodes a `PoseStamped` in `frame`.
///
/// # Errors
/// When the stamp does not fit into a message.
pub fn encode(out: &mut Encoder<'_>, frame: &str, stamp: Stamp, pose: &Pose) -> Result<(), RecordingError> {
    out.header(stamp, frame)?;
    out.pose(pose);
    Ok(())
}

/// Encodes a `PoseWithCovarianceStamped` in `frame`.
///
/// # Errors
/// When the stamp does not fit into a message.
pub fn encode_uncertain(
    out: &mut Encoder<'_>,
    frame: &str,
    stamp: Stamp,
    pose: &Pose,
    covariance: &PoseCovariance,
) -> Result<(), RecordingError> {
    out.header(stamp, frame)?;
    out.pose(pose);
    // The message is row-major, the slice column-major; the matrix is symmetric.
    out.f64s(covariance.as_slice());
    Ok(())
}

/// Decodes a `PoseStamped`.
///
/// # Errors
/// When the bytes are not such a message, or the pose is invalid.
pub fn decode(message: Payload<'_>) -> Result<(Stamp, Pose), DecodeError> {
    let mut input = Decoder::new(message)?;
    let (stamp, _) = input.header()?;
    Ok((stamp, input.pose()?))
}

/// Decodes the pose of an `Odometry`.
///
/// # Errors
/// When the bytes are not such a message, or the pose is invalid.
pub fn decode_odometry(message: Payload<'_>) -> Result<(Stamp, Pose), DecodeError> {
    let mut input = Decoder::new(message)?;
    let (stamp, _) = input.header()?;
    input.string()?;
    Ok((stamp, input.pose()?))
}

/// Encodes an `Odometry`: the pose in `frame`, with its covariance, the twist in the moving frame `child`.
///
/// # Errors
/// When the stamp does not fit into a message.
pub fn encode_odometry(
    out: &mut Encoder<'_>,
    frame: &str,
    child: &str,
    stamp: Stamp,
    (body, covariance): (&Kinematics, &PoseCovariance),
) -> Result<(), RecordingError> {
    out.header(stamp, frame)?;
    out.string(child)?;
    out.pose(&body.world_from_body);
    // The message is row-major, the slice column-major; the matrix is symmetric.
    out.f64s(covariance.as_slice());
    out.vector(&(body.world_from_body.rotation.inverse() * body.velocity_in_world));
    out.vector(&body.angular_velocity_in_body());
    out.f64s(&[0.0; 36]);
    Ok(())
}

/// Encodes a `Path` in `frame`.
///
/// # Errors
/// When a stamp does not fit into a message.
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

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::geometry::{Vector, from_roll_pitch_yaw};

    #[test]
    fn the_twist_of_odometry_is_in_the_moving_frame() {
        // Yaw 90 degrees, moving along the world's y axis, hence forward. Rotation about z is the same in both frames.
        let pose = Pose::from_parts([1.0, 2.0, 3.0].into(), from_roll_pitch_yaw(0.0, 0.0, std::f64::consts::FRAC_PI_2));
        let body = Kinematics {
            velocity_in_world: Vector::new(0.0, 2.0, 0.5),
            angular_velocity_in_world: Vector::new(0.0, 0.3, 1.0),
            ..Kinematics::at_rest(pose)
        };
        let mut bytes = Vec::new();
        encode_odometry(
            &mut Encoder::new(&mut bytes),
            "map",
            "head",
            Stamp::from_nanos(5),
            (&body, &PoseCovariance::zeros()),
        )
        .unwrap();
        let mut input = Decoder::new(Payload::cdr(&bytes)).unwrap();
        assert_eq!(input.header().unwrap(), (Stamp::from_nanos(5), "map"));
        assert_eq!(input.string().unwrap(), "head");
        assert_eq!(input.pose().unwrap(), pose);
        assert_eq!(input.f64s::<36>().unwrap(), [0.0; 36]);
        assert_relative_eq!(input.vector().unwrap(), Vector::new(2.0, 0.0, 0.5), epsilon = 1e-15);
        assert_relative_eq!(input.vector().unwrap(), Vector::new(0.3, 0.0, 1.0), epsilon = 1e-15);
    }
}
