use super::{EvaluationError, Pairs};
use zsim_base::geometry::{Pose, Vector};
use zsim_base::time::Span;

/// Error of the motion within a fixed time or length of the path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RelativeError {
    /// Root mean square of the error of the position reached, m.
    pub position_rmse_m: f64,
    /// Root mean square of the rotation error, rad.
    pub rotation_rmse_rad: f64,
}

/// Tolerance of the distance between the two poses of a pair, as a fraction of the distance: the default of `evo_rpe`.
const TOLERANCE: f64 = 0.1;

/// Computes the relative pose error over `span`.
///
/// A pair is a pose and the first one that is at least `span` later. The error of a pair is
/// `(T_i^-1 T_j)^-1 (S_i^-1 S_j)`, `T` true and `S` estimated (Sturm et al. 2012, eq. 1). A pair over a gap of the
/// trajectory, longer than `span` by more than a tenth, does not count.
///
/// # Errors
/// When no two pairs are `span` apart in time.
pub fn relative_error(pairs: &Pairs, span: Span) -> Result<RelativeError, EvaluationError> {
    let stamps = pairs.stamps();
    let limit = span + Span::from_seconds(TOLERANCE * span.seconds());
    let mut later = 0;
    let indices = stamps.iter().enumerate().filter_map(|(now, stamp)| {
        later += stamps[later..].partition_point(|other| *other < *stamp + span);
        stamps.get(later).filter(|end| **end <= *stamp + limit).map(|_| (now, later))
    });
    root_mean_square(pairs, indices).ok_or(EvaluationError::TooShort {
        measure: "the relative error",
        needed_s: span.seconds(),
        found_s: pairs.duration_s(),
    })
}

/// Computes the relative pose error over a path of `length_m`, m.
///
/// A pair is a pose and the one that is nearest to that much further along the true path. The selection of pairs is
/// that of `evo_rpe --all_pairs --pairs_from_reference -u m`, the error of a pair that of [`relative_error`]. The path
/// includes all motion of the head, also its swing.
///
/// # Errors
/// When no two pairs are `length_m` apart, within a tenth.
pub fn relative_error_over_path(pairs: &Pairs, length_m: f64) -> Result<RelativeError, EvaluationError> {
    let path_m = path_lengths_m(pairs.truth());
    let indices = path_m.iter().enumerate().filter_map(|(now, start_m)| {
        let target_m = start_m + length_m;
        let after = path_m.partition_point(|at| *at < target_m);
        let before = path_m.partition_point(|at| *at < path_m[after - 1]);
        let distance_m = |index: usize| path_m.get(index).map_or(f64::INFINITY, |at| (at - target_m).abs());
        let nearest = if distance_m(after) < distance_m(before) { after } else { before };
        (nearest > now && distance_m(nearest) <= TOLERANCE * length_m).then_some((now, nearest))
    });
    let found_m = path_m.last().copied().unwrap_or_default();
    root_mean_square(pairs, indices).ok_or(EvaluationError::PathTooShort { needed_m: length_m, found_m })
}

/// Length of the path up to each pose, m.
fn path_lengths_m(poses: &[Pose]) -> Vec<f64> {
    let mut length_m = 0.0;
    let steps = poses.windows(2).map(|pair| (pair[1].translation.vector - pair[0].translation.vector).norm());
    let ends = steps.map(|step_m| {
        length_m += step_m;
        length_m
    });
    let start = poses.first().map(|_| 0.0);
    start.into_iter().chain(ends).collect()
}

/// Root mean square of the errors of the motion between the poses of these indices; `None` without any.
fn root_mean_square(pairs: &Pairs, indices: impl Iterator<Item = (usize, usize)>) -> Option<RelativeError> {
    let (estimate, truth) = (pairs.estimate(), pairs.truth());
    let (mut position, mut rotation, mut count) = (0.0, 0.0, 0_usize);
    for (now, later) in indices {
        let true_motion = truth[now].inverse() * truth[later];
        let error = true_motion.inverse() * (estimate[now].inverse() * estimate[later]);
        position += Vector::norm_squared(&error.translation.vector);
        rotation += error.rotation.angle().powi(2);
        count += 1;
    }
    let root = |sum: f64| (sum / count as f64).sqrt();
    (count > 0).then(|| RelativeError { position_rmse_m: root(position), rotation_rmse_rad: root(rotation) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::geometry::Trajectory;
    use zsim_base::time::Stamp;

    #[test]
    fn a_scale_error_is_proportional_to_the_distance() {
        // 1 m/s along x, overestimated by 1 %: within 2 s the error is 2 cm, for any start time.
        let line = |speed: f64| {
            let pose =
                |k: i64| (Stamp::from_nanos(k * 10_000_000), Pose::translation(speed * 0.01 * k as f64, 0.0, 0.0));
            Trajectory::from_poses((0..1000).map(pose)).unwrap()
        };
        let pairs = Pairs::associate(&line(1.01), &line(1.0)).unwrap();
        let found = relative_error(&pairs, Span::from_seconds(2.0)).unwrap();
        assert_relative_eq!(found.position_rmse_m, 0.02, epsilon = 1e-9);
        assert_relative_eq!(found.rotation_rmse_rad, 0.0);
        assert!(relative_error(&pairs, Span::from_seconds(60.0)).is_err());
    }

    #[test]
    fn an_error_per_metre_does_not_depend_on_the_speed() {
        // Along x with a speed that varies between 0.5 m/s and 1.5 m/s, overestimated by 1 %: 1 cm per metre. Steps are
        // at most 15 mm, so that the nearest pose is within 7.5 mm, and the error within 0.075 mm.
        let line = |scale: f64| {
            let x = |t: f64| scale * (t + 0.5 * (1.0 - t.cos()));
            let pose = |k: i64| (Stamp::from_nanos(k * 10_000_000), Pose::translation(x(0.01 * k as f64), 0.0, 0.0));
            Trajectory::from_poses((0..1000).map(pose)).unwrap()
        };
        let pairs = Pairs::associate(&line(1.01), &line(1.0)).unwrap();
        let found = relative_error_over_path(&pairs, 1.0).unwrap();
        assert_relative_eq!(found.position_rmse_m, 0.01, epsilon = 0.075e-3);
        let error = relative_error_over_path(&pairs, 100.0).unwrap_err().to_string();
        assert!(error.contains("100 m of path") && error.contains("10.9"), "{error}");
    }

    #[test]
    fn pairs_over_a_gap_do_not_count() {
        // At rest, estimated with a jump of 1 m during a gap of 5 s, which no pair of 1 s covers.
        let pose = |k: i64, x: f64| (Stamp::from_nanos(k * 10_000_000), Pose::translation(x, 0.0, 0.0));
        let estimate = (0..300).map(|k| pose(k, 0.0)).chain((800..1100).map(|k| pose(k, 1.0)));
        let truth = (0..1100).map(|k| pose(k, 0.0));
        let [estimate, truth] = [Trajectory::from_poses(estimate), Trajectory::from_poses(truth)].map(Result::unwrap);
        let found = relative_error(&Pairs::associate(&estimate, &truth).unwrap(), Span::from_seconds(1.0)).unwrap();
        assert_relative_eq!(found.position_rmse_m, 0.0);
    }
}
