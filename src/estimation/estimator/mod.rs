//! The estimator: measurements in, poses out.

mod gauge;
mod poses;
mod reports;
mod warnings;

use self::gauge::GaugeBuilder;
use self::reports::{is_dead_reckoning, problem, report};
use crate::estimation::border::Border;
use crate::estimation::consider::{ConsiderCovariance, Sensitivity, StartMatrix};
use crate::estimation::initial::{self, InitialState, NoiseFactors, StateBeforeGap};
use crate::estimation::intake::{Intake, Segment};
use crate::estimation::localisation::{GapRelocalisation, MapLocalisation};
use crate::estimation::observed::ObservedSurfels;
use crate::estimation::standstill::{Standstill, standstill};
use crate::estimation::strapdown::Interval;
use crate::estimation::surfel::{Patch, SurfelBuilder, TimedReturn};
use crate::estimation::timing::Stopwatch;
use crate::estimation::views::Views;
use crate::estimation::window::{Linearised, Window};
use crate::estimation::{EstimatedPose, EstimationError, EstimatorSpec, OpenLoop, Warning, WarningKind, WindowReport};
use crate::geometry::{Pose, Trajectory, Vector};
use crate::measurement::{Calibration, LidarCorrection, Measurement};
use crate::surfel_map::SurfelMap;
use crate::time::Stamp;
use std::time::Instant;

/// Speed (m/s) or rotation rate (rad/s) above which too few matches are a problem. Below both the IMU is sufficient.
const FAST_MOTION: (f64, f64) = (0.3, 0.5);

/// An estimated noise above the specification by more than this factor causes a warning.
const REPORTED_NOISE_FACTOR: f64 = 1.5;

/// The open-loop estimator: measurements in, poses out, memory bounded by the window and the fixed views.
///
/// Latency: [`Estimator::take_poses`] returns a pose when it is final, `window_s` plus `step_s` after the time of the
/// pose, plus 0.1 s for late measurements. While the head rests, the window grows until the lidar has swept for
/// `window_s`, up to three times `window_s`, and the latency grows with it.
#[derive(Debug)]
pub struct Estimator {
    spec: EstimatorSpec,
    calibration: Calibration,
    intake: Intake,
    /// Segments received before the first window exists.
    waiting: Vec<Segment>,
    window: Option<Window>,
    /// The state at the start of the last IMU gap, until gravity is aligned after the gap.
    before_gap: Option<StateBeforeGap>,
    views: Views,
    /// Localisation in the given map, if any.
    map_localisation: Option<MapLocalisation>,
    /// Pending relocalisation in the surfaces seen before an IMU gap.
    gap_relocalisation: Option<GapRelocalisation>,
    /// Observed surfaces, if the caller requests them.
    observed: Option<ObservedSurfels>,
    consider: ConsiderCovariance,
    gauge: GaugeBuilder,
    /// Sensitivity of the end of the newest window to the errors at its start.
    at_end: Option<Sensitivity>,
    next_pose: Option<Stamp>,
    /// Stamp of the last pose of the output.
    newest_pose: Option<Stamp>,
    poses: Vec<EstimatedPose>,
    clock_offsets: Vec<(Stamp, f64)>,
    windows: Vec<WindowReport>,
    warnings: Vec<Warning>,
    /// Total time of dead reckoning with the IMU, s.
    dead_reckoning_s: f64,
    /// The problem of the newest window, and whether it was reported.
    problem: Option<(WarningKind, bool)>,
}

impl Estimator {
    /// An estimator without measurements.
    ///
    /// # Errors
    /// If a setting or the calibration is invalid.
    pub fn new(spec: &EstimatorSpec, calibration: &Calibration) -> Result<Self, EstimationError> {
        spec.check()?;
        check(calibration)?;
        Ok(Self {
            spec: spec.clone(),
            calibration: calibration.clone(),
            intake: Intake::new(spec, calibration),
            waiting: Vec::new(),
            window: None,
            before_gap: None,
            views: Views::new(&spec.views, spec.fixed_views),
            map_localisation: None,
            gap_relocalisation: None,
            observed: None,
            consider: ConsiderCovariance::new(Vector::zeros(), &StartMatrix::zeros()),
            gauge: GaugeBuilder::default(),
            at_end: None,
            next_pose: None,
            newest_pose: None,
            poses: Vec::new(),
            clock_offsets: Vec::new(),
            windows: Vec::new(),
            warnings: Vec::new(),
            dead_reckoning_s: 0.0,
            problem: None,
        })
    }

