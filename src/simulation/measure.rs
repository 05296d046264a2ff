//! What the sensors make of a window of motion.

use super::motion::{STEP_S, Window};
use super::schedule::{ImuInterval, Schedule};
use super::{Rig, SimulationSummary};
use crate::geometry::Vector;
use crate::measurement::{ImuSample, LidarScan};
use crate::sensors::{Carried, Firing, ImuErrors, LidarErrors, Scenery, Track, mean_motion};
use crate::time::{Span, Stamp};
use crate::truth::{ClockTruth, TruthSample};
use rayon::prelude::*;
use std::time::Instant;

/// All that is to be delivered of a window, each kind in the order of its time, with its true time.
#[derive(Debug, Default)]
pub(super) struct Events {
    pub truth: Vec<(Stamp, TruthSample)>,
    pub clocks: Vec<(Stamp, ClockTruth)>,
    pub samples: Vec<(Stamp, ImuSample)>,
    pub scans: Vec<(Stamp, LidarScan)>,
    pub until_s: f64,
}

/// The sensors of a run, with what changes in them from sample to sample.
pub(super) struct Sensors<'a> {
    rig: &'a Rig<'a>,
    schedule: Schedule,
    lidar_errors: LidarErrors,
    imu_errors: ImuErrors,
    limits: (f64, f64),
}

impl<'a> Sensors<'a> {
    pub fn new(rig: &'a Rig<'a>) -> Self {
        let noise = rig.imu.noise();
        Self {
            rig,
            schedule: Schedule::new(rig),
            lidar_errors: LidarErrors::new(rig.lidar, rig.seed),
            imu_errors: ImuErrors::new(rig.imu, rig.seed),
            limits: (noise.gyro_limit_rad_per_s, noise.accel_limit_m_per_s2),
        }
    }

    /// Takes all but the scans that is over by `until_s`; counts it in `summary`.
    fn measure_but_scans(
        &mut self,
        head: &Track,
        base: &Track,
        until_s: f64,
        summary: &mut SimulationSummary,
    ) -> Events {
        let samples = self.schedule.samples(until_s);
        summary.imu_samples += samples.len() as u64;
        Events {
            truth: self.schedule.truths(until_s).iter().map(|at| self.truth(head, base, *at)).collect(),
            clocks: self.schedule.clocks(until_s).iter().map(|t_s| self.clock(*t_s)).collect(),
            samples: samples.iter().map(|interval| self.sample(head, interval, summary)).collect(),
            scans: Vec::new(),
            until_s,
        }
    }

    fn truth(&self, head: &Track, base: &Track, (t_s, lidar_stamp): (f64, Stamp)) -> (Stamp, TruthSample) {
        let sample = TruthSample { lidar_stamp, head: head.kinematics(t_s), base: base.kinematics(t_s) };
        (self.rig.true_stamp(t_s), sample)
    }

    fn clock(&self, t_s: f64) -> (Stamp, ClockTruth) {
        let (lidar, imu) = (&self.rig.clocks.lidar, &self.rig.clocks.imu);
        let delay = Span::from_seconds(self.rig.imu.delay_s());
        let truth = ClockTruth { lidar_ahead: lidar.ahead(t_s), imu_ahead: imu.ahead(t_s) + delay };
        (self.rig.true_stamp(t_s), truth)
    }

    fn sample(&mut self, head: &Track, interval: &ImuInterval, summary: &mut SimulationSummary) -> (Stamp, ImuSample) {
        let at = |t_s: f64| head.kinematics(t_s).of_frame(&self.rig.head_from_imu);
        let ideal = mean_motion(&at(interval.from_s), &at(interval.to_s), interval.to_s - interval.from_s);
        let said = self.imu_errors.measure(&ideal);
        let beyond = |v: &Vector, limit: f64| v.amax() >= limit;
        let (rate, force) = (said.angular_velocity_rad_per_s, said.specific_force_m_per_s2);
        summary.imu_samples_at_limit += u64::from(beyond(&rate, self.limits.0) || beyond(&force, self.limits.1));
        let sample =
            ImuSample { stamp: interval.stamp, angular_velocity_rad_per_s: rate, specific_force_m_per_s2: force };
        (self.rig.true_stamp(interval.to_s), sample)
    }
}

/// Takes all samples that are over by the end of `window`, by sensors that differ in the IMU and the lidar's errors alone:
/// what each of them delivers. Counts them in `summaries`.
pub(super) fn measure(
    sensors: &mut [Sensors],
    window: Window,
    summaries: &mut [SimulationSummary],
) -> Option<Vec<Events>> {
    let Window { first, heads, bases, until_s } = window;
    let head = Track::new(first, STEP_S, heads)?;
    let base = Track::new(first, STEP_S, bases)?;
    let each = sensors.iter_mut().zip(summaries.iter_mut());
    let mut events: Vec<Events> =
        each.map(|(sensors, summary)| sensors.measure_but_scans(&head, &base, until_s, summary)).collect();
    let scans = scans(sensors, (&head, &base), until_s, summaries);
    for ((events, scans), summary) in events.iter_mut().zip(scans).zip(summaries) {
        summary.scans += scans.len() as u64;
        summary.returns += scans.iter().map(|(_, scan)| scan.returns.len() as u64).sum::<u64>();
        events.scans = scans;
    }
    Some(events)
}

/// The scans of each of `sensors`, from rays that are cast once.
fn scans(
    sensors: &mut [Sensors],
    (head, base): (&Track, &Track),
    until_s: f64,
    summaries: &mut [SimulationSummary],
) -> Vec<Vec<(Stamp, LidarScan)>> {
    let firings: Vec<Vec<Firing>> = sensors.iter_mut().map(|one| one.schedule.scans(until_s)).collect();
    let (Some(first), Some(firings)) = (sensors.first(), firings.first()) else { return Vec::new() };
    let Rig { lidar, scenery, carrier, head_from_laser, .. } = *first.rig;
    let laser = head.of_frame(&head_from_laser);
    let carried = Carried { scenery, carrier, base };
    let scenery: &dyn Scenery = if carrier.is_empty() { scenery } else { &carried };
    let started = Instant::now();
    let sensors = &*sensors;
    let scan = |firing: &Firing| {
        let sweep = lidar.sweep(scenery, &laser, firing);
        let over = first.rig.true_stamp(firing.start_s + lidar.sweep_span().seconds() / firing.pace);
        let said = |one: &Sensors| (over, one.rig.lidar.measure(&sweep, &one.lidar_errors));
        sensors.iter().map(said).collect::<Vec<_>>()
    };
    let by_firing: Vec<Vec<(Stamp, LidarScan)>> = firings.par_iter().map(scan).collect();
    let wall_s = started.elapsed().as_secs_f64();
    for summary in summaries {
        summary.rays_wall_s += wall_s;
        summary.beams += (firings.len() * lidar.beams().len()) as u64;
        summary.rays += (firings.len() * lidar.beams().len() * lidar.rays_per_beam()) as u64;
    }
    let mut by_sensors: Vec<Vec<_>> = sensors.iter().map(|_| Vec::with_capacity(by_firing.len())).collect();
    for scans in by_firing {
        by_sensors.iter_mut().zip(scans).for_each(|(all, scan)| all.push(scan));
    }
    by_sensors
}
