//! CDR, the wire form of ROS 2 messages: primitives aligned to their size, little-endian, strings and sequences led by
//! their length (OMG DDSI-RTPS 2.5, section 10; OMG CORBA 3.4, part 2, section 9.3).
//!
//! Written by hand because a scan is thousands of numbers: whole runs of them are copied at once, into a buffer that is
//! used again for the next message.

use crate::geometry::{Pose, Rotation, Vector};
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

/// Why a message's bytes are not what its type says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// The encapsulation header is not that of plain CDR.
    #[error("not plain CDR")]
    Encapsulation,
    /// The message ends before its type does.
    #[error("the message is cut short")]
    Short,
    /// A string is not UTF-8.
    #[error("a string is not UTF-8")]
    Text,
    /// Lengths or fields that contradict each other.
    #[error("{0}")]
    Contradiction(&'static str),
}

/// Reads one message. Nothing is allocated on the word of a length field: every length is checked against what is there.
pub struct Decoder<'a> {
    rest: &'a [u8],
    whole: usize,
    big_endian: bool,
}

macro_rules! number {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        pub fn $name(&mut self) -> Result<$name, DecodeError> {
            let bytes = self.aligned()?;
            Ok(if self.big_endian { $name::from_be_bytes(bytes) } else { $name::from_le_bytes(bytes) })
        }
    };
}

impl<'a> Decoder<'a> {
    /// Begins to read `message`, whose first four bytes are its encapsulation header.
    ///
    /// # Errors
    /// When the header is not that of plain CDR.
    pub fn new(message: &'a [u8]) -> Result<Self, DecodeError> {
        let (header, rest) = message.split_at_checked(4).ok_or(DecodeError::Short)?;
        let big_endian = match header[..2] {
            [0, 0] => true,
            [0, 1] => false,
            _ => return Err(DecodeError::Encapsulation),
        };
        Ok(Self { rest, whole: rest.len(), big_endian })
    }

