//! Measurements of all sensors during a motion chunk.

use super::motion::{MotionChunk, STEP_S};
use super::schedule::{ImuInterval, ImuSchedule, Schedule};
use super::{Outputs, Rig, SimulationSummary};
use rayon::prelude::*;
use std::time::Instant;
use zsim_base::geometry::{Pose, Vector};
use zsim_base::measurement::{ImuNoise, ImuSample, LidarScan};
use zsim_base::random::Seed;
use zsim_base::time::{Span, Stamp};
use zsim_sensors::{Clock, Imu, ImuSampler, LidarErrors, ScanTiming, Scenery, SceneryWithCarrier, Track};
use zsim_truth::{ClockTruth, TruthSample};

/// All events of a motion chunk with their true time, each kind in order of time.
#[derive(Debug, Default)]
pub(super) struct Events {
    pub truth: Vec<(Stamp, TruthSample)>,
    pub clocks: Vec<(Stamp, ClockTruth)>,
    pub samples: Vec<(Stamp, ImuSample)>,
    pub base_samples: Vec<(Stamp, ImuSample)>,
    pub scans: Vec<(Stamp, LidarScan)>,
    pub until_s: f64,
}

/// The sensors of a run, with their state from sample to sample.
pub(super) struct Sensors<'a> {
    rig: &'a Rig<'a>,
    schedule: Schedule,
    lidar_errors: LidarErrors,
    imu: SimulatedImu,
    base_imu: Option<SimulatedImu>,
}

/// An IMU on a body, with the state from sample to sample.
struct SimulatedImu {
    samples: ImuSchedule,
    sampler: ImuSampler,
    noise: ImuNoise,
    body_from_imu: Pose,
}

impl SimulatedImu {
    fn new(imu: &Imu, body_from_imu: Pose, schedule: &Schedule, clock: Clock, seed: Seed) -> Self {
        let samples = schedule.samples(imu, clock, seed);
        Self { samples, sampler: ImuSampler::new(imu, seed), noise: imu.noise(), body_from_imu }
    }

    /// The samples that are complete by `until_s`, each with the completion time, s.
    fn take(&mut self, body: &Track, until_s: f64) -> Vec<(f64, ImuSample)> {
        self.samples.until(until_s).iter().map(|interval| (interval.to_s, self.sample(body, interval))).collect()
    }

    fn sample(&mut self, body: &Track, interval: &ImuInterval) -> ImuSample {
        let at = |t_s: f64| body.kinematics(t_s).of_frame(&self.body_from_imu);
        let measured = self.sampler.sample(at, (interval.from_s, interval.to_s));
        ImuSample {
            stamp: interval.stamp,
            angular_velocity_rad_per_s: measured.angular_velocity_rad_per_s,
            specific_force_m_per_s2: measured.specific_force_m_per_s2,
        }
    }

    /// Whether an axis of the sample is saturated.
    fn is_at_limit(&self, sample: &ImuSample) -> bool {
        let beyond = |v: &Vector, limit: f64| v.amax() >= limit;
        beyond(&sample.angular_velocity_rad_per_s, self.noise.gyro_limit_rad_per_s)
            || beyond(&sample.specific_force_m_per_s2, self.noise.accel_limit_m_per_s2)
    }
}

impl<'a> Sensors<'a> {
    pub fn new(rig: &'a Rig<'a>) -> Self {
        let schedule = Schedule::new(rig);
        let unit = |imu, body_from_imu, seed| SimulatedImu::new(imu, body_from_imu, &schedule, rig.clocks.imu, seed);
        Self {
            rig,
            lidar_errors: LidarErrors::new(rig.lidar, rig.seed),
            imu: unit(rig.imu, rig.head_from_imu, rig.seed),
            base_imu: rig.base_imu.map(|imu| unit(imu, Pose::identity(), rig.seed.child("base"))),
            schedule,
        }
    }

    /// Computes all events except scans that are complete by `until_s`, and counts them in `summary`.
    fn measure_except_scans(
        &mut self,
        head: &Track,
        base: &Track,
        until_s: f64,
        summary: &mut SimulationSummary,
    ) -> Events {
        let samples = self.imu.take(head, until_s);
        let base_samples = self.base_imu.as_mut().map_or_else(Vec::new, |imu| imu.take(base, until_s));
        summary.imu_samples += samples.len() as u64;
        summary.imu_samples_at_limit +=
            samples.iter().filter(|(_, sample)| self.imu.is_at_limit(sample)).count() as u64;
        let arrived = |samples: Vec<(f64, ImuSample)>| {
            samples.into_iter().map(|(over_s, sample)| (self.rig.true_stamp(over_s), sample)).collect()
        };
        let (samples, base_samples) = (arrived(samples), arrived(base_samples));
        if self.rig.outputs == Outputs::Imus {
            return Events { samples, base_samples, until_s, ..Events::default() };
        }
        let truths = self.schedule.truths(until_s);
        Events {
            truth: truths.iter().map(|(t_s, stamp)| self.truth(head, base, *t_s, *stamp)).collect(),
            clocks: self.schedule.clocks(until_s).iter().map(|t_s| self.clock(*t_s)).collect(),
            samples,
            base_samples,
            scans: Vec::new(),
            until_s,
        }
    }