    /// Also stores the observed surfaces for [`super::register`]; memory then grows with the recording.
    pub fn recording_surfels(self) -> Self {
        Self { observed: Some(ObservedSurfels::default()), ..self }
    }

    /// Estimates the trajectory in the frame of `map`, with every window matched with the map.
    ///
    /// The head must start near `map_from_head`: within 1 m horizontally and 20 degrees of heading. The first pose is
    /// available when the first full window is localised.
    pub fn in_map(self, map: &SurfelMap, map_from_head: &Pose) -> Self {
        Self { map_localisation: Some(MapLocalisation::new(map, *map_from_head, &self.spec)), ..self }
    }

    /// Adds a measurement, in approximate order of time; processes each segment that is complete.
    ///
    /// # Errors
    /// If the measurement is not finite, or localisation in the given map fails.
    pub fn push(&mut self, measurement: Measurement) -> Result<(), EstimationError> {
        self.intake.push(measurement)?;
        while let Some(segment) = self.intake.next_segment(false) {
            self.advance(segment)?;
        }
        Ok(())
    }

    /// The poses that became final since the last call, in order of time.
    pub fn take_poses(&mut self) -> Vec<EstimatedPose> {
        std::mem::take(&mut self.poses)
    }

    /// Processes the remaining data; the result has the poses not yet returned, and the reports of all windows.
    ///
    /// # Errors
    /// If IMU or lidar data are missing or too short to start, localisation in the given map fails, or a pose is not finite.
    pub fn finish(mut self) -> Result<OpenLoop, EstimationError> {
        while let Some(segment) = self.intake.next_segment(true) {
            self.advance(segment)?;
        }
        self.start_if_ready(true);
        self.localise_in_map()?;
        self.relocalise();
        self.intake.close();
        self.warnings.extend(self.intake.take_warnings());
        self.warn_of_loss();
        self.warn_of_contradiction();
        let Some(window) = &self.window else { return Err(self.missing_data_error()) };
        let end_s = window.nominal.end_s().min(window.clock.imu_s(self.end_tau_s()));
        let (lidar, calibrated_lidar) = (window.lidar(), window.calibrated_lidar());
        self.propagate_to_end();
        self.output_poses(end_s);
        self.record_observed(Window::observed_in_all, Window::end_s);
        let stamped = self.poses.iter().map(|pose| (pose.stamp, pose.map_from_head));
        let trajectory = Trajectory::from_poses(stamped)?;
        let aligned_covariances = self.gauge.finish(&mut self.consider, self.newest_pose);
        let Self { poses, clock_offsets, windows, warnings, observed, map_localisation, .. } = self;
        let observed = observed.unwrap_or_default();
        let located = map_localisation.and_then(|map_localisation| map_localisation.found().cloned());
        let learnt = OpenLoop { lidar, calibrated_lidar, located, ..OpenLoop::default() };
        Ok(OpenLoop { trajectory, poses, aligned_covariances, clock_offsets, windows, warnings, observed, ..learnt })
    }

    /// Adds a segment: handles a gap before it, starts the first window, and processes the segment.
    fn advance(&mut self, segment: Segment) -> Result<(), EstimationError> {
        // A restart before relocalisation would discard the pending search.
        // To restart again while a relocalisation is pending would leave no time for it.
        self.intake.bridge_gaps(self.gap_relocalisation.is_some());
        self.warnings.extend(self.intake.take_warnings());
        if segment.after_gap {
            self.localise_in_map()?;
            self.relocalise();
            self.stop_at_gap();
        }
        self.waiting.push(segment);
        self.start_if_ready(false);
        if self.window.is_some() {
            for segment in std::mem::take(&mut self.waiting) {
                self.process(segment)?;
            }
        }
        Ok(())
    }

