//! The paper's experiments: fit of damping ratios, and resumption after a stop.

use crate::command::{exits_with, zsim};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::SystemTime;
use zsim::dynamics::{AccelerationKind, DampingSpec, HeadModel, load};
use zsim::head::gains::with_damping;
use zsim::motion::Axis;
use zsim::study::reproduction::{Experiment, Extent, PeaksSpec, fit_damping};
use zsim::study::sweep::{Runner, Verdict};

const ZSIM: &str = env!("CARGO_BIN_EXE_zsim");

const RATIOS: (f64, f64) = (0.0005, 0.3);

/// Gain peaks of the handheld head with a given damping.
fn peaks(damping: DampingSpec, up_to_hz: f64) -> PeaksSpec {
    let (spec, source) = load("handheld").unwrap();
    let head = HeadModel::new(&with_damping(&spec, damping), &source).unwrap();
    let response = head.frequency_response(&head.default_points());
    let peak = |axis| response.peak(axis, up_to_hz, AccelerationKind::Kinematic).map(|peak| peak.gain);
    PeaksSpec {
        x_rot: peak(Axis::Roll),
        y_rot: peak(Axis::Pitch),
        z_rot: peak(Axis::Yaw),
        x: peak(Axis::X),
        y: peak(Axis::Y),
        z: peak(Axis::Z),
    }
}

#[test]
fn the_fit_recovers_the_damping_of_simulated_peaks() {
    let made = DampingSpec { rocking: 0.03, sway: 0.04, bounce: 0.02, yaw: 0.012 };
    let (spec, source) = load("handheld").unwrap();
    let fit = fit_damping(&spec, &source, &peaks(made, 20.0), RATIOS, 20.0).unwrap();
    let found = fit.damping_ratio;
    for (found, made) in [(found.rocking, made.rocking), (found.bounce, made.bounce), (found.yaw, made.yaw)] {
        assert!((found / made - 1.0).abs() < 0.01, "{fit:?}");
    }
    assert!(fit.rms_log_ratio().unwrap() < 0.005, "{fit:?}");
}

#[test]
fn a_single_yaw_peak_is_fitted_exactly_and_the_other_ratios_do_not_change() {
    // Yaw is nearly decoupled: H = (1 + 2 i zeta r) / (1 - r^2 + 2 i zeta r) with r = f / f0. The peak is taken on a fine grid.
    let (spec, source) = load("handheld").unwrap();
    let paper = PeaksSpec { z_rot: Some(15.0), ..PeaksSpec::default() };
    let fit = fit_damping(&spec, &source, &paper, RATIOS, 20.0).unwrap();
    let zeta = fit.damping_ratio.yaw;
    let gain = |r: f64| {
        let damped = (2.0 * zeta * r).powi(2);
        ((1.0 + damped) / ((1.0 - r * r).powi(2) + damped)).sqrt()
    };
    let peak = (0..4000).map(|k| gain(0.9 + 5e-5 * f64::from(k))).fold(0.0, f64::max);
    assert!((peak / 15.0 - 1.0).abs() < 0.01, "{peak} {fit:?}");
    assert!((fit.damping_ratio.rocking / 0.08 - 1.0).abs() < 0.05, "{fit:?}");
}

#[test]
fn an_unreachable_peak_is_reported_as_a_misfit() {
    // With a damping ratio of at least 0.02 no gain about z exceeds 1 / (2 zeta) sqrt(1 + 4 zeta^2) by more than 0.1 %.
    let (spec, source) = load("handheld").unwrap();
    let paper = PeaksSpec { z_rot: Some(100.0), ..PeaksSpec::default() };
    let fit = fit_damping(&spec, &source, &paper, (0.02, 0.3), 20.0).unwrap();
    assert!((fit.damping_ratio.yaw / 0.02 - 1.0).abs() < 0.01, "{fit:?}");
    assert!((fit.rms_log_ratio().unwrap() - (100.0_f64 / 25.0).ln()).abs() < 0.02, "{fit:?}");
}

