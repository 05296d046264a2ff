//! A sink that also reports what it receives, for a live view.

use super::{ProgressMonitor, StageData};
use std::cell::RefCell;
use zsim_base::measurement::{ImuSample, LidarScan, Sink, SinkError};
use zsim_base::time::Stamp;
use zsim_truth::{ClockTruth, TruthSample, TruthSink};

/// Passes everything on to `sink`, and reports scans and true motion.
pub(super) struct ObservedSink<'a, 'w, S> {
    pub sink: S,
    /// Shared with the progress callback of the simulation; neither holds it during a call of the other.
    pub watch: &'a RefCell<&'a mut ProgressMonitor<'w>>,
}

impl<S: Sink> Sink for ObservedSink<'_, '_, S> {
    fn imu(&mut self, arrival: Stamp, sample: &ImuSample) -> Result<(), SinkError> {
        self.sink.imu(arrival, sample)
    }

    fn base_imu(&mut self, arrival: Stamp, sample: &ImuSample) -> Result<(), SinkError> {
        self.sink.base_imu(arrival, sample)
    }

    fn lidar(&mut self, arrival: Stamp, scan: &LidarScan) -> Result<(), SinkError> {
        self.watch.borrow_mut().data(StageData::Scan(scan));
        self.sink.lidar(arrival, scan)
    }
}

impl<S: TruthSink> TruthSink for ObservedSink<'_, '_, S> {
    fn truth(&mut self, now: Stamp, sample: &TruthSample) -> Result<(), SinkError> {
        self.watch.borrow_mut().data(StageData::Truth(sample));
        self.sink.truth(now, sample)
    }

    fn clock(&mut self, now: Stamp, clock: &ClockTruth) -> Result<(), SinkError> {
        self.sink.clock(now, clock)
    }
}
