//! Numbers of RON: the value exactly, and which types can be read from the notation.

use std::borrow::Cow;

/// A number as written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Number {
    /// An integer of at most 64 bits. `negative` is separate for -0, which as a real number is -0.0.
    Integer { magnitude: u64, negative: bool, notation: Notation },
    /// A real number, or a decimal integer of more than 64 bits. `bits` is 32 or 64 for a suffix, else 0.
    Real { value: f64, bits: u8 },
    /// An integer of more than 64 bits in another base than 10: no type holds it.
    TooLarge,
}

/// Notation of an integer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Notation {
    /// Decimal digits: an integer or a real number.
    Decimal,
    /// `0x`, `0o` or `0b`: an integer.
    Based,
    /// With a suffix such as `u8`: an integer of this type.
    Suffix(Integer),
}

/// A type of integers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Integer {
    I8,
    I16,
    I32,
    I64,
    U8,
    U16,
    U32,
    U64,
}

impl Integer {
    const ALL: [(&str, Integer); 8] = [
        ("i8", Integer::I8),
        ("i16", Integer::I16),
        ("i32", Integer::I32),
        ("i64", Integer::I64),
        ("u8", Integer::U8),
        ("u16", Integer::U16),
        ("u32", Integer::U32),
        ("u64", Integer::U64),
    ];

    /// Smallest and largest integer.
    fn limits(self) -> (i128, i128) {
        match self {
            Self::I8 => (i8::MIN.into(), i8::MAX.into()),
            Self::I16 => (i16::MIN.into(), i16::MAX.into()),
            Self::I32 => (i32::MIN.into(), i32::MAX.into()),
            Self::I64 => (i64::MIN.into(), i64::MAX.into()),
            Self::U8 => (0, u8::MAX.into()),
            Self::U16 => (0, u16::MAX.into()),
            Self::U32 => (0, u32::MAX.into()),
            Self::U64 => (0, u64::MAX.into()),
        }
    }

    /// Returns `number` if the type contains it.
    pub fn checked(self, number: i128) -> Option<i128> {
        let (lower, upper) = self.limits();
        (lower..=upper).contains(&number).then_some(number)
    }

    /// The message about a number outside the range of the type.
    pub fn range_message(self, found: &str) -> String {
        let (lower, upper) = self.limits();
        format!("expected an integer from {lower} to {upper}, found {found}")
    }

    /// The type in words.
    pub fn noun(self) -> &'static str {
        match self {
            Self::I8 => "an 8-bit signed integer",
            Self::I16 => "a 16-bit signed integer",
            Self::I32 => "a 32-bit signed integer",
            Self::I64 => "a 64-bit signed integer",
            Self::U8 => "an 8-bit unsigned integer",
            Self::U16 => "a 16-bit unsigned integer",
            Self::U32 => "a 32-bit unsigned integer",
            Self::U64 => "a 64-bit unsigned integer",
        }
    }
}

/// Why a text is not a number.
type Reason = Cow<'static, str>;

impl Number {
    /// Reads a number; `text` is all of it.
    ///
    /// # Errors
    /// If `text` is neither an integer nor a real number in the notation of RON.
    pub fn parse(text: &str) -> Result<Self, Reason> {
        let negative = text.starts_with('-');
        let body = text.strip_prefix(['+', '-']).unwrap_or(text);
        if let Some(number) = Self::word(body) {
            return Ok(if negative { number.negated() } else { number });
        }
        for (prefix, base) in [("0x", 16), ("0o", 8), ("0b", 2)] {
            if let Some(digits) = body.strip_prefix(prefix) {
                return integer(digits, base, negative, text);
            }
        }
        // Digits, exponents and signs have none of these letters.
        let (digits, suffix) = body.split_at(body.find(['f', 'i', 'u']).unwrap_or(body.len()));
        let is_integer =
            digits.starts_with(|c: char| c.is_ascii_digit()) && digits.chars().all(|c| c.is_ascii_digit() || c == '_');
        match suffix {
            "f32" | "f64" => real(text, suffix),
            _ if is_integer => integer(body, 10, negative, text),
            _ => real(text, ""),
        }
    }