    /// Solves the window with the new segment and outputs the poses that become final.
    fn process(&mut self, segment: Segment) -> Result<(), EstimationError> {
        let Some(window) = &mut self.window else { return Ok(()) };
        let started = Instant::now();
        let mut timing = window.extend(&segment.intervals, segment.returns, segment.end_s);
        let (mut solved, mut linearised) = window.solve(&self.views);
        timing += solved.timing;
        let mut watch = Stopwatch::start();
        window.rebuild_newest_surfels();
        timing.surfels_s += watch.lap_s();
        if window.is_full()
            && let Some(before_gap) = self.before_gap.take()
        {
            window.align_gravity_with(&before_gap);
        }
        if window.is_full() && (self.localise_in_map()? || self.relocalise()) {
            // Solve again, with matches with the map or the old views.
            let Some(window) = &mut self.window else { return Ok(()) };
            (solved, linearised) = window.solve(&self.views);
            timing += solved.timing;
            watch.lap_s();
        }
        let Some(window) = &self.window else { return Ok(()) };
        let elapsed_s = started.elapsed().as_secs_f64();
        if window.is_full() {
            self.record_observed(Window::observed_in_oldest, Window::oldest_end_s);
        }
        watch.lap_s(); // the observed surfels have their own time
        let final_until_s = self.finish_oldest_segment(linearised.as_ref());
        timing.views_s += watch.lap_s();
        let Some(window) = &mut self.window else { return Ok(()) };
        let took = (elapsed_s + timing.views_s, timing);
        self.clock_offsets.push((self.intake.stamp(window.clock.at_s), window.clock.offset_s));
        let moving = window.speed_m_per_s() > FAST_MOTION.0
            || segment.intervals.iter().any(|(_, i)| i.gyro.norm() > FAST_MOTION.1);
        let problem = problem(&solved, &self.spec, moving);
        let at = (self.intake.stamp(segment.end_s), moving);
        self.windows.push(report(&solved, at, window, problem.clone(), took));
        self.dead_reckoning_s += if problem.as_ref().is_some_and(is_dead_reckoning) { self.spec.step_s } else { 0.0 };
        self.warn_of_problem(problem, segment.end_s);
        if let Some(until_s) = final_until_s {
            self.output_poses(until_s);
            let Some(window) = &mut self.window else { return Ok(()) };
            window.nominal.forget_before(until_s - 0.2);
        }
        Ok(())
    }

    /// Localises the window in the given map, if a search is pending; returns whether it succeeded.
    fn localise_in_map(&mut self) -> Result<bool, EstimationError> {
        let (Some(map_localisation), Some(window)) = (&mut self.map_localisation, &mut self.window) else {
            return Ok(false);
        };
        let found = match map_localisation.find(window, &self.calibration.head_from_imu) {
            Some(Ok(found)) => found,
            Some(Err(_)) if map_localisation.found().is_some() => {
                let stamp = self.intake.stamp(window.nominal.end_s());
                self.warnings.push(Warning { stamp, kind: WarningKind::LostInMap });
                return Ok(false);
            }
            Some(Err(error)) => return Err(error),
            None => return Ok(false),
        };
        window.move_by(&found.map_from_query);
        let position = window.start_pose().translation.vector;
        let views = Views::new(&self.spec.views, self.spec.fixed_views);
        self.views = views.with_map(map_localisation.patches(), window.matcher(), position);
        let known = window.known_at_start().unwrap_or_default();
        self.consider =
            ConsiderCovariance::localised(position, &known, (found.covariance, map_localisation.covariance()));
        Ok(true)
    }

    /// Relocalises the window in the surfaces seen before a gap, if a search is pending; returns whether it succeeded.
    fn relocalise(&mut self) -> bool {
        let (Some(window), Some(search)) = (&mut self.window, self.gap_relocalisation.take()) else { return false };
        let stamp = self.intake.stamp(window.nominal.end_s());
        let (map_from_here, views, consider) = match search.find(window, &self.spec) {
            Ok(found) => found,
            Err(why) => {
                self.warnings.push(Warning { stamp, kind: WarningKind::NotRelocalised { why } });
                return false;
            }
        };
        let distance_m = (consider.pivot() - self.consider.pivot()).norm();
        self.warnings.push(Warning { stamp, kind: WarningKind::Relocalised { distance_m } });
        window.move_by(&map_from_here);
        (self.views, self.consider) = (views, consider);
        true
    }

