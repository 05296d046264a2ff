//! Specs with as few keys as possible, and the message about the others.

use crate::command::{exits_with, run, zsim};
use std::path::Path;
use zsim::estimation::EstimatorSpec;
use zsim::head::gains::{GainPlan, GainsSpec};
use zsim::sensors::{ClocksSpec, ImuSpec, LidarSpec};
use zsim::spec::{Kind, NamedSpec, Source, find};
use zsim::study::sweep::{Measure, Sampling, SweepSpec};
use zsim::world::SceneSpec;

/// The shortest spec of each kind, and of each kind of motion, linkage and study.
const LEAST: [(Kind, &str); 22] = [
    (Kind::Scene, r#"(materials: {"wall": (reflectance: 0.5)}, items: [Solid(shape: Box(size_m: (4, 4, 3)), material: "wall")])"#),
    (Kind::Head, "(parts: [block(mass_kg: 0.3, size_m: (0.1, 0.1, 0.1), centre_m: (0, 0, 0))], head_from_imu: (), linkage: rigid())"),
    (
        Kind::Head,
        r#"(parts: [block(mass_kg: 0.3, size_m: (0.06, 0.06, 0.09), centre_m: (0, 0, 0))], head_from_imu: (),
            linkage: spring(spring: named("25x3x12x120"), head_from_spring: (position_m: (0, 0, -0.1)),
                damping_ratio: (rocking: 0.08, sway: 0.04, bounce: 0.04, yaw: 0.04)))"#,
    ),
    (Kind::Spring, "coil(coil_diameter_mm: 25, wire_diameter_mm: 3, active_coils: 12, free_length_mm: 120)"),
    (
        Kind::Lidar,
        "(pattern: planar(beams: 1081, first_deg: -135, step_deg: 0.25), rate_hz: 40, range_max_m: 30, intensity_at_1_m: 4000,
            errors: (range: (near_sigma_m: 0.01), detection: (white_reach_m: 60, softness: 0.15)))",
    ),
    (
        Kind::Imu,
        "(rate_hz: 100, gyro: (density_deg_per_s_per_sqrt_hz: 0.03), accel: (density_ug_per_sqrt_hz: 80))",
    ),
    (Kind::Clock, "()"),
    (Kind::Faults, "()"),
    (Kind::Faults, "(faults: [(sensor: imu, from_s: 5, to_s: 6, fault: gap())])"),
    (Kind::Motion, "Stand((height_m: 1.1))"),
    (Kind::Motion, "Cruise((height_m: 1.1, speed_m_per_s: 1))"),
    (
        Kind::Motion,
        "Hand((height_m: 1.1, carry: Walk((speed_m_per_s: 0.5)), shake: (frequency_hz: 1.2, pitch_deg: 2, roll_deg: 1)))",
    ),
    (Kind::Motion, "Legged((height_m: 0.7, follow: (speed_m_per_s: 1), stride_hz: 2))"),
    (
        Kind::Motion,
        "Marine((sea: (significant_height_m: 0.4, peak_period_s: 3, spreading: 4),
            hull: (length_m: 4, beam_m: 1.6, draught_m: 0.3, roll_period_s: 2, roll_damping: 0.1)))",
    ),
    (Kind::Motion, "Shaker((height_m: 1.1, drives: []))"),
    (Kind::Motion, "Replay((poses: Here([(0, (0, 0, 1), (0, 0, 0)), (5, (1, 0, 1), (0, 0, 0)), (10, (2, 0, 1), (0, 0, 0))])))"),
    (Kind::Estimator, "()"),
    (Kind::Estimator, "(window_s: 3.0, surfels: (levels: 2))"),
    (
        Kind::Study,
        r#"(base: journey(scene: "office"), axes: [values(path: "imu", values: ["3dm_gx2", "tactical"])])"#,
    ),
    (
        Kind::Study,
        r#"(base: gains(gains: (axis: Pitch)), axes: [values(path: "head.parts.0.mass_kg", values: [0.2, 0.3])])"#,
    ),
    (
        Kind::Study,
        "(space: coil(coil_diameter_mm: (16, 40), wire_diameter_mm: (1.6, 4), active_coils: (4, 20), free_length_mm: (50, 160)),
            goals: [(measure: rocking_hz, aim: target(1.3)), (measure: spring_mass_g, aim: least)])",
    ),
    (
        Kind::Experiment,
        r#"runs((figure: "-", study: "paper_rigid_link"))"#,
    ),
];

fn parsed<T: NamedSpec>(name: &str, text: &str) -> T {
    T::parse(&Source::in_memory(name, text)).unwrap()
}

fn shipped<T: NamedSpec>(name: &str) -> T {
    T::parse(&find(T::KIND, name).unwrap()).unwrap()
}

#[test]
fn the_shortest_spec_of_each_kind_is_valid() {
    let here = tempfile::tempdir().unwrap();
    let files = LEAST.iter().enumerate().map(|(index, (kind, text))| {
        let file = format!("{}/least_{index}.ron", kind.folder());
        std::fs::create_dir_all(here.path().join(kind.folder())).unwrap();
        std::fs::write(here.path().join(&file), text).unwrap();
        file
    });
    let files: Vec<String> = files.collect();
    let (code, stdout, stderr) = run(here.path(), &format!("check {}", files.join(" ")));
    assert_eq!(code, 0, "{stdout}{stderr}");
    let kinds: Vec<&str> = Kind::ALL.iter().map(|kind| kind.noun()).collect();
    assert!(kinds.iter().all(|kind| stdout.contains(&format!("{kind}, OK"))), "a kind is missing: {stdout}");
}

