//! The first window, at the start and after a gap.

use super::Estimator;
use super::phase::{Gathering, Phase, Tracking};
use crate::estimation::border::Border;
use crate::estimation::consider::ConsiderCovariance;
use crate::estimation::initial::{self, InitialState, NoiseFactors, StateBeforeGap};
use crate::estimation::intake::Segment;
use crate::estimation::standstill::{Standstill, standstill};
use crate::estimation::strapdown::Interval;
use crate::estimation::surfel::{SurfelBuilder, TimedReturn};
use crate::estimation::window::Window;
use crate::estimation::{EstimatorSpec, WarningKind};
use crate::geometry::Vector;

/// An estimated noise above the specification by more than this factor causes a warning.
const REPORTED_NOISE_FACTOR: f64 = 1.5;

impl Estimator {
    /// Starts the first window once there are enough data to distinguish rest from motion; with `last`, with any data.
    pub(super) fn start_if_ready(&mut self, phase: &mut Phase, last: bool) {
        let Phase::Gathering(gathering) = phase else { return };
        let intervals = gathering.intervals();
        let seconds: f64 = intervals.iter().map(|i| i.h).sum();
        if seconds < self.spec.inertial.rest_s && !last {
            return;
        }
        let Some(start_s) = gathering.start_s() else { return };
        *phase = Phase::Tracking(Box::new(self.start(std::mem::take(gathering), &intervals, start_s)));
    }

    /// The first window, which starts at `start_s` (IMU time) with the first of the gathered `intervals`.
    fn start(&mut self, gathering: Gathering, intervals: &[Interval], start_s: f64) -> Tracking {
        let adapted = self.adapt_to_scan_geometry();
        let standstill = lidar_standstill(&gathering.returns(), self.spec.inertial.rest_s);
        let initial_state = self.initial_state(intervals, standstill, &adapted);
        let Gathering { segments: mut waiting, recovery } = gathering;
        self.raise_noise(initial_state.noise_factors, &mut waiting, start_s);
        let before = recovery.as_ref().map(|recovery| &recovery.before);
        let initial_state = match before {
            Some(before) => initial_state.continued_from(before, start_s),
            None => initial_state,
        };
        if before.is_none() && initial_state.rest.is_none() {
            self.diagnostics.warn(self.intake.stamp(start_s), WarningKind::StartedInMotion);
        }
        let mut window = self.first_window(&adapted, &initial_state, start_s);
        if standstill == Standstill::Unknown {
            window = window.with_unobservable_rest();
        }
        if let Some(before) = before {
            window.resume_from(before);
        }
        self.local_map.consider = self.covariance_at_start(&window, before);
        Tracking { window, waiting, recovery, at_end: None, next_pose: None }
    }

    /// The settings adapted to the scan geometry of the lidar.
    fn adapt_to_scan_geometry(&mut self) -> EstimatorSpec {
        let scan_geometry = self.intake.scan_geometry();
        if let Some(observed) = &mut self.observed {
            observed.range_bias_is_fixed = scan_geometry.is_one_way();
        }
        scan_geometry.adapt(&self.spec)
    }

    /// The state at the start of `intervals`, from those that may be at rest.
    fn initial_state(&self, intervals: &[Interval], standstill: Standstill, spec: &EstimatorSpec) -> InitialState {
        let until = intervals.iter().scan(0.0, |sum, i| {
            *sum += i.h;
            Some(*sum)
        });
        let resting = until.take_while(|t| *t <= self.spec.inertial.rest_s).count().max(1);
        let may_rest = standstill != Standstill::Moves;
        let (head_from_imu, noise) = (&self.calibration.head_from_imu, &self.calibration.imu);
        initial::estimate(&intervals[..resting], may_rest, head_from_imu, noise, spec)
    }

    /// Multiplies the assumed IMU noise by factors, also for the `waiting` segments.
    fn raise_noise(&mut self, factors: NoiseFactors, waiting: &mut [Segment], start_s: f64) {
        if factors == NoiseFactors::ONE {
            return;
        }
        factors.scale_noise(&mut self.calibration.imu);
        self.intake.raise_noise(factors);
        for (_, interval) in waiting.iter_mut().flat_map(|segment| &mut segment.intervals) {
            *interval = factors.scale(*interval);
        }
        let NoiseFactors { gyro, accel } = factors;
        if gyro.max(accel) > REPORTED_NOISE_FACTOR {
            self.diagnostics.warn(self.intake.stamp(start_s), WarningKind::NoisyImu { gyro, accel });
        }
    }

    /// The window after the start or a restart.
    fn first_window(&self, spec: &EstimatorSpec, initial_state: &InitialState, start_s: f64) -> Window {
        let imu_from_laser = self.calibration.head_from_imu.inverse() * self.calibration.head_from_laser;
        let builder = SurfelBuilder {
            spec: spec.surfels.clone(),
            noise: self.calibration.lidar,
            scan_normal: self.intake.is_planar().then(|| imu_from_laser.rotation * Vector::z()),
            laser_in_imu: imu_from_laser.translation.vector,
        };
        let border = Border::new(initial_state.information, &self.calibration.imu, self.spec.clock.estimated);
        let observed_builder = SurfelBuilder { spec: spec.registration.surfels(&spec.surfels), ..builder.clone() };
        let window = Window::new(spec, builder, initial_state, start_s, border);
        if self.observed.is_some() { window.with_observed_builder(observed_builder) } else { window }
    }

    /// The covariance at the start of the first window.
    fn covariance_at_start(&self, window: &Window, before: Option<&StateBeforeGap>) -> ConsiderCovariance {
        let (pivot, known) = (self.local_map.consider.pivot(), window.known_at_start().unwrap_or_default());
        match before {
            Some(_) => ConsiderCovariance::after_gap(pivot, &known),
            None => ConsiderCovariance::new(pivot, &known),
        }
    }
}

/// Whether the lidar shows motion or rest during the assumed initial rest of `rest_s`.
fn lidar_standstill(returns: &[TimedReturn], rest_s: f64) -> Standstill {
    let (Some(first), Some(last)) = (returns.first(), returns.last()) else { return Standstill::Unknown };
    let quarter_s = 0.25 * (last.tau_s.min(first.tau_s + rest_s) - first.tau_s);
    let until_s = first.tau_s + 4.0 * quarter_s;
    let early = returns.partition_point(|one| one.tau_s < first.tau_s + quarter_s);
    let late = returns.partition_point(|one| one.tau_s < until_s - quarter_s);
    let end = returns.partition_point(|one| one.tau_s <= until_s);
    standstill(&returns[..early], &returns[late..end])
}
