//! Formats quantities with three significant digits and an SI prefix, and names them from the keys of specs.

use zsim_base::spec::split_unit;

/// Formats a length in m.
pub fn length(metres: f64) -> String {
    match metres.abs() {
        // The rest of an alignment, not a length.
        m if m < 1e-12 => "0 mm".to_owned(),
        m if m < 0.0995 => format!("{} mm", digits(metres * 1e3)),
        m if m < 0.995 => format!("{} cm", digits(metres * 1e2)),
        m if m < 995.0 => format!("{} m", digits(metres)),
        _ => format!("{} km", digits(metres * 1e-3)),
    }
}

/// Formats a duration.
pub(super) fn time(seconds: f64) -> String {
    match seconds.abs() {
        s if s < 0.995e-3 => format!("{} \u{b5}s", digits(seconds * 1e6)),
        s if s < 0.995 => format!("{} ms", digits(seconds * 1e3)),
        s if s < 120.0 => format!("{} s", digits(seconds)),
        s if s < 7200.0 => format!("{} min", digits(seconds / 60.0)),
        _ => format!("{} h", digits(seconds / 3600.0)),
    }
}

/// Formats a count, with the prefix k (10^3) or M (10^6).
pub(super) fn count(number: u64) -> String {
    match number {
        n if n < 10_000 => n.to_string(),
        n if n < 999_500 => format!("{} k", digits(n as f64 * 1e-3)),
        n => format!("{} M", digits(n as f64 * 1e-6)),
    }
}

/// Formats a fraction as a percentage.
pub(super) fn percent(fraction: f64) -> String {
    format!("{} %", digits(fraction * 1e2))
}

/// Formats a number with three significant digits and without an exponent.
pub fn digits(number: f64) -> String {
    if number == 0.0 || !number.is_finite() {
        return number.to_string();
    }
    let magnitude = number.abs().log10().floor() as i32;
    // 9.996 rounds to 10.0, not to 10.00.
    let rounded_up = (number.abs() / 10_f64.powi(magnitude - 2)).round() >= 1000.0;
    let decimals = (2 - magnitude - i32::from(rounded_up)).clamp(0, 9) as usize;
    format!("{number:.decimals$}")
}

/// Keys with another name than their own words. The unit follows from the key.
const NAMES: [(&str, &str); 14] = [
    ("bias_sigma_m", "standard deviation of the range bias"),
    ("bracket_kg", "mass of the bracket"),
    ("imu", "IMU"),
    ("base_imu", "IMU on the base"),
    ("min_sweep_deg_per_s", "minimum rotation rate out of the scan plane"),
    ("n_per_m", "stiffness"),
    ("noise_m", "range noise"),
    ("seed", "random seed"),
    ("x", "translation along x"),
    ("x_rot", "rotation about x"),
    ("y", "translation along y"),
    ("y_rot", "rotation about y"),
    ("z", "translation along z"),
    ("z_rot", "rotation about z"),
];

/// The name of the quantity with key `key`, with its unit in parentheses: `wire diameter (mm)` for `wire_diameter_mm`.
///
/// A key that is not in the table of names is split at its underscores, and its unit follows from its end.
pub fn quantity_name(key: &str) -> String {
    let (stem, unit) = split_unit(key);
    let words = match NAMES.iter().find(|(named, _)| *named == key) {
        Some((_, words)) => (*words).to_owned(),
        None if stem.is_empty() => return key.to_owned(),
        None => stem.replace('_', " "),
    };
    match unit {
        Some(unit) => format!("{words} ({unit})"),
        None => words,
    }
}

/// [`quantity_name`] with a capital letter at the start, for the axis of a plot.
pub fn axis_label(key: &str) -> String {
    capitalised(&quantity_name(key))
}

/// A text with a capital letter at the start.
pub fn capitalised(text: &str) -> String {
    let mut characters = text.chars();
    characters.next().map_or_else(String::new, |first| first.to_uppercase().chain(characters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_have_three_digits_and_a_prefix() {
        assert_eq!(length(0.012_34), "12.3 mm");
        assert_eq!(length(-0.25), "-25.0 cm");
        assert_eq!(length(1234.0), "1.23 km");
        assert_eq!(time(3.21e-4), "321 \u{b5}s");
        assert_eq!(time(7.0), "7.00 s");
        assert_eq!(digits(9.996), "10.0");
        assert_eq!(digits(0.0), "0");
        assert_eq!(digits(1e-12), "0.000000000");
        assert_eq!(percent(0.0351), "3.51 %");
        assert_eq!((count(950), count(5_189_000)), ("950".to_owned(), "5.19 M".to_owned()));
    }

    #[test]
    fn keys_become_words_with_their_unit_in_parentheses() {
        for (key, name) in [
            ("wire_diameter_mm", "wire diameter (mm)"),
            ("rate_hz", "rate (Hz)"),
            ("divergence_half_angle_mrad", "divergence half angle (mrad)"),
            ("max_drift_m_per_min", "max drift (m/min)"),
            ("angle_deg", "angle (°)"),
            ("clock_state", "clock state"),
            ("active_coils", "active coils"),
            ("bracket_kg", "mass of the bracket (kg)"),
            ("n_per_m", "stiffness (N/m)"),
            ("mm", "mm"),
            ("imu", "IMU"),
            ("y_rot", "rotation about y"),
            ("z", "translation along z"),
        ] {
            assert_eq!(quantity_name(key), name);
        }
        assert_eq!(axis_label("wire_diameter_mm"), "Wire diameter (mm)");
        assert_eq!(axis_label(""), "");
    }
}
