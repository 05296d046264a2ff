//! The estimator: measurements in, poses out.

mod diagnostics;
mod gap;
mod gauge;
mod localise;
mod phase;
mod poses;
mod reports;
mod sensed;
mod start;
mod tracking;

use self::diagnostics::Diagnostics;
use self::gauge::GaugeBuilder;
use self::phase::{Phase, Tracking};
use crate::consider::{ConsiderCovariance, StartMatrix};
use crate::intake::{Intake, Segment};
use crate::local_map::LocalMap;
use crate::localisation::MapLocalisation;
use crate::observed::ObservedSurfels;
use crate::{EstimatedPose, EstimationError, EstimatorSpec, Event, OpenLoop, WindowReport};
use zsim_base::geometry::{Pose, Trajectory, Vector};
use zsim_base::measurement::{Calibration, Measurement};
use zsim_base::surfel_map::SurfelMap;
use zsim_base::time::Stamp;

/// Largest standard deviation of scale errors and misalignments of an IMU: their equations are linear.
const MAX_MATRIX_SIGMA: f64 = 0.2;

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
    phase: Phase,
    local_map: LocalMap,
    /// Localisation in the given map, if any.
    map_localisation: Option<MapLocalisation>,
    /// Observed surfaces, if the caller requests them.
    observed: Option<ObservedSurfels>,
    gauge: GaugeBuilder,
    /// Final poses that the caller has not taken yet.
    poses: Vec<EstimatedPose>,
    /// Stamp of the last pose of the output.
    newest_pose: Option<Stamp>,
    clock_offsets: Vec<(Stamp, f64)>,
    diagnostics: Diagnostics,
    /// How often the estimate started again.
    restarts: usize,
}

impl Estimator {
    /// Creates an estimator without measurements.
    ///
    /// # Errors
    /// If a setting or the calibration is invalid.
    pub fn new(spec: &EstimatorSpec, calibration: &Calibration) -> Result<Self, EstimationError> {
        spec.check()?;
        check(calibration)?;
        let consider = ConsiderCovariance::new(Vector::zeros(), &StartMatrix::zeros());
        Ok(Self {
            spec: spec.clone(),
            calibration: calibration.clone(),
            intake: Intake::new(spec, calibration),
            phase: Phase::default(),
            local_map: LocalMap::without_views(spec, consider),
            map_localisation: None,
            observed: None,
            gauge: GaugeBuilder::default(),
            poses: Vec::new(),
            newest_pose: None,
            clock_offsets: Vec::new(),
            diagnostics: Diagnostics::new(spec.step_s),
            restarts: 0,
        })
    }

    /// Stores the observed surfaces too, for [`super::register`].
    ///
    /// Memory then grows with the recording.
    pub fn recording_surfels(self) -> Self {
        Self { observed: Some(ObservedSurfels::default()), ..self }
    }

    /// Estimates the trajectory in the frame of `map`.
    ///
    /// Every window is matched with the map. The head must start near `map_from_head`: within 1 m horizontally and 20
    /// degrees of heading; without it the whole map is searched. The first pose is available when the first full window is localised.
    pub fn in_map(self, map: &SurfelMap, map_from_head: Option<&Pose>) -> Self {
        Self { map_localisation: Some(MapLocalisation::new(map, map_from_head.copied(), &self.spec)), ..self }
    }

    /// Adds a measurement, and processes each segment that is complete.
    ///
    /// Measurements arrive in approximate order of time.
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

    /// Returns the poses that became final since the last call, in order of time.
    pub fn take_poses(&mut self) -> Vec<EstimatedPose> {
        std::mem::take(&mut self.poses)
    }

    /// Returns the reports on all windows so far, in order of time.
    pub fn windows(&self) -> &[WindowReport] {
        &self.diagnostics.windows
    }

    /// Returns the warnings so far, without those that concern the whole run.
    pub fn warnings(&self) -> &[Event] {
        &self.diagnostics.warnings
    }

    /// Processes the remaining data, and returns the estimate.
    ///
    /// It has the poses not yet returned, and the reports of all windows.
    ///
    /// # Errors
    /// If IMU or lidar data are missing, empty or too short for a pose, localisation in the given map fails, or a pose is not finite.
    pub fn finish(mut self) -> Result<OpenLoop, EstimationError> {
        self.keep_start();
        while let Some(segment) = self.intake.next_segment(true) {
            self.advance(segment)?;
        }
        let mut phase = std::mem::take(&mut self.phase);
        self.start_if_ready(&mut phase, true);
        let Phase::Tracking(mut tracking) = phase else {
            let failure = self.map_localisation.as_ref().and_then(MapLocalisation::failure);
            return Err(
                failure.map_or_else(|| self.missing_data_error(), |why| EstimationError::NotInMap(why.to_owned()))
            );
        };
        let unplaced = self.localise_at_end(&mut tracking)?;
        self.intake.close();
        self.diagnostics.warnings.extend(self.intake.take_warnings());
        self.diagnostics.finish();
        if unplaced.is_none() {
            self.output_window(&mut tracking);
            if self.newest_pose.is_none() {
                return Err(self.missing_data_error());
            }
        }
        self.into_open_loop(&tracking)
    }

