//! Position uncertainty of a point of the cloud.

use zsim_base::geometry::{PoseCovariance, Vector, skew};

/// Computes the root mean square position error of a point in the map, m.
///
/// `range_sigma_m` is the standard deviation along the beam; `covariance` is that of the head's pose, position first; `arm`
/// is the vector from the head to the point in map axes, m. The point `p = t + arm` moves by `dt + theta x arm`, so
///
/// ```text
/// sigma^2 = sigma_r^2 + tr(J C J^T),   J = [I, -[arm]_x]
/// ```
///
/// The angle of incidence is unknown for a single point and does not affect this error; it only determines the component
/// along the surface normal.
pub fn point_sigma_m(range_sigma_m: f64, covariance: &PoseCovariance, arm: &Vector) -> f64 {
    let by_rotation = -skew(arm);
    let turn = covariance.fixed_view::<3, 3>(3, 3);
    let cross = covariance.fixed_view::<3, 3>(0, 3);
    let shift = covariance.fixed_view::<3, 3>(0, 0).trace();
    let moved = shift
        + 2.0 * (cross * by_rotation.transpose()).trace()
        + (by_rotation * turn * by_rotation.transpose()).trace();
    (range_sigma_m * range_sigma_m + moved.max(0.0)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix6, Vector6};
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn sigma_equals_the_rms_distance_of_sampled_errors() {
        let root = Matrix6::from_fn(|r, c| 0.01 * ((r * 5 + c * 3) as f64 * 0.61).sin());
        let covariance = root * root.transpose();
        let (arm, range_sigma_m) = (Vector::new(3.0, -2.0, 0.5), 0.012);
        let along = arm.normalize();
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
        let count = 200_000;
        let mut sum = 0.0;
        for _ in 0..count {
            let e = root * Vector6::from_fn(|_, _| draw());
            let (shift, turn) = (e.fixed_rows::<3>(0).into_owned(), e.fixed_rows::<3>(3).into_owned());
            sum += (shift + turn.cross(&arm) + along * (range_sigma_m * draw())).norm_squared();
        }
        let sampled = (sum / f64::from(count)).sqrt();
        let predicted = point_sigma_m(range_sigma_m, &covariance, &arm);
        assert!((predicted / sampled - 1.0).abs() < 0.01, "predicted {predicted}, sampled {sampled}");
    }
}
