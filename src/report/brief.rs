//! The result of a run in four lines, for the terminal.

use super::quantity::{length, percent, time};
use super::rows::{degrees, title, verdict};
use super::{Metrics, wrapped};

/// Title, verdict, accuracy and time of a run, a line each; long lines are wrapped.
pub fn brief(metrics: &Metrics) -> String {
    let verdict = verdict(metrics).map(|verdict| format!("verdict: {verdict}"));
    let times = times(metrics);
    let lines = [Some(title(metrics)), verdict, Some(accuracy(metrics)), (!times.is_empty()).then_some(times)];
    wrapped(&lines.into_iter().flatten().collect::<Vec<_>>().join("\n"), "  ")
}

fn accuracy(metrics: &Metrics) -> String {
    let (open, closed) = (&metrics.open_loop, &metrics.closed_loop);
    let loops = [
        ("open loop", open.position_rmse_m, open.rotation_rmse_deg),
        ("closed loop", closed.position_rmse_m, closed.rotation_rmse_deg),
    ];
    let known = loops.iter().filter_map(|(name, position_m, rotation_deg)| {
        let rotation = rotation_deg.map_or_else(String::new, |deg| format!(" and {}", degrees(deg)));
        Some(format!("{name} {}{rotation}", length((*position_m)?)))
    });
    match known.collect::<Vec<_>>() {
        known if known.is_empty() => {
            "accuracy: unknown, no ground truth that the positions can be aligned with".to_owned()
        }
        known => format!("accuracy: {} (RMSE)", known.join(", ")),
    }
}

fn times(metrics: &Metrics) -> String {
    let of_acquisition = metrics.open_loop.fraction_of_acquisition;
    let fraction = of_acquisition.map_or_else(String::new, |f| format!(" ({} of run)", percent(f)));
    let parts = [
        metrics.simulation.wall_s.map(|s| format!("simulation {}", time(s))),
        metrics.open_loop.wall_s.map(|s| format!("open loop {}{fraction}", time(s))),
        metrics.closed_loop.wall_s.map(|s| format!("closed loop {}", time(s))),
    ];
    let known: Vec<String> = parts.into_iter().flatten().collect();
    if known.is_empty() { String::new() } else { format!("time: {}", known.join(", ")) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CauseMetrics, IntegrityMetrics};

    #[test]
    fn unknown_figures_are_left_out_or_said() {
        let mut metrics = Metrics { duration_s: 20.0, ..Metrics::default() };
        assert_eq!(
            brief(&metrics),
            "20.0 s\naccuracy: unknown, no ground truth that the positions can be aligned with\n"
        );
        metrics.scene = Some("office".to_owned());
        metrics.status = Some("good".to_owned());
        metrics.open_loop.position_rmse_m = Some(0.0041);
        metrics.closed_loop.position_rmse_m = Some(0.003);
        metrics.closed_loop.rotation_rmse_deg = Some(0.05);
        metrics.open_loop.wall_s = Some(2.0);
        metrics.open_loop.fraction_of_acquisition = Some(0.1);
        let text = brief(&metrics);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 4, "{text}");
        assert_eq!(lines[0], "office, 20.0 s");
        assert!(lines[1].starts_with("verdict: good"), "{text}");
        assert_eq!(lines[2], "accuracy: open loop 4.10 mm, closed loop 3.00 mm and 0.0500\u{b0} (RMSE)");
        assert_eq!(lines[3], "time: open loop 2.00 s (10.0 % of run)");
    }

    fn with_status(status: &str, causes: Vec<CauseMetrics>) -> Metrics {
        let (bound_m_99, largest_bound_m) = (Some(0.0062), Some(0.0518));
        let integrity = IntegrityMetrics { bound_m_99, largest_bound_m, causes, ..IntegrityMetrics::default() };
        Metrics { status: Some(status.to_owned()), integrity, ..Metrics::default() }
    }

    #[test]
    fn the_verdict_contains_the_first_cause_the_error_and_its_bound() {
        assert_eq!(verdict(&Metrics::default()), None);
        let mut good = with_status("good", vec![]);
        assert_eq!(verdict(&good).unwrap(), "good: 99 % bound: median 6.20 mm, at most 51.8 mm");
        good.open_loop.position_rmse_m = Some(0.004);
        assert_eq!(verdict(&good).unwrap(), "good: RMSE 4.00 mm; 99 % bound: median 6.20 mm, at most 51.8 mm");
        good.closed_loop.position_rmse_m = Some(0.003);
        good.integrity.bound_m_99 = None;
        assert_eq!(verdict(&good).unwrap(), "good: RMSE 3.00 mm; no error bound");
        let cause = |status: &str| CauseMetrics {
            status: status.to_owned(),
            kind: "gap".to_owned(),
            from_s: 3.25,
            to_s: 4.25,
            sentence: "gap of 1.00 s in the IMU data".to_owned(),
        };
        let degraded = verdict(&with_status("degraded", vec![cause("degraded")])).unwrap();
        let expected =
            "degraded: gap of 1.00 s in the IMU data, 3.2 to 4.2 s; 99 % bound: median 6.20 mm, at most 51.8 mm";
        assert_eq!(degraded, expected);
        let lost = verdict(&with_status("lost", vec![cause("lost")])).unwrap();
        assert_eq!(lost, "lost: gap of 1.00 s in the IMU data, from 3.2 s");
    }
}
