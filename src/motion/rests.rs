//! Rests along a route: the walker slows down, stops, and sets off after the rest.

use super::jet::Jet;
use super::smooth::{SmoothPath, SmoothSteps};
use zsim_base::geometry::Vector;
use zsim_base::spec::{Source, SpecError};

/// Half of the time in which the walker stops or sets off, s: a stop from 1 m/s in 1.5 s.
const HALF_S: f64 = 0.75;
/// Maximum number of rests in a run: a guard against a malformed spec.
const MAX_RESTS: usize = 10_000;

/// Time spent moving: the clock that drives the motion along the route, and that pauses in each rest.
pub(super) struct MovingTime {
    /// Moving time on the first axis, s.
    elapsed: SmoothPath,
    speed_fraction: SmoothSteps,
}

impl MovingTime {
    /// The moving time of a run of `duration_s` with `rests` (start, duration; s). `None` without rests.
    pub fn new(rests: &[(f64, f64)], source: &Source, duration_s: f64) -> Result<Option<Self>, SpecError> {
        if rests.is_empty() {
            return Ok(None);
        }
        check(rests).map_err(|message| SpecError::about(source, "rests", message))?;
        let before_s = -4.0 * HALF_S;
        let mut elapsed = SmoothPath::new(Vector::new(before_s, 0.0, 0.0), before_s, HALF_S);
        for (at_s, lasts_s) in rests {
            let moving_s = at_s - HALF_S - elapsed.end_s();
            elapsed.move_to(elapsed.end() + Vector::x() * moving_s, moving_s);
            elapsed.move_to(elapsed.end(), lasts_s + 2.0 * HALF_S);
        }
        let left_s = (duration_s - elapsed.end_s()).max(0.0) + 4.0 * HALF_S;
        elapsed.move_to(elapsed.end() + Vector::x() * left_s, left_s);
        let speed_fraction = elapsed.speed_fraction(1.0);
        Ok(Some(Self { elapsed, speed_fraction }))
    }

    /// The moving time at `t_s`, s.
    pub fn at(&self, t_s: f64) -> Jet {
        let [elapsed, ..] = self.elapsed.at(t_s);
        elapsed
    }

    /// Fraction of the full speed at `t_s`: 0 at rest.
    pub fn speed_fraction(&self, t_s: f64) -> Jet {
        self.speed_fraction.at(t_s)
    }
}

/// Checks that rests are in order, with time to set off and to stop in between.
fn check(rests: &[(f64, f64)]) -> Result<(), String> {
    if rests.len() > MAX_RESTS {
        return Err(format!("{} rests; {MAX_RESTS} at most", rests.len()));
    }
    let mut free_s = 0.0;
    for (index, &(at_s, lasts_s)) in rests.iter().enumerate() {
        if !(at_s.is_finite() && lasts_s.is_finite() && lasts_s > 0.0) {
            return Err(format!(
                "rest {index} (counted from 0) starts at {at_s} s and lasts {lasts_s} s; it must last longer than 0 s"
            ));
        }
        if at_s < free_s + 4.0 * HALF_S {
            let least_s = free_s + 4.0 * HALF_S;
            return Err(format!("rest {index} (counted from 0) is at {at_s} s; {least_s} s is the earliest possible"));
        }
        free_s = at_s + lasts_s;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moving_time_pauses_in_a_rest_and_loses_the_time_to_stop_and_start() {
        let source = Source::in_memory("test", "");
        let moving_time = MovingTime::new(&[(20.0, 40.0)], &source, 100.0).unwrap().unwrap();
        assert!((moving_time.at(10.0).x - 10.0).abs() < 1e-12 && (moving_time.at(10.0).d - 1.0).abs() < 1e-12);
        // The speed changes linearly on average, so each stop and each start loses half of 1.5 s.
        for t_s in [20.0, 33.0, 60.0] {
            let at = moving_time.at(t_s);
            assert!((at.x - (20.0 - HALF_S)).abs() < 1e-12 && at.d.abs() < 1e-12 && at.dd.abs() < 1e-9, "{at:?}");
            assert!(moving_time.speed_fraction(t_s).x.abs() < 1e-12);
        }
        assert!((moving_time.at(90.0).x - (50.0 - 2.0 * HALF_S)).abs() < 1e-12);
        assert!(MovingTime::new(&[(1.0, 5.0)], &source, 100.0).is_err(), "no time to stop");
        assert!(MovingTime::new(&[(10.0, f64::NAN)], &source, 100.0).is_err());
    }
}
