//! Steps of a sensor's clock in the middle of a recording.

use serde::Serialize;
use std::collections::BTreeSet;
use zsim_base::time::{Span, Stamp};

/// A clock that was set while the sensor ran, as log times show it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ClockStep {
    /// Topic of the sensor.
    pub topic: String,
    /// Stamp of the first message after the step, as it is read: without the step.
    pub at: Stamp,
    /// Change of the clock; later stamps are read as this much earlier.
    pub by: Span,
}

/// Steps of two sensors that differ by less are of one clock, s.
const SAME_STEP_S: f64 = 0.05;

impl ClockStep {
    /// Describes the largest of some steps in a sentence; `None` without steps.
    pub fn sentence(steps: &[Self]) -> Option<String> {
        let largest = Self::largest(steps)?;
        let is_same = |step: &&Self| (step.by - largest.by).seconds().abs() < SAME_STEP_S;
        let topics: BTreeSet<&str> = steps.iter().filter(is_same).map(|step| step.topic.as_str()).collect();
        let (topics, by_s) = (topics.into_iter().collect::<Vec<_>>().join(" and "), largest.by.seconds());
        Some(format!("the clock of {topics} steps by {by_s:+.3} s, by log times; later stamps are read without it"))
    }

    /// The largest of some steps, of either sign.
    pub fn largest(steps: &[Self]) -> Option<&Self> {
        steps.iter().max_by_key(|step| step.by.nanos().unsigned_abs())
    }
}
