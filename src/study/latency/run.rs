//! Execution of a latency study; finished runs are stored, so that it can be resumed.

use super::bootstrap::{Block, ConfidenceInterval, Resampling, pooled};
use super::evaluate::{RunContext, RunResult};
use super::reference::Reference;
use super::{ClockState, Disturbance, LatencySpec};
use crate::estimation::{self, EstimatorSpec};
use crate::measurement::Calibration;
use crate::recording::{Reader, Selection, TopicPreference};
use crate::simulation::{Simulation, Specs};
use crate::spec::Source;
use crate::study::cloud::Surroundings;
use crate::study::progress::PieceProgress;
use crate::study::reproduction::part_store::PartStore;
use crate::study::{OnProgress, ProgressMonitor, StudyError, record};
use serde::Serialize;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Name of the recording in the study's folder.
const RECORDING: &str = "recording.mcap";

/// A latency study with its specs loaded and checked.
#[derive(Debug, Clone)]
pub struct LatencyStudy {
    spec: LatencySpec,
    specs: Specs,
    estimator: EstimatorSpec,
}

/// Result of one run with its confidence intervals.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LatencyRun {
    /// Timing error of the run.
    pub disturbance: Disturbance,
    /// Whether the estimator estimated clock errors.
    pub clock: ClockState,
    /// Standard deviation of the cloud's distances to the true surfaces, m.
    pub cloud_sigma_m: ConfidenceInterval,
    /// Mean distance of the cloud to the true surfaces, m.
    pub cloud_bias_m: f64,
    /// Position RMSE after rigid alignment, m.
    pub position_rmse_m: ConfidenceInterval,
    /// Estimated minus true clock offset at the end of the run, ms.
    pub clock_error_ms: f64,
    /// Points of the section (along it, up), m.
    #[serde(skip)]
    pub section_m: Vec<(f32, f32)>,
}

/// Latency at which the errors are minimal with the clock state off, ms; `None` without a minimum.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Minimum {
    /// Minimum of the cloud's variance.
    pub cloud_ms: Option<ConfidenceInterval>,
    /// Minimum of the squared position error.
    pub position_ms: Option<ConfidenceInterval>,
    /// Whether the cloud's sigma increases monotonically with the magnitude of the latency on both sides of zero.
    pub rises_on_both_sides: bool,
}

/// Recovery by the clock state: deviation of the cloud's sigma from that without latency.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Recovery {
    /// Largest relative deviation of the cloud's sigma over the constant latencies, with the clock state on.
    pub cloud_sigma_departs_by: f64,
    /// Largest relative deviation with the clock state off.
    pub cloud_sigma_departs_by_off: f64,
}

/// Result of a latency study.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LatencyResult {
    /// Name of the scene.
    pub scene: String,
    /// Random seed.
    pub seed: u64,
    /// Duration of the recording, s.
    pub duration_s: f64,
    /// Length of the bootstrap blocks, s.
    pub block_s: f64,
    /// Latency of minimal error.
    pub minimum: Minimum,
    /// Recovery by the clock state.
    pub recovery: Recovery,
    /// The runs: first latencies, then noises.
    pub runs: Vec<LatencyRun>,
    /// True angular rate of the head in the section's plane for each point, degrees/s.
    #[serde(skip)]
    pub section_rates_deg_per_s: Vec<f64>,
    /// Shown range of the section (along it, up), m.
    #[serde(skip)]
    pub section_range_m: ((f64, f64), (f64, f64)),
    /// Disturbances with a section in the figure: latencies, noises.
    #[serde(skip)]
    pub shown: [Vec<Disturbance>; 2],
}

impl LatencyResult {
    /// The run with a disturbance and a clock state.
    pub fn run(&self, disturbance: Disturbance, clock: ClockState) -> Option<&LatencyRun> {
        self.runs.iter().find(|run| run.disturbance == disturbance && run.clock == clock)
    }

    /// Runs without noise, by increasing latency.
    pub fn latencies(&self, clock: ClockState) -> Vec<&LatencyRun> {
        let mut runs: Vec<&LatencyRun> =
            self.runs.iter().filter(|run| run.clock == clock && run.disturbance.noise_ms == 0.0).collect();
        runs.sort_by(|a, b| a.disturbance.latency_ms.total_cmp(&b.disturbance.latency_ms));
        runs
    }

    /// Runs without latency, by increasing noise.
    pub fn noises(&self, clock: ClockState) -> Vec<&LatencyRun> {
        let mut runs: Vec<&LatencyRun> =
            self.runs.iter().filter(|run| run.clock == clock && run.disturbance.latency_ms == 0.0).collect();
        runs.sort_by(|a, b| a.disturbance.noise_ms.total_cmp(&b.disturbance.noise_ms));
        runs
    }
}

