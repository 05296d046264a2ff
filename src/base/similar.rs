//! Finds the name that a misspelt one probably means.

use crate::unit::split_unit;

/// Shortest beginning that is taken for a name, characters.
const MIN_BEGINNING: usize = 3;

/// Returns the candidate that `name` probably means: it differs by upper case only, or by its unit only; a few letters
/// are misspelt; or it is the shortest one that begins with `name`.
fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let candidates: Vec<&str> = candidates.into_iter().collect();
    if candidates.contains(&name) {
        return None;
    }
    let lower = name.to_lowercase();
    let quantity = split_unit(&lower).0;
    let same_quantity = |candidate: &str| !quantity.is_empty() && split_unit(&candidate.to_lowercase()).0 == quantity;
    let find = |is_meant: &dyn Fn(&str) -> bool| candidates.iter().copied().find(|candidate| is_meant(candidate));
    find(&|candidate| candidate.to_lowercase() == lower)
        .or_else(|| find(&same_quantity))
        .or_else(|| misspelt(&lower, &candidates))
        .or_else(|| begun(&lower, &candidates))
}

/// Returns the candidate that differs from `name` by the fewest letters inserted, left out, replaced or exchanged with the
/// next one (optimal string alignment); `None` if more than a third of the letters differ.
fn misspelt<'a>(name: &str, candidates: &[&'a str]) -> Option<&'a str> {
    let similar = candidates.iter().copied().filter(|candidate| !differs_by_digits_only(name, candidate));
    let distances = similar.map(|candidate| (strsim::osa_distance(name, &candidate.to_lowercase()), candidate));
    let (distance, nearest) = distances.min_by_key(|(distance, _)| *distance)?;
    (3 * distance <= name.chars().count()).then_some(nearest)
}

/// Whether two names are equal without their digits, as those of two figures: one is not the other misspelt.
fn differs_by_digits_only(name: &str, other: &str) -> bool {
    let letters = |text: &str| text.to_lowercase().replace(|c: char| c.is_ascii_digit(), "");
    letters(name) == letters(other)
}

/// Returns the shortest candidate that begins with `name`; `None` if several are as short.
fn begun<'a>(name: &str, candidates: &[&'a str]) -> Option<&'a str> {
    let is_long = name.chars().count() >= MIN_BEGINNING;
    let mut longer: Vec<&str> =
        candidates.iter().copied().filter(|candidate| is_long && candidate.to_lowercase().starts_with(name)).collect();
    longer.sort_by_key(|candidate| candidate.len());
    match *longer {
        [only] => Some(only),
        [first, second, ..] if first.len() < second.len() => Some(first),
        _ => None,
    }
}

/// Returns `did you mean NAME?` for the candidate that `name` probably means.
pub fn did_you_mean<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<String> {
    nearest(name, candidates).map(|nearest| format!("did you mean {nearest}?"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misspelt_name_is_near_and_another_word_is_not() {
        let names = ["office", "handheld", "rate_hz", "gyro"];
        for (name, expected) in [
            ("offcie", Some("office")),
            ("handhold", Some("handheld")),
            ("rate_hx", Some("rate_hz")),
            ("gyo", Some("gyro")),
            ("gyro", None),
            ("lidar", None),
            ("x", None),
            ("hz", None),
            ("", None),
        ] {
            assert_eq!(nearest(name, names), expected, "{name}");
        }
    }

    #[test]
    fn a_name_without_its_unit_in_upper_case_or_not_complete_is_near() {
        let names = ["rate_hz", "mass_kg", "imu", "imus", "utm30lx", "utm30lx_exact", "handheld_2", "handheld_3"];
        for (name, expected) in [
            ("rate", Some("rate_hz")),
            ("mass_g", Some("mass_kg")),
            ("IMU", Some("imu")),
            ("utm30", Some("utm30lx")),
            ("UTM30", Some("utm30lx")),
            ("kg", None),
            ("ut", None),
            ("handh", None), // of two equal ones neither is meant
        ] {
            assert_eq!(nearest(name, names), expected, "{name}");
        }
    }

    #[test]
    fn another_number_is_another_name() {
        for name in ["fig6", "fig1", "fig33"] {
            assert_eq!(nearest(name, ["fig3", "fig10", "fig13"]), None, "{name}");
        }
        assert_eq!(nearest("fgi3", ["fig3", "fig10"]), Some("fig3"));
    }
}
