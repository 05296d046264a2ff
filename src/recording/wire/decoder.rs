use zsim_base::geometry::{Pose, Rotation, Vector};
use zsim_base::time::{NANOS_PER_SECOND, Stamp};

/// Serialisation of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WireFormat {
    /// CDR of ROS 2: an encapsulation header, numbers aligned to their size.
    Cdr,
    /// ROS 1: little-endian, no alignment, headers with a sequence number.
    Ros1,
}

impl WireFormat {
    /// Serialisation that a container names `encoding`; `None` if it is not supported.
    pub fn from_encoding(encoding: &str) -> Option<Self> {
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
    /// Serialised bytes.
    pub bytes: &'a [u8],
    /// Serialisation.
    pub wire: WireFormat,
}

impl<'a> Payload<'a> {
    /// A CDR message.
    #[cfg(test)]
    pub fn cdr(bytes: &'a [u8]) -> Self {
        Self { bytes, wire: WireFormat::Cdr }
    }
}

/// Reason why a message cannot be decoded.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// The encapsulation header is not that of plain CDR.
    #[error("not plain CDR")]
    Encapsulation,
    /// The message is shorter than its type requires.
    #[error("the message is truncated")]
    Short,
    /// A string is not UTF-8.
    #[error("a string is not UTF-8")]
    Text,
    /// A number that must be finite is not.
    #[error("{field} is NaN or infinite")]
    NotFinite {
        /// Name of the field.
        field: &'static str,
    },
    /// A field of a cloud's points that is needed cannot be read.
    #[error("field {name} ({datatype}) {problem}")]
    Field {
        /// Name of the field.
        name: String,
        /// Type of the field.
        datatype: String,
        /// Description of the problem.
        problem: &'static str,
    },
    /// Lengths or fields are inconsistent.
    #[error("{0}")]
    Contradiction(&'static str),
}

/// Decodes one message.
///
/// Every length field is checked against the available bytes before memory is allocated.
pub struct Decoder<'a> {
    rest: &'a [u8],
    length: usize,
    wire: WireFormat,
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
    /// Starts to decode `message`; in CDR its first four bytes are the encapsulation header.
    ///
    /// # Errors
    /// When the encapsulation header is not that of plain CDR.
    pub fn new(message: Payload<'a>) -> Result<Self, DecodeError> {
        let Payload { bytes, wire } = message;
        if wire == WireFormat::Ros1 {
            return Ok(Self { rest: bytes, length: bytes.len(), wire, big_endian: false });
        }
        let (header, rest) = bytes.split_at_checked(4).ok_or(DecodeError::Short)?;
        let big_endian = match header[..2] {
            [0, 0] => true,
            [0, 1] => false,
            _ => return Err(DecodeError::Encapsulation),
        };
        Ok(Self { rest, length: rest.len(), wire, big_endian })
    }

    fn take(&mut self, length: usize) -> Result<&'a [u8], DecodeError> {
        let (taken, rest) = self.rest.split_at_checked(length).ok_or(DecodeError::Short)?;
        self.rest = rest;
        Ok(taken)
    }

    fn align(&mut self, size: usize) -> Result<(), DecodeError> {
        if self.wire == WireFormat::Ros1 {
            return Ok(());
        }
        let at = self.length - self.rest.len();
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

    /// Reads `N` 64-bit floats.
    ///
    /// # Errors
    /// When the message is truncated.
    pub fn f64s<const N: usize>(&mut self) -> Result<[f64; N], DecodeError> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64()?;
        }
        Ok(values)
    }

    /// Reads a string, without the terminating zero.
    ///
    /// # Errors
    /// When the message is truncated, or the string is not UTF-8.
    pub fn string(&mut self) -> Result<&'a str, DecodeError> {
        let length = self.u32()? as usize;
        let bytes = self.take(length)?;
        let text = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        std::str::from_utf8(text).map_err(|_| DecodeError::Text)
    }

    /// Reads a sequence of bytes.
    ///
    /// # Errors
    /// When the message is truncated.
    pub fn bytes(&mut self) -> Result<&'a [u8], DecodeError> {
        let length = self.u32()? as usize;
        self.take(length)
    }

    /// Reads a sequence of 32-bit floats.
    ///
    /// # Errors
    /// When the message is truncated.
    pub fn f32_sequence(&mut self) -> Result<Vec<f32>, DecodeError> {
        let length = self.u32()? as usize;
        let bytes = self.take(length.checked_mul(4).ok_or(DecodeError::Short)?)?;
        let (words, _) = bytes.as_chunks::<4>();
        let from = if self.big_endian { f32::from_be_bytes } else { f32::from_le_bytes };
        Ok(words.iter().map(|word| from(*word)).collect())
    }

    /// Reads a `builtin_interfaces/Time`, or a ROS 1 `time`, whose seconds are unsigned.
    ///
    /// # Errors
    /// When the message is truncated.
    pub fn time(&mut self) -> Result<Stamp, DecodeError> {
        let seconds = self.u32()?;
        let seconds = match self.wire {
            WireFormat::Cdr => i64::from(seconds.cast_signed()),
            WireFormat::Ros1 => i64::from(seconds),
        };
        Ok(Stamp::from_nanos(seconds * NANOS_PER_SECOND + i64::from(self.u32()?)))
    }

    /// Reads a `std_msgs/Header`: stamp and frame.
    ///
    /// # Errors
    /// When the message is truncated, or the frame is not UTF-8.
    pub fn header(&mut self) -> Result<(Stamp, &'a str), DecodeError> {
        let stamp = self.header_stamp()?;
        Ok((stamp, self.string()?))
    }

    /// Reads the stamp of a `std_msgs/Header`, which in ROS 1 follows a sequence number.
    ///
    /// # Errors
    /// When the message is truncated.
    pub fn header_stamp(&mut self) -> Result<Stamp, DecodeError> {
        if self.wire == WireFormat::Ros1 {
            self.u32()?;
        }
        self.time()
    }

    /// Reads a `geometry_msgs/Vector3` (or `Point`).
    ///
    /// # Errors
    /// When the message is truncated.
    pub fn vector(&mut self) -> Result<Vector, DecodeError> {
        Ok(self.f64s::<3>()?.into())
    }

    /// Reads a `geometry_msgs/Pose` (or `Transform`).
    ///
    /// A quaternion of unit norm up to rounding is unchanged; others are normalised.
    ///
    /// # Errors
    /// When the message is truncated, a number is not finite, or the norm of the quaternion is far from 1.
    pub fn pose(&mut self) -> Result<Pose, DecodeError> {
        let position = self.vector()?;
        let [x, y, z, w] = self.f64s::<4>()?;
        let quaternion = nalgebra::Quaternion::new(w, x, y, z);
        let off = (quaternion.norm_squared() - 1.0).abs();
        if !position.iter().all(|c| c.is_finite()) || !off.is_finite() {
            return Err(DecodeError::Contradiction("a number of the pose is NaN or infinite"));
        }
        if off > 1e-2 {
            return Err(DecodeError::Contradiction("the quaternion of the pose is not of norm 1"));
        }
        let rotation =
            if off < 1e-12 { Rotation::new_unchecked(quaternion) } else { Rotation::from_quaternion(quaternion) };
        Ok(Pose::from_parts(position.into(), rotation))
    }
}
