//! Figure 4: latency and timing noise.

use super::kept::Kept;
use super::{Finding, Row};
use crate::study::latency::{ClockState, Disturbance, Latency, Study, csv, curve_figure, map_figure, sentences};
use crate::study::{OnProgress, StudyError};
use std::sync::atomic::AtomicBool;

/// Estimates, draws, and tells.
pub(super) fn run(latency: &Latency, kept: &Kept, on_progress: OnProgress<'_>) -> Result<Finding, StudyError> {
    let study = latency.run_in(kept, &AtomicBool::new(false), on_progress)?;
    kept.write("latency.csv", &csv(&study))?;
    kept.write("latency.json", &(serde_json::to_string_pretty(&study)? + "\n"))?;
    for (name, figure) in [
        ("maps", map_figure(&study, ClockState::Off)),
        ("maps_clock_on", map_figure(&study, ClockState::On)),
        ("curves", curve_figure(&study)),
    ] {
        figure.save(kept.folder(), name)?;
    }
    Ok(finding(&latency.spec().figure, &study))
}

fn finding(figure: &str, study: &Study) -> Finding {
    let row = |disturbance: Disturbance, (what, paper): (String, &str)| {
        let sigma_mm = |clock| study.run(disturbance, clock).map(|run| run.cloud_sigma_m.value * 1e3);
        let told = |clock, name: &str| sigma_mm(clock).map_or_else(String::new, |mm| format!("{mm:.1} mm {name}"));
        Row {
            figure: figure.to_owned(),
            what,
            paper: paper.to_owned(),
            ours: format!("{}, {}", told(ClockState::Off, "off"), told(ClockState::On, "on")),
        }
    };
    let misaligned = |disturbed: bool| if disturbed { "visible misalignment" } else { "sharp" };
    let [latencies, noises] = &study.shown;
    let mut rows = Vec::new();
    for shown in latencies {
        let what = format!("cloud sigma at {} ms of latency, clock state off and on", shown.latency_ms);
        rows.push(row(*shown, (what, misaligned(shown.latency_ms != 0.0))));
    }
    for shown in noises.iter().filter(|shown| shown.noise_ms > 0.0) {
        let what = format!("cloud sigma at {} ms of timing noise, clock state off and on", shown.noise_ms);
        rows.push(row(*shown, (what, "-")));
    }
    let mut notes = vec![
        "The paper shows maps and no numbers; ours is the spread about the true surfaces, beside the same maps. Its place, its \
         length and what its noise is added to are not told: here noise is on the stamp of each scan, white from scan to scan, \
         and with the clock state off no stamp is smoothed."
            .to_owned(),
        format!(
            "One recording ({}, seed {}, {} s). Bands are 95 %, by drawing blocks of {} s.",
            study.scene, study.seed, study.duration_s, study.block_s
        ),
    ];
    notes.extend(sentences(study));
    Finding { rows, notes }
}