    /// Removes the oldest segment if the window is full. Returns the time up to which poses are final, IMU time, s.
    fn finish_oldest_segment(&mut self, linearised: Option<&Linearised>) -> Option<f64> {
        let window = self.window.as_mut()?;
        let end_s = window.nominal.end_s();
        self.at_end = linearised.and_then(|at| window.sensitivity_at(end_s, at, &self.views));
        if !window.is_full() {
            return None;
        }
        let until_s = window.next_start_s()?;
        if let Some(by) = linearised.and_then(|at| window.sensitivity_at(until_s, at, &self.views)) {
            self.consider.advance(&by);
        }
        let tau_s = until_s - window.clock.offset_at(until_s);
        self.gauge.advance(&mut self.consider, until_s, self.intake.stamp(tau_s));
        let window = self.window.as_mut()?;
        let patches = window.remove_oldest(linearised)?;
        let update = self.views.add_segment(&patches, self.spec.step_s, (window.matcher(), self.consider.pivot()));
        self.consider.update_views(update);
        Some(until_s)
    }

    /// Handles an IMU gap: the content of the window is final, and the estimate restarts after the gap.
    fn stop_at_gap(&mut self) {
        self.waiting.clear();
        let Some(window) = &self.window else { return };
        let end_s = window.nominal.end_s().min(window.clock.imu_s(self.end_tau_s()));
        self.before_gap = window.state_before_gap();
        self.propagate_to_end();
        self.output_poses(end_s);
        self.record_observed(Window::observed_in_all, Window::end_s);
        let Some(window) = self.window.take() else { return };
        self.next_pose = None;
        // The pose relative to the old views is unknown after the gap; accidental matches with them would be wrong.
        let mut views = std::mem::replace(&mut self.views, Views::new(&self.spec.views, self.spec.fixed_views));
        if let Some(map_localisation) = &mut self.map_localisation {
            self.poses.last().into_iter().for_each(|last| map_localisation.restart_search(last.map_from_head));
        } else {
            let last = window.patches();
            let update = views.add_segment(&last, self.spec.views.length_s, (window.matcher(), self.consider.pivot()));
            self.consider.update_views(update);
            self.gap_relocalisation =
                Some(GapRelocalisation::new((views, self.consider.clone()), last, window.nominal.end_s()));
        }
    }

    /// Creates the first window once there are enough data to distinguish rest from motion; with `last`, with any data.
    fn start_if_ready(&mut self, last: bool) {
        if self.window.is_some() {
            return;
        }
        let intervals: Vec<Interval> = self.waiting.iter().flat_map(|s| &s.intervals).map(|(_, i)| *i).collect();
        let seconds: f64 = intervals.iter().map(|i| i.h).sum();
        if intervals.is_empty() || (seconds < self.spec.inertial.rest_s && !last) {
            return;
        }
        let Some((start_s, _)) = self.waiting.first().and_then(|s| s.intervals.first()) else { return };
        let until = intervals.iter().scan(0.0, |sum, i| {
            *sum += i.h;
            Some(*sum)
        });
        let resting = until.take_while(|t| *t <= self.spec.inertial.rest_s).count().max(1);
        let adapted = self.intake.scan_geometry().adapt(&self.spec);
        if let Some(observed) = &mut self.observed {
            observed.range_bias_is_fixed = self.intake.scan_geometry().is_one_way();
        }
        let (head_from_imu, noise) = (&self.calibration.head_from_imu, &self.calibration.imu);
        let standstill = self.lidar_standstill();
        let may_rest = standstill != Standstill::Moves;
        let initial_state = initial::estimate((&intervals[..resting], may_rest), head_from_imu, noise, &adapted);
        let start_s = *start_s;
        self.raise_noise(initial_state.noise_factors, start_s);
        let (initial_state, continues) = match &self.before_gap {
            Some(before_gap) => (initial_state.continued_from(before_gap, start_s), true),
            None => (initial_state, false),
        };
        if !continues && initial_state.rest.is_none() {
            let stamp = self.intake.stamp(start_s);
            self.warnings.push(Warning { stamp, kind: WarningKind::StartedInMotion });
        }
        let mut window = self.first_window(&adapted, &initial_state, start_s);
        if standstill == Standstill::Unknown {
            window = window.with_unobservable_rest();
        }
        if let Some(before_gap) = &self.before_gap {
            window.resume_from(before_gap);
        }
        let (pivot, known) = (self.consider.pivot(), window.known_at_start().unwrap_or_default());
        self.consider = if continues {
            ConsiderCovariance::after_gap(pivot, &known)
        } else {
            ConsiderCovariance::new(pivot, &known)
        };
        self.window = Some(window);
    }

