//! Fit of a head's damping ratios to the peak gains in the paper.

use super::PeaksSpec;
use crate::StudyError;
use crate::cma_es::CmaEs;
use serde::{Deserialize, Serialize};
use zsim_base::random::Seed;
use zsim_base::spec::Source;
use zsim_dynamics::{AccelerationKind, DampingSpec, HeadModel, HeadSpec, Peak};
use zsim_head::gains::{AXES, with_damping};
use zsim_motion::Axis;

/// Budget of the fit: evaluations of the closed form's peaks, 120 generations.
const MAX_EVALUATIONS: usize = 1200;

/// Population size of CMA-ES, slightly above the default of 8 for four parameters.
const POPULATION: usize = 10;

/// Weight of the prior, per unit of the logarithm of a damping ratio.
///
/// It keeps ratios that no peak depends on at the head's own values.
const PRIOR_WEIGHT: f64 = 1e-2;

/// Fitted damping ratios and the resulting peaks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DampingFit {
    /// Damping ratios.
    pub damping_ratio: DampingSpec,
    /// Peaks of the closed form, rotations first.
    pub peaks: Vec<FittedPeak>,
}

/// A peak and its counterpart in the paper.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FittedPeak {
    /// Axis of the gain.
    pub axis: Axis,
    /// Peak gain in the paper; `None` if the paper shows none.
    pub paper: Option<f64>,
    /// Peak of the closed form; `None` if the curve has no peak.
    pub peak: Option<Peak>,
}

impl FittedPeak {
    /// Logarithm of the ratio of the peak to the paper's. A curve without a peak has no resonance: its gain counts as 1.
    pub fn log_ratio(&self) -> Option<f64> {
        Some((self.peak.map_or(1.0, |peak| peak.gain) / self.paper?).ln())
    }
}

impl DampingFit {
    /// Root mean square of the log ratios; `None` if the paper shows no peak.
    pub fn rms_log_ratio(&self) -> Option<f64> {
        let ratios: Vec<f64> = self.peaks.iter().filter_map(FittedPeak::log_ratio).collect();
        (!ratios.is_empty()).then(|| (ratios.iter().map(|r| r * r).sum::<f64>() / ratios.len() as f64).sqrt())
    }

    /// Peaks of `head` in comparison with the paper's.
    fn new(head: &HeadModel, damping_ratio: DampingSpec, paper: &PeaksSpec, up_to_hz: f64) -> Self {
        let response = head.frequency_response(&head.default_points());
        let peak = |axis| response.peak(axis, up_to_hz, AccelerationKind::Kinematic);
        let peaks = AXES.map(|axis| FittedPeak { axis, paper: paper.peak(axis), peak: peak(axis) });
        Self { damping_ratio, peaks: peaks.to_vec() }
    }
}

/// Fits one damping ratio per kind of mode, each within `ratios`, to the peaks of the paper.
///
/// Minimises the root mean square of the log ratios of the closed form's peaks up to `up_to_hz` to the paper's, by CMA-ES
/// (Hansen 2016) on the logarithms of the damping ratios, starting at the head's own.
///
/// # Errors
/// If the head has no static equilibrium, or no spring.
pub fn fit_damping(
    spec: &HeadSpec,
    source: &Source,
    paper: &PeaksSpec,
    ratios: (f64, f64),
    up_to_hz: f64,
) -> Result<DampingFit, StudyError> {
    let Some(own) = spec.clone().linkage.damping_ratio_mut().copied() else {
        let message = "the head is rigid: it has no damping to fit".to_owned();
        return Err(StudyError::Plan { what: "damping", message });
    };
    let (low, high) = (ratios.0.ln(), ratios.1.ln());
    let coordinate = |ratio: f64| ((ratio.max(ratios.0).ln() - low) / (high - low)).clamp(0.0, 1.0);
    let start = [own.rocking, own.sway, own.bounce, own.yaw].map(coordinate);
    let ratios_at = |point: &[f64]| {
        let ratio = |k: usize| (low + point[k].clamp(0.0, 1.0) * (high - low)).exp();
        DampingSpec { rocking: ratio(0), sway: ratio(1), bounce: ratio(2), yaw: ratio(3) }
    };
    let fit_at = |point: &[f64]| -> Result<DampingFit, StudyError> {
        let damping = ratios_at(point);
        let head = HeadModel::new(&with_damping(spec, damping), source)?;
        Ok(DampingFit::new(&head, damping, paper, up_to_hz))
    };
    // Static equilibrium does not depend on damping: later evaluations cannot fail.
    let at_start = fit_at(&start)?;
    let objective = |point: &[f64]| {
        let outside: f64 = point.iter().map(|x| (x - x.clamp(0.0, 1.0)).powi(2)).sum();
        let deviation = point.iter().zip(start).map(|(x, own)| ((x - own) * (high - low)).powi(2)).sum::<f64>();
        let misfit = fit_at(point).map_or(1e3, |fit| fit.rms_log_ratio().unwrap_or(0.0));
        misfit * misfit + outside + PRIOR_WEIGHT * PRIOR_WEIGHT * deviation
    };
    let settings = CmaEs { step: 0.2, population: POPULATION, max_evaluations: MAX_EVALUATIONS };
    let best = settings.minimise(&start, &mut Seed(1).stream("reproduction/damping"), objective);
    best.map_or(Ok(at_start), |best| fit_at(&best.point))
}
