//! A study as tables.

use super::{Banded, ClockState, Disturbance, Study, StudyRun};
use crate::report;
use std::fmt::Write;

/// A line a run: `latency_ms,noise_ms,clock_state` and its figures, each of the banded ones with the ends of its band.
pub fn csv(study: &Study) -> String {
    let mut text = "latency_ms,noise_ms,clock_state,cloud_sigma_m,cloud_sigma_low_m,cloud_sigma_high_m,cloud_bias_m,\
        position_rmse_m,position_rmse_low_m,position_rmse_high_m,clock_error_ms\n"
        .to_owned();
    for run in &study.runs {
        let Disturbance { latency_ms, noise_ms } = run.disturbance;
        let clock = if run.clock == ClockState::On { "on" } else { "off" };
        let Banded { value, low, high } = run.cloud_sigma_m;
        // Writing to a string does not fail.
        let _ = write!(text, "{latency_ms},{noise_ms},{clock},{value},{low},{high},{}", run.cloud_bias_m);
        let Banded { value, low, high } = run.position_rmse_m;
        let _ = writeln!(text, ",{value},{low},{high},{}", run.clock_error_ms);
    }
    text
}

/// The table that closes a command.
pub fn words(study: &Study) -> String {
    let row = |name: String, disturbance: Disturbance| {
        let of = |clock| study.run(disturbance, clock);
        let cell = |run: Option<&StudyRun>, figure: fn(&StudyRun) -> Banded| {
            run.map_or_else(String::new, |run| millimetres(&figure(run)))
        };
        let (off, on) = (of(ClockState::Off), of(ClockState::On));
        let clock = on.map_or_else(String::new, |run| format!("{:+.3}", run.clock_error_ms));
        let sigma: fn(&StudyRun) -> Banded = |run| run.cloud_sigma_m;
        let rmse: fn(&StudyRun) -> Banded = |run| run.position_rmse_m;
        vec![name, cell(off, sigma), cell(off, rmse), cell(on, sigma), cell(on, rmse), clock]
    };
    let latencies = study.latencies(ClockState::Off);
    let latency = |run: &&StudyRun| row(format!("{:+} ms", run.disturbance.latency_ms), run.disturbance);
    let noises = study.noises(ClockState::Off);
    let noise = |run: &&StudyRun| row(format!("noise {} ms", run.disturbance.noise_ms), run.disturbance);
    let rows: Vec<Vec<String>> = latencies.iter().map(latency).chain(noises.iter().skip(1).map(noise)).collect();
    let header = ["timing", "cloud", "position", "cloud, on", "position, on", "clock ms"];
    format!(
        "{}\nMillimetres: standard deviation of the cloud about the true surfaces, and position RMSE; the clock state off, then \
         on, with the error of the offset that it ends with. Bands: 95 %, blocks of {} s.\n\n{}\n",
        report::table(&header, &rows, true),
        study.block_s,
        sentences(study).join("\n")
    )
}

/// What the curves say, a sentence each.
pub(in crate::study) fn sentences(study: &Study) -> Vec<String> {
    let at = |minimum: Option<Banded>| match minimum {
        Some(Banded { value, low, high }) => format!("at {value:+.3} ms (95 %: {low:+.3} to {high:+.3})"),
        None => "nowhere".to_owned(),
    };
    let rises = if study.minimum.rises_on_both_sides { "rises" } else { "does not rise everywhere" };
    vec![
        format!(
            "With the clock state off the cloud is sharpest {}, the position best {}; the cloud's spread {rises} on both sides.",
            at(study.minimum.cloud_ms),
            at(study.minimum.position_ms)
        ),
        format!(
            "Over all constant latencies the cloud's sigma departs from that without by {} at most with the clock state on, \
             by {} with it off.",
            percent(study.recovery.cloud_sigma_departs_by),
            percent(study.recovery.cloud_sigma_departs_by_off)
        ),
    ]
}

fn millimetres(banded: &Banded) -> String {
    let half = 0.5e3 * (banded.high - banded.low);
    format!("{:.2} \u{b1}{half:.2}", banded.value * 1e3)
}

fn percent(share: f64) -> String {
    format!("{:.1} %", share * 1e2)
}
