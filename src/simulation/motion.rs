//! How head and base move, window by window.

use super::SimulationError;
use crate::dynamics::{DynamicsError, HeadState};
use crate::geometry::Kinematics;
use std::collections::VecDeque;

/// Time between the instants of a [`HeadMotion`], s.
pub const STEP_S: f64 = 1e-3;

/// A head in motion, at 0, [`STEP_S`], 2 [`STEP_S`], ...: a [`HeadSimulation`](crate::dynamics::HeadSimulation) in
/// steps of [`STEP_S`], or whatever else tells how a head moves.
pub type HeadMotion<'a> = dyn Iterator<Item = Result<HeadState, DynamicsError>> + Send + 'a;

/// The motion in a while: instants `first`, `first + 1`, ... of [`STEP_S`] each.
#[derive(Debug, Clone)]
pub(super) struct Window {
    pub first: u64,
    pub heads: Vec<Kinematics>,
    pub bases: Vec<Kinematics>,
    /// Up to where samples are taken from it, s after the start.
    pub until_s: f64,
}

/// Cuts a motion into windows. Each begins `overlap` instants before the last one's end, so that a scan or a sample
/// which began then lies in one window.
pub(super) struct Windows<'a, 'm> {
    motion: &'a mut HeadMotion<'m>,
    recent: VecDeque<HeadState>,
    /// How many instants were asked of the motion.
    told: u64,
    last: u64,
    block: u64,
    overlap: usize,
}

impl<'a, 'm> Windows<'a, 'm> {
    /// Windows of `block` instants each, up to instant `last`.
    pub fn new(motion: &'a mut HeadMotion<'m>, block: u64, overlap: usize, last: u64) -> Self {
        Self { motion, recent: VecDeque::new(), told: 0, last, block, overlap }
    }

    /// The next window, or `None` after the last one.
    pub fn next(&mut self) -> Result<Option<Window>, SimulationError> {
        if self.told > self.last {
            return Ok(None);
        }
        let end = (self.told + self.block).min(self.last);
        while self.told <= end {
            let ended = SimulationError::MotionEnded { t_s: self.told as f64 * STEP_S };
            self.recent.push_back(self.motion.next().ok_or(ended)??);
            self.told += 1;
        }
        let window = Window {
            first: self.told - self.recent.len() as u64,
            heads: self.recent.iter().map(|state| state.head).collect(),
            bases: self.recent.iter().map(|state| state.base).collect(),
            until_s: end as f64 * STEP_S,
        };
        self.recent.drain(..self.recent.len().saturating_sub(self.overlap));
        Ok(Some(window))
    }
}
