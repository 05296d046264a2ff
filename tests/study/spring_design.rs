//! Spring design by search.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::SystemTime;
use zsim::dynamics::{HeadModel, LinkageSpec};
use zsim::head::coverage::{CoveragePlan, coverage};
use zsim::head::spring::{MISSION_HOURS, simulated};
use zsim::random::Seed;
use zsim::sensors::Lidar;
use zsim::simulation::{Run, Scenario, Simulation};
use zsim::spec::{Kind, Source, find, parse};
use zsim::study::design::{
    BuildLimitsSpec, CoilDesign, DesignSearch, DesignSpec, DesignStudy, SpaceSpec, WireStock, csv, pareto_figure,
    rejected_csv,
};
use zsim::study::sweep::{Measure, Runner, pareto_set};

fn load(name: &str) -> (DesignSpec, Source) {
    let source = find(Kind::Study, name).unwrap();
    (parse(&source).unwrap(), source)
}

/// Runs a search in a folder of its own.
fn run(search: &DesignSearch) -> DesignStudy {
    let folder = tempfile::tempdir().unwrap();
    let program = Path::new(env!("CARGO_BIN_EXE_zsim"));
    let runner = Runner { program, stop: &AtomicBool::new(false), on_progress: &|_| () };
    search.run(folder.path(), false, &runner).unwrap()
}

fn small(name: &str) -> DesignStudy {
    let (spec, source) = load(name);
    let spec = DesignSpec { evaluations: 800, candidates: 3, ..spec };
    run(&DesignSearch::new(&spec, &source).unwrap())
}

#[test]
fn a_search_over_geometry_meets_its_targets_as_simulation_confirms() {
    let study = small("spring_design");
    assert!(study.feasible > 50 && study.pareto > 3, "{} {}", study.feasible, study.pareto);
    assert_eq!(study.candidates.len(), 3);
    // The rocking frequency is a goal itself: the optimum is at the target.
    let best = study.candidates.iter().map(|v| (v.candidate.figures.rocking_hz / 1.3 - 1.0).abs()).fold(1.0, f64::min);
    assert!(best < 0.01, "{best}");
    for verified in &study.candidates {
        let (linear, full) = (verified.candidate.figures, verified.simulated);
        assert!(linear.stress_share.unwrap() <= 0.6 && linear.rate_deg_per_s <= 550.0, "{linear:?}");
        assert!((full.field_of_view_deg / linear.field_of_view_deg - 1.0).abs() < 0.3, "{linear:?} {full:?}");
    }
    assert_eq!(csv(&study).lines().count(), 4);
    assert!(pareto_figure(&study).svg().unwrap().contains("Rocking frequency (Hz)"));
}

#[test]
fn a_search_does_not_depend_on_the_number_of_threads() {
    let (spec, source) = load("spring_design");
    let spec = DesignSpec { evaluations: 500, ..spec };
    let explore = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| DesignSearch::new(&spec, &source).unwrap().explore(&|_| ()))
    };
    let (once, again) = (explore(1), explore(2));
    assert_eq!(once, again);
    assert!(once.evaluated <= 500 && once.evaluated > 400, "{}", once.evaluated);
    assert_eq!(once.rejected.values().sum::<usize>() + once.feasible.len(), once.evaluated);
}

#[test]
fn optimisation_gives_a_better_front_than_sampling() {
    // With the same number of evaluations, samples reach hardly any point of the search's front.
    let (spec, source) = load("spring_design");
    let front = |evaluations: usize| {
        let spec = DesignSpec { evaluations, ..spec.clone() };
        let found = DesignSearch::new(&spec, &source).unwrap().explore(&|_| ()).feasible;
        let costs: Vec<Vec<f64>> = found.iter().map(|c| c.costs.clone()).collect();
        let set = pareto_set(&costs);
        set.into_iter().map(|k| costs[k].clone()).collect::<Vec<_>>()
    };
    // With 150 evaluations less than one population remains for each descent, so that only samples are used.
    let (sampled, searched) = (front(150), front(1000));
    let beaten = |c: &&Vec<f64>| searched.iter().any(|s| s.iter().zip(*c).all(|(s, c)| s <= c));
    assert!(sampled.iter().filter(beaten).count() * 10 >= sampled.len() * 7);
}

