//! Decimal numbers: exact for stamps, and fast.

use std::io::Write;
use zsim_base::time::{NANOS_PER_SECOND, Stamp};

/// Decimals of each number.
const DECIMALS: usize = 9;

/// Upper limit of the fast path: 1e9 times the value is below 2^53, so it is an exact integer in a double.
const FAST_PATH_LIMIT: f64 = 1e6;

/// Appends seconds with nine decimals, i.e. exact to the nanosecond.
pub fn write_stamp(out: &mut Vec<u8>, stamp: Stamp) {
    write_billionths(out, stamp.nanos());
}

/// Appends `value` with nine decimals.
pub fn write(out: &mut Vec<u8>, value: f64) {
    if value.abs() < FAST_PATH_LIMIT {
        write_billionths(out, (value * 1e9).round() as i64);
    } else {
        // Writing to memory does not fail.
        let _ = write!(out, "{value:.DECIMALS$}");
    }
}

fn write_billionths(out: &mut Vec<u8>, billionths: i64) {
    if billionths < 0 {
        out.push(b'-');
    }
    let magnitude = billionths.unsigned_abs();
    let billion = NANOS_PER_SECOND.unsigned_abs();
    write_digits(out, magnitude / billion, 1);
    out.push(b'.');
    write_digits(out, magnitude % billion, DECIMALS);
}

/// Appends the digits of `value`, at least `least` of them.
fn write_digits(out: &mut Vec<u8>, mut value: u64, least: usize) {
    let start = out.len();
    while value > 0 || out.len() - start < least {
        out.push(b'0' + (value % 10) as u8);
        value /= 10;
    }
    out[start..].reverse();
}

/// Parses seconds as a decimal number with optional exponent, rounded down to a nanosecond.
///
/// It is exact where a `f64` is not.
pub fn parse_stamp(text: &str) -> Option<Stamp> {
    let (mantissa, exponent) = match text.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, exponent.parse::<i32>().ok()?),
        None => (text, 0),
    };
    let (negative, mantissa) = match mantissa.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, mantissa.strip_prefix('+').unwrap_or(mantissa)),
    };
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    if whole.is_empty() && fraction.is_empty() {
        return None;
    }
    // The decimal point follows the first `places - 9` digits, so the first `places` digits are the nanoseconds.
    let places = i32::try_from(whole.len()).ok()?.checked_add(exponent)?.checked_add(DECIMALS as i32)?;
    let mut nanos = 0_i64;
    let mut digits = whole.bytes().chain(fraction.bytes());
    for _ in 0..places.clamp(0, 64) {
        let digit = digits.next().unwrap_or(b'0');
        let value = digit.is_ascii_digit().then(|| i64::from(digit - b'0'))?;
        nanos = nanos.checked_mul(10)?.checked_add(value)?;
    }
    if places > 64 || !digits.all(|digit| digit.is_ascii_digit()) {
        return None;
    }
    Some(Stamp::from_nanos(if negative { -nanos } else { nanos }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(value: f64) -> String {
        let mut out = Vec::new();
        write(&mut out, value);
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn decimals_match_the_standard_formatter() {
        for value in [0.0, 1.0, -1.5, 0.123_456_789_4, -0.000_000_001, 999_999.999_999_9, 3e7, -1e-12] {
            let standard = format!("{value:.9}");
            let standard = if standard == "-0.000000000" { "0.000000000".to_owned() } else { standard };
            assert_eq!(written(value), standard);
        }
    }

    #[test]
    fn stamps_are_read_to_the_nanosecond() {
        let nanos = |text: &str| parse_stamp(text).map(Stamp::nanos);
        assert_eq!(nanos("1349049600.123456789"), Some(1_349_049_600_123_456_789));
        assert_eq!(nanos("1.305031102175300121e+09"), Some(1_305_031_102_175_300_121));
        assert_eq!(nanos("-0.5"), Some(-500_000_000));
        assert_eq!(nanos("12"), Some(12_000_000_000));
        assert_eq!(nanos("5e-3"), Some(5_000_000));
        assert_eq!(nanos("1e-30"), Some(0));
        for invalid in ["", ".", "-", "1.2.3", "nan", "inf", "1e", "1e99", "99999999999999", "0x10", "1_0"] {
            assert_eq!(nanos(invalid), None, "{invalid}");
        }
    }
}
