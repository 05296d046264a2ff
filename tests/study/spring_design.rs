//! Spring design by search.

use zsim::spec::{Kind, Source, find, parse};
use zsim::study::spring::design::{DesignSearch, DesignSpec, DesignStudy, csv, pareto_figure};
use zsim::study::sweep::pareto_set;

fn load(name: &str) -> (DesignSpec, Source) {
    let source = find(Kind::Study, name).unwrap();
    (parse(&source).unwrap(), source)
}

fn small(name: &str) -> DesignStudy {
    let (spec, source) = load(name);
    let spec = DesignSpec { evaluations: 800, candidates: 3, ..spec };
    DesignSearch::new(&spec, &source).unwrap().run(&|_| ()).unwrap()
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
        let (linear, full) = (verified.candidate.figures, verified.simulated.unwrap());
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
    assert!(once.1 <= 500 && once.1 > 400, "{}", once.1);
}

#[test]
fn optimisation_gives_a_better_front_than_sampling() {
    // With the same number of evaluations, samples reach hardly any point of the search's front.
    let (spec, source) = load("spring_design");
    let front = |evaluations: usize| {
        let spec = DesignSpec { evaluations, ..spec.clone() };
        let (found, _) = DesignSearch::new(&spec, &source).unwrap().explore(&|_| ());
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
    let study = DesignSearch::new(&spec, &source).unwrap().run(&|_| ()).unwrap();
    assert_eq!(study.evaluated, 690);
    assert!(study.candidates.iter().all(|v| !v.candidate.coil.name.is_empty()));
    assert!(study.feasible > 3, "{}", study.feasible);
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
        DesignSearch::new(&spec, &source).map(|search| search.run(&|_| ()).unwrap())
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

#[test]
fn an_invalid_search_is_an_error_with_the_reason() {
    let (spec, source) = load("spring_design");
    let wrong = |change: fn(&mut DesignSpec)| {
        let mut spec = spec.clone();
        change(&mut spec);
        DesignSearch::new(&spec, &source).map(|_| ()).unwrap_err().to_string()
    };
    assert!(wrong(|s| s.goals.clear()).contains("at least one goal"));
    assert!(wrong(|s| s.head = "rigid".to_owned()).contains("no spring"));
    assert!(wrong(|s| s.head = "nowhere".to_owned()).contains("no such head"));
    let bounds = |s: &mut DesignSpec| {
        if let zsim::study::spring::design::SpaceSpec::Coil { active_coils, .. } = &mut s.space {
            *active_coils = [9.0, 3.0];
        }
    };
    assert!(wrong(bounds).contains("exceeds the upper bound"));
}