/// An experiment with one well damped head, which takes about a second.
fn small(folder: &Path) -> PathBuf {
    let head = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("specs/heads/handheld.ron")).unwrap();
    std::fs::write(folder.join("head.ron"), head.replace("segments: 2", "segments: 1")).unwrap();
    let text = format!(
        "gain_curves((figure: \"3\", shown_to_hz: 5, up_to_hz: 8, ratios: (0.02, 0.3), designs: [(letter: \"a\", \
         title: \"Small\", head: {:?}, peaks: (y_rot: 15, x: 7))]))",
        folder.join("head.ron").display().to_string()
    );
    let path = folder.join("small.ron");
    std::fs::write(&path, text).unwrap();
    path
}

/// Content of all files below a folder, except those with computing times.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.ends_with("parts") || path.ends_with("times.csv") {
                continue;
            }
            if path.is_dir() {
                folders.push(path);
            } else {
                found.insert(path.strip_prefix(folder).unwrap().to_owned(), std::fs::read(&path).unwrap());
            }
        }
    }
    found
}

#[test]
fn a_stopped_experiment_resumes_with_the_same_result() {
    let here = tempfile::tempdir().unwrap();
    let experiment = Experiment::load(small(here.path()).to_str().unwrap()).unwrap();
    let whole = here.path().join("whole");
    let pool = |threads: usize| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let run = |folder: &Path, extent: Extent, stop_at: f64| {
        let stop = AtomicBool::new(false);
        let on_progress = |fraction: f64| stop.store(fraction >= stop_at, Ordering::Relaxed);
        experiment.run(
            folder,
            extent,
            false,
            &Runner { program: Path::new(ZSIM), stop: &stop, on_progress: &on_progress },
        )
    };
    let result = pool(1).install(|| run(&whole, Extent::Quick, 2.0)).unwrap();
    // Six axes, and the misfit over all axes.
    assert_eq!(result.rows.len(), 7);
    let at_end = files(&whole);
    for name in ["gains.svg", "gains.png", "coherence.svg", "coherence.png", "a/gains.csv", "a/head.ron"] {
        assert!(at_end.contains_key(Path::new(name)), "{name} of {:?}", at_end.keys());
    }

    let stopped = here.path().join("stopped");
    assert!(pool(1).install(|| run(&stopped, Extent::Quick, 0.3)).is_err_and(|error| error.is_stopped()));
    let modified = || -> BTreeMap<PathBuf, SystemTime> {
        let parts = std::fs::read_dir(stopped.join("parts")).unwrap().map(|entry| entry.unwrap());
        parts.map(|part| (part.path(), part.metadata().unwrap().modified().unwrap())).collect()
    };
    let kept = modified();
    assert!((1..6).contains(&kept.len()), "{kept:?}");
    assert!(experiment.finished(&stopped, Extent::Quick).unwrap().is_none());
    assert_eq!(pool(2).install(|| run(&stopped, Extent::Quick, 2.0)).unwrap(), result);
    let after = modified();
    assert!(kept.iter().all(|(part, time)| after.get(part) == Some(time)), "finished parts are used again");
    assert!(files(&stopped) == at_end, "the result differs from that without a stop");
    assert_eq!(experiment.finished(&stopped, Extent::Quick).unwrap(), Some(result));
    assert!(experiment.finished(&stopped, Extent::Whole).unwrap().is_none());

    let error = run(&whole, Extent::Whole, 2.0).unwrap_err();
    assert!(error.to_string().contains("another experiment"), "{error}");
}

