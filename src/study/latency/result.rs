//! Result of a latency study.

use crate::bootstrap::{ConfidenceInterval, Resampling};
use serde::Serialize;
use zsim_run::RunInputs;
use zsim_run::timing::{Block, ClockState, Disturbance, MapErrors, Section, pooled};

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
    /// Vertical section through the map, if it is shown.
    #[serde(skip)]
    pub section: Option<Section>,
}

impl LatencyRun {
    fn has_timing_of(&self, other: &Self) -> bool {
        (self.disturbance, self.clock) == (other.disturbance, other.clock)
    }
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
}

impl LatencyResult {
    /// Summarises the runs of a sweep, in its order; `None` without runs, or if two have the same timing.
    pub(crate) fn of(runs: &[(RunInputs, MapErrors)]) -> Option<Self> {
        let (first, errors) = runs.first()?;
        let (inputs, timing) = (&first.simulation, first.timing?);
        let resampling = Resampling::new(errors.blocks.len(), inputs.seed);
        let run = |(journey, errors): &(RunInputs, MapErrors)| {
            Some(LatencyRun {
                disturbance: journey.timing?.disturbance(),
                clock: ClockState::of(&journey.estimator.spec),
                cloud_sigma_m: resampling.interval(&errors.blocks, |sum| sum.cloud_variance_m2().sqrt()),
                cloud_bias_m: pooled(&errors.blocks).cloud_bias_m(),
                position_rmse_m: resampling.interval(&errors.blocks, |sum| sum.position_variance_m2().sqrt()),
                clock_error_ms: errors.clock_error_ms,
                section: errors.section.clone(),
            })
        };
        let all: Vec<LatencyRun> = runs.iter().map(run).collect::<Option<_>>()?;
        let is_repeated = |(k, run): (usize, &LatencyRun)| all[..k].iter().any(|other| other.has_timing_of(run));
        if all.iter().enumerate().any(is_repeated) {
            return None;
        }
        let mut result = Self {
            scene: inputs.scene.spec.name.clone(),
            seed: inputs.seed.0,
            duration_s: inputs.duration_s,
            block_s: timing.block_s,
            minimum: minimum(&all, runs, &resampling),
            recovery: Recovery { cloud_sigma_departs_by: f64::NAN, cloud_sigma_departs_by_off: f64::NAN },
            runs: all,
        };
        result.recovery = Recovery {
            cloud_sigma_departs_by: relative_deviation(&result.latencies(ClockState::On)),
            cloud_sigma_departs_by_off: relative_deviation(&result.latencies(ClockState::Off)),
        };
        result.minimum.rises_on_both_sides = is_monotonic(&result.latencies(ClockState::Off));
        Some(result)
    }

    /// Disturbances with a map in the figure, in the order of the runs: latencies, noises; both include none.
    pub fn shown(&self) -> [Vec<Disturbance>; 2] {
        let shown = self.runs.iter().filter(|run| run.clock == ClockState::Off && run.section.is_some());
        let shown: Vec<Disturbance> = shown.map(|run| run.disturbance).collect();
        let latencies = shown.iter().copied().filter(|shown| shown.noise_ms == 0.0).collect();
        [latencies, shown.iter().copied().filter(|shown| shown.latency_ms == 0.0).collect()]
    }

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

/// Latency of minimal error with the clock state off.
fn minimum(summaries: &[LatencyRun], runs: &[(RunInputs, MapErrors)], resampling: &Resampling) -> Minimum {
    let is_curve = |run: &LatencyRun| run.clock == ClockState::Off && run.disturbance.noise_ms == 0.0;
    let curve: Vec<(f64, &[Block])> = summaries
        .iter()
        .zip(runs)
        .filter(|(summary, _)| is_curve(summary))
        .map(|(summary, (_, errors))| (summary.disturbance.latency_ms, errors.blocks.as_slice()))
        .collect();
    Minimum {
        cloud_ms: resampling.minimum(&curve, Block::cloud_variance_m2),
        position_ms: resampling.minimum(&curve, Block::position_variance_m2),
        rises_on_both_sides: false,
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
