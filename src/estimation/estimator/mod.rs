//! The estimator: measurements in, poses out.

mod gauging;
mod poses;
mod verdict;

use self::gauging::Gauging;
use self::verdict::{leaves_to_the_imu, report, trouble};
use crate::estimation::border::Border;
use crate::estimation::consider::{Consider, OfBeginning, Sensitivity};
use crate::estimation::initial::{self, InitialState, NoiseFactors, StateBeforeGap};
use crate::estimation::intake::{Intake, Segment};
use crate::estimation::spent::Stopwatch;
use crate::estimation::standstill::{Standstill, standstill};
use crate::estimation::strapdown::Interval;
use crate::estimation::surfel::{Beam, Patch, SurfelMaker};
use crate::estimation::survey::Survey;
use crate::estimation::views::Views;
use crate::estimation::whereabouts::{GapRelocalisation, MapLocalisation};
use crate::estimation::window::{Linearised, Window};
use crate::estimation::{EstimatedPose, EstimationError, EstimatorSpec, OpenLoop, Warning, WarningKind, WindowReport};
use crate::geometry::{Pose, Trajectory, Vector};
use crate::measurement::{Calibration, LidarCorrection, Measurement};
use crate::surfel_map::SurfelMap;
use crate::time::Stamp;
use std::time::Instant;

/// A head faster than this, m/s, or turning faster than this, rad/s, should match surfaces. Below both the IMU is
/// sufficient.
const MOVING: (f64, f64) = (0.3, 0.5);

/// Until the head is relocalised after a gap, the next gap is bridged up to this many times longer than
/// usual.
const RELUCTANTLY: f64 = 3.0;

/// An estimated noise above the specification by more than this factor is reported.
const REPORTED_NOISE_FACTOR: f64 = 1.5;

/// The open-loop estimator: measurements in, poses out, memory bounded by the window and the fixed views.
///
/// Latency: [`Estimator::take_poses`] returns a pose when it is final, `window_s` plus `step_s` after the time of the
/// pose, plus 0.1 s for late measurements. While the head is at rest
/// the window grows until the lidar has swept for `window_s`, to three times `window_s` at most; the latency grows too.
#[derive(Debug)]
pub struct Estimator {
    spec: EstimatorSpec,
    calibration: Calibration,
    intake: Intake,
    /// Segments that wait until there are enough to begin.
    waiting: Vec<Segment>,
    window: Option<Window>,
    /// The state at the start of the last IMU gap, until the first window after the gap is level.
    carried: Option<StateBeforeGap>,
    views: Views,
    /// A map in which the head is, where one is given.
    whereabouts: Option<MapLocalisation>,
    /// Surfaces from before the IMU gap, until relocalisation in them is done.
    before: Option<GapRelocalisation>,
    /// Observed surfaces, where the caller requests them.
    survey: Option<Survey>,
    consider: Consider,
    gauging: Gauging,
    /// Sensitivity of the newest window's end to the errors of its beginning.
    at_end: Option<Sensitivity>,
    next_pose: Option<Stamp>,
    /// Stamp of the last pose that was handed out.
    newest_pose: Option<Stamp>,
    poses: Vec<EstimatedPose>,
    clock_offsets: Vec<(Stamp, f64)>,
    windows: Vec<WindowReport>,
    warnings: Vec<Warning>,
    /// Time for which only the IMU constrained the motion, s.
    carried_s: f64,
    /// The problem of the newest window, and whether it was reported.
    trouble: Option<(WarningKind, bool)>,
}

impl Estimator {
    /// An estimator without measurements.
    ///
    /// # Errors
    /// When a setting or the calibration makes no sense.
    pub fn new(spec: &EstimatorSpec, calibration: &Calibration) -> Result<Self, EstimationError> {
        spec.check()?;
        check(calibration)?;
        Ok(Self {
            spec: spec.clone(),
            calibration: calibration.clone(),
            intake: Intake::new(spec, calibration),
            waiting: Vec::new(),
            window: None,
            carried: None,
            views: Views::new(&spec.views, spec.fixed_views),
            whereabouts: None,
            before: None,
            survey: None,
            consider: Consider::new(Vector::zeros(), &OfBeginning::zeros()),
            gauging: Gauging::default(),
            at_end: None,
            next_pose: None,
            newest_pose: None,
            poses: Vec::new(),
            clock_offsets: Vec::new(),
            windows: Vec::new(),
            warnings: Vec::new(),
            carried_s: 0.0,
            trouble: None,
        })
    }

    /// The same estimator, which also stores its observations for [`super::register`]: memory then grows with the
    /// recording.
    pub fn surveying(self) -> Self {
        Self { survey: Some(Survey::default()), ..self }
    }