    fn take(&mut self, length: usize) -> Result<&'a [u8], DecodeError> {
        let (taken, rest) = self.rest.split_at_checked(length).ok_or(DecodeError::Short)?;
        self.rest = rest;
        Ok(taken)
    }

    fn align(&mut self, size: usize) -> Result<(), DecodeError> {
        let at = self.whole - self.rest.len();
        self.take(at.next_multiple_of(size) - at).map(|_| ())
    }

    fn aligned<const N: usize>(&mut self) -> Result<[u8; N], DecodeError> {
        self.align(N)?;
        let (taken, rest) = self.rest.split_first_chunk().ok_or(DecodeError::Short)?;
        self.rest = rest;
        Ok(*taken)
    }

    number! {
        /// One byte.
        u8
    }
    number! {
        /// A 32-bit unsigned integer.
        u32
    }
    number! {
        /// A 32-bit float.
        f32
    }
    number! {
        /// A 64-bit float.
        f64
    }

    /// `N` 64-bit floats.
    ///
    /// # Errors
    /// When the message is cut short.
    pub fn f64s<const N: usize>(&mut self) -> Result<[f64; N], DecodeError> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64()?;
        }
        Ok(values)
    }

    /// A string, without the zero that ends it on the wire.
    ///
    /// # Errors
    /// When the message is cut short, or the string is not UTF-8.
    pub fn string(&mut self) -> Result<&'a str, DecodeError> {
        let length = self.u32()? as usize;
        let bytes = self.take(length)?;
        let text = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        std::str::from_utf8(text).map_err(|_| DecodeError::Text)
    }

    /// The bytes of a sequence of bytes.
    ///
    /// # Errors
    /// When the message is cut short.
    pub fn bytes(&mut self) -> Result<&'a [u8], DecodeError> {
        let length = self.u32()? as usize;
        self.take(length)
    }

    /// A sequence of 32-bit floats.
    ///
    /// # Errors
    /// When the message is cut short.
    pub fn f32_sequence(&mut self) -> Result<Vec<f32>, DecodeError> {
        let length = self.u32()? as usize;
        let bytes = self.take(length.checked_mul(4).ok_or(DecodeError::Short)?)?;
        let (words, _) = bytes.as_chunks::<4>();
        let from = if self.big_endian { f32::from_be_bytes } else { f32::from_le_bytes };
        Ok(words.iter().map(|word| from(*word)).collect())
    }

    /// `builtin_interfaces/Time`.
    ///
    /// # Errors
    /// When the message is cut short.
    pub fn time(&mut self) -> Result<Stamp, DecodeError> {
        let seconds = i64::from(self.u32()?.cast_signed());
        Ok(Stamp::from_nanos(seconds * NANOS_PER_SECOND + i64::from(self.u32()?)))
    }

    /// `std_msgs/Header`: stamp and frame.
    ///
    /// # Errors
    /// When the message is cut short, or the frame is not UTF-8.
    pub fn header(&mut self) -> Result<(Stamp, &'a str), DecodeError> {
        let stamp = self.time()?;
        Ok((stamp, self.string()?))
    }

    /// `geometry_msgs/Vector3` (and `Point`).
    ///
    /// # Errors
    /// When the message is cut short.
    pub fn vector(&mut self) -> Result<Vector, DecodeError> {
        Ok(self.f64s::<3>()?.into())
    }

    /// `geometry_msgs/Pose` (and `Transform`). A quaternion of norm 1 to the last bits is taken as it is, another is normalised.
    ///
    /// # Errors
    /// When the message is cut short, a number is not finite, or the quaternion is far from a unit one.
    pub fn pose(&mut self) -> Result<Pose, DecodeError> {
        let position = self.vector()?;
        let [x, y, z, w] = self.f64s::<4>()?;
        let quaternion = nalgebra::Quaternion::new(w, x, y, z);
        let off = (quaternion.norm_squared() - 1.0).abs();
        if !position.iter().all(|c| c.is_finite()) || !off.is_finite() || off > 1e-2 {
            return Err(DecodeError::Contradiction("a pose is not finite, or its quaternion is not a unit one"));
        }
        let rotation =
            if off < 1e-12 { Rotation::new_unchecked(quaternion) } else { Rotation::from_quaternion(quaternion) };
        Ok(Pose::from_parts(position.into(), rotation))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Serialize;

    #[derive(Serialize)]
    struct Mixed {
        sec: i32,
        nanosec: u32,
        frame: String,
        flag: u8,
        vector: [f64; 3],
        numbers: Vec<f32>,
        end: u8,
    }

    fn written(frame: &str, numbers: &[f32]) -> Vec<u8> {
        // Seven bytes before, as messages stand one after the other in a batch: alignment must not count them.
        let mut bytes = vec![0xAA; 7];
        let mut out = Encoder::new(&mut bytes);
        out.header(Stamp::from_nanos(-1), frame).unwrap();
        out.byte(9);
        out.vector(&Vector::new(1.0, -2.0, f64::MIN_POSITIVE));
        out.f32_sequence(numbers).unwrap();
        out.byte(3);
        bytes.split_off(7)
    }

    #[test]
    fn bytes_are_those_of_another_implementation() {
        for (frame, numbers) in
            [("", &[][..]), ("a", &[1.0]), ("laser", &[1.0, f32::INFINITY]), ("truth/map", &[0.5; 3])]
        {
            let mixed = Mixed {
                sec: -1,
                nanosec: 999_999_999,
                frame: frame.to_owned(),
                flag: 9,
                vector: [1.0, -2.0, f64::MIN_POSITIVE],
                numbers: numbers.to_vec(),
                end: 3,
            };
            let other = cdr_encoding::to_vec::<_, byteorder::LittleEndian>(&mixed).unwrap();
            assert_eq!(written(frame, numbers)[4..], other, "{frame}");
            let big = cdr_encoding::to_vec::<_, byteorder::BigEndian>(&mixed).unwrap();
            let mut input = Decoder { rest: &big, whole: big.len(), big_endian: true };
            assert_eq!(input.header().unwrap(), (Stamp::from_nanos(-1), frame));
            assert_eq!(input.u8().unwrap(), 9);
            assert_eq!(input.vector().unwrap(), Vector::new(1.0, -2.0, f64::MIN_POSITIVE));
            assert_eq!(input.f32_sequence().unwrap(), numbers);
        }
    }

    #[test]
    fn a_message_cut_anywhere_is_short_and_a_lying_length_takes_no_memory() {
        let whole = written("laser", &[1.0, 2.0]);
        let read = |bytes: &[u8]| -> Result<u8, DecodeError> {
            let mut input = Decoder::new(bytes)?;
            input.header()?;
            input.u8()?;
            input.vector()?;
            input.f32_sequence()?;
            input.u8()
        };
        assert_eq!(read(&whole), Ok(3));
        for cut in 0..whole.len() {
            assert_eq!(read(&whole[..cut]), Err(DecodeError::Short), "cut at {cut}");
        }
        let mut input = Decoder::new(&[0, 1, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF]).unwrap();
        assert_eq!(input.f32_sequence(), Err(DecodeError::Short));
        assert_eq!(read(&[0, 3, 0, 0]), Err(DecodeError::Encapsulation));
    }

    #[test]
    fn a_stamp_beyond_2038_is_refused() {
        let mut bytes = Vec::new();
        let error = Encoder::new(&mut bytes).time(Stamp::from_nanos((1 << 31) * NANOS_PER_SECOND)).unwrap_err();
        assert_eq!(
            error.to_string(),
            "a stamp is 2147483648000000000 ns, but a ROS 2 stamp ends 2^31 seconds from 1970"
        );
    }
}
