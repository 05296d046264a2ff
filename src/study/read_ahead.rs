//! Reads a recording on a thread of its own, so that decompressing and decoding it costs the estimator no time.

use crate::measurement::Measurement;
use crate::recording::{Loss, Reader, RecordingError, Selection};
use std::sync::mpsc::sync_channel;
use std::thread;

/// Measurements that may wait: about a second of them.
const WAITING: usize = 256;

/// What a recording gives, one after the other.
pub(super) type Coming<'a> = dyn Iterator<Item = Result<Measurement, RecordingError>> + 'a;

/// Calls `take` with the measurements, in order; what it gives, and what could not be read. They are read ahead where
/// there is more than one thread to use.
pub(super) fn read_ahead<T>(reader: &Reader, selection: &Selection, take: impl FnOnce(&mut Coming) -> T) -> (T, Loss) {
    let mut measurements = reader.measurements(selection);
    if rayon::current_num_threads() < 2 {
        let taken = take(&mut measurements);
        return (taken, measurements.loss().clone());
    }
    thread::scope(|scope| {
        let (ahead, coming) = sync_channel(WAITING);
        let reading = scope.spawn(move || {
            // Whoever takes them may stop before the end.
            let _ = measurements.by_ref().all(|measurement| ahead.send(measurement).is_ok());
            measurements.loss().clone()
        });
        let taken = take(&mut coming.into_iter());
        let loss = reading.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        (taken, loss)
    })
}
