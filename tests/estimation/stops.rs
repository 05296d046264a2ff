//! The estimator while the head does not swing: stops, and a multi-plane lidar that needs no swing.

use crate::estimation::fixture::{Room, Run, Scanner, Score, Walk, calibration, growth_m};
use zsim::estimation::{EstimatorSpec, estimate_all, load};
use zsim::geometry::{Rotation, Vector};

/// Start and end of the stop, s. The head takes a second to come to rest, and another to swing again.
const STOP_S: (f64, f64) = (7.0, 13.0);

/// A walk round a hall in which the swing stops for six seconds while the walk continues.
fn walk_with_a_stop(seed: u64) -> Run {
    let stop = Some((STOP_S.0 - 1.0, STOP_S.1));
    Run::new(Room::furnished(), Walk { start_s: 1.5, stop, ..Walk::new((1.8, 1.2), 25.0) }, seed, 16.0)
}

/// Growth of the position error over the stop, until the head swings again, m.
fn growth_in_the_stop_m(run: &Run, spec: &EstimatorSpec) -> f64 {
    let result = estimate_all(spec, &calibration(), run.measurements().into_iter()).unwrap();
    growth_m(&result, run, (STOP_S.0 - 1.0, STOP_S.1 + 1.0))
}

#[test]
fn the_error_grows_by_less_than_5_cm_over_a_6_s_stop() {
    let default = load("default").unwrap();
    for seed in [21, 22] {
        let run = walk_with_a_stop(seed);
        for fixed_views in [0, 2] {
            let grown_m = growth_in_the_stop_m(&run, &EstimatorSpec { fixed_views, ..default.clone() });
            println!("seed {seed}, {fixed_views} views: {grown_m:.4} m");
            // Worst of ten seeds: 19 mm.
            assert!(grown_m < 0.05, "seed {seed}, {fixed_views} views: {grown_m}");
        }
    }
}

#[test]
fn a_multi_plane_lidar_is_tracked_without_swing() {
    // The head moves round the hall without nodding: a single scan plane would not observe patches, 16 rings do.
    let walk = Walk { start_s: 1.5, stop: Some((-10.0, 1000.0)), ..Walk::new((1.8, 1.2), 25.0) };
    let run = Run { scanner: Scanner::Rings, ..Run::new(Room::furnished(), walk, 23, 10.0) };
    let result = estimate_all(&load("default").unwrap(), &calibration(), run.measurements().into_iter()).unwrap();
    let score = Score::of(&result, &run);
    println!("{score:?}");
    // Worst of ten seeds: 6.9 mm.
    assert!(score.rmse_m < 0.02, "{score:?}");
    assert!(result.windows.iter().skip(4).all(|window| window.matches > 200), "{:?}", result.windows.last());
    for window in &result.windows {
        let parts: f64 = window.timing.parts().iter().map(|part| part.seconds).sum();
        assert!(parts > 0.0 && parts <= window.elapsed_s, "{window:?}");
    }
}

#[test]
fn a_clock_that_is_not_estimated_keeps_its_initial_offset() {
    let mut spec = load("default").unwrap();
    (spec.clock.estimated, spec.clock.start_s) = (false, 0.002);
    let run = walk_with_a_stop(24);
    let measurements = Run { duration_s: 8.0, ..run }.measurements();
    let result = estimate_all(&spec, &calibration(), measurements.into_iter()).unwrap();
    assert!(
        result.clock_offsets.iter().all(|(_, offset_s)| (offset_s - 0.002).abs() < 1e-6),
        "{:?}",
        result.clock_offsets
    );
}

#[test]
fn lidar_extrinsics_are_estimated_from_an_incorrect_calibration() {
    let run = Run::new(Room::furnished(), Walk { start_s: 1.5, ..Walk::new((1.8, 1.2), 25.0) }, 25, 30.0);
    let (shift, turn) = (Vector::new(0.010, -0.008, 0.006), Vector::new(0.5, -0.4, 0.6).map(f64::to_radians));
    let mut wrong = calibration();
    let mut imu_from_laser = wrong.head_from_imu.inverse() * wrong.head_from_laser;
    imu_from_laser.translation.vector += shift;
    imu_from_laser.rotation = Rotation::from_scaled_axis(turn) * imu_from_laser.rotation;
    wrong.head_from_laser = wrong.head_from_imu * imu_from_laser;
    let estimate = |estimated: bool| {
        let mut spec = load("default").unwrap();
        spec.extrinsics.estimated = estimated;
        estimate_all(&spec, &wrong, run.measurements().into_iter()).unwrap()
    };
    let found = estimate(true).lidar;
    println!("{found:?}");
    let turned_back = found.rotation * Rotation::from_scaled_axis(turn);
    assert!(turned_back.angle().to_degrees() < 0.1, "{turned_back}");
    assert!((found.translation + shift).norm() < 0.003, "{found:?}");
    // Without refinement the calibrated extrinsics do not change.
    let unrefined = estimate(false).lidar;
    assert!(unrefined.rotation.angle() < 1e-6 && unrefined.translation.norm() < 1e-6, "{unrefined:?}");
}
