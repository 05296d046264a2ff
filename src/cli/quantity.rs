//! Parses durations and lengths with units.

/// Maximum duration on the command line, s (30 years); most commands have lower limits.
const MAX_S: f64 = 1e9;

/// Parses a duration such as `120s`, `2min`, `1.5h`, `250ms` or `90`; returns seconds.
pub(super) fn seconds(text: &str) -> Result<f64, String> {
    let text = text.trim();
    let unit_at = text.find(|c: char| c.is_alphabetic() && c != 'e' && c != 'E').unwrap_or(text.len());
    let (number, unit) = text.split_at(unit_at);
    let number: f64 = number
        .trim()
        .parse()
        .map_err(|_| format!("`{text}` is not a duration: write a number and a unit, as in 120s or 2min"))?;
    let factor = match unit {
        "" | "s" | "sec" => 1.0,
        "ms" => 1e-3,
        "min" | "m" => 60.0,
        "h" => 3600.0,
        _ => return Err(format!("`{unit}` is not a unit of time: use ms, s, min or h, as in 120s or 2min")),
    };
    let seconds = number * factor;
    if seconds > 0.0 && seconds <= MAX_S {
        Ok(seconds)
    } else {
        Err(format!("the duration must be above 0 s and at most {MAX_S:e} s"))
    }
}

/// Maximum magnitude of a length on the command line, m.
const MAX_M: f64 = 1e5;

/// Parses a length such as `1.2m`, `80cm`, `900mm` or `1.2`; returns metres.
pub(super) fn metres(text: &str) -> Result<f64, String> {
    let text = text.trim();
    let unit_at = text.find(|c: char| c.is_alphabetic() && c != 'e' && c != 'E').unwrap_or(text.len());
    let (number, unit) = text.split_at(unit_at);
    let number = number.trim().parse::<f64>();
    let number =
        number.map_err(|_| format!("`{text}` is not a length: write a number and a unit, as in 1.2m or 80cm"))?;
    let factor = match unit {
        "" | "m" => 1.0,
        "cm" => 1e-2,
        "mm" => 1e-3,
        _ => return Err(format!("`{unit}` is not a unit of length: use mm, cm or m, as in 1.2m or 80cm")),
    };
    let metres = number * factor;
    if metres.abs() <= MAX_M { Ok(metres) } else { Err(format!("the length must be within {MAX_M:e} m")) }
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
}