    /// Reads `inf` or `NaN`, also with the suffix of a type.
    pub fn word(text: &str) -> Option<Self> {
        let (value, suffix) = match text.split_at_checked(3)? {
            ("inf", suffix) => (f64::INFINITY, suffix),
            ("NaN", suffix) => (f64::NAN, suffix),
            _ => return None,
        };
        let bits = match suffix {
            "" => 0,
            "f32" => 32,
            "f64" => 64,
            _ => return None,
        };
        Some(Self::Real { value, bits })
    }

    /// The integer, if it is one of 64 bits with sign.
    pub fn as_i64(self) -> Option<i64> {
        match self {
            Self::Integer { magnitude, negative, .. } => i64::try_from(signed(magnitude, negative)).ok(),
            Self::Real { .. } | Self::TooLarge => None,
        }
    }

    fn negated(self) -> Self {
        match self {
            Self::Real { value, bits } => Self::Real { value: -value, bits },
            other => other,
        }
    }
}

/// Reads digits and a suffix.
fn integer(body: &str, base: u32, negative: bool, text: &str) -> Result<Number, Reason> {
    let (digits, suffix) = body.split_at(body.find(['i', 'u']).unwrap_or(body.len()));
    if digits.starts_with('_') {
        return Err("Unexpected leading underscore in a number".into());
    }
    if !digits.contains(|c: char| c.is_ascii_hexdigit()) {
        return Err("Expected integer".into());
    }
    let mut magnitude = Some(0_u64);
    for c in digits.chars().filter(|c| *c != '_') {
        let Some(digit) = c.to_digit(base) else {
            return Err(format!("Invalid digit {c:?} for base {base} integers").into());
        };
        magnitude = magnitude.and_then(|value| value.checked_mul(base.into())?.checked_add(digit.into()));
    }
    let notation = match Integer::ALL.iter().find(|(name, _)| *name == suffix) {
        Some((_, integer)) => Notation::Suffix(*integer),
        None if !suffix.is_empty() => return Err(format!("Unexpected suffix {suffix:?} of a number").into()),
        None if base == 10 => Notation::Decimal,
        None => Notation::Based,
    };
    let value = magnitude.map(|magnitude| signed(magnitude, negative));
    match (magnitude, notation) {
        (_, Notation::Suffix(integer)) if value.and_then(|value| integer.checked(value)).is_none() => {
            Err(integer.range_message(text).into())
        }
        (Some(magnitude), _) => Ok(Number::Integer { magnitude, negative, notation }),
        (None, Notation::Decimal) => real(text, ""),
        (None, _) => Ok(Number::TooLarge),
    }
}

/// The integer with this sign.
pub(super) fn signed(magnitude: u64, negative: bool) -> i128 {
    if negative { -i128::from(magnitude) } else { i128::from(magnitude) }
}

/// Reads a real number that ends with `suffix`.
fn real(text: &str, suffix: &str) -> Result<Number, Reason> {
    let digits = &text[..text.len() - suffix.len()];
    let Some(value) = float(digits)? else { return Err("Expected float".into()) };
    let bits = match suffix {
        "f32" => 32,
        "f64" => 64,
        _ => 0,
    };
    Ok(Number::Real { value, bits })
}

/// The value of digits with underscores, which are allowed after a digit; `None` for other text.
fn float<F: std::str::FromStr>(digits: &str) -> Result<Option<F>, Reason> {
    if digits.starts_with('_') {
        return Err("Unexpected leading underscore in a number".into());
    }
    let mut previous = ' ';
    for c in digits.chars() {
        if c == '_' && !matches!(previous, '0'..='9' | 'e' | 'E' | '_') {
            return Err("Unexpected underscore in float".into());
        }
        previous = c;
    }
    Ok(digits.replace('_', "").parse().ok())
}

/// The number `text` rounded to 32 bits once, not by way of 64 bits.
pub(super) fn single(text: &str) -> Option<f32> {
    let digits = text.strip_suffix("f32").unwrap_or(text);
    float(digits).ok().flatten()
}
