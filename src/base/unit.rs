//! The unit that a key ends with, by the naming convention of specs and results (`stiffness_n_per_m` is in N/m).

/// Parts of units in keys, and the symbols for them.
const SYMBOLS: [(&str, &str); 27] = [
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
    ("mpa", "MPa"),
    ("ppm", "ppm"),
    ("percent", "%"),
    ("rpm", "1/min"),
    ("mib", "MiB"),
    ("1e6", "1e-6"),
    ("sigmas", "σ"),
];

/// Parts that are units only after `per`, since names of quantities have them too.
const DENOMINATORS: [(&str, &str); 2] = [("h", "h"), ("min", "min")];

/// Splits `key` into the name of the quantity and the symbol of its unit; `None` for a key without a unit.
///
/// The name is empty for a key that is only a unit.
pub fn split_unit(key: &str) -> (&str, Option<String>) {
    if let Some(name) = key.strip_suffix("_m_deg") {
        return (name, Some("m, °".to_owned()));
    }
    let starts = std::iter::once(0).chain(key.match_indices('_').map(|(at, _)| at + 1));
    let unit = |start: usize| Some((start, written(&key[start..].split('_').collect::<Vec<_>>())?));
    match starts.into_iter().find_map(unit) {
        Some((start, unit)) => (key[..start].trim_end_matches('_'), Some(unit)),
        None => (key, None),
    }
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
    use super::split_unit;

    #[test]
    fn a_key_ends_with_its_unit() {
        for (key, name, unit) in [
            ("stiffness_n_per_m", "stiffness", "N/m"),
            ("density_deg_per_s_per_sqrt_hz", "density", "°/s/√Hz"),
            ("inertia_kg_m2", "inertia", "kg m²"),
            ("damping_nm_s_per_rad", "damping", "N m s/rad"),
            ("range_min_m", "range_min", "m"),
            ("max_drift_m_per_min", "max_drift", "m/min"),
            ("n_per_m", "", "N/m"),
            ("at_m_deg", "at", "m, °"),
        ] {
            assert_eq!(split_unit(key), (name, Some(unit.to_owned())));
        }
        for key in ["count", "drag_per", "offset_grids", "h"] {
            assert_eq!(split_unit(key), (key, None));
        }
    }
}
