//! Motion of head and base, in chunks.

use super::SimulationError;
use std::collections::VecDeque;
use zsim_base::geometry::Kinematics;
use zsim_dynamics::{DynamicsError, HeadState};

/// Time step of a [`HeadMotion`], s: 1 ms resolves vibration up to 100 Hz (see [`Track`](zsim_sensors::Track)).
pub const STEP_S: f64 = 1e-3;

/// States of the head at 0, [`STEP_S`], 2 [`STEP_S`], ...: a [`HeadSimulation`](zsim_dynamics::HeadSimulation) with
/// this step, or another source.
pub type HeadMotion<'a> = dyn Iterator<Item = Result<HeadState, DynamicsError>> + Send + 'a;

/// A chunk of motion: the steps `first`, `first + 1`, ... of [`STEP_S`] each.
#[derive(Debug, Clone)]
pub(super) struct MotionChunk {
    pub first: u64,
    pub heads: Vec<Kinematics>,
    pub bases: Vec<Kinematics>,
    /// End of the interval in which samples are taken from this chunk, s after the start.
    pub until_s: f64,
}

/// Splits a motion into chunks. Each starts `overlap` steps before the end of the previous one, so that a scan or an
/// IMU sample in progress there lies completely in one chunk.
pub(super) struct MotionChunks<'a, 'm> {
    motion: &'a mut HeadMotion<'m>,
    recent: VecDeque<HeadState>,
    /// Number of steps read from the motion.
    read: u64,
    last: u64,
    chunk_steps: u64,
    overlap: usize,
}

impl<'a, 'm> MotionChunks<'a, 'm> {
    /// Chunks of `chunk_steps` steps each, up to step `last`.
    pub fn new(motion: &'a mut HeadMotion<'m>, chunk_steps: u64, overlap: usize, last: u64) -> Self {
        Self { motion, recent: VecDeque::new(), read: 0, last, chunk_steps, overlap }
    }

    /// The next chunk, or `None` after the last one.
    pub fn next(&mut self) -> Result<Option<MotionChunk>, SimulationError> {
        if self.read > self.last {
            return Ok(None);
        }
        let end = (self.read + self.chunk_steps).min(self.last);
        while self.read <= end {
            let ended = SimulationError::MotionEnded { t_s: self.read as f64 * STEP_S };
            self.recent.push_back(self.motion.next().ok_or(ended)??);
            self.read += 1;
        }
        let chunk = MotionChunk {
            first: self.read - self.recent.len() as u64,
            heads: self.recent.iter().map(|state| state.head).collect(),
            bases: self.recent.iter().map(|state| state.base).collect(),
            until_s: end as f64 * STEP_S,
        };
        self.recent.drain(..self.recent.len().saturating_sub(self.overlap));
        Ok(Some(chunk))
    }
}
