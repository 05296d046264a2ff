//! Messages and positions of errors.

use super::read;
use serde::{Deserialize, Serialize};

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(dead_code, reason = "it is parsed, not used")]
struct Counts {
    few: u8,
    many: u64,
    signed: i32,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
#[allow(dead_code, reason = "it is parsed, not used")]
enum Mode {
    Slow,
    Fast { gain: f64, on: bool },
    Named(Counts),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(dead_code, reason = "it is parsed, not used")]
struct Spec {
    mode: Mode,
    #[serde(default, with = "crate::spec::checked::PositiveArray::<2>")]
    size_m: [f64; 2],
    #[serde(default)]
    names: Vec<String>,
}

#[derive(Debug, PartialEq, Deserialize, Serialize)]
#[serde(transparent)]
struct Endless(Option<Box<Endless>>);

#[test]
fn an_integer_out_of_range_is_an_error_with_the_range() {
    for (text, column, expected) in [
        ("(few: 256, many: 1, signed: 0)", 7, "from 0 to 255, found 256"),
        ("(few: 1, many: 99_999_999_999_999_999_999, signed: 0)", 16, "from 0 to 18446744073709551615, found 99_9"),
        ("(few: 1, many: 0xfffff_ffff_ffff_ffff, signed: 0)", 16, "from 0 to 18446744073709551615, found 0xffff"),
        ("(few: 1, many: 1, signed: -3000000000)", 27, "from -2147483648 to 2147483647, found -3000000000"),
        ("(few: -1, many: 1, signed: 1)", 7, "from 0 to 255, found -1"),
        ("(few: 1.5, many: 1, signed: 1)", 7, "from 0 to 255, found 1.5"),
        ("(few: 300u8, many: 1, signed: 1)", 7, "from 0 to 255, found 300u8"),
        // A second error further on has no effect.
        ("(few: 0x100, many: -1, signed: 1)", 7, "from 0 to 255, found 0x100"),
    ] {
        let error = read::<Counts>(text).unwrap_err();
        assert!(error.message().contains(&format!("expected an integer {expected}")), "{text}: {error}");
        assert_eq!(error.line_and_column(), Some((1, column)), "{error}");
    }
}

#[test]
fn a_value_of_another_type_is_an_error_at_the_value() {
    for (text, column, message) in [
        (
            "(mode: quick)",
            8,
            "Unexpected variant named `quick` in enum `Mode`, expected one of `slow`, `fast`, or `named` instead",
        ),
        (
            "(modes: slow)",
            2,
            "Unexpected field named `modes` in `Spec` (did you mean mode?), expected one of `mode`, `size_m`, or `names` instead",
        ),
        ("(mode: slow, mode: slow)", 14, "Unexpected duplicate field named `mode` in `Spec`"),
        ("(size_m: (1, 2),\n)", 1, "`Spec` needs `mode`"),
        ("(mode: fast(gain: 1))", 20, "`fast` needs `on`"),
        (
            "(mode: fast(gain: 1, off: true))",
            22,
            "Unexpected field named `off` in `fast`, expected either `gain` or `on` instead",
        ),
        ("(mode: named((few: 1, many: 2)))", 30, "`Counts` needs `signed`"),
        (
            "(mode: named((few: 1, many: 2, signed: 3)), lost: 1)",
            45,
            "Unexpected field named `lost` in `Spec`, expected one of `mode`, `size_m`, or `names` instead",
        ),
        ("(mode: fast(gain: \"1\", on: true))", 19, "Expected float"),
        ("(mode: fast(gain: 1, on: 1))", 26, "Expected boolean"),
        ("(mode: fast)", 12, "Expected opening `(`"),
        ("(mode: slow(1))", 12, "`slow` has no keys: write `slow`"),
        ("(mode: slow(gain: 1))", 12, "`slow` has no keys: write `slow`"),
        ("(mode: ())", 8, "No variant of enum `Mode`, expected one of `slow`, `fast`, or `named` instead"),
        ("(mode: \"slo\")", 8, "No variant of enum `Mode`, expected one of `slow`, `fast`, or `named` instead"),
        ("(mode: \"slow\")", 8, "`slow` is a variant of `Mode`: write it without quotes"),
        ("(mode: named(3))", 14, "Expected opening `(` for struct `Counts`"),
        ("(mode: slow, names: \"a\")", 21, "Expected opening `[`"),
        ("(mode: slow, names: [1])", 22, "Expected string"),
        ("(mode: slow, size_m: [1, 2])", 22, "Expected opening `(`"),
        ("(mode: slow, size_m: (1, 2, 3))", 29, "Expected closing `)`"),
        ("(mode: slow, size_m: (1))", 24, "Expected an array of length 2 but found one element instead"),
        ("(mode: slow, size_m: (1, -2))", 26, "expected 2 finite numbers above 0, found -2 among them"),
        ("Other(mode: slow)", 1, "Expected struct `Spec` but found `Other`"),
    ] {
        let error = read::<Spec>(text).unwrap_err();
        assert_eq!(error.message(), message, "{error}");
        let line = text.lines().count();
        assert_eq!(error.line_and_column(), Some((line, column)), "{error}");
    }
}

#[test]
fn a_variant_without_keys_may_have_empty_brackets() {
    let spec = read::<Spec>("(mode: slow(), size_m: (1, 2))").unwrap();
    assert!(matches!(spec.mode, Mode::Slow), "{spec:?}");
}

#[test]
fn an_error_in_the_syntax_has_its_position() {
    for (text, place, message) in [
        ("", (1, 1), "Unexpected end of RON"),
        ("(a: 1,\n  // comment\n", (2, 13), "Unexpected end of RON"),
        ("(a: 1\n  b: 2)", (2, 3), "Expected comma"),
        ("(a: 1; b: 2)", (1, 6), "Expected comma"),
        ("(a: [1, 2)", (1, 10), "Expected comma"),
        ("(a 1)", (1, 4), "Expected colon"),
        ("(a: 1, 2)", (1, 8), "Expected identifier"),
        ("(a-b: 1)", (1, 2), "Found invalid std identifier \"a-b\", try the raw identifier `r#a-b` instead"),
        ("(é: 1) x", (1, 8), "Non-whitespace trailing characters"),
        ("(a: ;)", (1, 5), "Unexpected char ';'"),
        ("(a: \"open)", (1, 5), "Expected end of string"),
        ("(a: \"\\q\")", (1, 6), "Unknown escape character"),
        ("(a: 'ab')", (1, 7), "Expected char"),
        ("(a: /* /* */ 1)", (1, 5), "Unclosed block comment"),
        ("(a: 1.2.3)", (1, 5), "Expected float"),
        ("(a: 0b12)", (1, 5), "Invalid digit '2' for base 2 integers"),
        ("(a: 5ms)", (1, 5), "The unit is in the key: write 5"),
        ("(a: -1.5e3kg)", (1, 5), "The unit is in the key: write -1.5e3"),
        ("(a: 30deg)", (1, 5), "The unit is in the key: write 30"),
        ("(a: 5us)", (1, 5), "The unit is in the key: write 5"),
        ("(a: 1._5)", (1, 5), "Unexpected underscore in float"),
    ] {
        let error = read::<serde::de::IgnoredAny>(text).unwrap_err();
        assert_eq!((error.message(), error.line_and_column()), (message, Some(place)), "{error}");
    }
}

#[test]
fn deep_nesting_is_an_error_and_not_an_overflow() {
    let nested = |depth: usize| "[".repeat(depth) + &"]".repeat(depth);
    assert!(read::<serde::de::IgnoredAny>(&nested(64)).is_ok());
    for text in [nested(65), nested(1_000_000), "(a:".repeat(1_000_000), "A(".repeat(1_000_000)] {
        let error = read::<serde::de::IgnoredAny>(&text).unwrap_err();
        assert!(error.message().contains("recursion limit: more than 64 brackets"), "{}", error.message());
    }
    let comments = "/*".repeat(1_000_000);
    assert_eq!(read::<serde::de::IgnoredAny>(&comments).unwrap_err().message(), "Unclosed block comment");
    assert!(read::<Endless>("1").unwrap_err().message().contains("recursion limit: a type contains itself"));
}
