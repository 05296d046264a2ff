//! All runs of a study, kept as they are finished.

use super::band::{Banded, Block, Resampling, whole};
use super::judge::{Bench, Judged};
use super::probe::Probe;
use super::{ClockState, Disturbance, LatencySpec};
use crate::estimation::{self, EstimatorSpec};
use crate::measurement::Calibration;
use crate::recording::{Preference, Reader, Selection};
use crate::simulation::{Simulation, Specs};
use crate::spec::Source;
use crate::study::cloud::Surroundings;
use crate::study::reproduction::kept::Kept;
use crate::study::watch::PieceProgress;
use crate::study::{OnProgress, StudyError, Watch, record};
use serde::Serialize;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

const RECORDING: &str = "recording.mcap";

/// A study whose specs are found and checked, ready to run.
#[derive(Debug, Clone)]
pub struct Latency {
    spec: LatencySpec,
    specs: Specs,
    estimator: EstimatorSpec,
}

/// What a run came to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StudyRun {
    /// What was put on the timing.
    pub disturbance: Disturbance,
    /// Whether the estimator looked after the clocks.
    pub clock: ClockState,
    /// Standard deviation of the cloud's distances to the true surfaces, m.
    pub cloud_sigma_m: Banded,
    /// Their mean, m.
    pub cloud_bias_m: f64,
    /// Position error after rigid alignment, root mean square, m.
    pub position_rmse_m: Banded,
    /// Estimated minus true clock offset at the end, ms.
    pub clock_error_ms: f64,
    /// The points of the cut, along it and up, m.
    #[serde(skip)]
    pub cut_m: Vec<(f32, f32)>,
}

/// Where the curves over the latency have their minimum, ms, with the clock state off; `None` where they have none.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Minimum {
    /// That of the cloud's variance.
    pub cloud_ms: Option<Banded>,
    /// That of the squared position error.
    pub position_ms: Option<Banded>,
    /// Whether the cloud's sigma is greater at each latency than at those nearer to none.
    pub rises_on_both_sides: bool,
}

/// What the clock state recovers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Recovery {
    /// Over the constant latencies, the greatest departure of the cloud's sigma from that without latency, as a share
    /// of it.
    pub cloud_sigma_departs_by: f64,
    /// The same with the clock state off.
    pub cloud_sigma_departs_by_off: f64,
}

/// What the study found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Study {
    /// The scene's name.
    pub scene: String,
    /// The seed.
    pub seed: u64,
    /// How long the recording is, s.
    pub duration_s: f64,
    /// How long the blocks are that the bands come from, s.
    pub block_s: f64,
    /// The minimum over the latency.
    pub minimum: Minimum,
    /// What the clock state recovers.
    pub recovery: Recovery,
    /// The runs, latencies before noises.
    pub runs: Vec<StudyRun>,
    /// The head's true rate of rotation in the cut's plane for each of its points, degrees/s.
    #[serde(skip)]
    pub cut_rates_deg_per_s: Vec<f64>,
    /// What of the cut is shown, along it and up, m.
    #[serde(skip)]
    pub cut_range_m: ((f64, f64), (f64, f64)),
    /// Which disturbances' cuts are shown, latencies first.
    #[serde(skip)]
    pub shown: [Vec<Disturbance>; 2],
}

impl Study {
    /// The run of a disturbance.
    pub fn run(&self, disturbance: Disturbance, clock: ClockState) -> Option<&StudyRun> {
        self.runs.iter().find(|run| run.disturbance == disturbance && run.clock == clock)
    }

    /// The runs with a constant latency alone, from the least.
    pub fn latencies(&self, clock: ClockState) -> Vec<&StudyRun> {
        let mut runs: Vec<&StudyRun> =
            self.runs.iter().filter(|run| run.clock == clock && run.disturbance.noise_ms == 0.0).collect();
        runs.sort_by(|a, b| a.disturbance.latency_ms.total_cmp(&b.disturbance.latency_ms));
        runs
    }

    /// The runs with noise alone, from none.
    pub fn noises(&self, clock: ClockState) -> Vec<&StudyRun> {
        let mut runs: Vec<&StudyRun> =
            self.runs.iter().filter(|run| run.clock == clock && run.disturbance.latency_ms == 0.0).collect();
        runs.sort_by(|a, b| a.disturbance.noise_ms.total_cmp(&b.disturbance.noise_ms));
        runs
    }
}