#[test]
fn the_command_writes_the_table_and_a_second_call_does_not_change_it() {
    let here = tempfile::tempdir().unwrap();
    let path = small(here.path());
    let arguments = ["reproduce", path.to_str().unwrap(), "--quick", "--json"];
    let (printed, _) = exits_with(0, zsim().current_dir(here.path()).args(arguments));
    let printed: serde_json::Value = serde_json::from_str(&printed).unwrap();
    assert_eq!(printed["out"], "results/paper-quick");
    assert_eq!(printed["experiments"][0]["rows"].as_array().unwrap().len(), 7);
    let table = std::fs::read_to_string(here.path().join("results/paper-quick.md")).unwrap();
    assert!(table.contains("| 3a peak gain, rate about y | about 15 | within a factor of 1.5 | "), "{table}");
    assert!(table.contains("`zsim reproduce fig3 --quick`\n\nNot finished yet."), "{table}");
    let before = files(&here.path().join("results"));
    exits_with(0, zsim().current_dir(here.path()).args(arguments));
    assert!(files(&here.path().join("results")) == before);
}

#[test]
fn invalid_experiments_exit_with_2_and_a_message() {
    let here = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(small(here.path())).unwrap();
    for (name, from, to, sentence) in [
        ("order", "(0.02, 0.3)", "(0.3, 0.02)", "0 < least < most < 1"),
        ("peak", "x: 7", "x: 0.5", "a gain above 1"),
        ("shown", "shown_to_hz: 5", "shown_to_hz: 9", "less than the 9 Hz shown"),
        ("head", "head.ron", "nobody.ron", "no such head"),
        ("letter", "letter: \"a\"", "letter: \"../a\"", "names a folder"),
        ("key", "figure:", "figur:", "figur"),
    ] {
        let file = here.path().join(format!("{name}.ron"));
        std::fs::write(&file, text.replacen(from, to, 1)).unwrap();
        let arguments = ["reproduce", file.to_str().unwrap(), "--quick"];
        let (_, stderr) = exits_with(2, zsim().current_dir(here.path()).args(arguments));
        assert!(stderr.contains(sentence), "{name}: {stderr}");
    }
    let (_, stderr) = exits_with(2, zsim().current_dir(here.path()).args(["reproduce", "fig99"]));
    assert!(stderr.contains("fig3"), "the error lists the known experiments");
}

#[test]
fn the_shipped_experiments_are_valid() {
    assert!(!Experiment::all().is_empty());
    for name in Experiment::all() {
        Experiment::load(&name).unwrap();
    }
}

#[test]
fn five_fixed_views_drift_less_than_none_in_the_smoke_test_of_motion_capture() {
    let here = tempfile::tempdir().unwrap();
    let experiment = Experiment::load("fig11").unwrap();
    let (stop, on_progress) = (AtomicBool::new(false), |_: f64| {});
    let runner = Runner { program: Path::new(ZSIM), stop: &stop, on_progress: &on_progress };
    let result = experiment.run(here.path(), Extent::Quick, false, &runner).unwrap();
    assert_eq!(result.rows.len(), 10);
    let claim = result.rows[9].comparison.as_ref().unwrap();
    assert!(claim.verdict == Verdict::Met && claim.median < 1.0, "{result:?}");
    let drift = result.rows[0].comparison.as_ref().unwrap();
    assert!(drift.paper == Some(75.0) && drift.unit == "mm/min" && drift.median > 0.0, "{drift:?}");
    // Computing times, which are in a table of their own.
    for (row, paper) in result.rows[6..9].iter().zip([62.0, 71.0, 73.0]) {
        let time = row.comparison.as_ref().unwrap();
        assert!(time.paper == Some(paper) && time.unit == "%" && time.median > 0.0 && time.median < paper, "{time:?}");
    }
}

#[test]
fn an_experiment_whose_study_has_no_claims_is_an_error() {
    let here = tempfile::tempdir().unwrap();
    let path = here.path().join("wrong.ron");
    std::fs::write(&path, r#"runs((figure: "1", study: "imu_quality"))"#).unwrap();
    let error = Experiment::load(path.to_str().unwrap()).unwrap_err().to_string();
    assert!(error.contains("\"imu_quality\" has no claims"), "{error}");
}
