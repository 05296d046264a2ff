//! Figure 4 of the paper: latency and timing noise.

use super::ExperimentResult;
use crate::StudyError;
use crate::latency::{LatencyResult, conclusions, curve_figure, map_figure};
use crate::sweep::{ComparedNumber, Comparison};
use std::path::Path;
use zsim_run::timing::{ClockState, Disturbance};

/// What the paper shows of a map with latency.
const MISALIGNED: &str = "visible misalignment";
/// A map whose sigma exceeds that without timing errors by this factor counts as visibly misaligned.
const VISIBLE_FACTOR: f64 = 1.2;

/// Draws the figures of the finished study in `folder`, and compares with the paper.
pub(super) fn result(figure: &str, study: &LatencyResult, folder: &Path) -> Result<ExperimentResult, StudyError> {
    for (name, figure) in [
        ("maps", map_figure(study, ClockState::Off)),
        ("maps_clock_on", map_figure(study, ClockState::On)),
        ("curves", curve_figure(study)),
    ] {
        figure.save(folder, name)?;
    }
    Ok(compare(figure, study))
}

/// Compares the maps with the paper's.
fn compare(figure: &str, study: &LatencyResult) -> ExperimentResult {
    let sharp = study.run(Disturbance::NONE, ClockState::Off);
    let sharp_mm = sharp.map_or(f64::NAN, |run| run.cloud_sigma_m.value * 1e3);
    let row = |disturbance: Disturbance, what: String, paper: &str| {
        let sigma_mm = |clock| study.run(disturbance, clock).map(|run| run.cloud_sigma_m.value * 1e3);
        let text = |clock, name: &str| sigma_mm(clock).map_or_else(String::new, |mm| format!("{mm:.1} mm {name}"));
        ComparedNumber {
            figure: figure.to_owned(),
            what,
            paper: paper.to_owned(),
            ours: format!("{}, {}", text(ClockState::Off, "off"), text(ClockState::On, "on")),
            comparison: (paper == MISALIGNED).then(|| {
                let sigma_mm = sigma_mm(ClockState::Off).unwrap_or(f64::NAN);
                Comparison::above("mm", sharp_mm, VISIBLE_FACTOR, sigma_mm)
            }),
        }
    };
    let misaligned = |disturbed: bool| if disturbed { MISALIGNED } else { "sharp" };
    let [latencies, noises] = study.shown();
    let mut rows = Vec::new();
    for shown in latencies {
        let what = format!("cloud sigma at {} ms of latency, clock state off and on", shown.latency_ms);
        rows.push(row(shown, what, misaligned(shown.latency_ms != 0.0)));
    }
    for shown in noises.into_iter().filter(|shown| shown.noise_ms > 0.0) {
        let what = format!("cloud sigma at {} ms of timing noise, clock state off and on", shown.noise_ms);
        rows.push(row(shown, what, "-"));
    }
    let mut notes = vec![
        "The paper shows maps without numbers; zsim reports the standard deviation of the cloud about the true surfaces. The \
         paper does not state location, duration, or which stamps its noise is added to: here white noise is added to the \
         stamp of each scan, and with the clock state off stamps are not smoothed."
            .to_owned(),
        format!(
            "One recording ({}, seed {}, {} s). Confidence intervals: 95 %, bootstrap of blocks of {} s.",
            study.scene, study.seed, study.duration_s, study.block_s
        ),
    ];
    notes.extend(conclusions(study));
    ExperimentResult { rows, notes }
}
