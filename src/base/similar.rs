//! Finds the name that a misspelt one probably stands for.

/// Returns the candidate that differs from `name` by the fewest letters inserted, left out, replaced or exchanged with the
/// next one (optimal string alignment); `None` if more than a third of the letters differ.
fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let distances = candidates.into_iter().map(|candidate| (strsim::osa_distance(name, candidate), candidate));
    let (distance, nearest) = distances.min_by_key(|(distance, _)| *distance)?;
    (distance > 0 && 3 * distance <= name.chars().count()).then_some(nearest)
}

/// Returns `did you mean NAME?` for the candidate that `name` probably stands for.
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
}
