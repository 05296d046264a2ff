//! The beams of a recording: one pass over them, and their projection by an estimate or by the truth.

use super::RunError;
use super::truth_cursor::TruthCursor;
use std::sync::Arc;
use std::sync::mpsc::sync_channel;
use std::thread;
use zsim_base::geometry::{Pose, SmoothCursor, Trajectory, Vector};
use zsim_base::measurement::{Calibration, ImuSample, LidarCorrection, LidarReturn, LidarScan, Measurement};
use zsim_base::parallel::Stopped;
use zsim_base::time::{Span, Stamp};
use zsim_recording::{Loss, Reader, RecordingError, Selection};

/// Returns between poses farther apart than this, s, are not projected: the estimate has a pose every 10 ms, except in gaps.
const MAX_POSE_GAP_S: f64 = 0.1;

/// What reads the measurements of a recording in their order.
pub(super) trait BeamReader {
    /// Reads the next IMU sample.
    fn imu(&mut self, _sample: &ImuSample) {}

    /// Reads the next scan; `truth` is that of the recording, if it is wanted.
    fn scan(&mut self, scan: &LidarScan, truth: Option<&mut TruthCursor>) -> Result<(), RunError>;
}

/// A reader of beams that may have a thread of its own.
pub(super) type Reading<'a> = &'a mut (dyn BeamReader + Send);

/// Calls `readers` with all measurements of a recording, and with its truth if `with_truth`, in one pass.
///
/// `on_scan` is called with the stamp of each scan. Each reader but the first has a thread of its own if more than one is
/// available.
///
/// # Errors
/// If the recording cannot be read, or if a reader or `on_scan` fails.
pub(super) fn read_beams(
    (reader, selection): (&Reader, &Selection),
    with_truth: bool,
    readers: Vec<Reading>,
    on_scan: &mut dyn FnMut(Stamp) -> Result<(), Stopped>,
) -> Result<(), RunError> {
    let truth = || with_truth.then(|| TruthCursor::new(reader.truth()));
    let mut here = readers;
    let others = if rayon::current_num_threads() < 2 { Vec::new() } else { here.split_off(here.len().min(1)) };
    thread::scope(|scope| {
        let (mut senders, mut threads) = (Vec::new(), Vec::new());
        for reading in others {
            let (sender, receiver) = sync_channel::<Arc<Measurement>>(QUEUE_CAPACITY);
            let read = || {
                let (mut readings, mut truth) = ([reading], truth());
                receiver.into_iter().try_for_each(|measurement| pass_on(&measurement, &mut readings, truth.as_mut()))
            };
            threads.push(scope.spawn(read));
            senders.push(sender);
        }
        let pass = |measurements: &mut MeasurementStream| {
            let mut truth = truth();
            for measurement in measurements {
                let measurement = Arc::new(measurement?);
                if let Measurement::Lidar(scan) = &*measurement {
                    on_scan(scan.stamp)?;
                }
                // A reader that has failed receives no more; its error follows.
                senders.iter().for_each(|sender| drop(sender.send(measurement.clone())));
                pass_on(&measurement, &mut here, truth.as_mut())?;
            }
            Ok(())
        };
        let (passed, _) = read_ahead(reader, selection, pass);
        drop(senders);
        let join = |thread: thread::ScopedJoinHandle<'_, _>| {
            thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        };
        threads.into_iter().map(join).fold(passed, Result::and)
    })
}

/// Calls readers with a measurement.
fn pass_on(
    measurement: &Measurement,
    readers: &mut [Reading],
    mut truth: Option<&mut TruthCursor>,
) -> Result<(), RunError> {
    match measurement {
        Measurement::Imu(sample) => readers.iter_mut().for_each(|reader| reader.imu(sample)),
        Measurement::Lidar(scan) => {
            readers.iter_mut().try_for_each(|reader| reader.scan(scan, truth.as_deref_mut()))?;
        }
    }
    Ok(())
}

/// A projected beam: origin and end point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ProjectedBeam {
    pub point: Vector,
    pub origin: Vector,
}

/// Projects beams by an estimate, in order of time.
pub(super) struct EstimatedBeams<'a> {
    map_from_head: SmoothCursor<'a>,
    lidar: LidarModel,
}

impl<'a> EstimatedBeams<'a> {
    /// Beams by the poses `map_from_head`, with the estimated correction of the lidar.
    pub(super) fn new(map_from_head: &'a Trajectory, calibration: &Calibration, lidar: &LidarCorrection) -> Self {
        let max_gap = Span::from_seconds(MAX_POSE_GAP_S);
        let lidar = LidarModel::corrected(calibration, lidar);
        Self { map_from_head: SmoothCursor::with_max_gap(map_from_head, max_gap), lidar }
    }

    /// The beam in the map; `None` at the start and the end of the recording, and in gaps of the estimate.
    pub(super) fn project(&mut self, beam: &LidarReturn, stamp: Stamp) -> Option<(Pose, ProjectedBeam)> {
        let map_from_head = self.map_from_head.at(stamp)?;
        Some((map_from_head, self.lidar.beam(&map_from_head, &beam.point_in_laser.cast())))
    }
}

/// Extrinsics and range correction of the lidar.
pub(super) struct LidarModel {
    head_from_laser: Pose,
    /// Added to each range, m.
    range_m: f64,
}

impl LidarModel {
    /// The lidar as calibrated, for projection by the truth.
    pub(super) fn calibrated(calibration: &Calibration) -> Self {
        Self { head_from_laser: calibration.head_from_laser, range_m: 0.0 }
    }

    /// The lidar with the estimated correction, for projection by the estimate.
    fn corrected(calibration: &Calibration, lidar: &LidarCorrection) -> Self {
        Self { head_from_laser: calibration.head_from_corrected_laser(lidar), range_m: lidar.range_m }
    }

    /// Projects the beam that measured `point_in_laser` from the head pose `frame_from_head`.
    pub(super) fn beam(&self, frame_from_head: &Pose, point_in_laser: &Vector) -> ProjectedBeam {
        let frame_from_laser = frame_from_head * self.head_from_laser;
        let origin = frame_from_laser.translation.vector;
        let scale = 1.0 + self.range_m / point_in_laser.norm();
        ProjectedBeam { point: frame_from_laser.rotation * point_in_laser * scale + origin, origin }
    }
}

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
