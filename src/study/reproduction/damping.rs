//! Damping that brings a head's peaks near the paper's.

use super::PeaksSpec;
use crate::dynamics::{DampingSpec, HeadModel, HeadSpec, Peak, Quantity};
use crate::motion::Axis;
use crate::random::Seed;
use crate::spec::Source;
use crate::study::StudyError;
use crate::study::gains::{AXES, with_damping};
use cmaes::{CMAESOptions, DVector};
use serde::{Deserialize, Serialize};

/// Heads that the fit tries.
const EVALUATIONS: usize = 1200;

/// Heads of one generation of the fit.
const POPULATION: usize = 10;

/// What a ratio costs for each e-fold that it leaves the head's own: enough to keep those there that no peak depends
/// on.
const PULL: f64 = 1e-2;

/// A damping, and the peaks it leads to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fit {
    /// The ratios.
    pub damping_ratio: DampingSpec,
    /// The peaks of the closed form, rotations first.
    pub peaks: Vec<FittedPeak>,
}

/// A peak beside the paper's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FittedPeak {
    /// Which gain.
    pub axis: Axis,
    /// The paper's peak, where it shows one.
    pub paper: Option<f64>,
    /// That of the closed form, where there is one.
    pub peak: Option<Peak>,
}

impl FittedPeak {
    /// The logarithm of the peak over the paper's. A curve without a peak never rises above the base's own motion by a
    /// resonance: its gain counts as 1.
    pub fn log_ratio(&self) -> Option<f64> {
        Some((self.peak.map_or(1.0, |peak| peak.gain) / self.paper?).ln())
    }
}

impl Fit {
    /// Root mean square of the peaks' log ratios; nothing where the paper shows no peak.
    pub fn rms_log_ratio(&self) -> Option<f64> {
        let ratios: Vec<f64> = self.peaks.iter().filter_map(FittedPeak::log_ratio).collect();
        (!ratios.is_empty()).then(|| (ratios.iter().map(|r| r * r).sum::<f64>() / ratios.len() as f64).sqrt())
    }

    fn of(head: &HeadModel, damping_ratio: DampingSpec, paper: &PeaksSpec, up_to_hz: f64) -> Self {
        let response = head.frequency_response(&head.default_points());
        let peak = |axis| response.peak(axis, up_to_hz, Quantity::Kinematic);
        let peaks = AXES.map(|axis| FittedPeak { axis, paper: paper.of(axis), peak: peak(axis) });
        Self { damping_ratio, peaks: peaks.to_vec() }
    }
}

/// The damping ratios, one a kind of mode and each within `ratios`, by which the closed form's peaks up to `up_to_hz`
/// come nearest to the paper's: least root mean square of their log ratios.
///
/// CMA-ES (Hansen 2016) descends on the logarithms of the ratios, from those that the head has; ratios that no peak
/// depends on stay there.
///
/// # Errors
/// When the head does not stand, or has no spring.
pub fn fit_damping(
    spec: &HeadSpec,
    source: &Source,
    paper: &PeaksSpec,
    ratios: (f64, f64),
    up_to_hz: f64,
) -> Result<Fit, StudyError> {
    let Some(own) = spec.clone().linkage.damping_ratio_mut().copied() else {
        let message = "a head that does not move has none to fit".to_owned();
        return Err(StudyError::Plan { what: "damping", message });
    };
    let (low, high) = (ratios.0.ln(), ratios.1.ln());
    let place_of = |ratio: f64| ((ratio.max(ratios.0).ln() - low) / (high - low)).clamp(0.0, 1.0);
    let start = [own.rocking, own.sway, own.bounce, own.yaw].map(place_of);
    let ratios_at = |place: &[f64]| {
        let ratio = |k: usize| (low + place[k].clamp(0.0, 1.0) * (high - low)).exp();
        DampingSpec { rocking: ratio(0), sway: ratio(1), bounce: ratio(2), yaw: ratio(3) }
    };
    let fit_at = |place: &[f64]| -> Result<Fit, StudyError> {
        let damping = ratios_at(place);
        let head = HeadModel::new(&with_damping(spec, damping), source)?;
        Ok(Fit::of(&head, damping, paper, up_to_hz))
    };
    // Whether the head stands does not depend on its damping: after this nothing fails.
    let at_start = fit_at(&start)?;
    let objective = |place: &DVector<f64>| {
        let outside: f64 = place.iter().map(|x| (x - x.clamp(0.0, 1.0)).powi(2)).sum();
        let away = place.iter().zip(start).map(|(x, own)| ((x - own) * (high - low)).powi(2)).sum::<f64>();
        let misfit = fit_at(place.as_slice()).map_or(1e3, |fit| fit.rms_log_ratio().unwrap_or(0.0));
        misfit * misfit + outside + PULL * PULL * away
    };
    let options = CMAESOptions::new(start.to_vec(), 0.2)
        .population_size(POPULATION)
        .max_function_evals(EVALUATIONS)
        .seed(Seed(1).child("reproduction/damping").0);
    // The options are sound by construction: a positive step, a population of ten.
    let best = options.build(objective).ok().and_then(|mut descent| descent.run().overall_best);
    best.map_or(Ok(at_start), |best| fit_at(best.point.as_slice()))
}