    /// The same estimator, with the trajectory in the frame of `map`. The head starts near
    /// `map_from_head`: within a metre on the level and twenty degrees about the vertical. Every window is
    /// matched with the map too. The first pose follows after the first full window, when the head is localised.
    pub fn in_map(self, map: &SurfelMap, map_from_head: &Pose) -> Self {
        Self { whereabouts: Some(MapLocalisation::about(map, *map_from_head, &self.spec)), ..self }
    }

    /// Takes a measurement, in about the order of time; when a segment of time is complete, the window moves over it.
    ///
    /// # Errors
    /// When the measurement is not finite, or the head is not found in the map that was given.
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

    /// Solves the remaining windows; the result has the poses not yet returned, and the reports of all windows.
    ///
    /// # Errors
    /// When there was no IMU, no lidar, or too little of both to start, or the head is not found in the map that was
    /// given.
    pub fn finish(mut self) -> Result<OpenLoop, EstimationError> {
        while let Some(segment) = self.intake.next_segment(true) {
            self.advance(segment)?;
        }
        self.begin(true);
        self.find_in_map()?;
        self.find_again();
        self.intake.close();
        self.warnings.extend(self.intake.take_warnings());
        self.warn_of_loss();
        self.warn_of_contradiction();
        let Some(window) = &self.window else { return Err(self.why_nothing()) };
        let end_s = window.nominal.end_s().min(window.clock.imu_s(self.end_tau_s()));
        let (lidar, calibrated_lidar) = (window.lidar(), window.calibrated_lidar());
        self.consider_the_end();
        self.hand_out(end_s);
        self.survey_window(Window::survey_all, Window::end_s);
        let stamped = self.poses.iter().map(|pose| (pose.stamp, pose.map_from_head));
        let trajectory = Trajectory::from_poses(stamped).unwrap_or_default();
        let gauged = self.gauging.finish(&mut self.consider, self.newest_pose);
        let Self { poses, clock_offsets, windows, warnings, survey, whereabouts, .. } = self;
        let survey = survey.unwrap_or_default();
        let located = whereabouts.and_then(|whereabouts| whereabouts.found().cloned());
        let learnt = OpenLoop { lidar, calibrated_lidar, located, ..OpenLoop::default() };
        Ok(OpenLoop { trajectory, poses, gauged, clock_offsets, windows, warnings, survey, ..learnt })
    }

    /// Processes one segment: it joins the window, the window is solved, the oldest segment leaves, its poses are
    /// final, and its surfels may become a fixed view.
    fn advance(&mut self, segment: Segment) -> Result<(), EstimationError> {
        // While the head is still to be found, beginning once more would be to lose it.
        self.intake.bridge_gaps_up_to(if self.before.is_some() { RELUCTANTLY } else { 1.0 });
        self.warnings.extend(self.intake.take_warnings());
        if segment.after_gap {
            self.find_in_map()?;
            self.find_again();
            self.pause();
        }
        self.waiting.push(segment);
        self.begin(false);
        if self.window.is_some() {
            for segment in std::mem::take(&mut self.waiting) {
                self.take_in(segment)?;
            }
        }
        Ok(())
    }

    fn take_in(&mut self, segment: Segment) -> Result<(), EstimationError> {
        let Some(window) = &mut self.window else { return Ok(()) };
        let started = Instant::now();
        let mut spent = window.extend(&segment.intervals, segment.beams, segment.end_s);
        let (mut solved, mut linearised) = window.solve(&self.views);
        spent += solved.spent;
        let mut watch = Stopwatch::start();
        window.remake_newest();
        spent.surfels_s += watch.lap_s();
        if window.is_full()
            && let Some(carried) = self.carried.take()
        {
            window.level_as(&carried);
        }
        if window.is_full() && (self.find_in_map()? || self.find_again()) {
            // Solve a second time, with the surfaces in view there.
            let Some(window) = &mut self.window else { return Ok(()) };
            (solved, linearised) = window.solve(&self.views);
            spent += solved.spent;
            watch.lap_s();
        }
        let Some(window) = &self.window else { return Ok(()) };
        let elapsed_s = started.elapsed().as_secs_f64();
        if window.is_full() {
            self.survey_window(Window::survey_oldest, Window::oldest_end_s);
        }
        watch.lap_s(); // the survey reports this time itself
        let final_until_s = self.let_go(linearised.as_ref());
        spent.views_s += watch.lap_s();
        let Some(window) = &mut self.window else { return Ok(()) };
        let took = (elapsed_s + spent.views_s, spent);
        self.clock_offsets.push((self.intake.stamp(window.clock.at_s), window.clock.offset_s));
        let moving =
            window.speed_m_per_s() > MOVING.0 || segment.intervals.iter().any(|(_, i)| i.gyro.norm() > MOVING.1);
        let trouble = trouble(&solved, &self.spec, moving);
        let at = (self.intake.stamp(segment.end_s), moving);
        self.windows.push(report(&solved, at, window, trouble.clone(), took));
        self.carried_s += if trouble.as_ref().is_some_and(leaves_to_the_imu) { self.spec.step_s } else { 0.0 };
        self.say(trouble, segment.end_s);
        if let Some(until_s) = final_until_s {
            self.hand_out(until_s);
            let Some(window) = &mut self.window else { return Ok(()) };
            window.nominal.forget_before(until_s - 0.2);
        }
        Ok(())
    }

