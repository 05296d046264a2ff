use zsim_base::time::Stamp;

/// Error of an estimated clock offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClockError {
    /// RMS over all estimates, including the first ones, s.
    pub offset_rmse_s: f64,
    /// Estimated minus true offset at the end, s.
    pub offset_end_error_s: f64,
}

/// Computes the error of estimated offsets between the IMU and lidar clocks.
///
/// Both are over lidar time; the truth is interpolated linearly. `None` where the two do not overlap in time.
pub fn clock_error(estimate: &[(Stamp, f64)], truth: &[(Stamp, f64)]) -> Option<ClockError> {
    let errors = clock_errors(estimate, truth);
    let (_, last) = *errors.last()?;
    let mean_square = errors.iter().map(|(_, error)| error * error).sum::<f64>() / errors.len() as f64;
    Some(ClockError { offset_rmse_s: mean_square.sqrt(), offset_end_error_s: last })
}

/// Computes estimated minus true offset, s.
///
/// The stamps are those of the estimate that the truth covers.
pub fn clock_errors(estimate: &[(Stamp, f64)], truth: &[(Stamp, f64)]) -> Vec<(Stamp, f64)> {
    estimate.iter().filter_map(|(stamp, offset_s)| Some((*stamp, offset_s - offset_at(truth, *stamp)?))).collect()
}

/// Computes the absolute error of the offset `after_s` after the first estimate, s.
///
/// It is that of the last estimate until then. `None` if the estimate ends earlier, or the truth does not cover the time.
pub fn clock_error_after(estimate: &[(Stamp, f64)], truth: &[(Stamp, f64)], after_s: f64) -> Option<f64> {
    let (first, _) = estimate.first()?;
    let next = estimate.partition_point(|(stamp, _)| stamp.seconds_since(*first) <= after_s);
    let is_covered = estimate.last()?.0.seconds_since(*first) >= after_s;
    let (stamp, offset_s) = estimate[next.checked_sub(1).filter(|_| is_covered)?];
    Some((offset_s - offset_at(truth, stamp)?).abs())
}

/// The offset at `stamp`, interpolated linearly.
fn offset_at(offsets: &[(Stamp, f64)], stamp: Stamp) -> Option<f64> {
    let after = offsets.partition_point(|(at, _)| *at <= stamp);
    let (t0, y0) = offsets[after.checked_sub(1)?];
    match offsets.get(after) {
        Some((t1, y1)) => Some(y0 + (y1 - y0) * stamp.seconds_since(t0) / t1.seconds_since(t0)),
        None if t0 == stamp => Some(y0),
        None => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn rmse_includes_the_convergence_and_the_end_error_does_not() {
        // Truth 3 ms + 1 ms/min, given at 0 and 60 s. Estimates: 0 at the start (3 ms off), 3.6 at 30 s (+0.1), 3.9 at
        // 60 s.
        let at = |s: i64| Stamp::from_nanos(s * 1_000_000_000);
        let truth = [(at(0), 3e-3), (at(60), 4e-3)];
        let estimate = [(at(0), 0.0), (at(30), 3.6e-3), (at(60), 3.9e-3), (at(61), 9.0)];
        let found = clock_error(&estimate, &truth).unwrap();
        assert_relative_eq!(found.offset_end_error_s, -1e-4, epsilon = 1e-12);
        assert_relative_eq!(found.offset_rmse_s, ((9.0_f64 + 0.01 + 0.01) / 3.0).sqrt() * 1e-3, epsilon = 1e-12);
        assert_eq!(clock_error(&estimate, &[]), None);
    }

    #[test]
    fn the_error_after_a_time_is_that_of_the_last_estimate_until_then() {
        // Truth 3 ms + 1 ms/min: 3.5 ms at 30 s, 3.75 ms at 45 s.
        let at = |s: i64| Stamp::from_nanos(s * 1_000_000_000);
        let truth = [(at(0), 3e-3), (at(60), 4e-3)];
        let estimate = [(at(0), 0.0), (at(30), 3.6e-3), (at(45), 3.7e-3)];
        for (after_s, error_s) in [(0.0, 3e-3), (30.0, 1e-4), (44.0, 1e-4), (45.0, 5e-5)] {
            assert_relative_eq!(clock_error_after(&estimate, &truth, after_s).unwrap(), error_s, epsilon = 1e-12);
        }
        assert_eq!(clock_error_after(&estimate, &truth, 46.0), None);
        assert_eq!(clock_error_after(&[], &truth, 0.0), None);
    }
}
