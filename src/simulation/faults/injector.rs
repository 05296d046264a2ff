use super::clock::ClockFaults;
use super::pipeline::Pipeline;
use super::stage::Message;
use super::{FaultKind, Faults};
use crate::{EPOCH, Rig};
use std::collections::{BTreeMap, VecDeque};
use zsim_base::geometry::{Pose, Rotation, Vector, gravity_in_world};
use zsim_base::measurement::{ImuSample, LidarScan, Measurement, Sink, SinkError};
use zsim_base::time::{Span, Stamp};
use zsim_truth::{ClockTruth, TruthSample, TruthSink};

/// Applies faults to the data of a simulation, and passes the result to a sink in order of arrival.
pub(crate) struct Injector<'s, S: ?Sized> {
    sink: &'s mut S,
    imu: Pipeline,
    lidar: Pipeline,
    clock: ClockFaults,
    attitude: Option<Attitude>,
    /// Events that have not arrived yet, by arrival time and then by order of sending.
    queue: BTreeMap<(Stamp, u64), Event>,
    sent: u64,
}

/// A delivered event.
enum Event {
    Measurement(Measurement),
    BaseImu(ImuSample),
    Truth(TruthSample),
    Clock(ClockTruth),
}

impl<'s, S: Sink + TruthSink + ?Sized> Injector<'s, S> {
    /// An injector of `faults` for the sensors of `rig`; without faults it passes on everything.
    pub fn new(faults: Option<&Faults>, rig: &Rig, sink: &'s mut S) -> Self {
        let none = Faults::default();
        let faults = faults.unwrap_or(&none);
        let removes_gravity = |kind: &FaultKind| matches!(kind, FaultKind::Axes { remove_gravity: true, .. });
        let attitude = faults.for_sensor(true).any(|(_, kind, _)| removes_gravity(kind));
        let pipeline = |is_imu| Pipeline::new(faults, is_imu, rig.duration_s, rig.seed);
        Self {
            sink,
            imu: pipeline(true),
            lidar: pipeline(false),
            clock: faults.clock(),
            attitude: attitude.then(|| Attitude::new(rig)),
            queue: BTreeMap::new(),
            sent: 0,
        }
    }

    /// Delivers all held and delayed events.
    pub fn finish(mut self) -> Result<(), SinkError> {
        let mut emitted = Vec::new();
        self.imu.finish(&mut emitted);
        self.lidar.finish(&mut emitted);
        self.send_all(emitted);
        self.deliver(None)
    }

    fn take(&mut self, arrival: Stamp, measurement: Measurement) -> Result<(), SinkError> {
        let force_at_rest = self.attitude.as_ref().map_or_else(Vector::zeros, Attitude::force_at_rest);
        let pipeline = if matches!(measurement, Measurement::Imu(_)) { &mut self.imu } else { &mut self.lidar };
        let mut emitted = Vec::new();
        pipeline.take(Message { taken: arrival, arrival, measurement, force_at_rest }, &mut emitted);
        self.send_all(emitted);
        self.deliver(Some(arrival))
    }

    fn send_all(&mut self, messages: Vec<Message>) {
        messages.into_iter().for_each(|message| self.send(message.arrival, Event::Measurement(message.measurement)));
    }

    fn send(&mut self, arrival: Stamp, event: Event) {
        self.queue.insert((arrival, self.sent), event);
        self.sent += 1;
    }

    /// Delivers events that arrive up to `now` (`None`: all), except those that a held message may precede.
    fn deliver(&mut self, now: Option<Stamp>) -> Result<(), SinkError> {
        let held = self.imu.earliest_held().into_iter().chain(self.lidar.earliest_held()).min();
        let until = now.into_iter().chain(held).min();
        while let Some(first) = self.queue.first_entry() {
            let (arrival, _) = *first.key();
            if until.is_some_and(|until| arrival > until) {
                break;
            }
            match first.remove() {
                Event::Measurement(Measurement::Imu(sample)) => self.sink.imu(arrival, &sample),
                Event::Measurement(Measurement::Lidar(scan)) => self.sink.lidar(arrival, &scan),
                Event::BaseImu(sample) => self.sink.base_imu(arrival, &sample),
                Event::Truth(sample) => self.sink.truth(arrival, &sample),
                Event::Clock(clock) => self.sink.clock(arrival, &clock),
            }?;
        }
        Ok(())
    }
}

impl<S: Sink + TruthSink + ?Sized> Sink for Injector<'_, S> {
    fn imu(&mut self, arrival: Stamp, sample: &ImuSample) -> Result<(), SinkError> {
        self.take(arrival, Measurement::Imu(*sample))
    }

    fn base_imu(&mut self, arrival: Stamp, sample: &ImuSample) -> Result<(), SinkError> {
        self.send(arrival, Event::BaseImu(*sample));
        self.deliver(Some(arrival))
    }

    fn lidar(&mut self, arrival: Stamp, scan: &LidarScan) -> Result<(), SinkError> {
        self.take(arrival, Measurement::Lidar(scan.clone()))
    }
}

impl<S: Sink + TruthSink + ?Sized> TruthSink for Injector<'_, S> {
    fn truth(&mut self, now: Stamp, sample: &TruthSample) -> Result<(), SinkError> {
        if let Some(attitude) = &mut self.attitude {
            attitude.update(now, &sample.head.world_from_body);
        }
        let lidar_stamp = sample.lidar_stamp + self.clock.lidar_offset(now - EPOCH);
        self.send(now, Event::Truth(TruthSample { lidar_stamp, ..*sample }));
        self.deliver(Some(now))
    }

    fn clock(&mut self, now: Stamp, clock: &ClockTruth) -> Result<(), SinkError> {
        let mut emitted = Vec::new();
        self.imu.flush_silent(now, &mut emitted);
        self.lidar.flush_silent(now, &mut emitted);
        self.send_all(emitted);
        let clock = self.clock.apply(now - EPOCH, clock);
        self.send(now, Event::Clock(clock));
        self.deliver(Some(now))
    }
}

/// Attitude of the IMU during the interval of the last sample.
struct Attitude {
    head_from_imu: Rotation,
    period: Span,
    recent: VecDeque<(Stamp, Rotation)>,
}

impl Attitude {
    fn new(rig: &Rig) -> Self {
        let period = Span::from_seconds(rig.imu.period_s());
        Self { head_from_imu: rig.head_from_imu.rotation, period, recent: VecDeque::new() }
    }

    fn update(&mut self, now: Stamp, world_from_head: &Pose) {
        while self.recent.front().is_some_and(|(before, _)| *before + self.period < now) {
            self.recent.pop_front();
        }
        self.recent.push_back((now, world_from_head.rotation * self.head_from_imu));
    }

    /// Mean specific force of an IMU with this attitude and no acceleration, in the IMU frame, m/s^2.
    fn force_at_rest(&self) -> Vector {
        let at_rest = |(_, world_from_imu): &(Stamp, Rotation)| world_from_imu.inverse() * -gravity_in_world();
        self.recent.iter().map(at_rest).sum::<Vector>() / self.recent.len().max(1) as f64
    }
}
