use super::{Drift, Errors, EvaluationError, Pairs, RelativeError, drift, relative_error, relative_error_over_path};
use crate::pairs::median_interval;
use zsim_base::geometry::{Trajectory, Vector};
use zsim_base::time::{Span, Stamp};

/// The errors of a trajectory: absolute, relative, and drift.
#[derive(Debug, Clone, PartialEq)]
pub struct TrajectoryErrors {
    /// Number of poses with a true pose.
    pub poses: usize,
    /// Time from the first of these poses to the last, s.
    pub duration_s: f64,
    /// Fraction of the truth's time that these poses cover; gaps ([`gap_s`]) are not covered.
    pub coverage: f64,
    /// Root mean square of the position error after alignment, m: the `rmse` of `evo_ape -a`.
    pub position_rmse_m: f64,
    /// Median of the position error, m.
    pub position_median_m: f64,
    /// Maximum of the position error, m.
    pub position_max_m: f64,
    /// Root mean square of the rotation error after the same alignment, rad; `None` without true attitudes.
    pub rotation_rmse_rad: Option<f64>,
    /// Maximum of the rotation error, rad; `None` without true attitudes.
    pub rotation_max_rad: Option<f64>,
    /// Relative error over 1 m of the true path; `None` if the path is too short, or without true attitudes, in whose axes
    /// motions are compared.
    pub per_metre: Option<RelativeError>,
    /// Relative error over 1 s.
    pub per_second: Option<RelativeError>,
    /// Relative error over 60 s.
    pub per_minute: Option<RelativeError>,
    /// Drift; `None` if the trajectory is too short.
    pub drift: Option<Drift>,
}

impl TrajectoryErrors {
    /// Computes the errors of `pairs`, and the absolute errors over time.
    ///
    /// The absolute errors are those after a rigid alignment by the positions. `truth` is the complete true trajectory,
    /// for the coverage.
    ///
    /// # Errors
    /// When the positions cannot be aligned, or an error is not finite.
    pub fn of(pairs: &Pairs, truth: &Trajectory) -> Result<(Self, Errors), EvaluationError> {
        let errors = Errors::after(pairs, &pairs.world_from_map()?);
        let (position_m, rotation_rad) = (sorted_norms(&errors.position_m), sorted_norms(&errors.rotation_rad));
        let has_attitudes = !pairs.have_positions_only();
        let per_time = |seconds: f64| relative_error(pairs, Span::from_seconds(seconds)).ok().filter(|_| has_attitudes);
        let largest = |sorted: &[f64]| sorted.last().copied().unwrap_or_default();
        let found = Self {
            poses: pairs.len(),
            duration_s: pairs.duration_s(),
            coverage: coverage(pairs, truth),
            position_rmse_m: errors.position_rmse_m(),
            position_median_m: median(&position_m),
            position_max_m: largest(&position_m),
            rotation_rmse_rad: has_attitudes.then(|| errors.rotation_rmse_rad()),
            rotation_max_rad: has_attitudes.then(|| largest(&rotation_rad)),
            per_metre: relative_error_over_path(pairs, 1.0).ok().filter(|_| has_attitudes),
            per_second: per_time(1.0),
            per_minute: per_time(60.0),
            drift: drift(pairs).ok(),
        };
        if !(found.position_rmse_m.is_finite() && found.rotation_rmse_rad.is_none_or(f64::is_finite)) {
            return Err(EvaluationError::NotFinite);
        }
        Ok((found, errors))
    }
}

fn sorted_norms(vectors: &[Vector]) -> Vec<f64> {
    let mut norms: Vec<f64> = vectors.iter().map(Vector::norm).collect();
    norms.sort_by(f64::total_cmp);
    norms
}

/// The median of sorted values, as numpy computes it; 0 without values.
fn median(sorted: &[f64]) -> f64 {
    match sorted.len() {
        0 => 0.0,
        count => 0.5 * (sorted[(count - 1) / 2] + sorted[count / 2]),
    }
}

/// Returns the interval between poses above which a trajectory has a gap, s.
///
/// It is 1 s, or two median intervals of the sparser of the two trajectories that are compared, whose stamps these are.
pub fn gap_s(stamps: &[Stamp]) -> f64 {
    median_interval(stamps).map_or(0.0, |interval| 2.0 * interval.seconds()).max(1.0)
}

fn coverage(pairs: &Pairs, truth: &Trajectory) -> f64 {
    let truth_s = truth.span().map_or(0.0, |(first, last)| last.seconds_since(first));
    let intervals = pairs.stamps().windows(2).map(|pair| pair[1].seconds_since(pair[0]));
    let gap_s = gap_s(truth.stamps());
    let covered_s: f64 = intervals.filter(|interval_s| *interval_s <= gap_s).sum();
    // The sum of the intervals can exceed the time by rounding.
    if truth_s > 0.0 { (covered_s / truth_s).min(1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::geometry::Pose;
    use zsim_base::time::Stamp;

    /// A pose at 100 Hz on a circle with a radius of 2 m, `error_m` too far out.
    fn on_circle(k: i64, error_m: f64) -> (Stamp, Pose) {
        let angle = 0.01 * k as f64;
        let radius_m = 2.0 + error_m;
        (Stamp::from_nanos(k * 10_000_000), Pose::translation(radius_m * angle.cos(), radius_m * angle.sin(), 0.0))
    }

    #[test]
    fn gaps_and_missing_ends_are_not_covered() {
        // The truth has 10 s. The estimate has 1 to 3 s, and 5 to 9 s: 6 s without the gap of 2 s.
        let truth = Trajectory::from_poses((0..=1000).map(|k| on_circle(k, 0.0))).unwrap();
        let with_gap = (100..=300).chain(500..=900).map(|k| on_circle(k, 0.0));
        let pairs = Pairs::associate(&Trajectory::from_poses(with_gap).unwrap(), &truth).unwrap();
        let (found, _) = TrajectoryErrors::of(&pairs, &truth).unwrap();
        assert_relative_eq!(found.coverage, 0.6, epsilon = 1e-9);
        assert_relative_eq!(found.duration_s, 8.0, epsilon = 1e-9);
        assert!(found.drift.is_none() && found.per_minute.is_none());
    }

    #[test]
    fn the_median_is_that_of_most_poses_and_the_maximum_that_of_one() {
        // Two full circles, so that the errors have no mean motion: 2 mm outwards for all but one pose, 30 mm for that
        // one. The alignment of 1257 poses moves by at most 30 mm / 1257.
        let truth = Trajectory::from_poses((0..1257).map(|k| on_circle(k, 0.0))).unwrap();
        let estimate = (0..1257).map(|k| on_circle(k, if k == 700 { 0.03 } else { 0.002 }));
        let pairs = Pairs::associate(&Trajectory::from_poses(estimate).unwrap(), &truth).unwrap();
        let (found, errors) = TrajectoryErrors::of(&pairs, &truth).unwrap();
        assert_relative_eq!(found.position_median_m, 0.002, epsilon = 5e-5);
        assert_relative_eq!(found.position_max_m, 0.03, epsilon = 1e-4);
        assert_eq!(errors.stamps.len(), 1257);
    }
}
