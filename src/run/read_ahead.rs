//! Reads a recording on a separate thread, so that the estimator does not wait for decompression and decoding.

use std::sync::mpsc::sync_channel;
use std::thread;
use zsim_base::measurement::Measurement;
use zsim_recording::{Loss, Reader, RecordingError, Selection};

/// Capacity of the queue, measurements: about 1 s of data.
pub(super) const QUEUE_CAPACITY: usize = 256;

/// The measurements of a recording, in order.
pub(super) type MeasurementStream<'a> = dyn Iterator<Item = Result<Measurement, RecordingError>> + 'a;

/// Calls `process` with the measurements, and returns its result and the losses of the reader.
///
/// The measurements are read ahead if more than one thread is available.
pub(super) fn read_ahead<T>(
    reader: &Reader,
    selection: &Selection,
    process: impl FnOnce(&mut MeasurementStream) -> T,
) -> (T, Loss) {
    let mut measurements = reader.measurements(selection);
    if rayon::current_num_threads() < 2 {
        let result = process(&mut measurements);
        return (result, measurements.loss().clone());
    }
    thread::scope(|scope| {
        let (sender, receiver) = sync_channel(QUEUE_CAPACITY);
        let reading = scope.spawn(move || {
            // `process` can stop before the end of the recording.
            let _ = measurements.by_ref().all(|measurement| sender.send(measurement).is_ok());
            measurements.loss().clone()
        });
        let result = process(&mut receiver.into_iter());
        let loss = reading.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        (result, loss)
    })
}
