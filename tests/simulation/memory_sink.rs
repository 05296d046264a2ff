//! Sink that stores the measurements and ground truth of a simulation in memory.

use zsim::geometry::Trajectory;
use zsim::measurement::{ImuSample, LidarScan, Sink, SinkError};
use zsim::time::Stamp;
use zsim::truth::{ClockTruth, TruthSample, TruthSink};

/// Stores everything with its arrival time.
#[derive(Default, PartialEq, Debug)]
pub struct MemorySink {
    pub samples: Vec<(Stamp, ImuSample)>,
    pub scans: Vec<(Stamp, LidarScan)>,
    pub truth: Vec<(Stamp, TruthSample)>,
    pub clocks: Vec<(Stamp, ClockTruth)>,
    last: Stamp,
}

impl MemorySink {
    fn arrive(&mut self, now: Stamp) {
        assert!(now >= self.last, "arrivals never decrease");
        self.last = now;
    }

    pub fn trajectory(&self) -> Trajectory {
        Trajectory::from_poses(self.truth.iter().map(|(_, t)| (t.lidar_stamp, t.head.world_from_body))).unwrap()
    }
}

impl Sink for MemorySink {
    fn imu(&mut self, arrival: Stamp, sample: &ImuSample) -> Result<(), SinkError> {
        self.arrive(arrival);
        self.samples.push((arrival, *sample));
        Ok(())
    }

    fn lidar(&mut self, arrival: Stamp, scan: &LidarScan) -> Result<(), SinkError> {
        self.arrive(arrival);
        self.scans.push((arrival, scan.clone()));
        Ok(())
    }
}

impl TruthSink for MemorySink {
    fn truth(&mut self, now: Stamp, sample: &TruthSample) -> Result<(), SinkError> {
        self.arrive(now);
        self.truth.push((now, *sample));
        Ok(())
    }

    fn clock(&mut self, now: Stamp, clock: &ClockTruth) -> Result<(), SinkError> {
        self.arrive(now);
        self.clocks.push((now, *clock));
        Ok(())
    }
}
