//! Parses durations, lengths, angles and frequencies with units.

/// Maximum duration on the command line, s (30 years); most commands have lower limits.
const MAX_S: f64 = 1e9;
/// Maximum magnitude of a length on the command line, m.
const MAX_M: f64 = 1e5;
/// Maximum magnitude of an angle on the command line, degrees.
const MAX_DEG: f64 = 1e6;
/// Maximum frequency on the command line, Hz.
const MAX_HZ: f64 = 1e9;

/// A kind of quantity: its name with article, an example, and its units with their factors.
struct Quantity {
    noun: &'static str,
    example: &'static str,
    units: &'static [(&'static str, f64)],
}

const DURATION: Quantity = Quantity {
    noun: "a duration",
    example: "120s or 2min",
    units: &[("", 1.0), ("s", 1.0), ("sec", 1.0), ("ms", 1e-3), ("min", 60.0), ("m", 60.0), ("h", 3600.0)],
};
const OFFSET: Quantity = Quantity {
    noun: "an offset of time",
    example: "2ms or -0.1s",
    units: &[("", 1.0), ("ms", 1.0), ("us", 1e-3), ("\u{b5}s", 1e-3), ("s", 1e3)],
};
const LENGTH: Quantity =
    Quantity { noun: "a length", example: "1.2m or 80cm", units: &[("", 1.0), ("m", 1.0), ("cm", 1e-2), ("mm", 1e-3)] };
const ANGLE: Quantity = Quantity {
    noun: "an angle",
    example: "2deg or 0.1rad",
    units: &[
        ("", 1.0),
        ("deg", 1.0),
        ("°", 1.0),
        ("rad", 180.0 / std::f64::consts::PI),
        ("mrad", 0.18 / std::f64::consts::PI),
    ],
};
const FREQUENCY: Quantity = Quantity {
    noun: "a frequency",
    example: "2Hz or 500mHz",
    units: &[("", 1.0), ("Hz", 1.0), ("hz", 1.0), ("mHz", 1e-3), ("kHz", 1e3)],
};

impl Quantity {
    /// Returns the value of a number and a unit; without unit, the first unit applies.
    fn parse(&self, text: &str) -> Result<f64, String> {
        let Self { noun, example, units } = self;
        let (number, unit) = number_and_unit(text);
        let number = number
            .ok_or_else(|| format!("`{}` is not {noun}: write a number and a unit, as in {example}", text.trim()))?;
        let factor = units.iter().find(|(known, _)| *known == unit).map(|(_, factor)| *factor);
        let of = noun.trim_start_matches("a ").trim_start_matches("an ");
        let factor = factor.ok_or_else(|| format!("`{unit}` is not a unit of {of}: write for example {example}"))?;
        Ok(number * factor)
    }
}

/// Splits a text such as `1.5 mm` into its number, if it is one, and its unit.
pub(super) fn number_and_unit(text: &str) -> (Option<f64>, &str) {
    let is_unit = |c: char| (c.is_alphabetic() && c != 'e' && c != 'E') || c == '°';
    let text = text.trim();
    let (number, unit) = text.split_at(text.find(is_unit).unwrap_or(text.len()));
    (number.trim().parse().ok(), unit.trim())
}

/// Parses a duration such as `120s`, `2min`, `1.5h`, `250ms` or `90`; returns seconds.
pub(super) fn seconds(text: &str) -> Result<f64, String> {
    let seconds = DURATION.parse(text)?;
    if seconds > 0.0 && seconds <= MAX_S {
        Ok(seconds)
    } else {
        Err(format!("the duration must be above 0 s and at most {MAX_S:e} s"))
    }
}

/// Parses a time as [`seconds`] does, which may be zero.
pub(super) fn seconds_from_zero(text: &str) -> Result<f64, String> {
    match DURATION.parse(text)? {
        0.0 => Ok(0.0),
        _ => seconds(text),
    }
}

/// Parses an offset of time such as `-2ms`, `10us` or `-2`; returns milliseconds.
pub(super) fn milliseconds(text: &str) -> Result<f64, String> {
    let milliseconds = OFFSET.parse(text)?;
    if milliseconds.abs() <= MAX_S { Ok(milliseconds) } else { Err(format!("the offset must be within {MAX_S:e} ms")) }
}

/// Parses a length such as `1.2m`, `80cm`, `900mm` or `1.2`; returns metres.
pub(super) fn metres(text: &str) -> Result<f64, String> {
    let metres = LENGTH.parse(text)?;
    if metres.abs() <= MAX_M { Ok(metres) } else { Err(format!("the length must be within {MAX_M:e} m")) }
}

/// Parses an angle such as `2deg`, `0.1rad`, `20mrad` or `2`; returns degrees.
pub(super) fn degrees(text: &str) -> Result<f64, String> {
    let degrees = ANGLE.parse(text)?;
    if degrees.abs() <= MAX_DEG { Ok(degrees) } else { Err(format!("the angle must be within {MAX_DEG:e} degrees")) }
}

/// Parses an angular rate such as `0.1deg/s`, `5mrad/s` or `0.1`; returns degrees per second.
pub(super) fn degrees_per_second(text: &str) -> Result<f64, String> {
    degrees(text.trim().trim_end_matches("/s"))
}

/// Parses a frequency such as `2Hz`, `500mHz` or `2`; returns hertz.
pub(super) fn hertz(text: &str) -> Result<f64, String> {
    let hertz = FREQUENCY.parse(text)?;
    if hertz > 0.0 && hertz <= MAX_HZ {
        Ok(hertz)
    } else {
        Err(format!("the frequency must be above 0 Hz and at most {MAX_HZ:e} Hz"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_duration_is_a_number_and_a_unit() {
        for (text, expected) in [("120s", 120.0), ("2min", 120.0), ("90", 90.0), ("1.5 h", 5400.0), ("250ms", 0.25)] {
            assert_eq!(seconds(text), Ok(expected), "{text}");
        }
        for text in ["", "s", "-3s", "0", "nan", "inf", "3 parsecs", "1e400s", "1e300s", "300000h"] {
            assert!(seconds(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_length_is_a_number_and_a_unit() {
        for (text, expected) in [("1.2m", 1.2), ("80cm", 0.8), ("-900 mm", -0.9), ("2", 2.0)] {
            assert_eq!(metres(text), Ok(expected), "{text}");
        }
        for text in ["", "m", "nan", "inf", "3 feet", "1e400m", "1e6m"] {
            assert!(metres(text).is_err(), "{text}");
        }
    }

    #[test]
    fn angles_and_frequencies_have_units_or_none() {
        for (text, expected) in [("2", 2.0), ("-2deg", -2.0), ("2°", 2.0), ("0.5 rad", 28.648), ("100mrad", 5.7296)] {
            assert!((degrees(text).unwrap() - expected).abs() < 1e-3, "{text}");
        }
        for (text, expected) in [("2", 2.0), ("2Hz", 2.0), ("500 mHz", 0.5), ("1kHz", 1000.0)] {
            assert_eq!(hertz(text), Ok(expected), "{text}");
        }
        for text in ["", "2m", "nan", "-1Hz", "0", "1e400"] {
            assert!(hertz(text).is_err(), "{text}");
        }
        assert!(degrees("2hz").is_err() && degrees("inf").is_err());
    }
}
