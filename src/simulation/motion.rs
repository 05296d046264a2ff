//! How head and base move, block by block.

use super::SimulationError;
use crate::geometry::Kinematics;
use std::collections::VecDeque;

/// Time between the instants of a [`HeadMotion`], s.
pub const STEP_S: f64 = 1e-3;

/// How head and base move at an instant, both in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moved {
    /// The head: `world_from_head` and its derivatives.
    pub head: Kinematics,
    /// The base that carries it.
    pub base: Kinematics,
}

/// A head in motion, one instant after another: physics, or anything else that moves.
pub trait HeadMotion: Send {
    /// How it moves at the next instant: the first call tells time 0, and each one after it [`STEP_S`] later.
    ///
    /// # Errors
    /// When the motion cannot go on.
    fn next(&mut self) -> Result<Moved, SimulationError>;
}

/// The motion in a while: instants `first`, `first + 1`, ... of [`STEP_S`] each.
#[derive(Debug, Clone)]
pub(super) struct Window {
    pub first: u64,
    pub heads: Vec<Kinematics>,
    pub bases: Vec<Kinematics>,
    /// Up to where samples are taken from it, s after the start.
    pub until_s: f64,
}

/// Cuts a motion into windows. Each begins `overlap` instants before the last one's end, so that a scan or a sample which
/// began then lies in one window.
pub(super) struct Windows<'a> {
    motion: &'a mut dyn HeadMotion,
    recent: VecDeque<Moved>,
    /// How many instants were asked of the motion.
    told: u64,
    last: u64,
    block: u64,
    overlap: usize,
}

impl<'a> Windows<'a> {
    /// Windows of `block` instants each, up to instant `last`.
    pub fn new(motion: &'a mut dyn HeadMotion, block: u64, overlap: usize, last: u64) -> Self {
        Self { motion, recent: VecDeque::new(), told: 0, last, block, overlap }
    }

    /// The next window, or `None` after the last one.
    pub fn next(&mut self) -> Result<Option<Window>, SimulationError> {
        if self.told > self.last {
            return Ok(None);
        }
        let end = (self.told + self.block).min(self.last);
        while self.told <= end {
            self.recent.push_back(self.motion.next()?);
            self.told += 1;
        }
        let window = Window {
            first: self.told - self.recent.len() as u64,
            heads: self.recent.iter().map(|moved| moved.head).collect(),
            bases: self.recent.iter().map(|moved| moved.base).collect(),
            until_s: end as f64 * STEP_S,
        };
        self.recent.drain(..self.recent.len().saturating_sub(self.overlap));
        Ok(Some(window))
    }
}