    fn truth(&self, head: &Track, base: &Track, t_s: f64, lidar_stamp: Stamp) -> (Stamp, TruthSample) {
        let sample = TruthSample { lidar_stamp, head: head.kinematics(t_s), base: base.kinematics(t_s) };
        (self.rig.true_stamp(t_s), sample)
    }

    fn clock(&self, t_s: f64) -> (Stamp, ClockTruth) {
        let (lidar, imu) = (&self.rig.clocks.lidar, &self.rig.clocks.imu);
        let delay = Span::from_seconds(self.rig.imu.delay_s());
        let truth = ClockTruth { lidar_offset: lidar.offset_at(t_s), imu_offset: imu.offset_at(t_s) + delay };
        (self.rig.true_stamp(t_s), truth)
    }
}

/// Computes all events that are complete by the end of `chunk`, for each of `sensors`, which differ only in the IMUs
/// and the lidar errors. Counts them in `summaries`.
pub(super) fn measure(
    sensors: &mut [Sensors],
    chunk: MotionChunk,
    summaries: &mut [SimulationSummary],
) -> Option<Vec<Events>> {
    let MotionChunk { first, heads, bases, until_s } = chunk;
    let head = Track::new(first, STEP_S, heads)?;
    let base = Track::new(first, STEP_S, bases)?;
    let each = sensors.iter_mut().zip(summaries.iter_mut());
    let mut events: Vec<Events> =
        each.map(|(sensors, summary)| sensors.measure_except_scans(&head, &base, until_s, summary)).collect();
    let scans = scans(sensors, &head, &base, until_s, summaries);
    for ((events, scans), summary) in events.iter_mut().zip(scans).zip(summaries) {
        summary.scans += scans.len() as u64;
        summary.returns += scans.iter().map(|(_, scan)| scan.returns.len() as u64).sum::<u64>();
        events.scans = scans;
    }
    Some(events)
}

/// The scans of each of `sensors`; the rays are cast once. Empty if only the IMUs are simulated.
fn scans(
    sensors: &mut [Sensors],
    head: &Track,
    base: &Track,
    until_s: f64,
    summaries: &mut [SimulationSummary],
) -> Vec<Vec<(Stamp, LidarScan)>> {
    if sensors.first().is_some_and(|first| first.rig.outputs == Outputs::Imus) {
        return Vec::new();
    }
    let timings: Vec<Vec<ScanTiming>> = sensors.iter_mut().map(|one| one.schedule.scans(until_s)).collect();
    let (Some(first), Some(timings)) = (sensors.first(), timings.first()) else { return Vec::new() };
    let Rig { lidar, scenery, carrier, head_from_laser, .. } = *first.rig;
    let laser = head.of_frame(&head_from_laser);
    let carried = SceneryWithCarrier { scenery, carrier, base };
    let scenery: &dyn Scenery = if carrier.is_empty() { scenery } else { &carried };
    let started = Instant::now();
    let sensors = &*sensors;
    let scan = |timing: &ScanTiming| {
        let sweep = lidar.sweep(scenery, &laser, timing);
        let over = first.rig.true_stamp(timing.start_s + lidar.sweep_span().seconds() / timing.pace);
        let measured = |one: &Sensors| (over, one.rig.lidar.measure(&sweep, &one.lidar_errors));
        sensors.iter().map(measured).collect::<Vec<_>>()
    };
    let by_scan: Vec<Vec<(Stamp, LidarScan)>> = timings.par_iter().map(scan).collect();
    let wall_s = started.elapsed().as_secs_f64();
    for summary in summaries {
        summary.rays_wall_s += wall_s;
        summary.beams += (timings.len() * lidar.beams().len()) as u64;
        summary.rays += (timings.len() * lidar.beams().len() * lidar.rays_per_beam()) as u64;
    }
    let mut by_sensors: Vec<Vec<_>> = sensors.iter().map(|_| Vec::with_capacity(by_scan.len())).collect();
    for scans in by_scan {
        by_sensors.iter_mut().zip(scans).for_each(|(all, scan)| all.push(scan));
    }
    by_sensors
}
