//! Valid range of an integer key of a spec, for the error about a value out of range.

use super::Source;
use super::ron_text::from_text;
use ron::error::{Position, SpannedError};
use serde::de::DeserializeOwned;

/// Upper and lower limits of the integer types of keys, widest first.
const UPPER_LIMITS: [i128; 8] = [
    u64::MAX as i128,
    i64::MAX as i128,
    u32::MAX as i128,
    i32::MAX as i128,
    u16::MAX as i128,
    i16::MAX as i128,
    u8::MAX as i128,
    i8::MAX as i128,
];
const LOWER_LIMITS: [i128; 5] = [i64::MIN as i128, i32::MIN as i128, i16::MIN as i128, i8::MIN as i128, 0];

/// A message with the valid range of the number that `error` is about; `None` if it cannot be determined.
///
/// The parser does not report the type of a key. It is found by trial: the text of the number is replaced by the limits
/// of each type until the parser accepts one.
pub(super) fn message<T: DeserializeOwned>(source: &Source, error: &SpannedError) -> Option<String> {
    let text = &source.text;
    let end = offset(text, error.span.end)?;
    let is_number = |c: &char| c.is_ascii_hexdigit() || ['x', 'o', '_', '+', '-'].contains(c);
    let start = end - text[..end].chars().rev().take_while(is_number).map(char::len_utf8).sum::<usize>();
    let accepts = |number: &i128| {
        let number = number.to_string();
        let tried = format!("{}{number}{}", &text[..start], &text[end..]);
        let end = start + number.len();
        // An error further on is about another key.
        from_text::<T>(&tried).map_or_else(|other| offset(&tried, other.span.start) > Some(end), |_| true)
    };
    let upper = UPPER_LIMITS.into_iter().find(accepts)?;
    let lower = LOWER_LIMITS.into_iter().find(accepts)?;
    Some(format!("expected an integer from {lower} to {upper}, found {}", &text[start..end]))
}

/// Byte offset of a position, whose line and column start at 1.
fn offset(text: &str, position: Position) -> Option<usize> {
    let line: usize = text.split_inclusive('\n').take(position.line.checked_sub(1)?).map(str::len).sum();
    let column: usize = text[line..].chars().take(position.col.checked_sub(1)?).map(char::len_utf8).sum();
    Some(line + column)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::parse;
    use serde::Deserialize;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code, reason = "it is parsed, not used")]
    struct Counts {
        few: u8,
        many: u64,
        signed: i32,
    }

    #[test]
    fn the_error_of_an_integer_out_of_bounds_has_the_bounds_and_the_position() {
        for (text, expected) in [
            ("(few: 256, many: 1, signed: 0)", "from 0 to 255, found 256"),
            ("(few: 1, many: 99_999_999_999_999_999_999, signed: 0)", "from 0 to 18446744073709551615, found 99_9"),
            ("(few: 1, many: 1, signed: -3000000000)", "from -2147483648 to 2147483647, found -3000000000"),
            ("(few: -1, many: 1, signed: 1)", "from 0 to 255, found -1"),
            // A second error further on has no effect.
            ("(few: 0x100, many: -1, signed: 1)", "from 0 to 255, found 0x100"),
        ] {
            let error = parse::<Counts>(&Source::in_memory("counts.ron", text)).unwrap_err();
            assert!(error.message().contains(expected), "{text}: {error}");
            assert_eq!(error.line_and_column().map(|at| at.0), Some(1), "{error}");
        }
    }
}