impl LatencyStudy {
    /// Checks `spec`, read from `source`, and loads the specs that it refers to.
    ///
    /// # Errors
    /// If its numbers are inconsistent, or if a spec that it refers to is missing or invalid.
    pub fn new(spec: &LatencySpec, source: &Source) -> Result<Self, StudyError> {
        spec.check(source)?;
        let estimator = estimation::load(&spec.estimator)?;
        estimator.check()?;
        let (specs, _) = Specs::load(&spec.scenario)?;
        Ok(Self { spec: spec.clone(), specs, estimator })
    }

    /// The spec of the study.
    pub fn spec(&self) -> &LatencySpec {
        &self.spec
    }

    /// Everything that determines the result; a folder with other inputs is not resumed.
    pub(in crate::study) fn inputs(&self) -> impl Serialize + use<> {
        (env!("CARGO_PKG_VERSION"), self.spec.clone(), self.specs.clone(), self.estimator.clone())
    }

    /// Runs the study in `folder`, resuming an interrupted one; `on_progress` receives the finished fraction.
    ///
    /// The result does not depend on the number of threads, nor on interruptions.
    ///
    /// # Errors
    /// If the folder contains other results and `anew` does not permit replacing them, if a run fails, or on a stop.
    pub fn run(
        &self,
        folder: &Path,
        anew: bool,
        stop: &AtomicBool,
        on_progress: OnProgress<'_>,
    ) -> Result<LatencyResult, StudyError> {
        let store = PartStore::open(folder, &self.inputs(), anew)?;
        self.run_in(&store, stop, on_progress)
    }

    /// Runs the study in an open folder.
    pub(in crate::study) fn run_in(
        &self,
        store: &PartStore,
        stop: &AtomicBool,
        on_progress: OnProgress<'_>,
    ) -> Result<LatencyResult, StudyError> {
        let simulation = Simulation::prepare(&self.spec.scenario)?;
        let path = store.folder().join(RECORDING);
        if !path.is_file() {
            let part = store.folder().join("recording.part");
            let mut watch = ProgressMonitor { stop, report: &mut |_| {} };
            record(&simulation, &part, &store.folder().join("truth.tum"), false, &mut watch)?;
            std::fs::rename(&part, &path).map_err(StudyError::file(&path))?;
        }
        let reader = Reader::open(&path)?;
        let selection = reader.select(&TopicPreference::default())?;
        let calibration = simulation.calibration();
        let reference = self.reference(&simulation, &reader, (&selection, &calibration), stop)?;
        let context = RunContext {
            reader: &reader,
            selection: &selection,
            calibration: &calibration,
            estimator: &self.estimator,
            world: simulation.world(),
            reference: &reference,
            block_s: self.spec.block_s,
            seed: self.spec.scenario.seed,
        };
        let results = self.estimate_all(&context, store, stop, on_progress)?;
        Ok(self.summarise(simulation.world().name(), &results, reference))
    }

    /// Ground truth and sampled returns of the recording.
    fn reference(
        &self,
        simulation: &Simulation,
        reader: &Reader,
        selection_and_calibration: (&Selection, &Calibration),
        stop: &AtomicBool,
    ) -> Result<Reference, StudyError> {
        let surroundings = Surroundings { world: simulation.world(), carrier: simulation.carrier() };
        let lidar = simulation.lidar();
        let scans = self.spec.scenario.duration_s / lidar.period_s();
        let returns = (scans * lidar.beams().len() as f64) as usize;
        Reference::read(reader, selection_and_calibration, surroundings, (returns, self.spec.shown_s), stop)
    }

