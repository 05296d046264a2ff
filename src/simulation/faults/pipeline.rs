//! The faults of a sensor in order, one stage each.

use super::interval::Interval;
use super::stage::{Message, Stage};
use super::{FaultKind, Faults, loss, scan, timing, values};
use crate::EPOCH;
use zsim_base::random::Seed;
use zsim_base::time::{Span, Stamp};

/// Time without messages after which a stage emits held messages: the message that they wait for may never come.
const FLUSH_TIMEOUT: Span = Span::from_nanos(5_000_000_000);

/// All fault stages of a sensor.
pub(super) struct Pipeline {
    stages: Vec<TimedStage>,
}

/// A stage and the interval of the fault.
struct TimedStage {
    interval: Interval,
    stage: Box<dyn Stage>,
    /// Time of the last message.
    last: Stamp,
}

impl Pipeline {
    /// The faults of the IMU (or of the lidar) in a run of `duration_s`.
    pub fn new(faults: &Faults, is_imu: bool, duration_s: f64, seed: Seed) -> Self {
        let sensor = if is_imu { "imu" } else { "lidar" };
        let placed = |(index, kind, interval): (usize, &FaultKind, Interval)| {
            let stream = seed.stream(&format!("faults/{index}/{sensor}"));
            let stage = loss::stage(kind, &stream)
                .or_else(|| timing::stage(kind, &stream, &interval))
                .or_else(|| values::stage(kind, stream, interval.limits_s(duration_s)))
                .or_else(|| scan::stage(kind))?;
            Some(TimedStage { interval, stage, last: EPOCH })
        };
        Self { stages: faults.for_sensor(is_imu).filter_map(placed).collect() }
    }

    /// Processes a message of the sensor, and emits the resulting messages.
    pub fn take(&mut self, message: Message, out: &mut Vec<Message>) {
        feed(&mut self.stages, message, out);
    }

    /// Emits the held messages of stages that have had no message for [`FLUSH_TIMEOUT`].
    pub fn flush_silent(&mut self, now: Stamp, out: &mut Vec<Message>) {
        let mut stages = self.stages.as_mut_slice();
        while let Some((first, rest)) = stages.split_first_mut() {
            if first.stage.earliest_held().is_some() && now - first.last > FLUSH_TIMEOUT {
                flush(first, rest, out);
            }
            stages = rest;
        }
    }

    /// Emits all held messages.
    pub fn finish(&mut self, out: &mut Vec<Message>) {
        let mut stages = self.stages.as_mut_slice();
        while let Some((first, rest)) = stages.split_first_mut() {
            flush(first, rest, out);
            stages = rest;
        }
    }

    /// Earliest arrival of a held message.
    pub fn earliest_held(&self) -> Option<Stamp> {
        self.stages.iter().filter_map(|placed| placed.stage.earliest_held()).min()
    }
}

fn feed(stages: &mut [TimedStage], message: Message, out: &mut Vec<Message>) {
    let Some((first, rest)) = stages.split_first_mut() else { return out.push(message) };
    first.last = message.taken;
    let mut emitted = Vec::new();
    match first.interval.contains(message.since_start()) {
        true => first.stage.take(message, &mut emitted),
        false => first.stage.pass(message, &mut emitted),
    }
    emitted.into_iter().for_each(|message| feed(rest, message, out));
}

fn flush(first: &mut TimedStage, rest: &mut [TimedStage], out: &mut Vec<Message>) {
    let mut emitted = Vec::new();
    first.stage.finish(&mut emitted);
    emitted.into_iter().for_each(|message| feed(rest, message, out));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FaultsSpec;
    use zsim_base::geometry::Vector;
    use zsim_base::measurement::{ImuSample, Measurement};
    use zsim_base::spec::{Source, parse};

    /// The IMU pipeline with `list`.
    fn pipeline(list: &str) -> Pipeline {
        let source = Source::in_memory("test", format!("(faults: [{list}])"));
        let faults = Faults::new(&parse::<FaultsSpec>(&source).unwrap(), &source).unwrap();
        Pipeline::new(&faults, true, 100.0, Seed(1))
    }

    /// An IMU message at `ms` after the start.
    fn message(ms: i64) -> Message {
        let taken = EPOCH + Span::from_nanos(ms * 1_000_000);
        let still = Vector::zeros();
        let sample = ImuSample { stamp: taken, angular_velocity_rad_per_s: still, specific_force_m_per_s2: still };
        Message { taken, arrival: taken, measurement: Measurement::Imu(sample), force_at_rest: still }
    }

    #[test]
    fn held_messages_are_emitted_after_seconds_of_silence() {
        let at = |s: i64| EPOCH + Span::from_nanos(s * 1_000_000_000);
        for waiting in ["burst(size: 4, spacing_us: 0)", "reorder(share: 1)", "thin(arrivals_s: [0.105, 0.18])"] {
            // Eleven messages up to 0.1 s: the last ones are held, and none follow.
            let mut pipeline = pipeline(&format!("(sensor: imu, fault: {waiting})"));
            let mut out = Vec::new();
            (0..11).for_each(|k| pipeline.take(message(10 * k), &mut out));
            let before = out.len();
            pipeline.flush_silent(at(5), &mut out);
            assert!(out.len() == before && pipeline.earliest_held().is_some(), "{waiting}");
            pipeline.flush_silent(at(6), &mut out);
            assert!(out.len() <= 11 && pipeline.earliest_held().is_none(), "{waiting}");
        }
    }

    #[test]
    fn held_messages_pass_through_the_faults_that_follow() {
        let mut pipeline = pipeline(
            "(sensor: imu, fault: burst(size: 4, spacing_us: 0)), (sensor: imu, fault: clock_offset(offset_s: 1))",
        );
        let mut out = Vec::new();
        (0..6).for_each(|k| pipeline.take(message(10 * k), &mut out));
        assert_eq!(out.len(), 4);
        pipeline.finish(&mut out);
        let second = Span::from_nanos(1_000_000_000);
        let stamps: Vec<Stamp> = out.iter().map(Message::stamp).collect();
        let (first, last) = (message(30).taken + second, message(50).taken + second);
        assert_eq!(stamps, [first, first, first, first, last, last]);
    }
}