impl Latency {
    /// Finds and checks what `spec`, which `source` says, names.
    ///
    /// # Errors
    /// When its numbers do not fit together, or a spec that it names is missing or wrong.
    pub fn new(spec: &LatencySpec, source: &Source) -> Result<Self, StudyError> {
        spec.check(source)?;
        let estimator = estimation::load(&spec.estimator)?;
        estimator.check()?;
        let (specs, _) = Specs::load(&spec.scenario)?;
        Ok(Self { spec: spec.clone(), specs, estimator })
    }

    /// Its spec.
    pub fn spec(&self) -> &LatencySpec {
        &self.spec
    }

    /// All that the work depends on.
    pub(in crate::study) fn made_from(&self) -> impl Serialize + use<> {
        (env!("CARGO_PKG_VERSION"), self.spec.clone(), self.specs.clone(), self.estimator.clone())
    }

    /// Does in `folder` what is not done yet; `on_progress` is told how far it is.
    ///
    /// What it finds does not depend on the number of threads, nor on where an earlier run was stopped.
    ///
    /// # Errors
    /// When the folder holds other work and `anew` does not allow to throw it away, a part fails, or somebody stops it.
    pub fn run(
        &self,
        folder: &Path,
        anew: bool,
        stop: &AtomicBool,
        on_progress: OnProgress<'_>,
    ) -> Result<Study, StudyError> {
        let kept = Kept::open(folder, &self.made_from(), anew)?;
        self.run_in(&kept, stop, on_progress)
    }

    /// The same in a folder that is open.
    pub(in crate::study) fn run_in(
        &self,
        kept: &Kept,
        stop: &AtomicBool,
        on_progress: OnProgress<'_>,
    ) -> Result<Study, StudyError> {
        let simulation = Simulation::prepare(&self.spec.scenario)?;
        let path = kept.folder().join(RECORDING);
        if !path.is_file() {
            let part = kept.folder().join("recording.part");
            let mut watch = Watch { stop, report: &mut |_| {} };
            record(&simulation, &part, &kept.folder().join("truth.tum"), false, &mut watch)?;
            std::fs::rename(&part, &path).map_err(StudyError::file(&path))?;
        }
        let reader = Reader::open(&path)?;
        let selection = reader.select(&Preference::default())?;
        let calibration = simulation.calibration();
        let probe = self.probe(&simulation, &reader, (&selection, &calibration), stop)?;
        let bench = Bench {
            reader: &reader,
            selection: &selection,
            calibration: &calibration,
            estimator: &self.estimator,
            world: simulation.world(),
            probe: &probe,
            block_s: self.spec.block_s,
            seed: self.spec.scenario.seed,
        };
        let judged = self.estimate_all(&bench, kept, stop, on_progress)?;
        Ok(self.sum_up(simulation.world().name(), &judged, probe))
    }

    fn probe(
        &self,
        simulation: &Simulation,
        reader: &Reader,
        how: (&Selection, &Calibration),
        stop: &AtomicBool,
    ) -> Result<Probe, StudyError> {
        let surroundings = Surroundings { world: simulation.world(), carrier: simulation.carrier() };
        let lidar = simulation.lidar();
        let scans = self.spec.scenario.duration_s / lidar.period_s();
        let returns = (scans * lidar.beams().len() as f64) as usize;
        Probe::read(reader, how, surroundings, (returns, self.spec.shown_s), stop)
    }

