//! `tf2_msgs/TFMessage`: transforms between frames.

use crate::geometry::Pose;
use crate::recording::RecordingError;
use crate::recording::topics::printable;
use crate::recording::wire::{DecodeError, Decoder, Encoder, Payload};
use crate::time::Stamp;

/// Least bytes that a transform takes on the wire: time, two strings, seven doubles.
const LEAST_BYTES: usize = 8 + 5 + 5 + 56;

/// Where a frame stands in its parent.
#[derive(Debug, Clone, PartialEq)]
pub struct Transform {
    /// The parent's name.
    pub parent: String,
    /// The frame's name.
    pub child: String,
    /// `parent_from_child`.
    pub parent_from_child: Pose,
}

/// Writes transforms that hold at `stamp`.
///
/// # Errors
/// When the stamp does not fit a message.
pub fn encode(out: &mut Encoder<'_>, stamp: Stamp, transforms: &[Transform]) -> Result<(), RecordingError> {
    out.length(transforms.len())?;
    for transform in transforms {
        out.header(stamp, &transform.parent)?;
        out.string(&transform.child)?;
        out.pose(&transform.parent_from_child);
    }
    Ok(())
}

/// Reads transforms.
///
/// # Errors
/// When the bytes are not a `TFMessage`, or a transform is not a rigid one.
pub fn decode(message: Payload<'_>) -> Result<Vec<Transform>, DecodeError> {
    let mut input = Decoder::new(message)?;
    let count = input.u32()? as usize;
    if count > message.bytes.len() / LEAST_BYTES {
        return Err(DecodeError::Short);
    }
    (0..count)
        .map(|_| {
            let (_, parent) = input.header()?;
            let parent = plain(parent);
            let child = plain(input.string()?);
            Ok(Transform { parent, child, parent_from_child: input.pose()? })
        })
        .collect()
}

/// A frame's name as it is printed, without the slash that tf (the first one) put before it.
pub fn plain(frame: &str) -> String {
    printable(frame.trim_start_matches('/'))
}