    /// Puts the window into the map where one is given and the head is not found in it yet; whether it is found now.
    fn find_in_map(&mut self) -> Result<bool, EstimationError> {
        let (Some(whereabouts), Some(window)) = (&mut self.whereabouts, &mut self.window) else { return Ok(false) };
        let found = match whereabouts.find(window, &self.calibration.head_from_imu) {
            Some(Ok(found)) => found,
            Some(Err(_)) if whereabouts.found().is_some() => {
                let stamp = self.intake.stamp(window.nominal.end_s());
                self.warnings.push(Warning { stamp, kind: WarningKind::LostInMap });
                return Ok(false);
            }
            Some(Err(error)) => return Err(error),
            None => return Ok(false),
        };
        window.found_at(&found.map_from_seen);
        let place = window.begins().translation.vector;
        let views = Views::new(&self.spec.views, self.spec.fixed_views);
        self.views = views.in_map(whereabouts.patches(), window.matcher(), place);
        let known = window.known_at_start().unwrap_or_default();
        self.consider = Consider::found(place, &known, (found.covariance, whereabouts.covariance()));
        Ok(true)
    }

    /// Relocalises the window in the surfaces from before a gap, if a search is pending; returns whether it succeeded.
    fn find_again(&mut self) -> bool {
        let (Some(window), Some(before)) = (&mut self.window, self.before.take()) else { return false };
        let stamp = self.intake.stamp(window.nominal.end_s());
        let (map_from_here, views, consider) = match before.find(window, &self.spec) {
            Ok(found) => found,
            Err(why) => {
                self.warnings.push(Warning { stamp, kind: WarningKind::NotRelocalised { why } });
                return false;
            }
        };
        let away_m = (consider.pivot() - self.consider.pivot()).norm();
        self.warnings.push(Warning { stamp, kind: WarningKind::Relocalised { away_m } });
        window.found_at(&map_from_here);
        (self.views, self.consider) = (views, consider);
        true
    }

    /// Lets the oldest segment go if the window is full. Until when, IMU time, the poses are final then, s.
    fn let_go(&mut self, linearised: Option<&Linearised>) -> Option<f64> {
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
        self.gauging.advance(&mut self.consider, until_s, self.intake.stamp(tau_s));
        let window = self.window.as_mut()?;
        let patches = window.let_go(linearised)?;
        let taken = self.views.take(&patches, self.spec.step_s, (window.matcher(), self.consider.pivot()));
        self.consider.take(taken);
        Some(until_s)
    }

    /// Handles an IMU gap: the window's content is final, and the estimate restarts after the gap.
    fn pause(&mut self) {
        self.waiting.clear();
        let Some(window) = &self.window else { return };
        let end_s = window.nominal.end_s().min(window.clock.imu_s(self.end_tau_s()));
        self.carried = window.carried();
        self.consider_the_end();
        self.hand_out(end_s);
        self.survey_window(Window::survey_all, Window::end_s);
        let Some(window) = self.window.take() else { return };
        self.next_pose = None;
        // Where the head is now in the old views is unknown: matched by chance, they would bend the new segment.
        let mut views = std::mem::replace(&mut self.views, Views::new(&self.spec.views, self.spec.fixed_views));
        if let Some(whereabouts) = &mut self.whereabouts {
            self.poses.last().into_iter().for_each(|last| whereabouts.look_again(last.map_from_head));
        } else {
            let last = window.patches();
            let taken = views.take(&last, self.spec.views.length_s, (window.matcher(), self.consider.pivot()));
            self.consider.take(taken);
            self.before = Some(GapRelocalisation::new((views, self.consider.clone()), last, window.nominal.end_s()));
        }
    }

