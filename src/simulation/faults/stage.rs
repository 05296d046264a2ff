//! A measurement on its way from sensor to sink, and a stage that applies a fault to it.

use crate::EPOCH;
use zsim_base::geometry::Vector;
use zsim_base::measurement::Measurement;
use zsim_base::time::{Span, Stamp};

/// A measurement between sensor and sink.
#[derive(Debug, Clone)]
pub(super) struct Message {
    /// Arrival in true time without faults. The intervals of faults refer to this time.
    pub taken: Stamp,
    /// Arrival in true time.
    pub arrival: Stamp,
    pub measurement: Measurement,
    /// Specific force of an IMU at rest in the attitude of this sample, m/s^2; computed only if a fault needs it.
    pub force_at_rest: Vector,
}

impl Message {
    /// Time since the start of the run, to which the intervals of faults refer.
    pub fn since_start(&self) -> Span {
        self.taken - EPOCH
    }

    pub fn stamp(&self) -> Stamp {
        match &self.measurement {
            Measurement::Imu(sample) => sample.stamp,
            Measurement::Lidar(scan) => scan.stamp,
        }
    }

    pub fn set_stamp(&mut self, stamp: Stamp) {
        match &mut self.measurement {
            Measurement::Imu(sample) => sample.stamp = stamp,
            Measurement::Lidar(scan) => scan.stamp = stamp,
        }
    }
}

/// A stage that applies a fault. Its output messages arrive no earlier than its input messages.
pub(super) trait Stage {
    /// Processes a message within the interval of the fault.
    fn take(&mut self, message: Message, out: &mut Vec<Message>);

    /// Processes a message outside the interval.
    fn pass(&mut self, message: Message, out: &mut Vec<Message>) {
        self.finish(out);
        out.push(message);
    }

    /// Emits all held messages at the end of the run.
    fn finish(&mut self, _out: &mut Vec<Message>) {}

    /// Earliest arrival of a held message.
    fn earliest_held(&self) -> Option<Stamp> {
        None
    }
}
