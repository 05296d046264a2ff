use super::{Errors, EvaluationError, Pairs};
use zsim_estimation::ALIGNMENT_S;

/// Duration of the interval at the end over which the error is averaged, s.
pub const TAIL_S: f64 = 5.0;

/// Weight of a rotation in the alignment: equivalent shift per angle, m; small compared with a path that is not
/// straight.
const TURN_LEVER_M: f64 = 0.3;

const SECONDS_PER_MINUTE: f64 = 60.0;

/// Drift of an estimate relative to the truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift {
    /// Growth of the distance to the true position, m/min.
    pub position_m_per_min: f64,
    /// Growth of the error about the vertical, absolute, rad/min; `None` without true attitudes.
    pub yaw_rad_per_min: Option<f64>,
    /// Distance to the true position at the end, with the start aligned, m.
    pub end_error_m: f64,
}

/// Computes the drift of an estimate that is aligned over the first 20 s only.
///
/// The estimate is aligned with the truth over the first [`ALIGNMENT_S`] seconds, all six degrees of freedom: by
/// positions, and by attitudes where positions do not determine the rotation (twenty seconds of a straight path);
/// without true attitudes by positions only. The drift is the mean distance over the last [`TAIL_S`] seconds, divided
/// by the minutes from the middle of the first interval (where a constant drift is aligned to zero) to the middle of
/// the last; for the yaw, the mean error over the last interval minus that over the first. So a constant drift that a
/// test adds is returned unchanged.
///
/// # Errors
/// When the two intervals overlap, or the first has too little motion for an alignment.
pub fn drift(pairs: &Pairs) -> Result<Drift, EvaluationError> {
    let (needed_s, found_s) = (ALIGNMENT_S + TAIL_S, pairs.duration_s());
    if found_s < needed_s {
        return Err(EvaluationError::TooShort { measure: "drift", needed_s, found_s });
    }
    let (start, tail) = (pairs.first_seconds(ALIGNMENT_S), pairs.last_seconds(TAIL_S));
    let world_from_map = match start.have_positions_only() {
        true => start.world_from_map()?,
        false => super::align_poses(start.truth(), start.estimate(), TURN_LEVER_M)?,
    };
    let (at_start, at_end) = (Errors::after(&start, &world_from_map), Errors::after(&tail, &world_from_map));
    let origin = pairs.stamps()[0];
    let yaw_rad = (!start.have_positions_only()).then(|| (at_end.mean_yaw_rad() - at_start.mean_yaw_rad()).abs());
    let minutes = (tail.mean_time_s(origin) - start.mean_time_s(origin)) / SECONDS_PER_MINUTE;
    Ok(Drift {
        position_m_per_min: at_end.mean_position_m() / minutes,
        yaw_rad_per_min: yaw_rad.map(|yaw_rad| yaw_rad / minutes),
        end_error_m: at_end.end_position_m().unwrap_or_default(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::geometry::{Pose, Rotation, Trajectory, Vector};
    use zsim_base::time::Stamp;

    /// Two minutes round a room at 50 Hz, distorted by `error` as a function of the time in minutes.
    fn walk(error: impl Fn(f64) -> Pose) -> Trajectory {
        let pose = |k: i64| {
            let t = k as f64 * 0.02;
            let at = Vector::new(3.0 * (0.5 * t).cos(), 2.0 * (0.7 * t).sin(), 0.2 * (2.0 * t).sin());
            (Stamp::from_nanos(k * 20_000_000), error(t / 60.0) * Pose::translation(at.x, at.y, at.z))
        };
        Trajectory::from_poses((0..=6000).map(pose)).unwrap()
    }

    fn drift_of(error: impl Fn(f64) -> Pose) -> Drift {
        drift(&Pairs::associate(&walk(error), &walk(|_| Pose::identity())).unwrap()).unwrap()
    }

    #[test]
    fn a_constant_drift_is_recovered() {
        // 6 cm/min upwards. The alignment tilts a little to follow the drift within its 20 s (2 cm over a room of 6 m,
        // of which the part that correlates with the path), so to a few per cent.
        let found = drift_of(|minutes| Pose::translation(0.0, 0.0, 0.06 * minutes));
        assert_relative_eq!(found.position_m_per_min, 0.06, max_relative = 0.05);
        assert!(found.yaw_rad_per_min.unwrap() < 1e-4);
        // At the end 110 s have passed since the middle of the alignment.
        assert_relative_eq!(found.end_error_m, 0.06 * 110.0 / 60.0, max_relative = 0.05);
    }

    #[test]
    fn a_yaw_error_without_position_error_is_pure_yaw_drift() {
        let yawed = walk(|_| Pose::identity());
        let turned = yawed.iter().map(|(stamp, pose)| {
            let yaw = 0.01 * stamp.nanos() as f64 * 1e-9 / 60.0;
            (stamp, Pose::from_parts(pose.translation, Rotation::from_scaled_axis(Vector::z() * yaw) * pose.rotation))
        });
        let pairs = Pairs::associate(&Trajectory::from_poses(turned).unwrap(), &yawed).unwrap();
        let found = drift(&pairs).unwrap();
        assert_relative_eq!(found.yaw_rad_per_min.unwrap(), 0.01, max_relative = 1e-6);
        // The head's turn over the first 20 s, 1/600 rad from its mean at most, turns the alignment by a hundredth of
        // that.
        assert!(found.position_m_per_min < 1e-4, "{found:?}");
    }

    #[test]
    fn a_run_of_twenty_seconds_is_too_short_for_a_drift() {
        let short = Trajectory::from_poses(walk(|_| Pose::identity()).iter().take(1000).map(|(s, p)| (s, *p))).unwrap();
        let error = drift(&Pairs::associate(&short, &short).unwrap()).unwrap_err();
        assert_eq!(error, EvaluationError::TooShort { measure: "drift", needed_s: 25.0, found_s: 19.98 });
    }
}
