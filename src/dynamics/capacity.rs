//! The largest mass of a head that a linkage supports.

use super::body::Body;
use super::error::DynamicsError;
use super::mount::Mount;
use super::spec::HeadSpec;
use crate::spec::Source;

/// Largest mass that is tried, as a multiple of the mass of the head.
const MAX_MASS_FACTOR: f64 = 1024.0;

/// The largest mass of a head with the shape of `spec` that is stable in the linkage, kg.
///
/// Found by bisection to a relative accuracy of 1e-6. `None` where there is no limit: a rigid or actuated mount, or a
/// hanging head.
///
/// # Errors
/// When the parts of the head or a spring are invalid.
pub fn max_head_mass_kg(spec: &HeadSpec, source: &Source) -> Result<Option<f64>, DynamicsError> {
    let body = Body::of(spec, source)?;
    let Mount::Compliant(mount) = Mount::of(&spec.linkage, &body, source)? else { return Ok(None) };
    let (mut stable, mut unstable) = (0.0, 1.0);
    while mount.equilibrium(unstable).is_ok() {
        (stable, unstable) = (unstable, 2.0 * unstable);
        if unstable > MAX_MASS_FACTOR {
            return Ok(None);
        }
    }
    while unstable - stable > 1e-6 * unstable && unstable > 1e-9 {
        let middle = 0.5 * (stable + unstable);
        if mount.equilibrium(middle).is_ok() { stable = middle } else { unstable = middle }
    }
    Ok(Some(stable * body.mass_kg))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::{HeadModel, PartSpec, load};

    /// The handheld head with the mass of each part multiplied by `factor`.
    fn scaled(factor: f64) -> (HeadSpec, Source) {
        let (mut spec, source) = load("handheld").unwrap();
        for part in &mut spec.parts {
            if let PartSpec::Block { mass_kg, .. } = part {
                *mass_kg *= factor;
            }
        }
        (spec, source)
    }

    #[test]
    fn a_head_is_stable_below_the_mass_limit_and_unstable_above() {
        let (spec, source) = scaled(1.0);
        let factor = max_head_mass_kg(&spec, &source).unwrap().unwrap() / 0.35;
        assert!((1.0..5.0).contains(&factor), "{factor}");
        let (lighter, heavier) = (scaled(factor * 0.999), scaled(factor * 1.001));
        assert!(HeadModel::new_without_advice(&lighter.0, &lighter.1).is_ok());
        assert!(HeadModel::new_without_advice(&heavier.0, &heavier.1).is_err());
        // The limit does not depend on the mass in the spec, even if that head is unstable.
        let of_heavier = max_head_mass_kg(&heavier.0, &heavier.1).unwrap().unwrap();
        assert!((of_heavier / (0.35 * factor) - 1.0).abs() < 1e-4);
    }
}
