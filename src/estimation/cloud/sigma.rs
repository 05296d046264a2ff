//! How far a point of the cloud may be from where it truly is.

use crate::geometry::{PoseCovariance, Vector, skew};

/// Standard deviation of a point's place in the map, m: the root of the mean square of its distance from its true
/// place.
///
/// Its range errs by `range_sigma_m` along its beam. The head, from which the point is `arm` away (m, in the map), errs
/// by `covariance`, position first: `p = t + arm` moves by `dt + theta x arm`, so that
///
/// ```text
/// sigma^2 = sigma_r^2 + tr(J C J^T),   J = [I, -[arm]_x]
/// ```
///
/// The incidence is not known of a single point, and does not matter to its distance from its true place: it tells how
/// much of that lies along the surface's normal, a share of `cos` at most.
pub fn point_sigma_m(range_sigma_m: f64, covariance: &PoseCovariance, arm: &Vector) -> f64 {
    let by_turn = -skew(arm);
    let turn = covariance.fixed_view::<3, 3>(3, 3);
    let cross = covariance.fixed_view::<3, 3>(0, 3);
    let shift = covariance.fixed_view::<3, 3>(0, 0).trace();
    let moved = shift + 2.0 * (cross * by_turn.transpose()).trace() + (by_turn * turn * by_turn.transpose()).trace();
    (range_sigma_m * range_sigma_m + moved.max(0.0)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix6, Vector6};
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn it_is_the_root_mean_square_of_the_distances_drawn_from_the_same_errors() {
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
        let drawn = (sum / f64::from(count)).sqrt();
        let told = point_sigma_m(range_sigma_m, &covariance, &arm);
        assert!((told / drawn - 1.0).abs() < 0.01, "{told} told, {drawn} drawn");
    }
}
