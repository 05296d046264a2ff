use crate::geometry::{Pose, Rotation, Vector};
use crate::time::{NANOS_PER_SECOND, Stamp};

/// How a message is serialised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wire {
    /// CDR of ROS 2: an encapsulation header, numbers aligned to their size.
    Cdr,
    /// ROS 1: little-endian, no alignment, headers with a sequence number.
    Ros1,
}

impl Wire {
    /// The serialisation that a container calls `encoding`; `None` for one that is not read.
    pub fn of_encoding(encoding: &str) -> Option<Self> {
        match encoding {
            "cdr" => Some(Self::Cdr),
            "ros1" => Some(Self::Ros1),
            _ => None,
        }
    }
}

/// A serialised message.
#[derive(Debug, Clone, Copy)]
pub struct Payload<'a> {
    /// Its bytes.
    pub bytes: &'a [u8],
    /// How they are serialised.
    pub wire: Wire,
}

impl<'a> Payload<'a> {
    /// A message in CDR.
    #[cfg(test)]
    pub fn cdr(bytes: &'a [u8]) -> Self {
        Self { bytes, wire: Wire::Cdr }
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
    /// A number that must be finite is not.
    #[error("{field} is NaN or infinite")]
    NotFinite {
        /// Which number.
        field: &'static str,
    },
    /// Lengths or fields that contradict each other.
    #[error("{0}")]
    Contradiction(&'static str),
}

/// Reads one message. Nothing is allocated on the word of a length field: every length is checked against what is
/// there.
pub struct Decoder<'a> {
    rest: &'a [u8],
    whole: usize,
    wire: Wire,
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
    /// Begins to read `message`; in CDR its first four bytes are the encapsulation header.
    ///
    /// # Errors
    /// When the header is not that of plain CDR.
    pub fn new(message: Payload<'a>) -> Result<Self, DecodeError> {
        let Payload { bytes, wire } = message;
        if wire == Wire::Ros1 {
            return Ok(Self { rest: bytes, whole: bytes.len(), wire, big_endian: false });
        }
        let (header, rest) = bytes.split_at_checked(4).ok_or(DecodeError::Short)?;
        let big_endian = match header[..2] {
            [0, 0] => true,
            [0, 1] => false,
            _ => return Err(DecodeError::Encapsulation),
        };
        Ok(Self { rest, whole: rest.len(), wire, big_endian })
    }

    fn take(&mut self, length: usize) -> Result<&'a [u8], DecodeError> {
        let (taken, rest) = self.rest.split_at_checked(length).ok_or(DecodeError::Short)?;
        self.rest = rest;
        Ok(taken)
    }

    fn align(&mut self, size: usize) -> Result<(), DecodeError> {
        if self.wire == Wire::Ros1 {
            return Ok(());
        }
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
        /// A 64-bit unsigned integer.
        u64
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

    /// `builtin_interfaces/Time`, or the `time` of ROS 1, whose seconds have no sign.
    ///
    /// # Errors
    /// When the message is cut short.
    pub fn time(&mut self) -> Result<Stamp, DecodeError> {
        let seconds = self.u32()?;
        let seconds = match self.wire {
            Wire::Cdr => i64::from(seconds.cast_signed()),
            Wire::Ros1 => i64::from(seconds),
        };
        Ok(Stamp::from_nanos(seconds * NANOS_PER_SECOND + i64::from(self.u32()?)))
    }

    /// `std_msgs/Header`: stamp and frame.
    ///
    /// # Errors
    /// When the message is cut short, or the frame is not UTF-8.
    pub fn header(&mut self) -> Result<(Stamp, &'a str), DecodeError> {
        if self.wire == Wire::Ros1 {
            self.u32()?;
        }
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

    /// `geometry_msgs/Pose` (and `Transform`). A quaternion of norm 1 to the last bits is taken as it is, another is
    /// normalised.
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