    /// Whether the lidar shows motion or rest during the assumed initial rest.
    fn lidar_standstill(&self) -> Standstill {
        let returns: Vec<TimedReturn> = self.waiting.iter().flat_map(|segment| &segment.returns).copied().collect();
        let (Some(first), Some(last)) = (returns.first(), returns.last()) else { return Standstill::Unknown };
        let quarter_s = 0.25 * (last.tau_s.min(first.tau_s + self.spec.inertial.rest_s) - first.tau_s);
        let until_s = first.tau_s + 4.0 * quarter_s;
        let early = returns.partition_point(|one| one.tau_s < first.tau_s + quarter_s);
        let late = returns.partition_point(|one| one.tau_s < until_s - quarter_s);
        let end = returns.partition_point(|one| one.tau_s <= until_s);
        standstill(&returns[..early], &returns[late..end])
    }

    /// Multiplies the assumed IMU noise by factors, also for the queued segments.
    fn raise_noise(&mut self, factors: NoiseFactors, start_s: f64) {
        if factors == NoiseFactors::ONE {
            return;
        }
        factors.scale_noise(&mut self.calibration.imu);
        self.intake.raise_noise(factors);
        for (_, interval) in self.waiting.iter_mut().flat_map(|segment| &mut segment.intervals) {
            *interval = factors.scale(*interval);
        }
        let NoiseFactors { gyro, accel } = factors;
        if gyro.max(accel) > REPORTED_NOISE_FACTOR {
            let stamp = self.intake.stamp(start_s);
            self.warnings.push(Warning { stamp, kind: WarningKind::NoisyImu { gyro, accel } });
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
            lidar: LidarCorrection::default(),
        };
        let border = Border::new(initial_state.information, &self.calibration.imu, self.spec.clock.estimated);
        let observed_builder = SurfelBuilder { spec: spec.registration.surfels(&spec.surfels), ..builder.clone() };
        let window = Window::new(spec, builder, initial_state, start_s, border);
        if self.observed.is_some() { window.with_observed_builder(observed_builder) } else { window }
    }

    /// Adds the patches returned by `surfels`, up to time `until`, to the observed surfels, if they are recorded.
    fn record_observed(&mut self, surfels: fn(&Window) -> Vec<(f64, Patch)>, until: fn(&Window) -> f64) {
        if let (Some(window), Some(observed)) = (&self.window, &mut self.observed) {
            let mut watch = Stopwatch::start();
            observed.extend(self.intake.origin(), surfels(window).into_iter(), window.lidar(), until(window));
            observed.elapsed_s += watch.lap_s();
        }
    }

    /// Propagates the covariance to the end of the window, when the content of the window becomes final.
    fn propagate_to_end(&mut self) {
        if let Some(end) = self.at_end.take() {
            self.consider.propagate_to(&end);
        }
    }

    /// End of the newest window, lidar time, s.
    fn end_tau_s(&self) -> f64 {
        self.windows.last().map_or(0.0, |report| report.stamp.seconds_since(self.intake.origin()))
    }

    /// The error of a run without any window.
    fn missing_data_error(&self) -> EstimationError {
        match self.intake.counts() {
            (0, scans) => EstimationError::NoImu { scans },
            (samples, 0) => EstimationError::NoLidar { samples },
            _ => EstimationError::TooShort { common_s: self.intake.common_s(), needed_s: 2.0 * self.spec.step_s },
        }
    }
}

/// Checks the noise densities of the calibration.
fn check(calibration: &Calibration) -> Result<(), EstimationError> {
    let imu = &calibration.imu;
    let numbers = [
        ("gyroscope noise density", imu.gyro_density_rad_per_s_per_sqrt_hz),
        ("accelerometer noise density", imu.accel_density_m_per_s2_per_sqrt_hz),
        ("lidar range noise", calibration.lidar.near_sigma_m),
    ];
    match numbers.iter().find(|(_, x)| !(x.is_finite() && *x > 0.0)) {
        Some((what, x)) => Err(EstimationError::Calibration(format!("{what} is {x}; must be above 0"))),
        None => Ok(()),
    }
}

/// Estimates a whole recording.
///
/// # Errors
/// As [`Estimator::new`], [`Estimator::push`] and [`Estimator::finish`].
pub fn estimate_all(
    spec: &EstimatorSpec,
    calibration: &Calibration,
    measurements: impl Iterator<Item = Measurement>,
) -> Result<OpenLoop, EstimationError> {
    let mut estimator = Estimator::new(spec, calibration)?;
    for measurement in measurements {
        estimator.push(measurement)?;
    }
    estimator.finish()
}
