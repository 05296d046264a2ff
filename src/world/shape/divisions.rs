//! Limit of the number of divisions of a shape.

/// Maximum number of sides of a cylinder, steps of stairs, or nodes along a height field.
pub(super) const MAX_DIVISIONS: usize = 4096;

/// Checks that a number of divisions is between `least` and the maximum.
pub(super) fn check_count(key: &'static str, count: usize, least: usize) -> Result<(), (&'static str, String)> {
    if (least..=MAX_DIVISIONS).contains(&count) {
        Ok(())
    } else {
        Err((key, format!("`{key}` is {count}; it must be from {least} to {MAX_DIVISIONS}")))
    }
}
