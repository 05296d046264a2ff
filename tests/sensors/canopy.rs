//! Canopies compared with the law of Beer and Lambert.

use approx::assert_relative_eq;
use zsim::geometry::{Kinematics, Pose};
use zsim::random::Seed;
use zsim::sensors::{Lidar, LidarErrors, LidarSpec, ScanTiming, Switch, Track};
use zsim::spec::{self, Source, parse};
use zsim::time::Stamp;
use zsim::world::World;

/// Extinction coefficient, 1/m, and where the canopy begins and how long it is, m.
const PER_M: f64 = 0.8;
const FROM_M: f64 = 2.0;
const LENGTH_M: f64 = 3.0;

/// A canopy across the x axis, and a white wall behind it.
fn meadow() -> World {
    let text = format!(
        r#"(
            name: "meadow",
            materials: {{ "white": (reflectance: 0.9) }},
            items: [Solid(shape: Box(size_m: (1, 20, 20)), material: "white", at_m_deg: [(8.5, 0, -10)])],
            canopies: [(size_m: ({LENGTH_M}, 20, 20), extinction_per_m: {PER_M}, material: "white", at_m_deg: [({}, 0, -10)])],
        )"#,
        FROM_M + LENGTH_M / 2.0
    );
    let source = Source::in_memory("meadow.ron", text);
    World::build(&parse(&source).unwrap(), &source).unwrap()
}

/// Ranges of 20 scans of 1000 beams within half a degree of the x axis, without range noise.
fn ranges(seed: u64, noise: Switch) -> Vec<f64> {
    let mut spec: LidarSpec = spec::load("utm30lx").unwrap();
    (spec.errors.range.near_sigma_m, spec.errors.range.bias_sigma_m, spec.errors.detection.weak_bias_m) =
        (0.0, 0.0, 0.0);
    spec.errors.range.resolution_m = 0.0;
    spec.noise = noise;
    let narrow = "planar(beams: 1000, first_deg: -0.5, step_deg: 0.001, slots_per_turn: 1440)";
    spec.pattern = parse(&Source::in_memory("narrow", narrow)).unwrap();
    let lidar = Lidar::new(&spec, &Source::in_memory("test.ron", "")).unwrap();
    let resting = Track::new(0, 1e-3, vec![Kinematics::at_rest(Pose::identity()); 101]).unwrap();
    let (world, errors) = (meadow(), LidarErrors::new(&lidar, Seed(seed)));
    let scan = |index| {
        let timing = ScanTiming { index, start_s: 0.0, pace: 1.0, stamp: Stamp::from_nanos(1_000_000_000) };
        lidar.measure(&lidar.sweep(&world, &resting, &timing), &errors).planar.unwrap().ranges_m
    };
    (0..20).flat_map(scan).map(f64::from).collect()
}

#[test]
fn the_fraction_that_passes_and_the_mean_depth_follow_beer_and_lambert() {
    let ranges = ranges(1, Switch::On);
    let is_stopped = |range: &&f64| **range < FROM_M + LENGTH_M + 0.01;
    let depths: Vec<f64> = ranges.iter().filter(is_stopped).map(|range| range - FROM_M).collect();
    let passed = 1.0 - depths.len() as f64 / ranges.len() as f64;
    // exp(-0.8 * 3) = 0.0907, with a standard error of 0.002 over 20 000 beams.
    let (count, expected) = (ranges.len() as f64, (-PER_M * LENGTH_M).exp());
    assert!((passed - expected).abs() < 4.0 * (expected * (1.0 - expected) / count).sqrt(), "{passed}, not {expected}");
    // Density k exp(-k s) / (1 - exp(-k d)) on 0..d: the mean is 1/k - d exp(-k d) / (1 - exp(-k d)).
    let mean_m = depths.iter().sum::<f64>() / depths.len() as f64;
    let expected_m = 1.0 / PER_M - LENGTH_M * expected / (1.0 - expected);
    assert!((mean_m - expected_m).abs() < 4.0 * 0.8 / count.sqrt(), "{mean_m} m, not {expected_m} m");
    assert!(depths.iter().all(|depth| *depth > -0.01));
}

#[test]
fn depths_depend_on_the_seed_and_exact_beams_pass() {
    assert_eq!(ranges(1, Switch::On), ranges(1, Switch::On));
    assert_ne!(ranges(1, Switch::On), ranges(2, Switch::On));
    for range in ranges(1, Switch::Off) {
        assert_relative_eq!(range, 8.0, epsilon = 1e-3);
    }
}
