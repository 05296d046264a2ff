//! A latency study as a document and as CSV.

use super::{LatencyResult, LatencyRun};
use crate::bootstrap::ConfidenceInterval;
use zsim_report::{Document, Table};
use zsim_run::timing::{ClockState, Disturbance};

/// The content of `latency.csv`: a row per run, measures with their confidence limits.
pub fn csv(study: &LatencyResult) -> String {
    let interval = |of: &ConfidenceInterval| [of.value, of.low, of.high].map(|x| x.to_string());
    let rows = study.runs.iter().map(|run| {
        let Disturbance { latency_ms, noise_ms } = run.disturbance;
        let clock = if run.clock == ClockState::On { "on" } else { "off" }.to_owned();
        let timing = [latency_ms.to_string(), noise_ms.to_string(), clock];
        let [bias, clock_error] = [run.cloud_bias_m, run.clock_error_ms].map(|x| vec![x.to_string()]);
        [&timing[..], &interval(&run.cloud_sigma_m), &bias, &interval(&run.position_rmse_m), &clock_error].concat()
    });
    let header = [
        "latency_ms",
        "noise_ms",
        "clock_state",
        "cloud_sigma_m",
        "cloud_sigma_low_m",
        "cloud_sigma_high_m",
        "cloud_bias_m",
        "position_rmse_m",
        "position_rmse_low_m",
        "position_rmse_high_m",
        "clock_error_ms",
    ];
    Table::new(header, rows).csv()
}

/// Table and conclusions.
pub fn document(study: &LatencyResult) -> Document {
    let row = |name: String, disturbance: Disturbance| {
        let run = |clock| study.run(disturbance, clock);
        let cell = |run: Option<&LatencyRun>, measure: fn(&LatencyRun) -> ConfidenceInterval| {
            run.map_or_else(String::new, |run| millimetres(&measure(run)))
        };
        let (off, on) = (run(ClockState::Off), run(ClockState::On));
        let clock = on.map_or_else(String::new, |run| format!("{:+.3}", run.clock_error_ms));
        let sigma: fn(&LatencyRun) -> ConfidenceInterval = |run| run.cloud_sigma_m;
        let rmse: fn(&LatencyRun) -> ConfidenceInterval = |run| run.position_rmse_m;
        vec![name, cell(off, sigma), cell(off, rmse), cell(on, sigma), cell(on, rmse), clock]
    };
    let latencies = study.latencies(ClockState::Off);
    let latency = |run: &&LatencyRun| row(format!("{:+} ms", run.disturbance.latency_ms), run.disturbance);
    let noises = study.noises(ClockState::Off);
    let noise = |run: &&LatencyRun| row(format!("noise {} ms", run.disturbance.noise_ms), run.disturbance);
    let rows = latencies.iter().map(latency).chain(noises.iter().skip(1).map(noise));
    let mut document = Document::new("Latency and timing noise", "");
    document.add(Table::new(["timing", "cloud", "position", "cloud, on", "position, on", "clock ms"], rows));
    document.add(format!(
        "Cloud: standard deviation about the true surfaces, mm. Position: RMSE, mm. First with the clock state off, then on; clock: \
         error of the estimated offset at the end. Intervals: 95 %, bootstrap of blocks of {} s.",
        study.block_s
    ));
    document.add(conclusions(study).join("\n"));
    document
}

/// Conclusions from the curves, one sentence each.
pub(crate) fn conclusions(study: &LatencyResult) -> Vec<String> {
    let at = |minimum: Option<ConfidenceInterval>| match minimum {
        Some(ConfidenceInterval { value, low, high }) => format!("at {value:+.3} ms (95 %: {low:+.3} to {high:+.3})"),
        None => "not found".to_owned(),
    };
    let rises = if study.minimum.rises_on_both_sides { "increases" } else { "does not increase monotonically" };
    vec![
        format!(
            "Clock state off: minimum of the cloud's sigma {}, of the position error {}; sigma {rises} on both sides of zero.",
            at(study.minimum.cloud_ms),
            at(study.minimum.position_ms)
        ),
        format!(
            "Over all constant latencies, the cloud's sigma deviates from that without latency by at most {} with the clock state \
             on, and {} with it off.",
            percent(study.recovery.cloud_sigma_departs_by),
            percent(study.recovery.cloud_sigma_departs_by_off)
        ),
    ]
}

fn millimetres(interval: &ConfidenceInterval) -> String {
    let half = 0.5e3 * (interval.high - interval.low);
    format!("{:.2} \u{b1}{half:.2}", interval.value * 1e3)
}

fn percent(fraction: f64) -> String {
    format!("{:.1} %", fraction * 1e2)
}
