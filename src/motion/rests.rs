//! Rests in the middle of a way: the carrier slows down, stands still, and goes on.

use super::jet::Jet;
use super::smooth::{Steps, Way};
use crate::geometry::Vector;
use crate::spec::{Source, SpecError};

/// Half of the time in which a carrier comes to rest or sets off again, s.
const HALF_S: f64 = 0.75;
/// Most rests in a run.
const MOST_RESTS: usize = 10_000;

/// The time that has passed without the rests: where a carrier is on its way.
pub(super) struct Progress {
    /// Elapsed time on the first axis, s.
    elapsed: Way,
    moving: Steps,
}

impl Progress {
    /// The progress with rests that begin and last so long, s, in a run of `duration_s`; `None` without any.
    pub fn new(rests: &[(f64, f64)], source: &Source, duration_s: f64) -> Result<Option<Self>, SpecError> {
        if rests.is_empty() {
            return Ok(None);
        }
        check(rests).map_err(|message| SpecError::about(source, "rests", message))?;
        let before_s = -4.0 * HALF_S;
        let mut elapsed = Way::new(Vector::new(before_s, 0.0, 0.0), before_s, HALF_S);
        for (at_s, lasts_s) in rests {
            let moving_s = at_s - HALF_S - elapsed.end_s();
            elapsed.go(elapsed.end() + Vector::x() * moving_s, moving_s);
            elapsed.go(elapsed.end(), lasts_s + 2.0 * HALF_S);
        }
        let left_s = (duration_s - elapsed.end_s()).max(0.0) + 4.0 * HALF_S;
        elapsed.go(elapsed.end() + Vector::x() * left_s, left_s);
        let moving = elapsed.speed_share(1.0);
        Ok(Some(Self { elapsed, moving }))
    }

    /// The elapsed time at an instant, s.
    pub fn at(&self, t_s: f64) -> Jet {
        let [elapsed, ..] = self.elapsed.at(t_s);
        elapsed
    }

    /// The share of its speed with which the carrier moves, 0 at rest.
    pub fn moving(&self, t_s: f64) -> Jet {
        self.moving.at(t_s)
    }
}

/// Checks that rests follow each other with time to set off and to stop in between.
fn check(rests: &[(f64, f64)]) -> Result<(), String> {
    if rests.len() > MOST_RESTS {
        return Err(format!("{} rests; {MOST_RESTS} at most", rests.len()));
    }
    let mut free_s = 0.0;
    for (index, &(at_s, lasts_s)) in rests.iter().enumerate() {
        if !(at_s.is_finite() && lasts_s.is_finite() && lasts_s > 0.0) {
            return Err(format!("rest {index} (counted from 0) is at {at_s} s for {lasts_s} s"));
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
    fn time_stands_still_in_a_rest_and_is_behind_by_its_length_and_the_stopping() {
        let source = Source::in_memory("test", "");
        let progress = Progress::new(&[(20.0, 40.0)], &source, 100.0).unwrap().unwrap();
        assert!((progress.at(10.0).x - 10.0).abs() < 1e-12 && (progress.at(10.0).d - 1.0).abs() < 1e-12);
        // A linear slowdown in the mean: half of the 1.5 s before and behind a rest is lost.
        for t_s in [20.0, 33.0, 60.0] {
            let at = progress.at(t_s);
            assert!((at.x - (20.0 - HALF_S)).abs() < 1e-12 && at.d.abs() < 1e-12 && at.dd.abs() < 1e-9, "{at:?}");
            assert!(progress.moving(t_s).x.abs() < 1e-12);
        }
        assert!((progress.at(90.0).x - (50.0 - 2.0 * HALF_S)).abs() < 1e-12);
        assert!(Progress::new(&[(1.0, 5.0)], &source, 100.0).is_err(), "no time to stop");
        assert!(Progress::new(&[(10.0, f64::NAN)], &source, 100.0).is_err());
    }
}