    /// Every run, one thread each, in the order of the spec.
    fn estimate_all(
        &self,
        bench: &Bench<'_>,
        kept: &Kept,
        stop: &AtomicBool,
        on_progress: OnProgress<'_>,
    ) -> Result<Vec<Judged>, StudyError> {
        let runs = self.spec.runs();
        let (next, pieces) = (AtomicUsize::new(0), PieceProgress::new(runs.len(), on_progress));
        let work = || -> Result<(), StudyError> {
            let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
            while let Some((disturbance, clock)) = runs.get(next.fetch_add(1, Ordering::Relaxed)) {
                let make = || alone.install(|| bench.run(*disturbance, *clock, stop));
                let made = kept.part::<Judged>(&part_name(*disturbance, *clock), make);
                if made.is_err() {
                    // What is left would be done for nothing.
                    next.store(runs.len(), Ordering::Relaxed);
                }
                made?;
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
        runs.iter().map(|(disturbance, clock)| kept.get(&part_name(*disturbance, *clock))).collect()
    }

    fn sum_up(&self, scene: &str, judged: &[Judged], probe: Probe) -> Study {
        let blocks = judged.first().map_or(0, |judged| judged.blocks.len());
        let resampling = Resampling::new(blocks, self.spec.scenario.seed);
        let run = |((disturbance, clock), judged): ((Disturbance, ClockState), &Judged)| StudyRun {
            disturbance,
            clock,
            cloud_sigma_m: resampling.banded(&judged.blocks, |sum| sum.cloud_variance_m2().sqrt()),
            cloud_bias_m: whole(&judged.blocks).cloud_bias_m(),
            position_rmse_m: resampling.banded(&judged.blocks, |sum| sum.position_variance_m2().sqrt()),
            clock_error_ms: judged.clock_error_ms,
            cut_m: judged.cut_m.clone(),
        };
        let runs: Vec<StudyRun> = self.spec.runs().into_iter().zip(judged).map(run).collect();
        let latency = |latency_ms: &f64| Disturbance { latency_ms: *latency_ms, noise_ms: 0.0 };
        let noise = |noise_ms: &f64| Disturbance { latency_ms: 0.0, noise_ms: *noise_ms };
        let shown_latencies = self.spec.shown_latencies_ms.iter().map(latency).collect();
        let shown = [shown_latencies, self.spec.shown_noises_ms.iter().map(noise).collect()];
        let mut study = Study {
            scene: scene.to_owned(),
            seed: self.spec.scenario.seed.0,
            duration_s: self.spec.scenario.duration_s,
            block_s: self.spec.block_s,
            minimum: self.minimum(judged, &resampling),
            recovery: Recovery { cloud_sigma_departs_by: f64::NAN, cloud_sigma_departs_by_off: f64::NAN },
            runs,
            cut_rates_deg_per_s: probe.shown_rates_deg_per_s,
            cut_range_m: probe.range_m,
            shown,
        };
        study.recovery = Recovery {
            cloud_sigma_departs_by: departure(&study.latencies(ClockState::On)),
            cloud_sigma_departs_by_off: departure(&study.latencies(ClockState::Off)),
        };
        study.minimum.rises_on_both_sides = rises(&study.latencies(ClockState::Off));
        study
    }

    fn minimum(&self, judged: &[Judged], resampling: &Resampling) -> Minimum {
        let runs = self.spec.runs();
        let is_curve =
            |(disturbance, clock): &(Disturbance, ClockState)| *clock == ClockState::Off && disturbance.noise_ms == 0.0;
        let curve: Vec<(f64, &[Block])> = runs
            .iter()
            .zip(judged)
            .filter(|(run, _)| is_curve(run))
            .map(|((disturbance, _), judged)| (disturbance.latency_ms, judged.blocks.as_slice()))
            .collect();
        Minimum {
            cloud_ms: resampling.minimum(&curve, Block::cloud_variance_m2),
            position_ms: resampling.minimum(&curve, Block::position_variance_m2),
            rises_on_both_sides: false,
        }
    }
}

/// Greatest departure of the cloud's sigma from that of the run without latency, as a share of it.
fn departure(latencies: &[&StudyRun]) -> f64 {
    let without = latencies.iter().find(|run| run.disturbance == Disturbance::NONE);
    let Some(without) = without.map(|run| run.cloud_sigma_m.value) else { return f64::NAN };
    latencies.iter().map(|run| (run.cloud_sigma_m.value / without - 1.0).abs()).fold(0.0, f64::max)
}

/// Whether the cloud's sigma grows from no latency to either side.
fn rises(latencies: &[&StudyRun]) -> bool {
    latencies.windows(2).all(|pair| {
        let (before, after) = (pair[0].cloud_sigma_m.value, pair[1].cloud_sigma_m.value);
        if pair[1].disturbance.latency_ms <= 0.0 { before > after } else { before < after }
    })
}

fn part_name(disturbance: Disturbance, clock: ClockState) -> String {
    let clock = if clock == ClockState::On { "on" } else { "off" };
    let Disturbance { latency_ms, noise_ms } = disturbance;
    format!("clock-{clock}-latency-{latency_ms}-noise-{noise_ms}")
}
