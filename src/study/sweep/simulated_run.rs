//! Runs that are simulated, recorded and estimated.

use super::Measure;
use super::measure::Origin;
use super::part::RunOutcome;
use super::tree::Journey;
use super::{LimitSpec, Plan, timing};
use crate::dynamics::HeadModel;
use crate::estimation::{EstimatorSpec, Status};
use crate::evaluation::{Errors, MapKnowledge, Pairs, clock_error_after};
use crate::geometry::Trajectory;
use crate::measurement::Calibration;
use crate::recording::{Reader, Selection, TopicPreference, Writer};
use crate::report::IntegrityMetrics;
use crate::simulation::Simulation;
use crate::spec;
use crate::study::calibration::calibration;
use crate::study::closed_loop::run_closed_loop;
use crate::study::comparison::Comparison;
use crate::study::coverage::{Coverage, CoveragePlan, coverage};
use crate::study::integrity::{Integrity, path_length_m};
use crate::study::latency::{MapErrors, Reference, TimingRun, TimingSpec};
use crate::study::open_loop::{OpenLoopOptions, run_open_loop};
use crate::study::record::{description, record_together};
use crate::study::sampled_truth::SampledTruth;
use crate::study::sensor_models::RecordedSensors;
use crate::study::{CalibrationSpec, Manifest, ProgressMonitor, StudyError, comparison, information_bound};
use std::fs::File;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Maximum number of recordings written at once; bounds memory and temporary disk space.
pub(super) const MAX_RECORDINGS: usize = 16;

/// A simulation and its recording in an unlinked temporary file, which the system removes when the process ends.
pub(super) struct TemporaryRecording {
    simulation: Simulation,
    /// One file handle per reader thread; empty without a recording.
    handles: Vec<File>,
    /// Ground truth for runs with timing errors, read by the first of them, and the time range of their maps, s.
    reference: Mutex<Option<(f64, Arc<Reference>)>>,
    /// Information bound with an unknown map, m, computed by the first run that needs it.
    slam_bound_m: Mutex<Option<f64>>,
}

/// Runs simulations that share physics and rays, and records them for `readers` threads.
///
/// Without `recorded` the simulations are not run, and the recordings are empty.
pub(super) fn record_simulations(
    simulations: Vec<Simulation>,
    recorded: bool,
    readers: usize,
    limit: LimitSpec,
) -> Result<Vec<TemporaryRecording>, StudyError> {
    let of = |(simulation, handles)| TemporaryRecording {
        simulation,
        handles,
        reference: Mutex::default(),
        slam_bound_m: Mutex::default(),
    };
    if !recorded {
        return Ok(simulations.into_iter().map(|simulation| of((simulation, Vec::new()))).collect());
    }
    let mut writers = Vec::new();
    let mut handles = Vec::new();
    for simulation in &simulations {
        let file = tempfile::NamedTempFile::new().map_err(StudyError::file(&std::env::temp_dir()))?;
        let open = || file.reopen().map_err(StudyError::file(file.path()));
        handles.push((0..readers).map(|_| open()).collect::<Result<Vec<_>, _>>()?);
        writers.push(Writer::new(open()?, description(simulation, false)?)?);
        // The file is unlinked here; the open handles keep its content.
    }
    with_time_limit(limit, |stop| {
        record_together(&simulations, writers, &ProgressMonitor { stop, report: &mut |_| {} })
    })?;
    Ok(simulations.into_iter().zip(handles).map(of).collect())
}

impl TemporaryRecording {
    /// Evaluates a run on this recording, read by thread `reader`.
    pub fn evaluate(&self, plan: &Plan, limit: LimitSpec, run: &Journey, reader: usize) -> RunOutcome {
        let measures = plan.result_measures();
        let bound = match measures.contains(&Measure::ErrorOverSlamBound) {
            true => self.slam_bound_m(limit, reader),
            false => Ok(None),
        };
        let started = Instant::now();
        let outcome = match bound.and_then(|bound_m| self.figures(limit, &measures, run, reader, bound_m)) {
            Ok((figures, details)) => RunOutcome { figures, details, ..RunOutcome::default() },
            Err(error) => RunOutcome::from_error(measures.len(), &error),
        };
        RunOutcome { wall_s: Some(started.elapsed().as_secs_f64()), ..outcome }
    }

