//! The unit that a key ends with, by the naming convention of specs (`stiffness_n_per_m` is in N/m).

/// Parts of units in keys, and the symbols for them.
const SYMBOLS: [(&str, &str); 26] = [
    ("m", "m"),
    ("m2", "m²"),
    ("m3", "m³"),
    ("mm", "mm"),
    ("s", "s"),
    ("s2", "s²"),
    ("ms", "ms"),
    ("us", "µs"),
    ("hz", "Hz"),
    ("kg", "kg"),
    ("n", "N"),
    ("nm", "N m"),
    ("deg", "°"),
    ("rad", "rad"),
    ("mrad", "mrad"),
    ("turns", "turns"),
    ("g", "g"),
    ("mg", "mg"),
    ("ug", "µg"),
    ("gpa", "GPa"),
    ("ppm", "ppm"),
    ("percent", "%"),
    ("rpm", "1/min"),
    ("mib", "MiB"),
    ("1e6", "1e-6"),
    ("sigmas", "σ"),
];

/// Parts that are units only after `per`, since names of quantities have them too.
const DENOMINATORS: [(&str, &str); 2] = [("h", "h"), ("min", "min")];

/// The unit of the quantity that `key` names; `None` for a key without one.
pub(super) fn of(key: &str) -> Option<String> {
    if key.ends_with("_m_deg") {
        return Some("m, °".to_owned());
    }
    let parts: Vec<&str> = key.split('_').collect();
    (0..parts.len()).find_map(|first| written(&parts[first..]))
}

/// `parts` as a unit; `None` where one of them is no part of a unit.
fn written(parts: &[&str]) -> Option<String> {
    let mut text = String::new();
    let mut previous = "";
    for part in parts {
        match (*part, previous) {
            ("per", "" | "per" | "sqrt") => return None,
            ("per", _) => text.push('/'),
            ("sqrt", "per") => text.push('√'),
            (part, previous) => {
                let denominator = DENOMINATORS.iter().filter(|_| previous == "per");
                let symbol = SYMBOLS.iter().chain(denominator).find(|(name, _)| *name == part)?.1;
                let separator = if matches!(previous, "" | "per" | "sqrt") { "" } else { " " };
                text += &format!("{separator}{symbol}");
            }
        }
        previous = part;
    }
    (!matches!(previous, "per" | "sqrt")).then_some(text)
}

#[cfg(test)]
mod tests {
    use super::of;

    #[test]
    fn a_key_ends_with_its_unit() {
        for (key, unit) in [
            ("stiffness_n_per_m", "N/m"),
            ("density_deg_per_s_per_sqrt_hz", "°/s/√Hz"),
            ("inertia_kg_m2", "kg m²"),
            ("damping_nm_s_per_rad", "N m s/rad"),
            ("range_min_m", "m"),
            ("max_drift_m_per_min", "m/min"),
            ("n_per_m", "N/m"),
            ("at_m_deg", "m, °"),
        ] {
            assert_eq!(of(key).as_deref(), Some(unit), "{key}");
        }
        for key in ["count", "drag_per", "offset_grids", "h"] {
            assert_eq!(of(key), None, "{key}");
        }
    }
}
