//! A sensor's faults in their order: a stage each.

use super::interval::Interval;
use super::{FaultKind, Faults, loss, scan, timing, values};
use crate::geometry::Vector;
use crate::measurement::Measurement;
use crate::random::Seed;
use crate::simulation::EPOCH;
use crate::time::{Span, Stamp};

/// A measurement on its way to the sink.
#[derive(Debug, Clone)]
pub(super) struct Message {
    /// When it would arrive without faults, true time. Faults' intervals are about this time.
    pub taken: Stamp,
    /// When it arrives, true time.
    pub arrival: Stamp,
    pub measurement: Measurement,
    /// Specific force of an IMU at rest in the attitude of this sample, m/s^2, where some fault asks for it.
    pub force_at_rest: Vector,
}

impl Message {
    /// The time since the start that faults' intervals are about.
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

/// A fault at work. Messages that it emits arrive no earlier than those that it took.
pub(super) trait Stage {
    /// Takes a message within the fault's interval.
    fn take(&mut self, message: Message, out: &mut Vec<Message>);

    /// Takes a message outside of it.
    fn pass(&mut self, message: Message, out: &mut Vec<Message>) {
        self.finish(out);
        out.push(message);
    }

    /// Emits what is held, as no more messages come.
    fn finish(&mut self, _out: &mut Vec<Message>) {}

    /// The earliest arrival of a message that is held.
    fn held(&self) -> Option<Stamp> {
        None
    }
}

/// All faults of a sensor.
pub(super) struct Pipeline {
    stages: Vec<(Interval, Box<dyn Stage>)>,
}

impl Pipeline {
    /// The faults of the IMU, or else of the lidar, in a run of `duration_s`.
    pub fn new(faults: &Faults, is_imu: bool, duration_s: f64, seed: Seed) -> Self {
        let sensor = if is_imu { "imu" } else { "lidar" };
        let stage = |(index, kind, interval): (usize, &FaultKind, Interval)| {
            let stream = seed.stream(&format!("faults/{index}/{sensor}"));
            let stage = loss::stage(kind, &stream)
                .or_else(|| timing::stage(kind, &stream, &interval))
                .or_else(|| values::stage(kind, stream, interval.limits_s(duration_s)))
                .or_else(|| scan::stage(kind))?;
            Some((interval, stage))
        };
        Self { stages: faults.of(is_imu).filter_map(stage).collect() }
    }

    /// Takes a message from the sensor, and emits what comes of it and of those before.
    pub fn take(&mut self, message: Message, out: &mut Vec<Message>) {
        feed(&mut self.stages, message, out);
    }

    /// Emits what is held.
    pub fn finish(&mut self, out: &mut Vec<Message>) {
        finish(&mut self.stages, out);
    }

    /// The earliest arrival of a message that is held.
    pub fn held(&self) -> Option<Stamp> {
        self.stages.iter().filter_map(|(_, stage)| stage.held()).min()
    }
}

fn feed(stages: &mut [(Interval, Box<dyn Stage>)], message: Message, out: &mut Vec<Message>) {
    let Some(((interval, stage), rest)) = stages.split_first_mut() else { return out.push(message) };
    let mut emitted = Vec::new();
    match interval.contains(message.since_start()) {
        true => stage.take(message, &mut emitted),
        false => stage.pass(message, &mut emitted),
    }
    emitted.into_iter().for_each(|message| feed(rest, message, out));
}

fn finish(stages: &mut [(Interval, Box<dyn Stage>)], out: &mut Vec<Message>) {
    let Some(((_, stage), rest)) = stages.split_first_mut() else { return };
    let mut emitted = Vec::new();
    stage.finish(&mut emitted);
    emitted.into_iter().for_each(|message| feed(rest, message, out));
    finish(rest, out);
}
