//! The queue between a run and its live page: it never blocks the run.

use super::frame::Frame;
use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Maximum number of frames: at most 20 MB.
const CAPACITY: usize = 4096;

/// A queue of limited length that drops old frames.
#[derive(Debug, Default)]
pub(super) struct Queue {
    content: Mutex<Content>,
    filled: Condvar,
}

#[derive(Debug, Default)]
struct Content {
    frames: VecDeque<Frame>,
    is_closed: bool,
}

impl Queue {
    /// Adds a frame; if the queue is full, the oldest dispensable frame is dropped.
    pub(super) fn push(&self, frame: Frame) {
        let mut content = self.content();
        if content.frames.len() >= CAPACITY {
            let oldest = content.frames.iter().position(Frame::is_dispensable).unwrap_or(0);
            content.frames.remove(oldest);
        }
        content.frames.push_back(frame);
        self.filled.notify_one();
    }

    /// Ends the queue: after the frames in it, [`Self::take`] returns `None`.
    pub(super) fn close(&self) {
        self.content().is_closed = true;
        self.filled.notify_one();
    }

    /// Waits for frames and takes all of them; `None` after the last one of a closed queue.
    pub(super) fn take(&self) -> Option<VecDeque<Frame>> {
        let is_waiting = |content: &mut Content| content.frames.is_empty() && !content.is_closed;
        let mut content = self.filled.wait_while(self.content(), is_waiting).unwrap_or_else(PoisonError::into_inner);
        Some(std::mem::take(&mut content.frames)).filter(|frames| !frames.is_empty())
    }

    fn content(&self) -> MutexGuard<'_, Content> {
        self.content.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_queue_drops_the_oldest_scans_and_keeps_the_notes() {
        let queue = Queue::default();
        queue.push(Frame::Note("first".to_owned()));
        for _ in 0..CAPACITY + 10 {
            queue.push(Frame::Scan(Vec::new()));
        }
        queue.push(Frame::Note("last".to_owned()));
        queue.close();
        let frames = queue.take().unwrap();
        assert_eq!(frames.len(), CAPACITY);
        let notes = frames.iter().filter(|frame| matches!(frame, Frame::Note(_))).count();
        assert_eq!(notes, 2);
        assert!(queue.take().is_none());
    }
}
