//! Parses durations with units.

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
}