    fn figures(
        &self,
        limit: LimitSpec,
        measures: &[Measure],
        run: &Journey,
        reader: usize,
        slam_bound_m: Option<f64>,
    ) -> Result<(Vec<Option<f64>>, Option<String>), StudyError> {
        let needs = |origin: Origin| measures.iter().any(|measure| measure.origin() == origin);
        let swing = match needs(Origin::Swing) || needs(Origin::SwingOrClosedForm) {
            true => Some(self.swing()?),
            false => None,
        };
        let (mut estimated, mut map_errors) = (None, None);
        if let Some(handle) = self.handles.get(reader).filter(|_| needs(Origin::Estimate) || needs(Origin::Map)) {
            let file = handle.try_clone().map_err(StudyError::file(&std::env::temp_dir()))?;
            let closes_loops = measures.contains(&Measure::ClosedPositionRmseM) || slam_bound_m.is_some();
            match &run.timing {
                None => {
                    let head = self.simulation.head();
                    let work = |stop: &AtomicBool| estimate(file, head, &run.estimator.spec, closes_loops, stop);
                    estimated = Some(EstimateMetrics { slam_bound_m, ..with_time_limit(limit, work)? });
                }
                Some(timing) => {
                    let work = |stop: &AtomicBool| self.map_errors(file, timing, &run.estimator.spec, stop);
                    map_errors = Some(with_time_limit(limit, work)?);
                }
            }
        }
        let figure = |measure: &Measure| {
            let by_swing = swing.as_ref().and_then(|coverage| swing_figure(*measure, coverage));
            let by_map = || map_errors.as_ref().and_then(|errors| timing::figure(errors, *measure));
            by_swing.or_else(by_map).or_else(|| estimated.as_ref().and_then(|estimated| estimated.figure(*measure)))
        };
        let details = map_errors.as_ref().map(spec::to_text).transpose()?;
        Ok((measures.iter().map(figure).collect(), details))
    }

    /// Estimates with timing errors on one thread, and evaluates the result.
    fn map_errors(
        &self,
        recording: File,
        timing: &TimingSpec,
        estimator: &EstimatorSpec,
        stop: &AtomicBool,
    ) -> Result<MapErrors, StudyError> {
        let reader = Reader::new("the recording", recording)?;
        let selection = reader.select(&TopicPreference::default())?;
        let calibration = self.simulation.calibration();
        let reference = self.reference(&reader, &selection, &calibration, timing.shown_s, stop)?;
        let run = TimingRun {
            reader: &reader,
            selection: &selection,
            calibration: &calibration,
            simulation: &self.simulation,
            reference: &reference,
            timing,
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
        pool.install(|| run.evaluate(estimator, stop))
    }

    /// Ground truth for maps of `shown_s`; read once, while other threads wait for it.
    fn reference(
        &self,
        reader: &Reader,
        selection: &Selection,
        calibration: &Calibration,
        shown_s: f64,
        stop: &AtomicBool,
    ) -> Result<Arc<Reference>, StudyError> {
        let mut stored = self.reference.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, reference)) = stored.as_ref().filter(|(stored_s, _)| *stored_s == shown_s) {
            return Ok(reference.clone());
        }
        let read = Reference::read(reader, selection, calibration, &self.simulation, shown_s, stop);
        let reference = Arc::new(read?);
        *stored = Some((shown_s, reference.clone()));
        Ok(reference)
    }

    /// The information bound with an unknown map, m; computed once, on one thread, while other threads wait for it.
    fn slam_bound_m(&self, limit: LimitSpec, reader: usize) -> Result<Option<f64>, StudyError> {
        let Some(handle) = self.handles.get(reader) else { return Ok(None) };
        let mut stored = self.slam_bound_m.lock().unwrap_or_else(PoisonError::into_inner);
        if stored.is_none() {
            let file = handle.try_clone().map_err(StudyError::file(&std::env::temp_dir()))?;
            let reader = Reader::new("the recording", file)?;
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
            let bounded = with_time_limit(limit, |stop| {
                let world = self.simulation.world();
                pool.install(|| {
                    let mut watch = ProgressMonitor { stop, report: &mut |_| {} };
                    information_bound(&reader, world, MapKnowledge::Unknown, &mut watch)
                })
            })?;
            *stored = Some(bounded.bound.aligned_position_rmse_m);
        }
        Ok(*stored)
    }

    /// Coverage of the lidar and use of the gyroscope's range, from 5 s (after the rest at the start) to the run's end.
    fn swing(&self) -> Result<Coverage, StudyError> {
        let simulation = &self.simulation;
        let usual = CoveragePlan::default();
        let plan = CoveragePlan {
            duration_s: simulation.inputs().duration_s - usual.from_s,
            rate_limit_deg_per_s: simulation.imu().spec().gyro.limit_deg_per_s,
            ..usual
        };
        coverage(simulation.head(), simulation.motion(), simulation.lidar(), &plan, |_| ())
    }
}

