//! Numeric fields of a point.

use crate::topics::shortened;
use crate::wire::DecodeError;

/// `PointField.UINT32`.
pub const UINT32: u8 = 6;
/// `PointField.FLOAT32`.
pub const FLOAT32: u8 = 7;

/// Names of the data types by code, from 1 on; the last three are those of PCL.
const TYPE_NAMES: [&str; 11] =
    ["int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64", "int64", "uint64", "bool"];

/// Numeric field of each point.
#[derive(Debug, Clone, Copy)]
pub struct Field<'a> {
    /// Field name.
    pub name: &'a str,
    /// Offset in the point, bytes.
    pub offset: usize,
    /// Data type, in the codes of `PointField`.
    pub kind: u8,
    /// Number of values.
    pub count: u32,
}

impl Field<'_> {
    /// Size of a value, bytes; `None` if the type is unknown.
    fn size(&self) -> Option<usize> {
        match self.kind {
            1 | 2 | 11 => Some(1),
            3 | 4 => Some(2),
            5..=7 => Some(4),
            8..=10 => Some(8),
            _ => None,
        }
    }

    /// Whether the type is an integer of 32 bits.
    pub fn is_word(&self) -> bool {
        matches!(self.kind, 5 | UINT32)
    }

    /// Whether the type is an integer of at most 32 bits.
    pub fn is_short_integer(&self) -> bool {
        self.kind < FLOAT32
    }

    /// Name of the type.
    pub fn type_name(&self) -> String {
        let name = usize::from(self.kind).checked_sub(1).and_then(|index| TYPE_NAMES.get(index));
        name.map_or_else(|| format!("datatype {}", self.kind), |name| (*name).to_owned())
    }

    /// Checks that values can be read from points of `step` bytes.
    ///
    /// # Errors
    /// When the type is unknown, or the field exceeds the point.
    pub fn check(&self, step: usize) -> Result<(), DecodeError> {
        let problem = match self.size() {
            None => "has an unknown type",
            Some(size) if self.offset.checked_add(size).is_none_or(|end| end > step) => "exceeds the size of a point",
            Some(_) => return Ok(()),
        };
        Err(DecodeError::Field { name: shortened(self.name), datatype: self.type_name(), problem })
    }

    /// Value in a point, as a 64-bit float. The caller has checked the field.
    pub fn number(&self, point: &[u8], big_endian: bool) -> f64 {
        let bytes = &point[self.offset..];
        match self.kind {
            1 => f64::from(bytes[0].cast_signed()),
            2 | 11 => f64::from(bytes[0]),
            3 => f64::from(u16::from_le_bytes(little_endian(bytes, big_endian)).cast_signed()),
            4 => f64::from(u16::from_le_bytes(little_endian(bytes, big_endian))),
            5 => f64::from(u32::from_le_bytes(little_endian(bytes, big_endian)).cast_signed()),
            UINT32 => f64::from(u32::from_le_bytes(little_endian(bytes, big_endian))),
            FLOAT32 => f64::from(f32::from_le_bytes(little_endian(bytes, big_endian))),
            8 => f64::from_le_bytes(little_endian(bytes, big_endian)),
            // Rounded to 53 bits: 128 ns for nanoseconds since 1970.
            9 => u64::from_le_bytes(little_endian(bytes, big_endian)).cast_signed() as f64,
            _ => u64::from_le_bytes(little_endian(bytes, big_endian)) as f64,
        }
    }
}

/// The first `N` bytes in little-endian order. The caller has checked that the field fits.
fn little_endian<const N: usize>(bytes: &[u8], big_endian: bool) -> [u8; N] {
    let mut word = [0; N];
    word.copy_from_slice(&bytes[..N]);
    if big_endian {
        word.reverse();
    }
    word
}
