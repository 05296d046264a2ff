//! `tf2_msgs/TFMessage`: transforms between frames.

use crate::RecordingError;
use crate::schema::MessageType;
use crate::wire::{DecodeError, Decoder, Encoder, Payload};
use zsim_base::geometry::Pose;
use zsim_base::printable::printable_name;
use zsim_base::time::Stamp;

/// Minimum bytes of a serialised transform: time, two strings, seven doubles.
const MIN_BYTES: usize = 8 + 5 + 5 + 56;

/// Pose of a frame in the parent frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Transform {
    /// Name of the parent frame.
    pub parent: String,
    /// Name of the frame.
    pub child: String,
    /// `parent_from_child`.
    pub parent_from_child: Pose,
}

/// Encodes transforms valid at `stamp`.
///
/// # Errors
/// When the stamp does not fit into a message.
pub fn encode(out: &mut Encoder<'_>, stamp: Stamp, transforms: &[Transform]) -> Result<(), RecordingError> {
    out.length(transforms.len())?;
    for transform in transforms {
        out.header(stamp, &transform.parent)?;
        out.string(&transform.child)?;
        out.pose(&transform.parent_from_child);
    }
    Ok(())
}

/// Transform as read.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadTransform {
    /// Name of the parent frame.
    pub parent: String,
    /// Name of the frame.
    pub child: String,
    /// `parent_from_child`, or why it is not a rigid transform.
    pub parent_from_child: Result<Pose, DecodeError>,
}

/// Whether messages of the type `name` are transforms; tf 1 had another name.
pub fn is_type(name: &str) -> bool {
    MessageType::Transforms.is_named(name) || name == "tf/tfMessage" || name == "tf/msg/tfMessage"
}

/// Decodes transforms; one that is not rigid does not affect the others.
///
/// # Errors
/// When the bytes are not a `TFMessage`.
pub fn decode(message: Payload<'_>) -> Result<Vec<ReadTransform>, DecodeError> {
    let mut input = Decoder::new(message)?;
    let count = input.u32()? as usize;
    if count > message.bytes.len() / MIN_BYTES {
        return Err(DecodeError::Short);
    }
    (0..count)
        .map(|_| {
            let (_, parent) = input.header()?;
            let parent = printable_frame(parent);
            let child = printable_frame(input.string()?);
            match input.pose() {
                Err(DecodeError::Short) => Err(DecodeError::Short),
                parent_from_child => Ok(ReadTransform { parent, child, parent_from_child }),
            }
        })
        .collect()
}

/// Printable name of a frame, without the leading slash of tf 1.
pub fn printable_frame(frame: &str) -> String {
    printable_name(frame.trim_start_matches('/'))
}

/// Whether `frame`, as written, has the name `printable`.
pub fn is_frame(frame: &str, printable: &str) -> bool {
    // Most names are printable as they are.
    frame.trim_start_matches('/') == printable || printable_frame(frame) == printable
}
