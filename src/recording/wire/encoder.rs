use crate::RecordingError;
use zsim_base::geometry::{Pose, Vector};
use zsim_base::time::{NANOS_PER_SECOND, Stamp};

/// Encapsulation header of plain little-endian CDR, version 1.
const LITTLE_ENDIAN_CDR: [u8; 4] = [0, 1, 0, 0];

/// Appends one message to a buffer. Alignment counts from the end of the encapsulation header.
pub struct Encoder<'a> {
    out: &'a mut Vec<u8>,
    origin: usize,
}

impl<'a> Encoder<'a> {
    /// Starts a message at the end of `out`.
    pub fn new(out: &'a mut Vec<u8>) -> Self {
        out.extend_from_slice(&LITTLE_ENDIAN_CDR);
        let origin = out.len();
        Self { out, origin }
    }

    fn align(&mut self, size: usize) {
        let length = self.out.len() - self.origin;
        self.out.resize(self.origin + length.next_multiple_of(size), 0);
    }

    /// Writes one byte.
    pub fn byte(&mut self, value: u8) {
        self.out.push(value);
    }

    /// Writes a 32-bit unsigned integer.
    pub fn u32(&mut self, value: u32) {
        self.align(4);
        self.out.extend_from_slice(&value.to_le_bytes());
    }

    /// Writes a 32-bit float.
    pub fn f32(&mut self, value: f32) {
        self.u32(value.to_bits());
    }

    /// Writes consecutive 64-bit floats, without a length.
    pub fn f64s(&mut self, values: &[f64]) {
        self.align(8);
        for value in values {
            self.out.extend_from_slice(&value.to_le_bytes());
        }
    }

    /// Writes the length of a sequence or string.
    ///
    /// # Errors
    /// When the length does not fit into 32 bits.
    pub fn length(&mut self, length: usize) -> Result<(), RecordingError> {
        let fits = u32::try_from(length).map_err(|_| RecordingError::Unwritable {
            what: "a sequence's length",
            value: length.to_string(),
            limit: "a length is limited to 32 bits",
        })?;
        self.u32(fits);
        Ok(())
    }

    /// Writes a string and a terminating zero.
    ///
    /// # Errors
    /// When the length does not fit into 32 bits.
    pub fn string(&mut self, text: &str) -> Result<(), RecordingError> {
        self.length(text.len() + 1)?;
        self.out.extend_from_slice(text.as_bytes());
        self.out.push(0);
        Ok(())
    }

    /// Writes a sequence of 32-bit floats.
    ///
    /// # Errors
    /// When the length does not fit into 32 bits.
    pub fn f32_sequence(&mut self, values: &[f32]) -> Result<(), RecordingError> {
        self.length(values.len())?;
        for (bytes, value) in self.room(values.len() * 4).chunks_exact_mut(4).zip(values) {
            bytes.copy_from_slice(&value.to_le_bytes());
        }
        Ok(())
    }

    /// Appends `length` bytes for the caller to fill.
    pub fn room(&mut self, length: usize) -> &mut [u8] {
        let start = self.out.len();
        self.out.resize(start + length, 0);
        &mut self.out[start..]
    }

    /// Writes a `builtin_interfaces/Time`.
    ///
    /// # Errors
    /// When the seconds do not fit into a signed 32-bit integer.
    pub fn time(&mut self, stamp: Stamp) -> Result<(), RecordingError> {
        let nanos = stamp.nanos();
        let seconds = i32::try_from(nanos.div_euclid(NANOS_PER_SECOND)).map_err(|_| RecordingError::Unwritable {
            what: "a stamp",
            value: format!("{nanos} ns"),
            limit: "ROS 2 stamps end 2^31 s after 1970",
        })?;
        self.u32(seconds.cast_unsigned());
        self.u32(nanos.rem_euclid(NANOS_PER_SECOND) as u32);
        Ok(())
    }

    /// Writes a `std_msgs/Header`.
    ///
    /// # Errors
    /// As [`time`](Self::time).
    pub fn header(&mut self, stamp: Stamp, frame: &str) -> Result<(), RecordingError> {
        self.time(stamp)?;
        self.string(frame)
    }

    /// Writes a `geometry_msgs/Pose` (or `Transform`, which has the same layout).
    pub fn pose(&mut self, pose: &Pose) {
        let (p, q) = (&pose.translation.vector, &pose.rotation.coords);
        self.f64s(&[p.x, p.y, p.z, q.x, q.y, q.z, q.w]);
    }

    /// Writes a `geometry_msgs/Vector3` (or `Point`).
    pub fn vector(&mut self, vector: &Vector) {
        self.f64s(&[vector.x, vector.y, vector.z]);
    }
}
