use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// What an experiment is at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Physics, rays, recording.
    Simulating,
    /// The open loop.
    Estimating,
    /// The closed loop.
    ClosingLoops,
    /// Beams become a cloud.
    Registering,
    /// What the measurements could tell at best.
    Bounding,
    /// Errors, plots, the page.
    Reporting,
}

/// What an experiment tells while it runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StudyEvent<'a> {
    /// How far a stage is: from 0 to 1 where its end is known, and by seconds of data.
    Progress {
        /// The stage.
        stage: Stage,
        /// The share that is done, where that is known.
        fraction: Option<f64>,
        /// Seconds of data that are done.
        done_s: f64,
    },
    /// A remark that whoever started it should read.
    Note(&'a str),
}

/// Who watches an experiment, and may stop it.
pub struct Watch<'a> {
    /// Set from outside to stop as soon as what is begun can be closed.
    pub stop: &'a AtomicBool,
    /// Hears how it goes.
    pub report: &'a mut dyn FnMut(StudyEvent),
}

impl Watch<'_> {
    pub(super) fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    pub(super) fn progress(&mut self, stage: Stage, done_s: f64, whole_s: Option<f64>) {
        let fraction = whole_s.filter(|whole_s| *whole_s > 0.0).map(|whole_s| (done_s / whole_s).clamp(0.0, 1.0));
        (self.report)(StudyEvent::Progress { stage, fraction, done_s });
    }

    pub(super) fn note(&mut self, text: &str) {
        (self.report)(StudyEvent::Note(text));
    }
}

/// Hears which share of some work is done, from 0 to 1, on whatever thread did it.
pub type OnProgress<'a> = &'a (dyn Fn(f64) + Sync);

/// Work in equal pieces that threads finish in any order.
pub(super) struct PieceProgress<'a> {
    whole: usize,
    done: AtomicUsize,
    on_progress: OnProgress<'a>,
}

impl<'a> PieceProgress<'a> {
    pub(super) fn new(whole: usize, on_progress: OnProgress<'a>) -> Self {
        Self { whole, done: AtomicUsize::new(0), on_progress }
    }

    /// Counts a piece that is done.
    pub(super) fn finish_one(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        (self.on_progress)(done as f64 / self.whole.max(1) as f64);
    }
}
