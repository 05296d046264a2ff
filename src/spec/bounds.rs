//! The bounds of a whole number that a spec's key takes, for the error about one beyond them.

use super::{Source, options};
use ron::error::{Position, SpannedError};
use serde::de::DeserializeOwned;

/// Greatest and least values of the integer types that keys have, widest first.
const GREATEST: [i128; 8] = [
    u64::MAX as i128,
    i64::MAX as i128,
    u32::MAX as i128,
    i32::MAX as i128,
    u16::MAX as i128,
    i16::MAX as i128,
    u8::MAX as i128,
    i8::MAX as i128,
];
const LEAST: [i128; 5] = [i64::MIN as i128, i32::MIN as i128, i16::MIN as i128, i8::MIN as i128, 0];

/// A sentence with the bounds of the number that `error` is about; `None` where they cannot be determined.
///
/// The parser does not report the type that a key has. It is found by trying: the number's text is replaced by the
/// limits of each type until one is accepted.
pub(super) fn message<T: DeserializeOwned>(source: &Source, error: &SpannedError) -> Option<String> {
    let text = &source.text;
    let end = offset(text, error.span.end)?;
    let is_number = |c: &char| c.is_ascii_hexdigit() || ['x', 'o', '_', '+', '-'].contains(c);
    let start = end - text[..end].chars().rev().take_while(is_number).map(char::len_utf8).sum::<usize>();
    let accepts = |number: &i128| {
        let number = number.to_string();
        let tried = format!("{}{number}{}", &text[..start], &text[end..]);
        let end = start + number.len();
        // An error further on is about something else.
        options().from_str::<T>(&tried).map_or_else(|other| offset(&tried, other.span.start) > Some(end), |_| true)
    };
    let greatest = GREATEST.into_iter().find(accepts)?;
    let least = LEAST.into_iter().find(accepts)?;
    Some(format!("expected a whole number from {least} to {greatest}, found {}", &text[start..end]))
}

/// Bytes before a position, whose line and column count from 1.
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
    fn an_integer_out_of_bounds_is_told_its_bounds_where_it_stands() {
        for (text, expected) in [
            ("(few: 256, many: 1, signed: 0)", "from 0 to 255, found 256"),
            ("(few: 1, many: 99_999_999_999_999_999_999, signed: 0)", "from 0 to 18446744073709551615, found 99_9"),
            ("(few: 1, many: 1, signed: -3000000000)", "from -2147483648 to 2147483647, found -3000000000"),
            ("(few: -1, many: 1, signed: 1)", "from 0 to 255, found -1"),
            // A second mistake further on changes nothing.
            ("(few: 0x100, many: -1, signed: 1)", "from 0 to 255, found 0x100"),
        ] {
            let error = parse::<Counts>(&Source::in_memory("counts.ron", text)).unwrap_err();
            assert!(error.message().contains(expected), "{text}: {error}");
            assert_eq!(error.line_and_column().map(|at| at.0), Some(1), "{error}");
        }
    }
}
