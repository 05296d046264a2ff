//! The summary table on the terminal.

use zsim::report::{CloudMetrics, Metrics, OpenLoopMetrics, SimulationMetrics, summary, table};

fn metrics() -> Metrics {
    Metrics {
        version: "0.1.0".to_owned(),
        scene: Some("office".to_owned()),
        seed: Some(1),
        duration_s: 120.0,
        simulation: SimulationMetrics {
            wall_s: Some(2.0),
            beams: Some(5_188_800),
            returns: Some(5_000_000),
            ..Default::default()
        },
        open_loop: OpenLoopMetrics {
            wall_s: Some(4.2),
            fraction_of_acquisition: Some(0.035),
            fixed_views: Some(5),
            position_rmse_m: Some(0.0123),
            imu_only_drift_m_per_min: Some(4321.0),
            ..Default::default()
        },
        cloud: CloudMetrics { sigma_m: Some(0.0134), ..Default::default() },
        ..Metrics::default()
    }
}

#[test]
fn the_summary_has_the_known_figures_in_80_columns() {
    let text = summary(&metrics());
    println!("{text}");
    assert!(text.starts_with("office, 2.00 min, seed 1\n"));
    for words in ["60.0 x real time", "4.20 s (3.50 % of the recording)", "12.3 mm", "4.32 km/min", "13.4 mm"] {
        assert!(text.contains(words), "{words} is missing in:\n{text}");
    }
    assert!(!text.contains("closed loop"), "the summary has rows without figures");
    assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
}

#[test]
fn a_table_of_long_words_wraps_at_80_columns() {
    let row = vec!["a".repeat(50), "word ".repeat(30), "1".to_owned()];
    let text = table(&["topic", "words", "n"], &[row], true);
    println!("{text}");
    assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
}
