//! Runs that share a simulation and its recording in a temporary file.

use super::bound::information_bound;
use super::record::{description, record_together};
use super::reference_system::{ReferenceMap, compare_clouds};
use super::results::{ClockCurve, Needs, Results, Swing};
use super::run_recording::RunRecording;
use super::sampled_truth::SampledTruth;
use super::timing::{MapErrors, Reference, TimingRun, TimingSpec};
use super::{ProgressMonitor, ReferenceInputs, RunError, RunInputs};
use std::fs::File;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use zsim_base::files::FileError;
use zsim_base::geometry::Trajectory;
use zsim_base::spec;
use zsim_dynamics::{ContactWatch, HeadModel, HeadState};
use zsim_estimation::EstimatorSpec;
use zsim_evaluation::{Errors, MapKnowledge, Pairs};
use zsim_head::coverage::{CoveragePlan, coverage};
use zsim_recording::{Reader, TopicPreference, Writer};
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
            let errors = alone(limit_s, |watch| self.map_errors(file, timing, &run.estimator.spec, watch.stop))?;
            let results = Results { metrics: errors.metrics(), swing, ..Results::default() };
            return Ok((results, Some(spec::to_text(&errors)?)));
        }
        let (results, curve) = alone(limit_s, |watch| self.estimate(file, run, &any, compared, watch))?;
        let curve = curve.filter(|_| any(|need| need == Needs::ClockCurve));
        Ok((Results { swing, ..results }, curve.as_ref().map(spec::to_text).transpose()?))
    }

    /// Estimates from the recording; returns the results, and the clock offset over time if the truth is known.
    fn estimate(
        &self,
        recording: File,
        run: &RunInputs,
        needs: &dyn Fn(fn(Needs) -> bool) -> bool,
        compared: &Compared,
        watch: &mut ProgressMonitor,
    ) -> Result<(Results, Option<ClockCurve>), RunError> {
        let recording = RunRecording::open(recording, run.ignore_manifest)?;
        let loops = recording.estimate(&run.estimator.spec, needs(Needs::is_of_closed_loop), watch)?;
        let truth = loops.truth.as_ref();
        let estimate = &loops.open.estimate;
        let mut results = Results {
            metrics: loops.metrics(&loops.integrity(), loops.pairs().as_ref()),
            rigid_link_rmse_m: truth
                .and_then(|truth| rigid_link_rmse_m(self.simulation.head(), &estimate.trajectory, truth)),
            slam_bound_m: compared.slam_bound_m,
            ..Results::default()
        };
        if needs(|need| matches!(need, Needs::Cloud | Needs::Reference)) {
            let reference = compared.reference.as_deref();
            compare_clouds(&recording, &loops, &self.simulation, reference, watch, &mut results)?;
        }
        Ok((results, truth.map(|truth| ClockCurve::new(&estimate.clock_offsets, &truth.clock_offsets))))
    }

    /// Estimates with timing errors, and evaluates the result.
    fn map_errors(
        &self,
        recording: File,
        timing: &TimingSpec,
        estimator: &EstimatorSpec,
        stop: &AtomicBool,
    ) -> Result<MapErrors, RunError> {
        let reader = Reader::new("the recording", recording)?;
        let selection = reader.select(&TopicPreference::default())?;
        let recording = RunRecording { reader, selection, calibration: self.simulation.calibration() };
        let (_, reference) = once(
            &self.reference,
            |(shown_s, _)| *shown_s == timing.shown_s,
            || {
                let reference = Reference::read(&recording, &self.simulation, timing.shown_s, stop)?;
                Ok((timing.shown_s, Arc::new(reference)))
            },
        )?;
        let run = TimingRun { recording: &recording, simulation: &self.simulation, reference: &reference, timing };
        run.evaluate(estimator, stop)
    }

    /// The information bound with an unknown map, m; computed once.
    fn slam_bound_m(&self, limit_s: f64, reader: usize) -> Result<Option<f64>, RunError> {
        let Some(handle) = self.handles.get(reader) else { return Ok(None) };
        let bound_m = || {
            let file = handle.try_clone().map_err(FileError::at(&std::env::temp_dir()))?;
            let reader = Reader::new("the recording", file)?;
            let world = self.simulation.world();
            let bounded = alone(limit_s, |watch| information_bound(&reader, world, MapKnowledge::Unknown, watch))?;
            Ok(bounded.bound.aligned_position_rmse_m)
        };
        once(&self.slam_bound_m, |_| true, bound_m).map(Some)
    }

    /// The map of a reference system; computed once.
    fn reference_map(
        &self,
        limit_s: f64,
        inputs: &ReferenceInputs,
        run: &RunInputs,
    ) -> Result<Arc<ReferenceMap>, RunError> {
        let map = || Ok(Arc::new(alone(limit_s, |watch| ReferenceMap::of(inputs, run, watch))?));
        once(&self.reference_map, |map| map.is_of(inputs, run), map)
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

/// Returns the stored value if it is valid, else computes and stores it, while other threads wait for it.
fn once<T: Clone>(
    stored: &Mutex<Option<T>>,
    is_valid: impl FnOnce(&T) -> bool,
    compute: impl FnOnce() -> Result<T, RunError>,
) -> Result<T, RunError> {
    let mut stored = stored.lock().unwrap_or_else(PoisonError::into_inner);
    match stored.take().filter(is_valid) {
        Some(value) => Ok(stored.insert(value).clone()),
        None => Ok(stored.insert(compute()?).clone()),
    }
}

/// Position error of the base computed with the rigid link, as `zsim base` does; `None` without a true trajectory of it.
fn rigid_link_rmse_m(head: &HeadModel, map_from_head: &Trajectory, truth: &SampledTruth) -> Option<f64> {
    let base = Trajectory::from_poses(head.base_from_rigid_link(map_from_head)).ok()?;
    let pairs = Pairs::of(&base, &truth.bases);
    Some(Errors::after(&pairs, &pairs.world_from_map().ok()?).position_rmse_m())
}

/// What a run is compared with.
pub struct Compared {
    /// Information bound with an unknown map, m.
    slam_bound_m: Option<f64>,
    reference: Option<Arc<ReferenceMap>>,
}

/// Does `work` on one thread within the time limit.
fn alone<T: Send>(
    limit_s: f64,
    work: impl FnOnce(&mut ProgressMonitor) -> Result<T, RunError> + Send,
) -> Result<T, RunError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    with_time_limit(limit_s, |stop| pool.install(|| work(&mut ProgressMonitor { stop, report: &mut |_| {} })))
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
