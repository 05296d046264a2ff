//! Numbers that are checked while a spec is parsed, so that an error has the line of the number.
//!
//! Use with `#[serde(with = "crate::spec::checked::Positive")]`. The JSON schema of a spec takes the range from the
//! same attribute.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Deserialize, Deserializer, Error};
use serde::ser::{Serialize, Serializer};
use std::borrow::Cow;

/// Maximum length in a scene, and maximum coordinate of a surface or a route, m.
///
/// Beyond, the single precision of the ray search is too coarse.
pub const MAX_LENGTH_M: f64 = 100_000.0;

/// Writes a number in at most some 25 characters.
fn written(number: f64) -> String {
    if number == 0.0 || (1e-6..1e15).contains(&number.abs()) || !number.is_finite() {
        number.to_string()
    } else {
        format!("{number:e}")
    }
}

/// Defines a checked number and the array of such numbers.
macro_rules! checked {
    ($(#[$doc:meta])* $number:ident, $array:ident, $accepts:expr, $expected:literal, $several:literal, $schema:tt) => {
        $(#[$doc])*
        pub struct $number;

        impl $number {
            /// Reads the number.
            ///
            /// # Errors
            /// If it is out of range.
            pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
                let number = f64::deserialize(deserializer)?;
                let accepts: fn(f64) -> bool = $accepts;
                if accepts(number) {
                    Ok(number)
                } else {
                    Err(D::Error::custom(format!("expected {}, found {}", $expected, written(number))))
                }
            }

            /// Writes the number.
            ///
            /// # Errors
            /// If the format cannot represent it.
            pub fn serialize<S: Serializer>(number: &f64, serializer: S) -> Result<S::Ok, S::Error> {
                number.serialize(serializer)
            }
        }

        impl JsonSchema for $number {
            fn schema_name() -> Cow<'static, str> {
                stringify!($number).into()
            }

            fn inline_schema() -> bool {
                true
            }

            fn json_schema(_: &mut SchemaGenerator) -> Schema {
                json_schema!($schema)
            }
        }

        #[doc = concat!("`N` numbers, each as [`", stringify!($number), "`].")]
        pub struct $array<const N: usize>;

        impl<const N: usize> $array<N> {
            /// Reads the numbers.
            ///
            /// # Errors
            /// If the count is not `N`, or a number is out of range.
            pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[f64; N], D::Error>
            where
                [f64; N]: Deserialize<'de>,
            {
                let numbers = <[f64; N]>::deserialize(deserializer)?;
                let accepts: fn(f64) -> bool = $accepts;
                match numbers.iter().find(|number| !accepts(**number)) {
                    Some(bad) => {
                        Err(D::Error::custom(format!("expected {N} {}, found {} among them", $several, written(*bad))))
                    }
                    None => Ok(numbers),
                }
            }

            /// Writes the numbers.
            ///
            /// # Errors
            /// If the format cannot represent them.
            pub fn serialize<S: Serializer>(numbers: &[f64; N], serializer: S) -> Result<S::Ok, S::Error>
            where
                [f64; N]: Serialize,
            {
                numbers.serialize(serializer)
            }
        }

        impl<const N: usize> JsonSchema for $array<N> {
            fn schema_name() -> Cow<'static, str> {
                format!("{}{N}", stringify!($array)).into()
            }

            fn inline_schema() -> bool {
                true
            }

            fn json_schema(generator: &mut SchemaGenerator) -> Schema {
                let number = $number::json_schema(generator);
                json_schema!({ "type": "array", "items": number, "minItems": N, "maxItems": N })
            }
        }
    };
}

checked!(
    /// A number that is neither NaN nor infinite.
    Finite,
    FiniteArray,
    |x| x.is_finite(),
    "a finite number",
    "finite numbers",
    { "type": "number" }
);

checked!(
    /// A finite number above zero.
    Positive,
    PositiveArray,
    |x| x.is_finite() && x > 0.0,
    "a finite number above 0",
    "finite numbers above 0",
    { "type": "number", "exclusiveMinimum": 0.0 }
);

checked!(
    /// A length above zero, m, at most [`MAX_LENGTH_M`].
    Length,
    LengthArray,
    |x| x > 0.0 && x <= MAX_LENGTH_M,
    "a length of at most 100 km (100000 m) and above 0",
    "lengths of at most 100 km (100000 m) and above 0",
    { "type": "number", "exclusiveMinimum": 0.0, "maximum": 100_000.0 }
);

checked!(
    /// A finite number of at least zero.
    NonNegative,
    NonNegativeArray,
    |x| x.is_finite() && x >= 0.0,
    "a finite number of at least 0",
    "finite numbers of at least 0",
    { "type": "number", "minimum": 0.0 }
);

checked!(
    /// A number from 0 to 1.
    Fraction,
    FractionArray,
    |x| (0.0..=1.0).contains(&x),
    "a number from 0 to 1",
    "numbers from 0 to 1",
    { "type": "number", "minimum": 0.0, "maximum": 1.0 }
);
