//! Reading numbers, characters and strings from nodes.

use super::failure::Failure;
use super::node::{Kind, Node};
use super::number::{Integer, Notation, Number, signed, single};
use super::reader::{Read, Value};

impl<'de> Value<'_, 'de> {
    pub fn bool(&self) -> Read<bool> {
        match self.scalar()?.name() {
            Some("true") => Ok(true),
            Some("false") => Ok(false),
            _ => Err(Failure::new("Expected boolean")),
        }
    }

    /// An integer within the range of the type `wanted`.
    pub fn integer(&self, wanted: Integer) -> Read<i128> {
        let node = self.scalar()?;
        let number = match &node.kind {
            Kind::Number(number) => *number,
            Kind::Byte(byte) if wanted == Integer::U8 => return Ok((*byte).into()),
            _ => return Err(Failure::new("Expected integer")),
        };
        let value = match number {
            Number::Integer { notation: Notation::Suffix(suffix), .. } if suffix != wanted => {
                return Err(self.mismatch(node, wanted.noun()));
            }
            Number::Integer { magnitude, negative, .. } => wanted.checked(signed(magnitude, negative)),
            Number::Real { .. } | Number::TooLarge => None,
        };
        value.ok_or_else(|| Failure::new(wanted.range_message(&self.text(node))))
    }

    /// A real number of 64 bits.
    pub fn float(&self) -> Read<f64> {
        let node = self.scalar()?;
        self.real(node, 64)
    }

    /// A real number of 32 bits.
    pub fn single_float(&self) -> Read<f32> {
        let node = self.scalar()?;
        let value = self.real(node, 32)?;
        let from_text = if node.is_json() { None } else { single(&self.text(node)) };
        Ok(from_text.unwrap_or(value as f32))
    }

    /// A number of any notation as a real number.
    pub fn any_float(&self) -> Read<f64> {
        match self.node.kind {
            Kind::Number(Number::TooLarge) => Err(Failure::new("Integer is out of bounds")),
            Kind::Number(Number::Real { bits: 32, .. }) => self.single_float().map(f64::from),
            Kind::Number(Number::Integer { magnitude, negative, .. }) => Ok(rounded(magnitude, negative)),
            _ => self.float(),
        }
    }

    fn real(&self, node: &'de Node, bits: u8) -> Read<f64> {
        let number = match &node.kind {
            Kind::Number(number) => Some(*number),
            Kind::Name(name) => Number::word(name),
            _ => None,
        };
        match number {
            Some(Number::Real { value, bits: suffix }) if suffix == 0 || suffix == bits => Ok(value),
            Some(Number::Real { .. }) if bits == 64 => Err(self.mismatch(node, "a 64-bit floating point number")),
            Some(Number::Real { .. }) => Err(self.mismatch(node, "a 32-bit floating point number")),
            Some(Number::Integer { magnitude, negative, notation: Notation::Decimal }) => {
                Ok(rounded(magnitude, negative))
            }
            _ => Err(Failure::new("Expected float")),
        }
    }

    #[cold]
    fn mismatch(&self, node: &Node, expected: &str) -> Failure {
        Failure::new(format!("Expected {expected} but found {} instead", self.text(node)))
    }

    /// A number as written.
    fn text(&self, node: &Node) -> String {
        let written = || self.reader.source.text.get(node.start as usize..node.end as usize).map(str::to_owned);
        match node.kind {
            Kind::Number(Number::Integer { magnitude, negative, .. }) if node.is_json() => {
                signed(magnitude, negative).to_string()
            }
            Kind::Number(Number::Real { value, .. }) if node.is_json() => value.to_string(),
            _ => written().unwrap_or_default(),
        }
    }

    pub fn char(&self) -> Read<char> {
        let node = self.scalar()?;
        let mut text = match &node.kind {
            Kind::Char(c) => return Ok(*c),
            Kind::String(text) if node.is_json() => text.chars(),
            _ => "".chars(),
        };
        match (text.next(), text.next()) {
            (Some(c), None) => Ok(c),
            _ => Err(Failure::new("Expected char")),
        }
    }

    pub fn string(&self) -> Read<&'de str> {
        match &self.scalar()?.kind {
            Kind::String(text) => Ok(text),
            _ => Err(Failure::new("Expected string")),
        }
    }

    pub fn bytes(&self) -> Read<&'de [u8]> {
        match &self.scalar()?.kind {
            Kind::Bytes(bytes) => Ok(bytes),
            _ => Err(Failure::new("Expected byte string")),
        }
    }
}

/// The real number nearest to an integer, as reading its digits gives it.
fn rounded(magnitude: u64, negative: bool) -> f64 {
    let value = magnitude as f64;
    if negative { -value } else { value }
}
