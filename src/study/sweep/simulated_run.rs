//! Runs that are simulated, recorded and estimated.

use super::Measure;
use super::estimated_run::{RunInputs, estimate};
use super::measure::Needs;
use super::part::RunOutcome;
use super::reference_inputs::ReferenceInputs;
use super::reference_system::ReferenceMap;
use super::results::{Results, Swing};
use super::tree::Journey;
use super::{LimitSpec, Plan, timing};
use crate::coverage::{CoveragePlan, coverage};
use crate::latency::{MapErrors, Reference, TimingRun, TimingSpec};
use crate::record::{description, record_together};
use crate::{ProgressMonitor, StudyError, information_bound};
use std::fs::File;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use zsim_base::measurement::Calibration;
use zsim_base::spec;
use zsim_dynamics::{ContactWatch, HeadState};
use zsim_estimation::EstimatorSpec;
use zsim_evaluation::MapKnowledge;
use zsim_recording::{Reader, Selection, TopicPreference, Writer};
use zsim_simulation::Simulation;

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
    /// Map of the reference system, computed by the first run that needs it.
    reference_map: Mutex<Option<Arc<ReferenceMap>>>,
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
        reference_map: Mutex::default(),
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
        let compared = self.compared_with(limit, &plan.spec().measures, run, reader);
        let started = Instant::now();
        let outcome = match compared.and_then(|compared| self.outcome(plan, limit, run, reader, &compared)) {
            Ok(outcome) => outcome,
            Err(error) => RunOutcome::from_error(plan.result_measures().len(), &error),
        };
        let wall_s = Some(started.elapsed().as_secs_f64());
        RunOutcome { times: std::iter::once(wall_s).chain(outcome.times).collect(), ..outcome }
    }

    /// What several runs on this recording are compared with.
    fn compared_with(
        &self,
        limit: LimitSpec,
        measures: &[Measure],
        run: &Journey,
        reader: usize,
    ) -> Result<Compared, StudyError> {
        let any = |needs: Needs| measures.iter().any(|measure| measure.needs() == needs);
        let reference = run.reference.as_ref().filter(|_| any(Needs::Reference));
        Ok(Compared {
            slam_bound_m: if any(Needs::SlamBound) { self.slam_bound_m(limit, reader)? } else { None },
            reference: reference.map(|inputs| self.reference_map(limit, inputs, run)).transpose()?,
        })
    }

    /// The outcome of a run, without its computing time.
    fn outcome(
        &self,
        plan: &Plan,
        limit: LimitSpec,
        run: &Journey,
        reader: usize,
        compared: &Compared,
    ) -> Result<RunOutcome, StudyError> {
        let measures = &plan.spec().measures;
        let (results, details) = self.results(measures, limit, run, reader, compared)?;
        let figures = results.figures(&plan.result_measures());
        let times = results.figures(&plan.time_measures()[1..]);
        Ok(RunOutcome { figures, times, details, ..RunOutcome::default() })
    }

    /// Computes what `measures` need: the results, and the details of the run as RON, if it has any.
    fn results(
        &self,
        measures: &[Measure],
        limit: LimitSpec,
        run: &Journey,
        reader: usize,
        compared: &Compared,
    ) -> Result<(Results, Option<String>), StudyError> {
        let any = |of: fn(Measure) -> bool| measures.iter().any(|measure| of(*measure));
        let swings = any(|measure| matches!(measure.needs(), Needs::Swing | Needs::SwingOrHead));
        let swing = swings.then(|| self.swing()).transpose()?;
        let Some(handle) = self.handles.get(reader).filter(|_| any(Measure::is_of_estimate)) else {
            return Ok((Results { swing, ..Results::default() }, None));
        };
        let file = handle.try_clone().map_err(StudyError::file(&std::env::temp_dir()))?;
        if let Some(timing) = &run.timing {
            let work = |stop: &AtomicBool| self.map_errors(file, timing, &run.estimator.spec, stop);
            let errors = with_time_limit(limit, work)?;
            let results = Results { metrics: timing::metrics(&errors), swing, ..Results::default() };
            return Ok((results, Some(spec::to_text(&errors)?)));
        }
        let inputs = RunInputs {
            simulation: &self.simulation,
            journey: run,
            closes_loops: any(Measure::needs_closed_loop),
            slam_bound_m: compared.slam_bound_m,
            compares_clouds: any(|measure| matches!(measure.needs(), Needs::Cloud | Needs::Reference)),
            reference: compared.reference.as_deref(),
        };
        let (results, curve) = with_time_limit(limit, |stop| estimate(file, &inputs, stop))?;
        let curve = curve.filter(|_| any(|measure| measure.needs() == Needs::ClockCurve));
        Ok((Results { swing, ..results }, curve.as_ref().map(spec::to_text).transpose()?))
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

    /// The map of a reference system; computed once, while other threads wait for it.
    fn reference_map(
        &self,
        limit: LimitSpec,
        inputs: &ReferenceInputs,
        run: &Journey,
    ) -> Result<Arc<ReferenceMap>, StudyError> {
        let mut stored = self.reference_map.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(map) = stored.as_ref().filter(|map| map.is_of(inputs, run)) {
            return Ok(map.clone());
        }
        let map = Arc::new(with_time_limit(limit, |stop| ReferenceMap::of(inputs, run, stop))?);
        *stored = Some(map.clone());
        Ok(map)
    }

    /// The swing from 5 s (after the rest at the start) to the run's end.
    fn swing(&self) -> Result<Swing, StudyError> {
        let simulation = &self.simulation;
        let usual = CoveragePlan::default();
        let plan = CoveragePlan {
            duration_s: simulation.inputs().duration_s - usual.from_s,
            rate_limit_deg_per_s: simulation.imu().spec().gyro.limit_deg_per_s,
            ..usual
        };
        let head = simulation.head();
        let mut contact = ContactWatch::new(head);
        let mut check = |state: &HeadState| contact.check(state.t_s, &state.base, &state.head);
        let coverage = coverage(head, simulation.motion(), simulation.lidar(), &plan, &mut check)?;
        Ok(Swing { coverage, coil_contact_s: contact.contact().map_or(0.0, |contact| contact.contact_s) })
    }
}

/// The figures of one journey without timing errors or a reference system, simulated and estimated on this thread; `None` for
/// a figure that does not exist.
///
/// # Errors
/// If the specs do not make a simulation, or if it or the estimate fails or exceeds its time limit.
pub(crate) fn journey_figures(
    journey: &Journey,
    measures: &[Measure],
    limit: LimitSpec,
) -> Result<Vec<Option<f64>>, StudyError> {
    let recorded = measures.iter().any(|measure| measure.is_of_estimate());
    let simulation = Simulation::build(journey.simulation.clone())?;
    let mut figures = Vec::new();
    for recording in record_simulations(vec![simulation], recorded, 1, limit)? {
        let compared = recording.compared_with(limit, measures, journey, 0)?;
        let (results, _) = recording.results(measures, limit, journey, 0, &compared)?;
        figures.extend(results.figures(measures));
    }
    Ok(figures)
}

/// What a run is compared with.
struct Compared {
    /// Information bound with an unknown map, m.
    slam_bound_m: Option<f64>,
    reference: Option<Arc<ReferenceMap>>,
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