    /// Executes all runs in parallel, each on one thread; results are in the order of the spec.
    fn estimate_all(
        &self,
        context: &RunContext<'_>,
        store: &PartStore,
        stop: &AtomicBool,
        on_progress: OnProgress<'_>,
    ) -> Result<Vec<RunResult>, StudyError> {
        let runs = self.spec.runs();
        let (next, pieces) = (AtomicUsize::new(0), PieceProgress::new(runs.len(), on_progress));
        let work = || -> Result<(), StudyError> {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
            while let Some((disturbance, clock)) = runs.get(next.fetch_add(1, Ordering::Relaxed)) {
                let evaluate = || pool.install(|| context.run(*disturbance, *clock, stop));
                let result = store.part::<RunResult>(&part_name(*disturbance, *clock), evaluate);
                if result.is_err() {
                    // After an error, the other threads skip the remaining runs.
                    next.store(runs.len(), Ordering::Relaxed);
                }
                result?;
                pieces.finish_one();
            }
            Ok(())
        };
        let threads = rayon::current_num_threads().min(runs.len());
        std::thread::scope(|scope| {
            let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
            let end = |worker: std::thread::ScopedJoinHandle<'_, Result<(), StudyError>>| {
                worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
            };
            workers.into_iter().try_for_each(end)
        })?;
        runs.iter().map(|(disturbance, clock)| store.get(&part_name(*disturbance, *clock))).collect()
    }

    fn summarise(&self, scene: &str, results: &[RunResult], reference: Reference) -> LatencyResult {
        let blocks = results.first().map_or(0, |result| result.blocks.len());
        let resampling = Resampling::new(blocks, self.spec.scenario.seed);
        let run = |((disturbance, clock), result): ((Disturbance, ClockState), &RunResult)| LatencyRun {
            disturbance,
            clock,
            cloud_sigma_m: resampling.interval(&result.blocks, |sum| sum.cloud_variance_m2().sqrt()),
            cloud_bias_m: pooled(&result.blocks).cloud_bias_m(),
            position_rmse_m: resampling.interval(&result.blocks, |sum| sum.position_variance_m2().sqrt()),
            clock_error_ms: result.clock_error_ms,
            section_m: result.section_m.clone(),
        };
        let runs: Vec<LatencyRun> = self.spec.runs().into_iter().zip(results).map(run).collect();
        let latency = |latency_ms: &f64| Disturbance { latency_ms: *latency_ms, noise_ms: 0.0 };
        let noise = |noise_ms: &f64| Disturbance { latency_ms: 0.0, noise_ms: *noise_ms };
        let shown_latencies = self.spec.shown_latencies_ms.iter().map(latency).collect();
        let shown = [shown_latencies, self.spec.shown_noises_ms.iter().map(noise).collect()];
        let mut study = LatencyResult {
            scene: scene.to_owned(),
            seed: self.spec.scenario.seed.0,
            duration_s: self.spec.scenario.duration_s,
            block_s: self.spec.block_s,
            minimum: self.minimum(results, &resampling),
            recovery: Recovery { cloud_sigma_departs_by: f64::NAN, cloud_sigma_departs_by_off: f64::NAN },
            runs,
            section_rates_deg_per_s: reference.shown_rates_deg_per_s,
            section_range_m: reference.range_m,
            shown,
        };
        study.recovery = Recovery {
            cloud_sigma_departs_by: relative_deviation(&study.latencies(ClockState::On)),
            cloud_sigma_departs_by_off: relative_deviation(&study.latencies(ClockState::Off)),
        };
        study.minimum.rises_on_both_sides = is_monotonic(&study.latencies(ClockState::Off));
        study
    }

    fn minimum(&self, results: &[RunResult], resampling: &Resampling) -> Minimum {
        let runs = self.spec.runs();
        let is_curve =
            |(disturbance, clock): &(Disturbance, ClockState)| *clock == ClockState::Off && disturbance.noise_ms == 0.0;
        let curve: Vec<(f64, &[Block])> = runs
            .iter()
            .zip(results)
            .filter(|(run, _)| is_curve(run))
            .map(|((disturbance, _), result)| (disturbance.latency_ms, result.blocks.as_slice()))
            .collect();
        Minimum {
            cloud_ms: resampling.minimum(&curve, Block::cloud_variance_m2),
            position_ms: resampling.minimum(&curve, Block::position_variance_m2),
            rises_on_both_sides: false,
        }
    }
}

/// Largest relative deviation of the cloud's sigma from that of the run without latency.
fn relative_deviation(latencies: &[&LatencyRun]) -> f64 {
    let without = latencies.iter().find(|run| run.disturbance == Disturbance::NONE);
    let Some(without) = without.map(|run| run.cloud_sigma_m.value) else { return f64::NAN };
    latencies.iter().map(|run| (run.cloud_sigma_m.value / without - 1.0).abs()).fold(0.0, f64::max)
}

/// Whether the cloud's sigma increases monotonically from zero latency to both sides.
fn is_monotonic(latencies: &[&LatencyRun]) -> bool {
    latencies.windows(2).all(|pair| {
        let (before, after) = (pair[0].cloud_sigma_m.value, pair[1].cloud_sigma_m.value);
        if pair[1].disturbance.latency_ms <= 0.0 { before > after } else { before < after }
    })
}

/// Name of a run's part file.
fn part_name(disturbance: Disturbance, clock: ClockState) -> String {
    let clock = if clock == ClockState::On { "on" } else { "off" };
    let Disturbance { latency_ms, noise_ms } = disturbance;
    format!("clock-{clock}-latency-{latency_ms}-noise-{noise_ms}")
}