    /// Starts when the data suffice to distinguish rest from motion; with `last`, with the data available.
    fn begin(&mut self, last: bool) {
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
        let fitting = self.intake.sight().fit(&self.spec);
        if let Some(survey) = &mut self.survey {
            survey.ranges_are_held = self.intake.sight().is_one_way();
        }
        let (head_from_imu, noise) = (&self.calibration.head_from_imu, &self.calibration.imu);
        let seen = self.seen_standstill();
        let may_rest = seen != Standstill::Moves;
        let beginning = initial::estimate((&intervals[..resting], may_rest), head_from_imu, noise, &fitting);
        let start_s = *start_s;
        self.raise_noise(beginning.noise_factors, start_s);
        let (beginning, goes_on) = match &self.carried {
            Some(carried) => (beginning.continued_from(carried, start_s), true),
            None => (beginning, false),
        };
        if !goes_on && beginning.rest.is_none() {
            let stamp = self.intake.stamp(start_s);
            self.warnings.push(Warning { stamp, kind: WarningKind::StartedInMotion });
        }
        let mut window = self.first_window(&fitting, &beginning, start_s);
        if seen == Standstill::Unknown {
            window = window.without_seeing_rest();
        }
        if let Some(carried) = &self.carried {
            window.take_over(carried);
        }
        let (pivot, known) = (self.consider.pivot(), window.known_at_start().unwrap_or_default());
        self.consider = if goes_on { Consider::lost(pivot, &known) } else { Consider::new(pivot, &known) };
        self.window = Some(window);
    }

    /// The evidence of the lidar on whether the head moved in the assumed rest.
    fn seen_standstill(&self) -> Standstill {
        let beams: Vec<Beam> = self.waiting.iter().flat_map(|segment| &segment.beams).copied().collect();
        let (Some(first), Some(last)) = (beams.first(), beams.last()) else { return Standstill::Unknown };
        let quarter_s = 0.25 * (last.tau_s.min(first.tau_s + self.spec.inertial.rest_s) - first.tau_s);
        let until_s = first.tau_s + 4.0 * quarter_s;
        let early = beams.partition_point(|beam| beam.tau_s < first.tau_s + quarter_s);
        let late = beams.partition_point(|beam| beam.tau_s < until_s - quarter_s);
        let end = beams.partition_point(|beam| beam.tau_s <= until_s);
        standstill(&beams[..early], &beams[late..end])
    }

    /// Raises the assumed IMU noise from now on, for the queued samples too.
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

    fn first_window(&self, spec: &EstimatorSpec, beginning: &InitialState, start_s: f64) -> Window {
        let imu_from_laser = self.calibration.head_from_imu.inverse() * self.calibration.head_from_laser;
        let maker = SurfelMaker {
            spec: spec.surfels.clone(),
            noise: self.calibration.lidar,
            scan_normal: self.intake.is_planar().then(|| imu_from_laser.rotation * Vector::z()),
            laser_in_imu: imu_from_laser.translation.vector,
            lidar: LidarCorrection::default(),
        };
        let border = Border::new(beginning.information, &self.calibration.imu, self.spec.clock.estimated);
        let surveyor = SurfelMaker { spec: spec.registration.surfels(&spec.surfels), ..maker.clone() };
        let window = Window::new(spec, maker, beginning, start_s, border);
        if self.survey.is_some() { window.surveyed_by(surveyor) } else { window }
    }

    /// Adds the window's observations returned by `seen`, up to `until`, to the survey, if there is one.
    fn survey_window(&mut self, seen: fn(&Window) -> Vec<(f64, Patch)>, until: fn(&Window) -> f64) {
        if let (Some(window), Some(survey)) = (&self.window, &mut self.survey) {
            let mut watch = Stopwatch::start();
            survey.extend(self.intake.origin(), seen(window).into_iter(), window.lidar(), until(window));
            survey.took_s += watch.lap_s();
        }
    }

    /// The window's content is final: the uncertainty is that of the window's end.
    fn consider_the_end(&mut self) {
        if let Some(end) = self.at_end.take() {
            self.consider.carry(&end);
        }
    }

    fn end_tau_s(&self) -> f64 {
        self.windows.last().map_or(0.0, |report| report.stamp.seconds_since(self.intake.origin()))
    }

    fn why_nothing(&self) -> EstimationError {
        match self.intake.counts() {
            (0, scans) => EstimationError::NoImu { scans },
            (samples, 0) => EstimationError::NoLidar { samples },
            _ => EstimationError::TooShort { common_s: self.intake.common_s(), needed_s: 2.0 * self.spec.step_s },
        }
    }
}

fn check(calibration: &Calibration) -> Result<(), EstimationError> {
    let imu = &calibration.imu;
    let numbers = [
        ("gyroscope's noise density", imu.gyro_density_rad_per_s_per_sqrt_hz),
        ("accelerometer's noise density", imu.accel_density_m_per_s2_per_sqrt_hz),
        ("lidar's range noise", calibration.lidar.near_sigma_m),
    ];
    match numbers.iter().find(|(_, x)| !(x.is_finite() && *x > 0.0)) {
        Some((what, x)) => Err(EstimationError::Calibration(format!("the {what} is {x}; it must be above 0"))),
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
