use crate::geometry::{Pose, Vector};
use crate::recording::RecordingError;
use crate::time::{NANOS_PER_SECOND, Stamp};

/// Encapsulation header of plain little-endian CDR, version 1.
const LITTLE_ENDIAN_CDR: [u8; 4] = [0, 1, 0, 0];

/// Appends one message to a buffer. Alignment counts from the end of the encapsulation header.
pub struct Encoder<'a> {
    out: &'a mut Vec<u8>,
    origin: usize,
}

impl<'a> Encoder<'a> {
    /// Begins a message at the end of `out`.
    pub fn new(out: &'a mut Vec<u8>) -> Self {
        out.extend_from_slice(&LITTLE_ENDIAN_CDR);
        let origin = out.len();
        Self { out, origin }
    }

    fn align(&mut self, size: usize) {
        let length = self.out.len() - self.origin;
        self.out.resize(self.origin + length.next_multiple_of(size), 0);
    }

    /// One byte.
    pub fn byte(&mut self, value: u8) {
        self.out.push(value);
    }

    /// A 32-bit unsigned integer.
    pub fn u32(&mut self, value: u32) {
        self.align(4);
        self.out.extend_from_slice(&value.to_le_bytes());
    }

    /// A 32-bit float.
    pub fn f32(&mut self, value: f32) {
        self.u32(value.to_bits());
    }

    /// 64-bit floats one after the other, without a length before them.
    pub fn f64s(&mut self, values: &[f64]) {
        self.align(8);
        for value in values {
            self.out.extend_from_slice(&value.to_le_bytes());
        }
    }

    /// The length of a sequence or string.
    ///
    /// # Errors
    /// When it does not fit 32 bits.
    pub fn length(&mut self, length: usize) -> Result<(), RecordingError> {
        let fits = u32::try_from(length).map_err(|_| RecordingError::Unwritable {
            what: "a sequence's length",
            value: length.to_string(),
            limit: "a message holds 32 bits of it",
        })?;
        self.u32(fits);
        Ok(())
    }

    /// A string, zero-terminated on the wire.
    ///
    /// # Errors
    /// When it is longer than 32 bits can say.
    pub fn string(&mut self, text: &str) -> Result<(), RecordingError> {
        self.length(text.len() + 1)?;
        self.out.extend_from_slice(text.as_bytes());
        self.out.push(0);
        Ok(())
    }

    /// A sequence of 32-bit floats.
    ///
    /// # Errors
    /// When it is longer than 32 bits can say.
    pub fn f32_sequence(&mut self, values: &[f32]) -> Result<(), RecordingError> {
        self.length(values.len())?;
        for (bytes, value) in self.room(values.len() * 4).chunks_exact_mut(4).zip(values) {
            bytes.copy_from_slice(&value.to_le_bytes());
        }
        Ok(())
    }

    /// The next `length` bytes, for the caller to fill.
    pub fn room(&mut self, length: usize) -> &mut [u8] {
        let start = self.out.len();
        self.out.resize(start + length, 0);
        &mut self.out[start..]
    }

    /// `builtin_interfaces/Time`.
    ///
    /// # Errors
    /// When the seconds do not fit 32 bits, signed.
    pub fn time(&mut self, stamp: Stamp) -> Result<(), RecordingError> {
        let nanos = stamp.nanos();
        let seconds = i32::try_from(nanos.div_euclid(NANOS_PER_SECOND)).map_err(|_| RecordingError::Unwritable {
            what: "a stamp",
            value: format!("{nanos} ns"),
            limit: "a ROS 2 stamp ends 2^31 seconds from 1970",
        })?;
        self.u32(seconds.cast_unsigned());
        self.u32(nanos.rem_euclid(NANOS_PER_SECOND) as u32);
        Ok(())
    }

    /// `std_msgs/Header`.
    ///
    /// # Errors
    /// As [`time`](Self::time).
    pub fn header(&mut self, stamp: Stamp, frame: &str) -> Result<(), RecordingError> {
        self.time(stamp)?;
        self.string(frame)
    }

    /// `geometry_msgs/Pose` (and `Transform`, which has the same layout).
    pub fn pose(&mut self, pose: &Pose) {
        let (p, q) = (&pose.translation.vector, &pose.rotation.coords);
        self.f64s(&[p.x, p.y, p.z, q.x, q.y, q.z, q.w]);
    }

    /// `geometry_msgs/Vector3` (and `Point`).
    pub fn vector(&mut self, vector: &Vector) {
        self.f64s(&[vector.x, vector.y, vector.z]);
    }
}
