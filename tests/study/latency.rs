//! The latency study: it recovers the simulated latency, and resumes after a stop.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use zsim::run::timing::{ClockState, Disturbance};
use zsim::spec::{Kind, NamedSpec, Source, find, parse};
use zsim::study::StudyError;
use zsim::study::latency::{LatencyResult, csv, curve_figure, document, map_figure};
use zsim::study::reproduction::ExperimentSpec;
use zsim::study::sweep::{AxisSpec, BaseSpec, JourneySpec, Plan, Runner, Shard, SweepSpec};

const ZSIM: &str = env!("CARGO_BIN_EXE_zsim");

/// 14 s of the mocap room: no latency, 5 ms in both directions, and 5 ms of timing noise.
fn small() -> Plan {
    let source = find(Kind::Study, "timing").unwrap();
    let mut small: SweepSpec = parse(&source).unwrap();
    let BaseSpec::Journey(JourneySpec { scene, duration_s, timing: Some(timing), .. }) = &mut small.base else {
        panic!("the study has timing errors")
    };
    (*scene, *duration_s, timing.block_s) = ("mocap_room".to_owned(), 14.0, 2.0);
    let AxisSpec::Levels { levels, .. } = &mut small.axes[0] else { panic!("the timings are levels") };
    levels.retain(|level| ["-5 ms", "0 ms", "5 ms", "noise 5 ms"].contains(&level.name.as_str()));
    Plan::new("timing", &small, &source).unwrap()
}

/// Runs the study, and stops it when the fraction `stop_at` is done.
fn run(folder: &Path, threads: usize, stop_at: f64) -> Result<LatencyResult, StudyError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let stop = AtomicBool::new(false);
    let on_progress = |fraction: f64| stop.store(fraction >= stop_at, Ordering::Relaxed);
    let runner = Runner { program: Path::new(ZSIM), stop: &stop, on_progress: &on_progress };
    pool.install(|| {
        let sweep = small().write(folder, false)?;
        sweep.run(Shard::WHOLE, &runner)?;
        Ok(sweep.merge_and_report()?.latency.unwrap())
    })
}

#[test]
fn latency_blurs_the_cloud_clock_estimation_recovers_it_and_a_stop_changes_nothing() {
    let here = tempfile::tempdir().unwrap();
    let (cut, whole) = (here.path().join("cut"), here.path().join("whole"));
    assert!(run(&cut, 1, 0.2).is_err_and(|error| error.is_stopped()));
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
    assert!(document(&study).text().contains("noise 5 ms"));
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
fn an_invalid_study_is_refused() {
    let study = find(Kind::Study, "timing").unwrap();
    for (old, new, sentence) in [
        ("\"timing.latency_ms\": -5.0", "\"timing.latency_ms\": -25.0", "expected -20 to 20"),
        ("\"timing.noise_ms\": 1.0", "\"timing.noise_ms\": -1.0", "expected 0 to 20"),
        ("block_s: 5.0", "block_s: 70.0", "do not fit"),
        ("scene: \"office\"", "scene: \"nowhere\"", "no such scene"),
        ("[cloud_sigma_m,", "[drift_m_per_min,", "does not measure drift_m_per_min"),
    ] {
        assert!(study.text.contains(old), "{old}");
        let source = Source { text: study.text.replacen(old, new, 1), ..study.clone() };
        let error = Plan::new("timing", &parse(&source).unwrap(), &source).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(sentence), "{error}");
    }
    let figure = find(Kind::Experiment, "fig4").unwrap();
    let source = Source { text: figure.text.replace("\"timing\"", "\"imu_quality\""), ..figure };
    let error = parse::<ExperimentSpec>(&source).unwrap().check_model(&source).unwrap_err().to_string();
    assert!(error.contains("has no `timing`"), "{error}");
}