    /// Advances the estimate by a segment.
    fn advance(&mut self, segment: Segment) -> Result<(), EstimationError> {
        let mut phase = std::mem::take(&mut self.phase);
        // On a thread of the pool, so that each of the many short parallel steps need not wait for another thread to wake up.
        let advanced = rayon::scope(|_| self.advance_phase(&mut phase, segment));
        self.phase = phase;
        advanced
    }

    /// Takes in a segment: restarts after a gap, starts the first window, and processes the segment with the window.
    fn advance_phase(&mut self, phase: &mut Phase, mut segment: Segment) -> Result<(), EstimationError> {
        // To restart again while a relocalisation is pending would leave no time for it.
        self.intake.bridge_gaps(phase.awaits_relocalisation());
        self.diagnostics.warnings.extend(self.intake.take_warnings());
        if segment.after_gap {
            if self.may_start_again(phase.recovery()) {
                // The views of a few seconds are too few to relocalise in.
                self.start_again(phase);
                return Ok(());
            }
            self.restart_after_gap(phase, segment.coasting.take())?;
        }
        phase.queue(segment);
        self.start_if_ready(phase, false);
        while let Phase::Tracking(tracking) = phase {
            let Some(segment) = tracking.waiting.pop_front() else { break };
            self.process(tracking, segment)?;
            if tracking.is_rejected {
                self.start_later(phase);
            }
        }
        Ok(())
    }

    /// The result of the run, with the states of the last window.
    fn into_open_loop(mut self, Tracking { window, .. }: &Tracking) -> Result<OpenLoop, EstimationError> {
        let stamped = self.poses.iter().map(|pose| (pose.stamp, pose.map_from_head));
        let trajectory = Trajectory::from_poses(stamped)?;
        Ok(OpenLoop {
            trajectory,
            aligned_covariances: self.gauge.finish(&mut self.local_map.consider, self.newest_pose),
            poses: self.poses,
            clock_offsets: self.clock_offsets,
            lidar: window.lidar(),
            calibrated_lidar: window.calibrated_lidar(),
            located: self.map_localisation.and_then(|map_localisation| map_localisation.found().cloned()),
            windows: self.diagnostics.windows,
            warnings: self.diagnostics.warnings,
            observed: self.observed.unwrap_or_default(),
        })
    }

    /// The error of a run without any pose.
    fn missing_data_error(&self) -> EstimationError {
        match self.intake.counts() {
            (0, scans) => EstimationError::NoImu { scans },
            (samples, 0) => EstimationError::NoLidar { samples },
            (_, scans) if self.intake.sees_nothing() => EstimationError::NoReturns { scans },
            _ => {
                let (common_s, needed_s) = (self.intake.common_s(), 2.0 * self.spec.step_s);
                if common_s < needed_s {
                    EstimationError::TooShort { common_s, needed_s }
                } else {
                    EstimationError::Interrupted { common_s, needed_s }
                }
            }
        }
    }
}

/// Checks the noise of the calibration, and the scale errors and misalignments of the IMU.
fn check(calibration: &Calibration) -> Result<(), EstimationError> {
    let imu = &calibration.imu;
    let densities = [
        ("gyroscope noise density", imu.gyro_density_rad_per_s_per_sqrt_hz),
        ("accelerometer noise density", imu.accel_density_m_per_s2_per_sqrt_hz),
        ("lidar range noise", calibration.lidar.near_sigma_m),
    ];
    let fractions = [
        ("scale error of the gyroscope", imu.gyro_scale_error),
        ("misalignment of the gyroscope, rad,", imu.gyro_misalignment_rad),
        ("scale error of the accelerometer", imu.accel_scale_error),
        ("misalignment of the accelerometer, rad,", imu.accel_misalignment_rad),
    ];
    let invalid = |what, x, domain| EstimationError::Calibration(format!("{what} is {x}; must be {domain}"));
    if let Some((what, x)) = densities.iter().find(|(_, x)| !(x.is_finite() && *x > 0.0)) {
        return Err(invalid(what, x, "above 0"));
    }
    match fractions.iter().find(|(_, x)| !(0.0..=MAX_MATRIX_SIGMA).contains(x)) {
        Some((what, x)) => Err(invalid(what, x, "from 0 to 0.2, the standard deviation over parts")),
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
