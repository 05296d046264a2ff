//! The first window, at the start and after a gap.

use super::Estimator;
use super::phase::{GapRecovery, Gathering, Phase, Tracking};
use super::sensed::SensedMotion;
use crate::border::Border;
use crate::clock::Clock;
use crate::consider::ConsiderCovariance;
use crate::initial::{self, InitialState, NoiseFactors, StateBeforeGap};
use crate::intake::Segment;
use crate::local_map::LocalMap;
use crate::standstill::{Standstill, standstill};
use crate::strapdown::Interval;
use crate::surfel::SurfelBuilder;
use crate::window::{Window, WindowSolution};
use crate::{EstimatorSpec, EventKind};
use zsim_base::geometry::Vector;
use zsim_base::time::Stamp;

/// An estimated noise above the specification by more than this factor causes a warning.
const REPORTED_NOISE_FACTOR: f64 = 1.5;

/// A first window is rejected if its solution still moves by more than this, m, or if IMU and lidar contradict each other by
/// more than this multiple of the IMU noise (at most 0.6 in windows of sound runs): the start was wrong.
const MAX_AT_START: (f64, f64) = (0.02, 0.9);
/// The estimate, and the window after each gap, start again at most so often: a head that never starts well is reported as
/// lost.
const MAX_RESTARTS: usize = 3;
/// Number of windows before the first full one after a gap that must converge, too.
const EARLIER_WINDOWS: usize = 2;
/// A window after a gap that starts again starts later by this, s.
const LATER_S: f64 = 0.5;

impl Estimator {
    /// Whether to start again costs nothing, because no pose has been output yet, and none is known from before a gap.
    pub(super) fn may_start_again(&self, recovery: Option<&GapRecovery>) -> bool {
        self.newest_pose.is_none() && recovery.is_none() && self.restarts < MAX_RESTARTS
    }

    /// Keeps the estimate even if its start is wrong: no data follow from which it could start again.
    pub(super) fn keep_start(&mut self) {
        self.restarts = MAX_RESTARTS;
    }

    /// Whether the first full window, at the start or after a gap, shows by its solution that its start was wrong.
    ///
    /// A head that swings while the IMU has gaps can start with a velocity and a tilt from which the matches do not converge.
    pub(super) fn rejects_start(&mut self, tracking: &Tracking, solved: &WindowSolution, stamp: Stamp) -> bool {
        let may_reject = match &tracking.recovery {
            Some(recovery) => recovery.restarts < MAX_RESTARTS,
            None => self.may_start_again(None) && self.map_localisation.is_none(),
        };
        if !(may_reject && tracking.window.is_full()) {
            return false;
        }
        // A window after a gap can converge to a wrong motion in the end, so that the windows before count, too.
        let earlier = tracking.recovery.as_ref().map_or(0, |_| EARLIER_WINDOWS);
        let last = self.diagnostics.windows.iter().rev().take(earlier).map(|window| window.last_correction_m);
        let correction_m = last.fold(solved.last_correction_m, f64::max);
        let times = tracking.window.imu_contradiction();
        let is_rejected = correction_m > MAX_AT_START.0 || times > MAX_AT_START.1;
        if is_rejected {
            self.diagnostics.warn(stamp, EventKind::StartRejected { correction_m, times });
        }
        is_rejected
    }

    /// Discards a window whose start was wrong: after a gap it starts again later, else the next data start the estimate.
    pub(super) fn start_later(&mut self, phase: &mut Phase) {
        let Phase::Tracking(tracking) = phase else { return };
        let Some(mut recovery) = tracking.recovery.take() else { return self.start_again(phase) };
        let mut segments = std::mem::take(&mut recovery.segments);
        segments.extend(tracking.waiting.drain(..));
        let skipped = segments.drain(..segments.len().min((LATER_S / self.spec.step_s).ceil() as usize));
        for segment in skipped {
            recovery.coasting.iter_mut().for_each(|coasting| coasting.add_skipped(&segment.intervals));
        }
        recovery.restarts += 1;
        self.forget_windows_after(recovery.windows);
        *phase = Phase::Gathering(Gathering { segments, recovery: Some(recovery) });
        self.start_if_ready(phase, false);
    }

    /// Discards everything estimated so far; the next data start the estimate.
    pub(super) fn start_again(&mut self, phase: &mut Phase) {
        // Without a place in the map there is nothing to lose.
        let is_unplaced = self.map_localisation.as_ref().is_some_and(|map| map.found().is_none());
        self.restarts += usize::from(!is_unplaced);
        *phase = Phase::default();
        self.intake.start_again();
        self.local_map = LocalMap::without_views(&self.spec, self.local_map.consider.clone());
        self.forget_windows_after(0);
    }

    /// Forgets what has been reported on the windows after the first `count`; the warnings remain.
    fn forget_windows_after(&mut self, count: usize) {
        self.diagnostics.forget_windows_after(count);
        self.clock_offsets.truncate(count);
    }

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
        let standstill = standstill(&gathering.returns(), self.spec.inertial.rest_s);
        let initial_state = self.initial_state(intervals, standstill, &adapted);
        let Gathering { segments: mut waiting, recovery } = gathering;
        self.raise_noise(initial_state.noise_factors, &mut waiting, start_s);
        let before = recovery.as_ref().map(|recovery| &recovery.before);
        let initial_state = match &recovery {
            Some(recovery) => match &recovery.coasting {
                Some(coasting) => initial_state.after_coasting(&recovery.before, coasting),
                None => initial_state.continued_from(&recovery.before, start_s),
            },
            None => initial_state,
        };
        if before.is_none() && initial_state.rest.is_none() {
            self.diagnostics.warn(self.intake.stamp(start_s), EventKind::StartedInMotion);
        }
        let clock = match before {
            Some(before) => before.unknowns.clock.after_gap(before.until_s, start_s),
            None => Clock::starting(&self.spec, start_s),
        };
        let mut window = self.first_window(&adapted, &initial_state, start_s, clock);
        if standstill == Standstill::Unknown {
            window = window.with_unobservable_rest();
        }
        if let Some(before) = before {
            window.resume_from(before);
        }
        self.local_map.consider = self.covariance_at_start(&window, before);
        let (waiting, sensed) = (waiting.into(), SensedMotion::default());
        Tracking { window, waiting, recovery, at_end: None, sensed, next_pose: None, is_rejected: false }
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
            self.diagnostics.warn(self.intake.stamp(start_s), EventKind::NoisyImu { gyro, accel });
        }
    }

    /// The window after the start or a restart at `start_s`, IMU time, s.
    fn first_window(&self, spec: &EstimatorSpec, initial_state: &InitialState, start_s: f64, clock: Clock) -> Window {
        let imu_from_laser = self.calibration.head_from_imu.inverse() * self.calibration.head_from_laser;
        let builder = SurfelBuilder {
            spec: spec.surfels.clone(),
            noise: self.calibration.lidar,
            scan_normal: self.intake.is_planar().then(|| imu_from_laser.rotation * Vector::z()),
            laser_in_imu: imu_from_laser.translation.vector,
        };
        let border = Border::new(initial_state.information, &self.calibration.imu, self.spec.clock.estimated);
        let observed_builder = SurfelBuilder { spec: spec.registration.surfels(&spec.surfels), ..builder.clone() };
        let window = Window::new(spec, builder, initial_state, start_s, clock, border);
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