#[test]
fn a_catalogue_is_searched_completely() {
    let (spec, source) = load("spring_stock");
    let spec = DesignSpec { candidates: 2, ..spec };
    let study = run(&DesignSearch::new(&spec, &source).unwrap());
    assert_eq!(study.evaluated, 690);
    assert!(study.candidates.iter().all(|v| v.candidate.coil.label() == v.candidate.coil.name));
    assert!(study.feasible > 3, "{}", study.feasible);
    // Each spring is feasible, or has a line with the limit that rejects it.
    let by_closed_form = study.rejections.iter().filter(|rejection| !rejection.simulated).count();
    assert_eq!(by_closed_form + study.feasible, 690);
    assert_eq!(rejected_csv(&study).lines().count(), 1 + study.rejections.len());
}

#[test]
fn files_that_a_search_names_are_relative_to_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let text = |kind, name: &str| find(kind, name).unwrap().text;
    std::fs::write(folder.path().join("mine.ron"), text(Kind::Head, "handheld_2")).unwrap();
    let catalogue = "name,coil_diameter_mm,wire_diameter_mm,active_coils,free_length_mm,material\n\
                     a,25.0,3.0,12.0,120.0,spring_steel\n";
    std::fs::write(folder.path().join("springs.csv"), catalogue).unwrap();
    let design = text(Kind::Study, "spring_stock").replace("\"stock\"", "\"springs.csv\"");
    let search = |head: &str| {
        let path = folder.path().join("design.ron");
        std::fs::write(&path, design.replace("\"handheld\"", &format!("\"{head}\""))).unwrap();
        let source = Source::read(&path).unwrap();
        let spec: DesignSpec = parse(&source).unwrap();
        DesignSearch::new(&spec, &source).map(|search| run(&search))
    };
    // With and without the extension; a name without a file is that of a shipped head.
    for head in ["mine.ron", "mine", "handheld"] {
        assert_eq!(search(head).unwrap().evaluated, 1, "{head}");
    }
    let error = search("other.ron").map(|_| ()).unwrap_err().to_string();
    let expected =
        format!("no such head: \"other.ron\" is not in {}/, specs/heads/, not built in", folder.path().display());
    assert!(error.contains(&expected), "{error}");
    assert!(error.contains("design.ron:3:12"), "the position in the file of the search: {error}");
}

/// A search in a catalogue of four springs by journeys of 12 s with two seeds.
fn search_by_journeys(goals: &str, limits: &str) -> Result<DesignSearch, String> {
    let folder = tempfile::tempdir().unwrap();
    let catalogue = "name,coil_diameter_mm,wire_diameter_mm,active_coils,free_length_mm,material\n\
                     usual,25.0,3.0,12.0,120.0,spring_steel\n\
                     stiff,32.0,3.5,8.5,125.0,spring_steel\n\
                     short,20.0,2.5,12.5,63.0,spring_steel\n\
                     falls,20.0,1.5,20.0,160.0,spring_steel\n";
    std::fs::write(folder.path().join("springs.csv"), catalogue).unwrap();
    let text = format!(
        "(head: \"handheld\", lidar: \"utm30lx\", shake: (pitch_deg: 2.0), space: catalogue(\"springs.csv\"),
          journey: (scene: \"mocap_room\", motion: \"hand\", imu: \"3dm_gx2\", clock: \"drifting\", estimator: \"default\",
            duration_s: 12.0, seeds: [1, 2], designs: 8, time_limit_s: 60.0),
          goals: [{goals}], limits: [{limits}], evaluations: 1, candidates: 4, seed: 1)"
    );
    let path = folder.path().join("design.ron");
    std::fs::write(&path, text).unwrap();
    let source = Source::read(&path).unwrap();
    let spec: DesignSpec = parse(&source).unwrap();
    DesignSearch::new(&spec, &source).map_err(|error| error.to_string())
}

fn by_outcome(goals: &str, limits: &str) -> Result<DesignStudy, String> {
    search_by_journeys(goals, limits).map(|search| run(&search))
}

