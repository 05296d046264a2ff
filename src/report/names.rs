//! Names of quantities for plots and tables, from the keys of specs.

use zsim_base::spec::split_unit;

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
    let name = quantity_name(key);
    let mut characters = name.chars();
    characters.next().map_or_else(String::new, |first| first.to_uppercase().chain(characters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

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