fn swing_figure(measure: Measure, coverage: &Coverage) -> Option<f64> {
    match measure {
        Measure::FractionSeen => Some(coverage.fraction_seen),
        Measure::CoveredS => Some(coverage.covered_s),
        Measure::DensityPerSrS => Some(coverage.density_per_sr_s.mean),
        Measure::FieldOfViewDeg => Some(coverage.field_of_view_deg),
        Measure::RateDegPerS => Some(coverage.gyro.most_deg_per_s),
        Measure::RateP99DegPerS => Some(coverage.gyro.p99_deg_per_s),
        Measure::Saturated => Some(coverage.gyro.saturated),
        _ => None,
    }
}

/// Metrics of an estimate.
struct EstimateMetrics {
    open_loop: crate::report::OpenLoopMetrics,
    clock: crate::report::ClockMetrics,
    /// Errors of the clock offset after 30 s and 120 s, s.
    clock_errors_s: [Option<f64>; 2],
    rigid_link_rmse_m: Option<f64>,
    closed_position_rmse_m: Option<f64>,
    slam_bound_m: Option<f64>,
    status: Status,
    integrity: IntegrityMetrics,
    path_length_m: f64,
}

impl EstimateMetrics {
    fn figure(&self, measure: Measure) -> Option<f64> {
        let figure = match measure {
            Measure::PositionRmseM => self.open_loop.position_rmse_m,
            Measure::RotationRmseDeg => self.open_loop.rotation_rmse_deg,
            Measure::DriftMPerMin => self.open_loop.drift_m_per_min,
            Measure::YawDriftDegPerMin => self.open_loop.yaw_drift_deg_per_min,
            Measure::ClockRmseS => self.clock.offset_rmse_s,
            Measure::ClockError30S => self.clock_errors_s[0],
            Measure::ClockError120S => self.clock_errors_s[1],
            Measure::RigidLinkRmseM => self.rigid_link_rmse_m,
            Measure::ClosedPositionRmseM => self.closed_position_rmse_m,
            Measure::ErrorOverSlamBound => {
                self.closed_position_rmse_m.zip(self.slam_bound_m).map(|(error_m, bound_m)| error_m / bound_m)
            }
            Measure::Status => Some(f64::from(self.status as u8)),
            Measure::AlignedRmseM => self.integrity.aligned_rmse_m,
            Measure::LargestErrorM => self.integrity.largest_error_m,
            Measure::BoundM99 => self.integrity.bound_m_99,
            Measure::WithinBound => self.integrity.within_bound,
            Measure::BoundOverError => self.integrity.bound_over_error,
            Measure::WayM => Some(self.path_length_m),
            _ => None,
        };
        figure.filter(|figure| figure.is_finite())
    }
}