#[test]
fn a_stopped_search_continues_with_its_finished_journeys() {
    let search =
        search_by_journeys("(measure: fraction_seen_1s, aim: most), (measure: sag_mm, aim: least)", "").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let run_until = |stop_at: f64| {
        let stop = AtomicBool::new(false);
        let on_progress = |fraction: f64| stop.store(fraction >= stop_at, Ordering::Relaxed);
        let program = Path::new(env!("CARGO_BIN_EXE_zsim"));
        search.run(folder.path(), false, &Runner { program, stop: &stop, on_progress: &on_progress })
    };
    let parts = || -> BTreeMap<PathBuf, SystemTime> {
        let parts = std::fs::read_dir(folder.path().join("journeys/parts")).unwrap().map(|part| part.unwrap());
        parts.map(|part| (part.path(), part.metadata().unwrap().modified().unwrap())).collect()
    };
    assert!(run_until(0.3).is_err_and(|error| error.is_stopped()));
    let before = parts();
    assert!((1..6).contains(&before.len()), "{before:?}");
    let continued = run_until(2.0).unwrap();
    let after = parts();
    assert_eq!(after.len(), 6, "three standing springs with two seeds");
    assert!(before.iter().all(|(part, time)| after.get(part) == Some(time)), "finished journeys are used again");
    assert_eq!(continued, run(&search));
    let other = search_by_journeys("(measure: gyro_range_left, aim: most)", "").unwrap();
    let runner = Runner { program: Path::new(""), stop: &AtomicBool::new(false), on_progress: &|_| () };
    let error = other.run(folder.path(), false, &runner).unwrap_err().to_string();
    assert!(error.contains("another"), "{error}");
}

#[test]
fn springs_are_compared_by_their_journeys() {
    let goals =
        "(measure: position_rmse_m, aim: least), (measure: gyro_range_left, aim: most), (measure: sag_mm, aim: least)";
    let study = by_outcome(goals, "").unwrap();
    assert_eq!((study.evaluated, study.feasible), (4, 3), "{:?}", study.rejected);
    let names = |study: &DesignStudy| -> Vec<String> {
        study.candidates.iter().map(|design| design.candidate.coil.name.clone()).collect()
    };
    // The stiff spring swings least and sags least, so it is in every Pareto set of these goals.
    assert!(names(&study).contains(&"stiff".to_owned()), "{:?}", names(&study));
    let costs: Vec<_> = study.candidates.iter().map(|design| design.candidate.costs.clone()).collect();
    assert_eq!(pareto_set(&costs).len(), costs.len());
    // The figures are those of a simulation of the same journeys.
    for design in &study.candidates {
        let range_left = |seed: u64| {
            let scenario = Scenario { duration_s: 12.0, seed: Seed(seed), ..Scenario::in_scene("mocap_room") };
            let mut run = Run::load(&scenario).unwrap();
            run.head.spec = head_on(&study.spec, &design.candidate.coil).0;
            let simulation = Simulation::build(run).unwrap();
            let plan = CoveragePlan { duration_s: 7.0, ..CoveragePlan::default() };
            let swing = coverage(simulation.head(), simulation.motion(), simulation.lidar(), &plan, |_| ()).unwrap();
            1.0 - swing.gyro.most_deg_per_s / 600.0
        };
        let left = design.journey[&Measure::named("gyro_range_left")];
        assert!((left - 0.5 * (range_left(1) + range_left(2))).abs() < 1e-12, "{left}");
        let error_m = design.journey[&Measure::named("position_rmse_m")];
        assert!(error_m > 0.0 && error_m < 0.02, "{error_m}");
    }
    let header = csv(&study).lines().next().unwrap().to_owned();
    assert!(header.ends_with("journey_position_rmse_m,journey_status,journey_gyro_range_left,journey_coil_contact_s"));
}

#[test]
fn a_limit_of_the_journey_rejects_springs_and_a_goal_without_a_journey_is_an_error() {
    let goals = "(measure: fraction_seen_1s, aim: most)";
    let open = by_outcome(goals, "").unwrap();
    let best = open.candidates.first().unwrap();
    let (name, most) = (&best.candidate.coil.name, best.journey[&Measure::named("fraction_seen_1s")]);
    // A limit below the best spring's coverage rejects it, with its value.
    let limited = by_outcome(goals, &format!("(measure: fraction_seen_1s, most: {})", 0.999 * most)).unwrap();
    let rejection = limited.rejections.iter().find(|rejection| rejection.coil.name == *name).unwrap();
    assert_eq!(
        (rejection.limit.as_str(), rejection.value, rejection.simulated),
        ("fraction_seen_1s", Some(most), true)
    );
    assert!(limited.candidates.iter().all(|design| design.candidate.coil.name != *name));
    let error = by_outcome("(measure: wall_s, aim: least)", "").unwrap_err();
    assert!(error.contains("wall_s cannot be a goal"), "{error}");
}

