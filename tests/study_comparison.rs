//! The comparison of settings: it can be stopped and gone on with, and threads change nothing but times.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use zsim::spec::{Kind, Source, find, parse};
use zsim::study::comparison::{
    BASE, BaseSpec, Comparison, ComparisonSpec, Measure, PlaceSpec, Summary, markdown, ratio_figure, words,
};
use zsim::study::{News, Stage, StudyError, Watch};

fn small() -> (ComparisonSpec, Source) {
    let source = find(Kind::Study, "estimator_ablation_small").unwrap();
    let spec: ComparisonSpec = parse(&source).unwrap();
    // Two variants, one of which has the base's own value: it must come out as the base to the bit.
    let place = |scene: &str| PlaceSpec { scene: scene.to_owned(), motion: "hand".to_owned() };
    let mut variants = spec.variants[..2].to_vec();
    variants[1].name = "the same".to_owned();
    variants[1].set = [("fixed_views".to_owned(), zsim::study::comparison::Setting::Count(5))].into();
    let base = BaseSpec { duration_s: 5.0, ..spec.base.clone() };
    (ComparisonSpec { base, places: vec![place("mocap_room")], variants, ..spec }, source)
}

/// Runs it with so many threads, and stops it after so many estimates.
fn run(folder: &Path, threads: usize, stop_after: usize) -> Result<Summary, StudyError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let (spec, source) = small();
        let (stop, mut done) = (AtomicBool::new(false), 0);
        let mut tell = |news: News| {
            if matches!(news, News::Progress { stage: Stage::Estimating, .. }) {
                done += 1;
                stop.store(done >= stop_after, Ordering::Relaxed);
            }
        };
        Comparison::new(&spec, &source)?.run(folder, &mut Watch { stop: &stop, tell: &mut tell })
    })
}

/// The rows without the time they took.
fn rows(folder: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(folder.join("runs.csv")).unwrap();
    text.lines().map(|line| line.rsplit_once(',').unwrap().0.to_owned()).collect()
}

#[test]
fn a_study_goes_on_where_it_was_stopped_and_threads_change_nothing() {
    let here = tempfile::tempdir().unwrap();
    let (cut, whole) = (here.path().join("cut"), here.path().join("whole"));
    assert!(matches!(run(&cut, 1, 2), Err(StudyError::Stopped)));
    let before = rows(&cut);
    assert_eq!(before.len(), 1 + 2, "{before:?}");
    let times = |folder: &Path| std::fs::read_to_string(folder.join("runs.csv")).unwrap();
    let told = times(&cut);

    let summary = run(&cut, 2, usize::MAX).unwrap();
    assert!(told.lines().all(|line| times(&cut).contains(line)), "what was done is not done again");
    run(&whole, 1, usize::MAX).unwrap();
    assert_eq!(rows(&cut), rows(&whole));
    assert_eq!(rows(&cut).len(), 1 + 3 * 2);
    assert!(!cut.join("recordings").exists());

    let line = |variant: &str| summary.line(variant, None, Measure::PositionRmseM).unwrap();
    assert!(line(BASE).worst < 0.05, "{:?}", line(BASE));
    assert_eq!((line("the same").least_ratio, line("the same").greatest_ratio), (1.0, 1.0));
    assert_ne!(line("no offset grids").ratio, 1.0);
    // A run of five seconds has no drift to tell: it is missing, and missing on both sides is alike.
    assert_eq!(summary.line("the same", None, Measure::DriftMPerMin).unwrap().lost, 2);
    assert!(words(&summary).contains("no offset grids") && markdown(&summary, "x").contains("| no offset grids |"));
    assert!(ratio_figure(&summary).svg().unwrap().contains("no offset grids"));
}

#[test]
fn a_folder_of_another_study_is_left_alone() {
    let here = tempfile::tempdir().unwrap();
    std::fs::write(here.path().join("study.ron"), "()").unwrap();
    let error = run(here.path(), 1, 1).unwrap_err();
    assert!(error.is_wrong_input() && error.to_string().contains("another study"), "{error}");
}

#[test]
fn a_study_that_makes_no_sense_says_where() {
    let (_, source) = small();
    let wrong = |old: &str, new: &str| {
        assert!(source.text.contains(old), "{old}");
        let source = Source { text: source.text.replacen(old, new, 1), ..source.clone() };
        Comparison::new(&parse(&source).unwrap(), &source).map(|_| ()).unwrap_err().to_string()
    };
    let error = wrong("\"matching.reciprocal\"", "\"matching.reciproca\"");
    assert!(error.contains("no setting \"matching.reciproca\"") && error.contains("matching.reciprocal"), "{error}");
    let line = source.text.lines().position(|line| line.contains("name: \"one-sided matches\"")).unwrap() + 1;
    assert!(error.contains(&format!(":{line}:")), "{error}");
    assert!(wrong("\"window_s\": 2.0", "\"window_s\": 0.6").contains("more than half of window_s"));
    assert!(wrong("seeds: [1, 2]", "seeds: [1, 1]").contains("more than once"));
    assert!(wrong("seeds: [1, 2]", "seeds: []").contains("at least one"));
    assert!(wrong("name: \"one-sided matches\"", "name: \"base\"").contains("more than once"));
    assert!(wrong("name: \"one-sided matches\"", "name: \"a, b\"").contains("commas"));
    assert!(wrong("scene: \"mocap_room\"", "scene: \"nowhere\"").contains("no such scene"));
}

#[test]
fn every_setting_of_the_shipped_study_is_one() {
    let source = find(Kind::Study, "estimator_ablation").unwrap();
    let comparison = Comparison::new(&parse(&source).unwrap(), &source).unwrap();
    assert_eq!(comparison.runs(), 4 * 5 * 42);
}
