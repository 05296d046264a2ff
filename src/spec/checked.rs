//! Numbers that are checked where they are read, so that the error points at them.
//!
//! Use with `#[serde(deserialize_with = "crate::spec::checked::positive")]`.

use serde::de::{Deserialize, Deserializer, Error};

/// A number that is neither NaN nor infinite.
///
/// # Errors
/// When it is not.
pub fn finite<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    require(f64::deserialize(deserializer)?, |x| x.is_finite(), "a finite number")
}

/// A finite number above zero.
///
/// # Errors
/// When it is not.
pub fn positive<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    require(f64::deserialize(deserializer)?, |x| x.is_finite() && x > 0.0, "a finite number above 0")
}

/// A finite number of at least zero.
///
/// # Errors
/// When it is not.
pub fn non_negative<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    require(f64::deserialize(deserializer)?, |x| x.is_finite() && x >= 0.0, "a finite number of at least 0")
}

/// A number from 0 to 1.
///
/// # Errors
/// When it is not.
pub fn fraction<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    require(f64::deserialize(deserializer)?, |x| (0.0..=1.0).contains(&x), "a number from 0 to 1")
}

/// `N` finite numbers.
///
/// # Errors
/// When there are not `N`, or one of them is not finite.
pub fn finite_array<'de, D, const N: usize>(deserializer: D) -> Result<[f64; N], D::Error>
where
    D: Deserializer<'de>,
    [f64; N]: Deserialize<'de>,
{
    let numbers = <[f64; N]>::deserialize(deserializer)?;
    match numbers.iter().find(|x| !x.is_finite()) {
        Some(bad) => Err(D::Error::custom(format!("expected {N} finite numbers, found {bad} among them"))),
        None => Ok(numbers),
    }
}

/// `N` finite numbers of at least zero.
///
/// # Errors
/// When there are not `N`, or one of them is not.
pub fn non_negative_array<'de, D, const N: usize>(deserializer: D) -> Result<[f64; N], D::Error>
where
    D: Deserializer<'de>,
    [f64; N]: Deserialize<'de>,
{
    let numbers = <[f64; N]>::deserialize(deserializer)?;
    match numbers.iter().find(|x| !(x.is_finite() && **x >= 0.0)) {
        Some(bad) => {
            Err(D::Error::custom(format!("expected {N} finite numbers of at least 0, found {bad} among them")))
        }
        None => Ok(numbers),
    }
}

/// `N` finite numbers above zero.
///
/// # Errors
/// When there are not `N`, or one of them is not.
pub fn positive_array<'de, D, const N: usize>(deserializer: D) -> Result<[f64; N], D::Error>
where
    D: Deserializer<'de>,
    [f64; N]: Deserialize<'de>,
{
    let numbers = <[f64; N]>::deserialize(deserializer)?;
    match numbers.iter().find(|x| !(x.is_finite() && **x > 0.0)) {
        Some(bad) => Err(D::Error::custom(format!("expected {N} finite numbers above 0, found {bad} among them"))),
        None => Ok(numbers),
    }
}

fn require<E: Error>(x: f64, is_right: impl Fn(f64) -> bool, what: &str) -> Result<f64, E> {
    if is_right(x) { Ok(x) } else { Err(E::custom(format!("expected {what}, found {x}"))) }
}
