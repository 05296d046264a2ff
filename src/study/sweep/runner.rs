//! Execution options of a sweep.

use std::path::Path;
use std::sync::atomic::AtomicBool;
use zsim_base::parallel::OnProgress;

/// Execution options of a sweep.
#[derive(Clone, Copy)]
pub struct Runner<'a> {
    /// Path of the `zsim` executable: journeys run in worker processes.
    pub program: &'a Path,
    /// Stop flag, set by the caller.
    pub stop: &'a AtomicBool,
    /// Receives the finished fraction of the missing runs.
    pub on_progress: OnProgress<'a>,
}