/// Estimates from a recording on one thread, and evaluates the result.
fn estimate(
    recording: File,
    head: &HeadModel,
    estimator: &EstimatorSpec,
    closes_loops: bool,
    stop: &AtomicBool,
) -> Result<EstimateMetrics, StudyError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    pool.install(|| {
        let mut watch = ProgressMonitor { stop, report: &mut |_| {} };
        let reader = Reader::new("the recording", recording)?;
        let selection = reader.select(&TopicPreference::default())?;
        let manifest = Manifest::in_recording(&reader)?;
        let recorded = manifest.as_ref().and_then(|manifest| manifest.run.as_ref()).map(RecordedSensors::of);
        let recorded = recorded.unwrap_or_default();
        let (found, _) = calibration(&reader, &selection, &CalibrationSpec::default(), recorded, None)?;
        let how =
            OpenLoopOptions { estimator, calibration: &found.calibration, recording_surfels: closes_loops, map: None };
        let run = run_open_loop(&reader, &selection, how, None, None, &mut watch)?;
        let truth = SampledTruth::read(&reader, &run, None)?;
        let mut compare = |map_from_head, covariances| {
            truth.as_ref().map(|truth| Comparison::new(map_from_head, covariances, truth, &mut watch))
        };
        let known = compare(&run.map_from_head, &run.covariances[..]);
        let open_loop = comparison::open_loop_metrics(&run, known.as_ref(), None);
        let closed = closes_loops.then(|| run_closed_loop(&run, &found.calibration, estimator)).transpose()?;
        let map_from_head = closed.as_ref().map_or(&run.map_from_head, |closed| &closed.map_from_head);
        let integrity = Integrity::of(&run, closed.as_ref(), map_from_head);
        let pairs = truth.as_ref().map(|truth| Pairs::of(map_from_head, &truth.heads)).unwrap_or_default();
        let closed_errors = closed.as_ref().and_then(|_| compare(map_from_head, &[]));
        Ok(EstimateMetrics {
            open_loop,
            clock: comparison::clock_metrics(&run, truth.as_ref()),
            clock_errors_s: [30.0, 120.0].map(|after_s| {
                truth.as_ref().and_then(|truth| clock_error_after(&run.clock_offsets, &truth.clock_offsets, after_s))
            }),
            rigid_link_rmse_m: truth.as_ref().and_then(|truth| rigid_link_rmse_m(head, &run.map_from_head, truth)),
            closed_position_rmse_m: closed_errors.and_then(|known| known.errors).map(|errors| errors.position_rmse_m),
            slam_bound_m: None,
            status: integrity.status(),
            integrity: integrity.metrics(&run, Some(&pairs)),
            path_length_m: path_length_m(map_from_head),
        })
    })
}

/// Position error of the base computed with the rigid link, as `zsim base` does; `None` without a true trajectory of it.
fn rigid_link_rmse_m(head: &HeadModel, map_from_head: &Trajectory, truth: &SampledTruth) -> Option<f64> {
    let base = Trajectory::from_poses(head.base_from_rigid_link(map_from_head)).ok()?;
    let pairs = Pairs::of(&base, &truth.bases);
    Some(Errors::after(&pairs, &pairs.world_from_map().ok()?).position_rmse_m())
}

/// Does `work`, and sets its stop flag when the time limit is exceeded.
fn with_time_limit<T>(
    limit: LimitSpec,
    work: impl FnOnce(&AtomicBool) -> Result<T, StudyError>,
) -> Result<T, StudyError> {
    let stop = AtomicBool::new(false);
    let (done, is_done) = channel::<()>();
    let time = Duration::from_secs_f64(limit.time_s.min(1e9));
    let result = std::thread::scope(|scope| {
        let stop = &stop;
        scope.spawn(move || {
            if is_done.recv_timeout(time) == Err(RecvTimeoutError::Timeout) {
                stop.store(true, Ordering::Relaxed);
            }
        });
        let result = work(stop);
        drop(done);
        result
    });
    match result {
        Err(_) if stop.load(Ordering::Relaxed) => Err(StudyError::TooLong { time_s: limit.time_s }),
        result => result,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_is_stopped_at_the_time_limit() {
        let limit = LimitSpec { time_s: 0.05, memory_mib: 1 };
        let forever = |stop: &AtomicBool| {
            while !stop.load(Ordering::Relaxed) {
                std::thread::sleep(Duration::from_millis(1));
            }
            Err::<(), _>(StudyError::Stopped)
        };
        let error = with_time_limit(limit, forever).unwrap_err().to_string();
        assert!(error.contains("0.05 s"), "{error}");
        assert_eq!(with_time_limit(limit, |_| Ok(3)).unwrap(), 3);
    }
}
