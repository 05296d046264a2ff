//! The latency study: it recovers the simulated latency, and resumes after a stop.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use zsim::spec::{Kind, Source, find, parse};
use zsim::study::StudyError;
use zsim::study::latency::{
    ClockState, Disturbance, LatencyResult, LatencySpec, LatencyStudy, csv, curve_figure, map_figure, text_table,
};
use zsim::study::reproduction::ExperimentSpec;

fn shipped() -> (LatencySpec, Source) {
    let source = find(Kind::Experiment, "fig4").unwrap();
    let ExperimentSpec::Latency(spec) = parse(&source).unwrap() else { panic!("figure 4 is of latency") };
    (*spec, source)
}

/// 14 s of the mocap room: no latency, 5 ms in both directions, and 5 ms of timing noise.
fn small() -> LatencySpec {
    let (spec, _) = shipped();
    let mut small = LatencySpec {
        latencies_ms: vec![-5.0, 0.0, 5.0],
        noises_ms: vec![0.0, 5.0],
        shown_latencies_ms: vec![-5.0, 0.0],
        shown_noises_ms: vec![0.0, 5.0],
        block_s: 2.0,
        ..spec
    };
    small.scenario.scene = "mocap_room".to_owned();
    small.scenario.duration_s = 14.0;
    small
}

/// Runs the study, and stops it when the fraction `stop_at` is done.
fn run(folder: &Path, threads: usize, stop_at: f64) -> Result<LatencyResult, StudyError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let stop = AtomicBool::new(false);
    let hear = |share: f64| stop.store(share >= stop_at, Ordering::Relaxed);
    let latency = LatencyStudy::new(&small(), &shipped().1).unwrap();
    pool.install(|| latency.run(folder, false, &stop, &hear))
}

#[test]
fn latency_blurs_the_cloud_clock_estimation_recovers_it_and_a_stop_changes_nothing() {
    let here = tempfile::tempdir().unwrap();
    let (cut, whole) = (here.path().join("cut"), here.path().join("whole"));
    assert!(matches!(run(&cut, 1, 0.2), Err(StudyError::Stopped)));
    let kept = std::fs::read_dir(cut.join("parts")).unwrap().count();
    assert!((1..8).contains(&kept), "{kept}");
    let study = run(&cut, 2, 2.0).unwrap();
    let again = run(&whole, 1, 2.0).unwrap();
    assert_eq!(csv(&again), csv(&study));
    assert!(map_figure(&again, ClockState::On).svg().unwrap() == map_figure(&study, ClockState::On).svg().unwrap());
    assert_eq!(study.runs.len(), 8);

    let sigma = |latency_ms: f64, noise_ms: f64, clock| {
        study.run(Disturbance { latency_ms, noise_ms }, clock).unwrap().cloud_sigma_m.value
    };
    let without = sigma(0.0, 0.0, ClockState::Off);
    // Range noise is 10 mm, and less normal to a surface at oblique incidence. With 5 ms of latency a head that nods at
    // 200 degrees/s displaces a wall at 3 m by 5 cm.
    assert!((0.005..0.012).contains(&without), "{without}");
    for (latency_ms, noise_ms) in [(-5.0, 0.0), (5.0, 0.0), (0.0, 5.0)] {
        let (off, on) = (sigma(latency_ms, noise_ms, ClockState::Off), sigma(latency_ms, noise_ms, ClockState::On));
        assert!(off > 1.3 * without, "{latency_ms} {noise_ms}: {off} {without}");
        assert!(on < 1.15 * without, "{latency_ms} {noise_ms}: {on} {without}");
    }
    // Three points 5 ms apart over 11 s of motion do not determine it better; figure 4 does.
    let minimum = study.minimum.cloud_ms.unwrap();
    assert!(minimum.value.abs() < 1.0 && study.minimum.rises_on_both_sides, "{minimum:?}");
    for latency_ms in [-5.0, 0.0, 5.0] {
        let on = study.run(Disturbance { latency_ms, noise_ms: 0.0 }, ClockState::On).unwrap();
        assert!(on.clock_error_ms.abs() < 0.3, "{}", on.clock_error_ms);
        let off = study.run(Disturbance { latency_ms, noise_ms: 0.0 }, ClockState::Off).unwrap();
        assert!((off.clock_error_ms + latency_ms).abs() < 1e-6, "{}", off.clock_error_ms);
    }

    assert_eq!(csv(&study).lines().count(), 9);
    assert!(text_table(&study).contains("noise 5 ms"));
    assert!(map_figure(&study, ClockState::Off).svg().unwrap().contains("ms latency"));
    assert!(curve_figure(&study).svg().unwrap().contains("clock state on"));
}

#[test]
fn the_folder_of_another_study_is_not_changed() {
    let here = tempfile::tempdir().unwrap();
    std::fs::write(here.path().join("made_from.ron"), "()").unwrap();
    let error = run(here.path(), 1, 2.0).unwrap_err();
    assert!(error.is_invalid_input() && error.to_string().contains("another experiment"), "{error}");
}

#[test]
fn an_invalid_study_is_an_error_with_the_line() {
    let (_, source) = shipped();
    for (old, new, sentence) in [
        ("latencies_ms: [-5.0, -2.0, -1.0, -0.5, 0.0,", "latencies_ms: [-5.0,", "needs a 0"),
        ("latencies_ms: [-5.0, -2.0, -1.0, -0.5, 0.0,", "latencies_ms: [0.0,", "on each side of 0"),
        ("latencies_ms: [-5.0, -2.0,", "latencies_ms: [-5.0, -5.0,", "more than once"),
        ("noises_ms: [0.0, 1.0,", "noises_ms: [0.0, -1.0,", "expected 0 to 20"),
        ("shown_noises_ms: [0.0,", "shown_noises_ms: [0.0, 3.0,", "but not studied"),
        ("shown_noises_ms: [0.0, 1.0,", "shown_noises_ms: [0.0,", "expected equal numbers"),
        ("block_s: 5.0", "block_s: 70.0", "do not fit"),
        ("scene: \"office\"", "scene: \"nowhere\"", "no such scene"),
    ] {
        assert!(source.text.contains(old), "{old}");
        let source = Source { text: source.text.replacen(old, new, 1), ..source.clone() };
        let ExperimentSpec::Latency(spec) = parse(&source).unwrap() else { panic!("figure 4 is of latency") };
        let error = LatencyStudy::new(&spec, &source).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(sentence), "{error}");
    }
}
