//! The largest mass of a head that a linkage supports.

use super::body::Body;
use super::error::DynamicsError;
use super::mount::Mount;
use super::spec::HeadSpec;
use zsim_base::geometry::Pose;
use zsim_base::spec::Source;

/// Largest mass that is tried, as a multiple of the mass of the head.
const MAX_MASS_FACTOR: f64 = 1024.0;

/// The largest mass of a head that a linkage supports.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct MassLimit {
    /// Mass, kg.
    pub mass_kg: f64,
    /// What happens above it, as text.
    pub reason: String,
}

/// Returns the limit that a head violates in the rest pose `base_from_head`; `None` if it is within all limits.
///
/// The body is the head with a multiple of its real mass.
pub type RestLimit<'a> = &'a dyn Fn(&Body, &Pose) -> Option<String>;

/// The largest mass of a head with the shape of `spec` that has a stable rest pose within `limit`.
///
/// Found by bisection to a relative accuracy of 1e-6. `None` where there is no limit: a rigid or actuated mount, or a
/// hanging head that no `limit` restricts.
///
/// # Errors
/// When the parts of the head or a spring are invalid.
pub fn max_head_mass(
    spec: &HeadSpec,
    source: &Source,
    limit: RestLimit<'_>,
) -> Result<Option<MassLimit>, DynamicsError> {
    let body = Body::of(spec, source)?;
    let Mount::Compliant(mount) = Mount::of(&spec.linkage, &body, source)? else { return Ok(None) };
    let mount = mount.refined();
    let violation = |factor: f64| match mount.equilibrium(factor) {
        Ok((_, rest, _)) => {
            let (mass_kg, inertia_in_head) = (body.mass_kg * factor, body.inertia_in_head * factor);
            limit(&Body { mass_kg, inertia_in_head, ..body }, &rest)
        }
        Err(failure) => Some(failure.to_string()),
    };
    let (mut stable, mut unstable) = (0.0, 1.0);
    let mut reason = loop {
        match violation(unstable) {
            Some(reason) => break reason,
            None => (stable, unstable) = (unstable, 2.0 * unstable),
        }
        if unstable > MAX_MASS_FACTOR {
            return Ok(None);
        }
    };
    while unstable - stable > 1e-6 * unstable && unstable > 1e-9 {
        let middle = 0.5 * (stable + unstable);
        match violation(middle) {
            Some(nearer) => (unstable, reason) = (middle, nearer),
            None => stable = middle,
        }
    }
    Ok(Some(MassLimit { mass_kg: stable * body.mass_kg, reason }))
}

/// Whether a head of the shape of `spec` with `factor` times its mass has a stable rest pose.
///
/// # Errors
/// When the parts of the head or a spring are invalid.
pub fn stands_with_mass(spec: &HeadSpec, source: &Source, factor: f64) -> Result<bool, DynamicsError> {
    let body = Body::of(spec, source)?;
    let Mount::Compliant(mount) = Mount::of(&spec.linkage, &body, source)? else { return Ok(true) };
    Ok(mount.refined().equilibrium(factor).is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{HeadModel, LinkageSpec, PartSpec, load};

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
        let factor = max_head_mass(&spec, &source, &|_, _| None).unwrap().unwrap().mass_kg / 0.35;
        assert!((1.0..5.0).contains(&factor), "{factor}");
        let (lighter, heavier) = (scaled(factor * 0.999), scaled(factor * 1.001));
        assert!(HeadModel::new_without_advice(&lighter.0, &lighter.1).is_ok());
        assert!(HeadModel::new_without_advice(&heavier.0, &heavier.1).is_err());
        // The limit does not depend on the mass in the spec, even if that head is unstable.
        let of_heavier = max_head_mass(&heavier.0, &heavier.1, &|_, _| None).unwrap().unwrap().mass_kg;
        assert!((of_heavier / (0.35 * factor) - 1.0).abs() < 1e-4);
    }

    #[test]
    fn the_number_of_segments_does_not_limit_the_mass_of_a_hanging_head() {
        let (mut spec, source) = load("hanging").unwrap();
        for segments in [1, 2, 8] {
            if let LinkageSpec::Spring { segments: of_spec, .. } = &mut spec.linkage {
                *of_spec = segments;
            }
            // Far above the strength of the wire the force law ends, for any number of segments.
            let elastic = max_head_mass(&spec, &source, &|_, _| None).unwrap().unwrap();
            assert!(elastic.mass_kg > 30.0 && elastic.reason.contains("deforms the coils"), "{segments}: {elastic:?}");
            // A limit of the rest pose: 200 mm below the foot; without load the head would be 160 mm below it.
            let deep = |_: &Body, rest: &Pose| (rest.translation.z < -0.2).then(|| "too deep".to_owned());
            let limit = max_head_mass(&spec, &source, &deep).unwrap().unwrap();
            // k = 845.9 N/m, extended by 40 mm by the head and half of the wire.
            let expected_kg = 0.040 * 845.9 / 9.80665 - 0.5 * 0.0232;
            assert!((limit.mass_kg / expected_kg - 1.0).abs() < 1e-2, "{limit:?}, expected {expected_kg}");
            assert_eq!(limit.reason, "too deep");
        }
    }

    #[test]
    fn a_pull_too_strong_for_one_segment_is_an_error_that_names_the_sufficient_number() {
        let (mut spec, source) = load("hanging").unwrap();
        for part in &mut spec.parts {
            if let PartSpec::Block { mass_kg, .. } = part {
                *mass_kg *= 20.0;
            }
        }
        let mut with = |count: usize| {
            if let LinkageSpec::Spring { segments, .. } = &mut spec.linkage {
                *segments = count;
            }
            HeadModel::new(&spec, &source)
        };
        let error = with(1).unwrap_err().to_string();
        assert!(error.contains("too strong for a spring of 1 segment") && !error.contains("supports"), "{error}");
        let needed: usize = error.split("use ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        assert!(with(needed).is_ok() && with(needed - 1).is_err());
    }
}
