use super::Pairs;
use zsim_base::geometry::{Matrix, Pose, PoseCovariance, Vector};
use zsim_base::time::{Span, Stamp};

/// Time between samples of the errors; errors within a shorter time are highly correlated.
const SAMPLE_PERIOD: Span = Span::from_nanos(1_000_000_000);

/// Whether the errors agree with the covariances of the estimator.
///
/// The normalised estimation error squared `e^T P^-1 e` (Bar-Shalom, Li and Kirubarajan, Estimation with Applications
/// to Tracking and Navigation, 2001, section 5.4) is chi-squared with three degrees of freedom, 3 on average, where the
/// covariance P is correct; a larger value means that the estimator is overconfident. Errors are relative to the first
/// pose of both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Consistency {
    /// Mean over the run, position.
    pub position_nees: f64,
    /// Mean over the run, attitude.
    pub attitude_nees: f64,
    /// The same at the end.
    pub end: [f64; 2],
}

/// Compares the errors of `pairs` with the covariances that the estimator reported.
///
/// The covariances are at some of the stamps, in order of time. `None` where no covariance is usable.
pub fn consistency(pairs: &Pairs, covariances: &[(Stamp, PoseCovariance)]) -> Option<Consistency> {
    let map_from_world = pairs.estimate().first()? * pairs.truth().first()?.inverse();
    let mut next = *pairs.stamps().first()?;
    let mut samples: Vec<[f64; 2]> = Vec::new();
    let mut rest = covariances.iter().peekable();
    for ((stamp, estimate), truth) in pairs.stamps().iter().zip(pairs.estimate()).zip(pairs.truth()) {
        while rest.next_if(|(at, _)| at < stamp).is_some() {}
        let Some((_, covariance)) = rest.peek().filter(|(at, _)| at == stamp && *stamp >= next) else { continue };
        if let Some(nees) = nees(estimate, &(map_from_world * truth), covariance) {
            samples.push(nees);
            next = *stamp + SAMPLE_PERIOD;
        }
    }
    let mean = |of: usize| samples.iter().map(|nees| nees[of]).sum::<f64>() / samples.len() as f64;
    Some(Consistency { end: *samples.last()?, position_nees: mean(0), attitude_nees: mean(1) })
}

/// Normalised errors squared of position and attitude; `None` if a covariance is not positive definite.
fn nees(estimate: &Pose, truth: &Pose, covariance: &PoseCovariance) -> Option<[f64; 2]> {
    let shift = estimate.translation.vector - truth.translation.vector;
    let turn = (estimate.rotation * truth.rotation.inverse()).scaled_axis();
    let of = |error: Vector, at: usize| {
        let block: Matrix = covariance.fixed_view::<3, 3>(at, at).into_owned();
        Some(error.dot(&block.cholesky()?.solve(&error)))
    };
    Some([of(shift, 0)?, of(turn, 3)?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::geometry::{Rotation, Trajectory};

    #[test]
    fn an_error_of_one_standard_deviation_on_each_axis_has_a_nees_of_three() {
        let stamp = |k: i64| Stamp::from_nanos(k * 1_000_000_000);
        let truth = Trajectory::from_poses((0..5).map(|k| (stamp(k), Pose::translation(k as f64, 0.0, 0.0)))).unwrap();
        // From the second pose on it is 2, 3, 4 cm off, and turned by 1, 2, 2 mrad.
        let off = Pose::from_parts(
            Vector::new(0.02, 0.03, 0.04).into(),
            Rotation::from_scaled_axis(Vector::new(1e-3, 2e-3, 2e-3)),
        );
        let moved = |k: i64| {
            if k == 0 {
                Pose::identity()
            } else {
                Pose::from_parts((Vector::x() * k as f64 + off.translation.vector).into(), off.rotation)
            }
        };
        let estimate = Trajectory::from_poses((0..5).map(|k| (stamp(k), moved(k)))).unwrap();
        let pairs = Pairs::associate(&estimate, &truth).unwrap();
        let sigmas = [0.02, 0.03, 0.04, 1e-3, 2e-3, 2e-3];
        let covariance = PoseCovariance::from_diagonal(&sigmas.map(|s: f64| s * s).into());
        let covariances: Vec<_> = (1..5).map(|k| (stamp(k), covariance)).collect();
        let found = consistency(&pairs, &covariances).unwrap();
        assert_relative_eq!(found.position_nees, 3.0, epsilon = 1e-9);
        assert_relative_eq!(found.attitude_nees, 3.0, epsilon = 1e-9);
        assert_eq!(consistency(&pairs, &[(stamp(2), PoseCovariance::zeros())]), None);
    }
}
