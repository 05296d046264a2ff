//! Where canopies stop a ray.

use crate::CanopyPart;

/// Cosine of incidence on a leaf, the mean over leaves without preferred direction, each weighted with the area that it shows
/// to the ray: the mean of cos^2 over that of cos.
pub(super) const LEAF_COS_INCIDENCE: f64 = 2.0 / 3.0;

/// Range at which canopies stop a ray, m, and the reflectance there; `None` if it passes.
///
/// `draw` is uniform in 0..1. The optical depth `tau(r)`, the integral of the extinction coefficient, at which the ray stops
/// has the distribution `1 - exp(-tau)` (Beer and Lambert), so it is `-ln(1 - draw)`. Coefficients of canopies that overlap
/// add up.
pub(super) fn stop(parts: &[CanopyPart], draw: f64) -> Option<(f64, f64)> {
    if parts.is_empty() {
        return None;
    }
    let mut left = -(-draw).ln_1p();
    let mut from_m = f64::NEG_INFINITY;
    loop {
        // The next side of a canopy, up to which the extinction coefficient is constant.
        let sides = parts.iter().flat_map(|part| [part.from_m, part.to_m]);
        let to_m = sides.filter(|side| *side > from_m).min_by(f64::total_cmp)?;
        let here = || parts.iter().filter(|part| part.from_m <= from_m && from_m < part.to_m);
        let per_m: f64 = here().map(|part| part.extinction_per_m).sum();
        if per_m > 0.0 && left < per_m * (to_m - from_m) {
            let reflected: f64 = here().map(|part| part.extinction_per_m * f64::from(part.reflectance)).sum();
            return Some((from_m + left / per_m, reflected / per_m));
        }
        if per_m > 0.0 {
            left -= per_m * (to_m - from_m);
        }
        from_m = to_m;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn part(from_m: f64, to_m: f64, extinction_per_m: f64, reflectance: f32) -> CanopyPart {
        CanopyPart { from_m, to_m, extinction_per_m, reflectance }
    }

    /// The draw for which a ray stops at optical depth `tau`.
    fn draw(tau: f64) -> f64 {
        1.0 - (-tau).exp()
    }

    #[test]
    fn a_ray_stops_where_the_optical_depth_reaches_the_drawn_one() {
        // 1/m from 2 to 5 m and 3/m from 4 to 6 m: tau is 2 at 4 m, 6 at 5 m and 9 at 6 m.
        let parts = [part(4.0, 6.0, 3.0, 0.8), part(2.0, 5.0, 1.0, 0.4)];
        for (tau, range_m, reflectance) in [(0.5, 2.5, 0.4), (3.0, 4.25, 0.7), (7.5, 5.5, 0.8)] {
            let (stopped_m, reflected) = stop(&parts, draw(tau)).unwrap();
            assert_relative_eq!(stopped_m, range_m, epsilon = 1e-9);
            assert_relative_eq!(reflected, reflectance, epsilon = 1e-6);
        }
        assert_eq!(stop(&parts, draw(9.1)), None);
        assert_eq!(stop(&[], 0.5), None);
    }
}
