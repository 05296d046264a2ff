//! Stops: intervals in which the hand grips the head while the walk continues.

use super::smooth::SmoothSteps;
use rand::RngExt;
use serde::{Deserialize, Serialize};
use zsim_base::random::Stream;
use zsim_base::spec::{Source, SpecError};

/// When the hand grips the head. The rest of the motion continues.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum StopsSpec {
    /// At given times: start and duration of each stop, s, grasp and release included. An empty list: never.
    At(Vec<(f64, f64)>),
    /// At random times.
    Random {
        /// Mean time from the end of a stop to the start of the next, s; uniformly distributed from 0.5 to 1.5 times this
        /// value.
        #[serde(with = "zsim_base::spec::checked::Positive")]
        every_s: f64,
        /// Shortest stop, s.
        #[serde(with = "zsim_base::spec::checked::Positive")]
        shortest_s: f64,
        /// Longest stop, s.
        #[serde(with = "zsim_base::spec::checked::Positive")]
        longest_s: f64,
    },
}

impl Default for StopsSpec {
    fn default() -> Self {
        Self::At(Vec::new())
    }
}

impl StopsSpec {
    /// Grip over time, 0 to 1: in each stop it rises for `grip_s`, stays at 1, and falls for `grip_s`.
    ///
    /// Random stops are between `from_s` and `until_s`.
    pub(super) fn grip(
        &self,
        source: &Source,
        grip_s: f64,
        from_s: f64,
        until_s: f64,
        stream: &mut Stream,
    ) -> Result<SmoothSteps, SpecError> {
        let stops = match self {
            StopsSpec::At(stops) => stops.clone(),
            StopsSpec::Random { every_s, shortest_s, longest_s } => {
                if shortest_s > longest_s {
                    let message =
                        format!("the shortest stop lasts {shortest_s} s, more than the longest, {longest_s} s");
                    return Err(SpecError::about(source, "shortest_s", message));
                }
                let mut draw = |low: f64, high: f64| low + (high - low) * stream.random::<f64>();
                let mut stops = Vec::new();
                let mut next_s = from_s + every_s * draw(0.5, 1.5);
                while next_s < until_s && stops.len() <= MAX_STOPS {
                    let length_s = draw(*shortest_s, *longest_s);
                    stops.push((next_s, length_s));
                    next_s += length_s + every_s * draw(0.5, 1.5);
                }
                stops
            }
        };
        check(&stops, grip_s).map_err(|message| SpecError::about(source, "stops", message))?;
        let mut grip = SmoothSteps::from_level(0.0);
        for (at_s, length_s) in stops {
            grip.push(at_s + grip_s / 2.0, grip_s / 2.0, 1.0);
            grip.push(at_s + length_s - grip_s / 2.0, grip_s / 2.0, -1.0);
        }
        Ok(grip)
    }
}

/// Maximum number of stops in a run: a guard against a malformed spec.
const MAX_STOPS: usize = 100_000;

/// Checks that stops do not overlap, and that each is long enough to grasp and release.
fn check(stops: &[(f64, f64)], grip_s: f64) -> Result<(), String> {
    if stops.len() > MAX_STOPS {
        return Err(format!("more than {MAX_STOPS} stops in one run; increase every_s or shorten the run"));
    }
    let mut free_s = 0.0;
    for (index, &(at_s, length_s)) in stops.iter().enumerate() {
        if !(at_s.is_finite() && length_s.is_finite()) {
            return Err(format!(
                "stop {index} (counted from 0) starts at {at_s} s and lasts {length_s} s, which is not finite"
            ));
        }
        if length_s < 2.0 * grip_s {
            return Err(format!("a stop of {length_s} s is too short to grasp and release, {grip_s} s each"));
        }
        if at_s < free_s {
            return Err(format!(
                "the stop at {at_s} s begins before {free_s} s, the end of the previous stop (or the start of the run)"
            ));
        }
        free_s = at_s + length_s;
    }
    Ok(())
}
