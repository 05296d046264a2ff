//! How heavy a head may be.

use super::body::Body;
use super::error::DynamicsError;
use super::site::Mount;
use super::spec::HeadSpec;
use crate::spec::Source;

/// The most that is tried, in parts of the head's mass.
const MOST: f64 = 1024.0;

/// The heaviest head of the shape of `spec`'s that rests in its linkage, kg, to a millionth; `None` where nothing
/// falls: a rigid head, or one that hangs.
///
/// # Errors
/// When the spec's numbers are no head's or no spring's.
pub fn heaviest_kg(spec: &HeadSpec, source: &Source) -> Result<Option<f64>, DynamicsError> {
    let body = Body::of(spec, source)?;
    let Mount::Gives(site) = Mount::of(&spec.linkage, &body, source)? else { return Ok(None) };
    let (mut stands, mut falls) = (0.0, 1.0);
    while site.at_rest(falls).is_ok() {
        (stands, falls) = (falls, 2.0 * falls);
        if falls > MOST {
            return Ok(None);
        }
    }
    while falls - stands > 1e-6 * falls && falls > 1e-9 {
        let middle = 0.5 * (stands + falls);
        if site.at_rest(middle).is_ok() { stands = middle } else { falls = middle }
    }
    Ok(Some(stands * body.mass_kg))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::{HeadModel, PartSpec, load};

    /// The handheld head, every part of it `share` times as heavy.
    fn scaled(share: f64) -> (HeadSpec, Source) {
        let (mut spec, source) = load("handheld").unwrap();
        for part in &mut spec.parts {
            if let PartSpec::Block { mass_kg, .. } = part {
                *mass_kg *= share;
            }
        }
        (spec, source)
    }

    #[test]
    fn a_head_stands_up_to_its_heaviest_and_falls_beyond() {
        let (spec, source) = scaled(1.0);
        let share = heaviest_kg(&spec, &source).unwrap().unwrap() / 0.35;
        assert!((1.0..5.0).contains(&share), "{share}");
        let (lighter, heavier) = (scaled(share * 0.999), scaled(share * 1.001));
        assert!(HeadModel::attempt(&lighter.0, &lighter.1).is_ok());
        assert!(HeadModel::attempt(&heavier.0, &heavier.1).is_err());
        // The heaviest head is the same whichever head of that shape is asked about, one that falls too.
        let of_heavier = heaviest_kg(&heavier.0, &heavier.1).unwrap().unwrap();
        assert!((of_heavier / (0.35 * share) - 1.0).abs() < 1e-4);
    }
}
