//! Runs that share a simulation and its recording in a temporary file.

use super::bound::information_bound;
use super::estimated_run::{EstimatedRun, estimate};
use super::record::{description, record_together};
use super::reference_system::ReferenceMap;
use super::results::{Needs, Results, Swing};
use super::timing::{MapErrors, Reference, TimingRun, TimingSpec};
use super::{ProgressMonitor, ReferenceInputs, RunError, RunInputs};
use std::fs::File;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use zsim_base::files::FileError;
use zsim_base::measurement::Calibration;
use zsim_base::spec;
use zsim_dynamics::{ContactWatch, HeadState};
use zsim_estimation::EstimatorSpec;
use zsim_evaluation::MapKnowledge;
use zsim_head::coverage::{CoveragePlan, coverage};
use zsim_recording::{Reader, Selection, TopicPreference, Writer};
use zsim_simulation::Simulation;

/// Maximum number of recordings written at once; bounds memory and temporary disk space.
pub const MAX_RECORDINGS: usize = 16;

/// A simulation and its recording in an unlinked temporary file, which the system removes when the process ends.
pub struct TemporaryRecording {
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
pub fn record_simulations(
    simulations: Vec<Simulation>,
    recorded: bool,
    readers: usize,
    limit_s: f64,
) -> Result<Vec<TemporaryRecording>, RunError> {
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
        let file = tempfile::NamedTempFile::new().map_err(FileError::at(&std::env::temp_dir()))?;
        let open = || file.reopen().map_err(FileError::at(file.path()));
        handles.push((0..readers).map(|_| open()).collect::<Result<Vec<_>, _>>()?);
        writers.push(Writer::new(open()?, description(simulation, false)?)?);
        // The file is unlinked here; the open handles keep its content.
    }
    with_time_limit(limit_s, |stop| {
        record_together(&simulations, writers, &ProgressMonitor { stop, report: &mut |_| {} })
    })?;
    Ok(simulations.into_iter().zip(handles).map(of).collect())
}

impl TemporaryRecording {
    /// What several runs on this recording are compared with.
    pub fn compared_with(
        &self,
        limit_s: f64,
        needs: &[Needs],
        run: &RunInputs,
        reader: usize,
    ) -> Result<Compared, RunError> {
        let any = |of: Needs| needs.contains(&of);
        let reference = run.reference.as_ref().filter(|_| any(Needs::Reference));
        Ok(Compared {
            slam_bound_m: if any(Needs::SlamBound) { self.slam_bound_m(limit_s, reader)? } else { None },
            reference: reference.map(|inputs| self.reference_map(limit_s, inputs, run)).transpose()?,
        })
    }

    /// Computes what a study needs: the results, and the details of the run as RON, if it has any.
    pub fn results(
        &self,
        needs: &[Needs],
        limit_s: f64,
        run: &RunInputs,
        reader: usize,
        compared: &Compared,
    ) -> Result<(Results, Option<String>), RunError> {
        let any = |of: fn(Needs) -> bool| needs.iter().any(|need| of(*need));
        let swings = any(|need| matches!(need, Needs::Swing | Needs::SwingOrHead));
        let swing = swings.then(|| self.swing()).transpose()?;
        let Some(handle) = self.handles.get(reader).filter(|_| any(Needs::is_of_estimate)) else {
            return Ok((Results { swing, ..Results::default() }, None));
        };
        let file = handle.try_clone().map_err(FileError::at(&std::env::temp_dir()))?;
        if let Some(timing) = &run.timing {
            let work = |stop: &AtomicBool| self.map_errors(file, timing, &run.estimator.spec, stop);
            let errors = with_time_limit(limit_s, work)?;
            let results = Results { metrics: errors.metrics(), swing, ..Results::default() };
            return Ok((results, Some(spec::to_text(&errors)?)));
        }
        let estimated = EstimatedRun {
            simulation: &self.simulation,
            inputs: run,
            closes_loops: any(Needs::is_of_closed_loop),
            slam_bound_m: compared.slam_bound_m,
            compares_clouds: any(|need| matches!(need, Needs::Cloud | Needs::Reference)),
            reference: compared.reference.as_deref(),
        };
        let (results, curve) = with_time_limit(limit_s, |stop| estimate(file, &estimated, stop))?;
        let curve = curve.filter(|_| any(|need| need == Needs::ClockCurve));
        Ok((Results { swing, ..results }, curve.as_ref().map(spec::to_text).transpose()?))
    }

    /// Estimates with timing errors on one thread, and evaluates the result.
    fn map_errors(
        &self,
        recording: File,
        timing: &TimingSpec,
        estimator: &EstimatorSpec,
        stop: &AtomicBool,
    ) -> Result<MapErrors, RunError> {
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
    ) -> Result<Arc<Reference>, RunError> {
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
    fn slam_bound_m(&self, limit_s: f64, reader: usize) -> Result<Option<f64>, RunError> {
        let Some(handle) = self.handles.get(reader) else { return Ok(None) };
        let mut stored = self.slam_bound_m.lock().unwrap_or_else(PoisonError::into_inner);
        if stored.is_none() {
            let file = handle.try_clone().map_err(FileError::at(&std::env::temp_dir()))?;
            let reader = Reader::new("the recording", file)?;
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
            let bounded = with_time_limit(limit_s, |stop| {
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
        limit_s: f64,
        inputs: &ReferenceInputs,
        run: &RunInputs,
    ) -> Result<Arc<ReferenceMap>, RunError> {
        let mut stored = self.reference_map.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(map) = stored.as_ref().filter(|map| map.is_of(inputs, run)) {
            return Ok(map.clone());
        }
        let map = Arc::new(with_time_limit(limit_s, |stop| ReferenceMap::of(inputs, run, stop))?);
        *stored = Some(map.clone());
        Ok(map)
    }

    /// The swing from 5 s (after the rest at the start) to the run's end.
    fn swing(&self) -> Result<Swing, RunError> {
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

/// What a run is compared with.
pub struct Compared {
    /// Information bound with an unknown map, m.
    slam_bound_m: Option<f64>,
    reference: Option<Arc<ReferenceMap>>,
}

/// Does `work`, and sets its stop flag when the time limit is exceeded.
fn with_time_limit<T>(limit_s: f64, work: impl FnOnce(&AtomicBool) -> Result<T, RunError>) -> Result<T, RunError> {
    let stop = AtomicBool::new(false);
    let (done, is_done) = channel::<()>();
    let time = Duration::from_secs_f64(limit_s.min(1e9));
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
        Err(_) if stop.load(Ordering::Relaxed) => Err(RunError::TooLong { time_s: limit_s }),
        result => result,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_is_stopped_at_the_time_limit() {
        let limit_s = 0.05;
        let forever = |stop: &AtomicBool| {
            while !stop.load(Ordering::Relaxed) {
                std::thread::sleep(Duration::from_millis(1));
            }
            Err::<(), _>(zsim_base::parallel::Stopped.into())
        };
        let error = with_time_limit(limit_s, forever).unwrap_err().to_string();
        assert!(error.contains("0.05 s"), "{error}");
        assert_eq!(with_time_limit(limit_s, |_| Ok(3)).unwrap(), 3);
    }
}