#[test]
fn an_invalid_search_is_an_error_with_the_reason() {
    let (spec, source) = load("spring_design");
    let wrong = |change: fn(&mut DesignSpec)| {
        let mut spec = spec.clone();
        change(&mut spec);
        DesignSearch::new(&spec, &source).map(|_| ()).unwrap_err().to_string()
    };
    assert!(wrong(|s| s.goals.clear()).contains("at least one goal"));
    assert!(wrong(|s| s.shake.frequency_hz = Some(0.0)).contains("expected a finite number above 0"));
    let no_journey = wrong(|s| s.goals[0].measure = Measure::named("position_rmse_m"));
    assert!(no_journey.contains("add `journey:"), "{no_journey}");
    assert!(wrong(|s| s.head = "rigid".to_owned()).contains("no spring"));
    assert!(wrong(|s| s.head = "nowhere".to_owned()).contains("no such head"));
    let bounds = |s: &mut DesignSpec| {
        if let SpaceSpec::Coil { active_coils, .. } = &mut s.space {
            *active_coils = [9.0, 3.0];
        }
    };
    assert!(wrong(bounds).contains("exceeds the upper bound"));
}

/// The head of a brief on a coil.
fn head_on(spec: &DesignSpec, coil: &CoilDesign) -> (zsim::dynamics::HeadSpec, Source) {
    let (mut head, source) = zsim::dynamics::load(&spec.head).unwrap();
    if let LinkageSpec::Spring { spring, .. } = &mut head.linkage {
        *spring = coil.spring();
    }
    (head, source)
}

#[test]
fn no_candidate_of_three_briefs_clashes_and_all_can_be_ordered() {
    let (wide, source) = load("spring_design");
    // A wide swing of few coils, where coils touch first, and a slow head.
    let briefs = [
        ("wide", wide.clone(), 2.0),
        ("far", wide.clone(), 3.5),
        ("slow", DesignSpec { head: "handheld_2".to_owned(), ..wide.clone() }, 1.0),
    ];
    let lidar_source = find(Kind::Lidar, "utm30lx").unwrap();
    let lidar = Lidar::new(&parse(&lidar_source).unwrap(), &lidar_source).unwrap();
    for (name, brief, pitch_deg) in briefs {
        let mut spec = DesignSpec { evaluations: 600, candidates: 3, ..brief };
        spec.shake.pitch_deg = pitch_deg;
        spec.limits.clear();
        let study = run(&DesignSearch::new(&spec, &source).unwrap());
        assert!(!study.candidates.is_empty(), "{name}: {:?}", study.rejected);
        for design in &study.candidates {
            let coil = &design.candidate.coil;
            // Simulated anew, twice as long as in the verification.
            let (head, head_source) = head_on(&spec, coil);
            let plan = CoveragePlan { from_s: 5.0, duration_s: 25.0, ..CoveragePlan::default() };
            let (metrics, coverage) =
                simulated(&head, &head_source, &spec.shake, &lidar, &plan, MISSION_HOURS).unwrap();
            let (gap_mm, label) = (metrics.margins.gap_mm.unwrap(), coil.label());
            assert!(gap_mm > 0.0 && metrics.margins.clash.unwrap() > 1.1, "{name} {label}: {metrics:?}");
            // Even a uniform bend of the spring by the largest tilt of the head leaves a gap on the inner side.
            let (radius_mm, open_mm) =
                (0.5 * coil.coil_diameter_mm, coil.free_length_mm - coil.active_coils * coil.wire_diameter_mm);
            assert!(radius_mm * coverage.most_tilt_deg.to_radians() < open_mm, "{name} {label}: {coverage:?}");
            let index = coil.coil_diameter_mm / coil.wire_diameter_mm;
            assert!((4.0..=16.0).contains(&index), "{name} {label}");
            // EN 10270-1 has wires of 1.6, 1.7, ..., 2.0, 2.1, 2.25, 2.4, ... mm: all multiples of 0.05 mm.
            let twentieths = coil.wire_diameter_mm * 20.0;
            assert!((twentieths - twentieths.round()).abs() < 1e-9, "{name} {label}");
            assert!(HeadModel::new(&head, &head_source).is_ok());
        }
    }
}