#[test]
fn keys_that_are_omitted_have_the_values_of_the_shipped_specs() {
    assert_eq!(parsed::<ClocksSpec>("mine.ron", "()"), shipped("exact"));
    assert_eq!(parsed::<EstimatorSpec>("mine.ron", "()"), shipped("default"));
    let default: EstimatorSpec = shipped("default");
    let partial: EstimatorSpec = parsed("mine.ron", "(window_s: 3.0, surfels: (levels: 2, fine: (min_points: 6)))");
    let mut expected = default.clone();
    (expected.window_s, expected.surfels.levels, expected.surfels.fine.min_points) = (3.0, 2, 6);
    assert_eq!(partial, expected);
    assert_eq!(EstimatorSpec::default(), default);

    let imu: ImuSpec = parsed("mine.ron", LEAST[5].1);
    let unknown: ImuSpec = shipped("unknown");
    assert_eq!(imu.gyro.limit_deg_per_s, unknown.gyro.limit_deg_per_s);
    assert_eq!(imu.accel.limit_g, unknown.accel.limit_g);
    assert_eq!(parsed::<SceneSpec>("scenes/mine.ron", "()").name, "mine");
    let lidar = |slots: &str| {
        let text = LEAST[4].1.replace("step_deg: 0.25", &format!("step_deg: 0.25{slots}"));
        let source = Source::in_memory("mine.ron", text);
        zsim::sensors::Lidar::new(&LidarSpec::parse(&source).unwrap(), &source).unwrap()
    };
    assert_eq!(lidar("").sweep_span(), lidar(", slots_per_turn: 1440").sweep_span());
    assert_eq!(lidar("").noise().sigma_m(25.0), 0.01);
}

#[test]
fn keys_that_are_omitted_in_studies_have_the_values_of_a_run() {
    let gains: GainsSpec = zsim::spec::parse(&Source::in_memory("gains.ron", "(axis: Pitch)")).unwrap();
    assert_eq!(gains.plan(), GainPlan::default());
    let journeys: SweepSpec = parsed("mine.ron", LEAST[18].1);
    assert_eq!(
        (journeys.sampling, journeys.seeds, journeys.measures),
        (Sampling::Grid, vec![1], vec![Measure::named("position_rmse_m")])
    );
    let gains: SweepSpec = parsed("mine.ron", LEAST[19].1);
    assert_eq!((gains.seeds, gains.measures), (vec![], vec![Measure::named("peak_gain")]));
}

/// Keys were asked for one at a time.
#[test]
fn all_keys_that_are_missing_are_named_at_once() {
    let here = tempfile::tempdir().unwrap();
    let error = |kind: Kind, text: &str| {
        let path = here.path().join("spec.ron");
        let folder = here.path().join(Path::new(kind.folder()).file_name().unwrap());
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(&path, text).unwrap();
        std::fs::rename(&path, folder.join("spec.ron")).unwrap();
        exits_with(2, zsim().arg("check").arg(folder.join("spec.ron"))).1
    };
    for (kind, text, message) in [
        (Kind::Imu, "()", "`ImuSpec` needs `rate_hz`, `gyro` and `accel`"),
        (Kind::Imu, "(gyro: (), rate_hz: 100)", "`GyroSpec` needs `density_deg_per_s_per_sqrt_hz`\n"),
        (Kind::Lidar, "(rate_hz: 10)", "`LidarSpec` needs `pattern`, `range_max_m`, `intensity_at_1_m` and `errors`"),
        (
            Kind::Spring,
            "coil(wire_diameter_mm: 3)",
            "`coil` needs `coil_diameter_mm`, `active_coils` and `free_length_mm`",
        ),
        (Kind::Head, "()", "`HeadSpec` needs `parts`, `head_from_imu` and `linkage`"),
        (Kind::Motion, "Hand((carry: Walk((speed_m_per_s: 1))))", "`HandSpec` needs `height_m` and `shake`"),
        (Kind::Study, "(base: spring())", "`SweepSpec` needs `axes`"),
        (Kind::Faults, "(faults: [()])", "`FaultSpec` needs `sensor` and `fault`"),
        (Kind::Scene, "(movers: [(repeats: true)])", "`MoverSpec` needs `template` and `waypoints`"),
        (Kind::Experiment, "runs(())", "`RunsSpec` needs `figure` and `study`"),
    ] {
        let stderr = error(kind, text);
        assert!(stderr.contains(message), "{text}: {stderr}");
        let help = format!("help: `zsim spec reference {}` lists the keys", kind.key());
        assert!(stderr.contains(&help), "{text}: {stderr}");
    }
}

#[test]
fn a_name_without_its_unit_or_its_end_is_suggested() {
    let here = tempfile::tempdir().unwrap();
    std::fs::write(here.path().join("mine.ron"), "(rate: 100)").unwrap();
    let (_, _, stderr) = run(here.path(), "simulate --scene office --imu mine.ron --duration 1s --out run.mcap");
    assert!(stderr.contains("did you mean rate_hz?"), "{stderr}");
    let (_, _, stderr) = run(here.path(), "simulate --scene office --lidar utm30 --duration 1s --out run.mcap");
    assert!(stderr.contains("did you mean utm30lx?"), "{stderr}");
    let (_, _, stderr) = run(here.path(), "reproduce fig6");
    assert!(!stderr.contains("did you mean"), "{stderr}");
}
