//! Limits of the errors of a trajectory, `position_rmse=5mm`.

use super::quantity::number_and_unit;
use serde_json::{Map, Value};
use zsim_base::similar::did_you_mean;

/// Figures that can have a limit, without their unit, with the end of their key.
const FIGURES: [(&str, &[Dimension]); 11] = [
    ("position_rmse", &[Dimension::Length]),
    ("position_median", &[Dimension::Length]),
    ("position_max", &[Dimension::Length]),
    ("rotation_rmse", &[Dimension::Angle]),
    ("rotation_max", &[Dimension::Angle]),
    ("drift", &[Dimension::LengthRate]),
    ("yaw_drift", &[Dimension::AngleRate]),
    ("end_error", &[Dimension::Length]),
    ("relative_error_per_metre", &[Dimension::Length, Dimension::Angle]),
    ("relative_error_per_second", &[Dimension::Length, Dimension::Angle]),
    ("relative_error_per_minute", &[Dimension::Length, Dimension::Angle]),
];

/// What a figure measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Dimension {
    Length,
    Angle,
    LengthRate,
    AngleRate,
}

impl Dimension {
    /// Units with their factor to the unit of the key.
    fn units(self) -> &'static [(&'static str, f64)] {
        const PER_RAD: f64 = 180.0 / std::f64::consts::PI;
        match self {
            Self::Length => &[("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)],
            Self::Angle => &[("deg", 1.0), ("mrad", 1e-3 * PER_RAD), ("rad", PER_RAD)],
            Self::LengthRate => &[("mm/min", 1e-3), ("cm/min", 1e-2), ("m/min", 1.0)],
            Self::AngleRate => &[("deg/min", 1.0), ("mrad/min", 1e-3 * PER_RAD)],
        }
    }

    /// End of the key in JSON.
    fn suffix(self) -> &'static str {
        match self {
            Self::Length => "m",
            Self::Angle => "deg",
            Self::LengthRate => "m_per_min",
            Self::AngleRate => "deg_per_min",
        }
    }
}

/// A limit of a figure.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Limit {
    /// The text of the user.
    text: String,
    /// Key of the figure in JSON.
    key: String,
    /// The limit in the unit of the key.
    value: f64,
}

impl Limit {
    /// Parses `NAME=NUMBER UNIT`, such as `position_rmse=5mm`.
    ///
    /// # Errors
    /// When there is no such figure, or the unit is not one of it.
    pub fn parse(text: &str) -> Result<Self, String> {
        let Some((name, value)) = text.split_once('=') else {
            return Err(format!("`{text}` is not NAME=LIMIT: write, for example, position_rmse=5mm"));
        };
        let name = name.trim();
        let Some((_, dimensions)) = FIGURES.iter().find(|(figure, _)| *figure == name) else {
            let names: Vec<&str> = FIGURES.iter().map(|(figure, _)| *figure).collect();
            let question = did_you_mean(name, names.iter().copied()).map_or_else(String::new, |q| format!(" {q}"));
            return Err(format!("`{name}` is not a figure with a limit:{question} use one of {}", names.join(", ")));
        };
        let value = value.trim();
        let (number, unit) = number_and_unit(value);
        let mut units = dimensions.iter().flat_map(|dimension| dimension.units().iter().map(move |u| (dimension, u)));
        let Some((dimension, (_, factor))) = units.clone().find(|(_, (symbol, _))| *symbol == unit) else {
            let symbols: Vec<&str> = units.by_ref().map(|(_, (symbol, _))| *symbol).collect();
            return Err(format!("the limit of {name} needs one of the units {}", symbols.join(", ")));
        };
        let number = number.ok_or_else(|| format!("`{value}` is not a number and a unit"))?;
        if !(number.is_finite() && number >= 0.0) {
            return Err(format!("the limit of {name} must be at least 0"));
        }
        let key = format!("{name}_{}", dimension.suffix());
        Ok(Self { text: text.to_owned(), key, value: number * factor })
    }

    /// Why the figures of the trajectory `name` do not keep this limit; `None` if they do. An unknown figure does not.
    pub fn violation(&self, name: &str, figures: &Map<String, Value>) -> Option<String> {
        let Some(found) = figures.get(&self.key).and_then(Value::as_f64) else {
            let (key, text) = (&self.key, &self.text);
            return Some(format!(
                "{name}: {key} is not known: the trajectory is too short or its poses are too sparse, or the truth has no attitudes (limit {text})"
            ));
        };
        let within = found <= self.value;
        (!within).then(|| format!("{name}: {} is {found:.6} (limit {})", self.key, self.text))
    }
}

/// Parses a fraction such as `95%` or `0.95`.
pub(super) fn fraction(text: &str) -> Result<f64, String> {
    let (number, whole) = match text.trim().strip_suffix('%') {
        Some(number) => (number, 100.0),
        None => (text, 1.0),
    };
    let value = number.trim().parse::<f64>().map(|number| number / whole);
    value
        .ok()
        .filter(|value| (0.0..=1.0).contains(value))
        .ok_or_else(|| format!("`{text}` is not a fraction from 0 to 1, or from 0% to 100%"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_limit_is_a_name_a_number_and_a_unit() {
        for (text, key, value) in [
            ("position_rmse=5mm", "position_rmse_m", 0.005),
            ("rotation_rmse = 0.1 deg", "rotation_rmse_deg", 0.1),
            ("relative_error_per_metre=1cm", "relative_error_per_metre_m", 0.01),
            ("relative_error_per_metre=0.2deg", "relative_error_per_metre_deg", 0.2),
            ("rotation_max=1mrad", "rotation_max_deg", 0.057_295_779_513),
            ("drift=2cm/min", "drift_m_per_min", 0.02),
            ("yaw_drift=1e-1deg/min", "yaw_drift_deg_per_min", 0.1),
        ] {
            let limit = Limit::parse(text).unwrap();
            assert!(limit.key == key && (limit.value - value).abs() < 1e-12, "{text}: {limit:?}");
        }
        for (text, words) in [
            ("position_rmse", "NAME=LIMIT"),
            ("position=5mm", "position_rmse, "),
            ("position_rmse=5", "mm, cm, m"),
            ("position_rmse=5deg", "mm, cm, m"),
            ("drift=5mm", "mm/min"),
            ("position_rmse=mm", "not a number"),
            ("position_rmse=-1mm", "at least 0"),
            ("position_rmse=nanmm", "one of the units"),
        ] {
            let error = Limit::parse(text).unwrap_err();
            assert!(error.contains(words), "{text}: {error}");
        }
    }

    #[test]
    fn an_error_above_the_limit_and_an_unknown_one_violate_it() {
        let limit = Limit::parse("position_rmse=5mm").unwrap();
        let violation = |value: Value| {
            let figures = Map::from_iter([("position_rmse_m".to_owned(), value)]);
            limit.violation("a.tum", &figures)
        };
        assert_eq!(violation(json!(0.005)), None);
        assert_eq!(violation(json!(0.0051)).unwrap(), "a.tum: position_rmse_m is 0.005100 (limit position_rmse=5mm)");
        assert!(violation(Value::Null).unwrap().contains("not known"));
    }

    #[test]
    fn a_fraction_is_a_number_or_a_percentage() {
        assert_eq!((fraction("95%"), fraction("0.5"), fraction("100 %")), (Ok(0.95), Ok(0.5), Ok(1.0)));
        for text in ["", "95", "-1%", "nan", "x"] {
            assert!(fraction(text).is_err(), "{text}");
        }
    }
}