#[test]
fn each_limit_rejects_what_it_names() {
    let (spec, source) = load("spring_stock");
    let rejected_by = |build: BuildLimitsSpec| {
        let spec = DesignSpec { build, limits: Vec::new(), ..spec.clone() };
        DesignSearch::new(&spec, &source).unwrap().explore(&|_| ())
    };
    let lenient = BuildLimitsSpec {
        index: [2.0, 20.0],
        wires: WireStock::Standard,
        clash_margin: 1e-3,
        gap_over_standard: 0.0,
        solid_margin: 1e-3,
        tipping_margin: 1.0,
        buckling_margin: 1e-3,
        yield_margin: 1e-3,
        fatigue_margin: 1e-3,
        mission_hours: 1000.0,
    };
    let changed = |change: fn(&mut BuildLimitsSpec)| {
        let mut build = lenient.clone();
        change(&mut build);
        rejected_by(build).rejected
    };
    let without = rejected_by(lenient.clone()).rejected;
    // A negative gap is below 0 times the standard; nothing else but the missing rest pose rejects.
    assert!(without.keys().all(|limit| limit == "stable rest pose" || limit == "gap_over_standard"), "{without:?}");
    type Tighten = fn(&mut BuildLimitsSpec);
    let cases: [(&str, Tighten); 8] = [
        ("index", |build| build.index = [7.0, 9.0]),
        ("clash_margin", |build| build.clash_margin = 8.0),
        ("gap_over_standard", |build| build.gap_over_standard = 8.0),
        ("solid_margin", |build| build.solid_margin = 200.0),
        ("tipping_margin", |build| build.tipping_margin = 3.0),
        ("buckling_margin", |build| build.buckling_margin = 50.0),
        ("yield_margin", |build| build.yield_margin = 20.0),
        ("fatigue_margin", |build| build.fatigue_margin = 20.0),
    ];
    for (limit, change) in cases {
        let count = |rejected: &BTreeMap<String, usize>| rejected.get(limit).copied().unwrap_or(0);
        let counts = changed(change);
        assert!(count(&counts) > count(&without), "{limit}: {counts:?}");
    }
}

#[test]
fn a_material_without_strength_is_searched_and_its_unchecked_limits_are_named() {
    let (spec, source) = load("spring_design");
    let mut spec = DesignSpec { evaluations: 300, candidates: 1, ..spec };
    if let SpaceSpec::Coil { material, .. } = &mut spec.space {
        let text = "moduli(youngs_gpa: 110.0, shear_gpa: 42.0)";
        *material = parse(&Source::in_memory("material", text)).unwrap();
    }
    for (goal, missing) in [("stress_share", "strength"), ("spring_mass_g", "density")] {
        let mut spec = spec.clone();
        spec.goals.retain(|one| one.measure.key() == goal);
        let error = DesignSearch::new(&spec, &source).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(&format!("{goal} needs the {missing} of the material")), "{error}");
    }
    spec.goals.retain(|goal| goal.measure.key() == "rocking_hz");
    let study = run(&DesignSearch::new(&spec, &source).unwrap());
    let [design] = &study.candidates[..] else { panic!("{:?}", study.rejected) };
    assert_eq!(design.unchecked, ["yield_margin", "stress_share", "fatigue_margin"]);
    assert_eq!((design.simulated.fatigue_margin, design.simulated.margins.yielding), (None, None));
}

#[test]
fn a_search_without_an_available_wire_is_an_error() {
    let (spec, source) = load("spring_design");
    let build = BuildLimitsSpec { wires: WireStock::Diameters(vec![5.0]), ..BuildLimitsSpec::default() };
    let error = DesignSearch::new(&DesignSpec { build, ..spec }, &source).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("no wire of 1.6 to 4 mm is available"), "{error}");
}

#[test]
fn limits_that_a_cable_makes_unknown_are_named() {
    let (spec, source) = load("spring_design");
    let mut spec =
        DesignSpec { head: "backpack".to_owned(), evaluations: 300, candidates: 1, limits: Vec::new(), ..spec };
    spec.goals.retain(|goal| goal.measure.key() == "rocking_hz");
    let study = run(&DesignSearch::new(&spec, &source).unwrap());
    let [design] = &study.candidates[..] else { panic!("{:?}", study.rejected) };
    assert_eq!(design.simulated.margins.clash, None);
    for limit in ["clash_margin", "yield_margin", "fatigue_margin"] {
        assert!(design.unchecked.contains(&limit), "{:?}", design.unchecked);
    }
}
