//! Gaps of the lidar in which the estimate stops and the IMU goes on.

use crate::estimation::fixture::{Room, Run, Score, Walk, calibration};
use zsim::estimation::{EventKind, estimate_all, load};
use zsim::measurement::Measurement;

/// The walk turns by 270 degrees while the lidar is silent for 7 s: only the IMU shows from where the hall is seen again.
#[test]
fn after_seven_seconds_without_the_lidar_the_head_is_found_where_the_imu_predicts_it() {
    let walk = Walk { start_s: 1.5, ..Walk::new((1.8, 1.2), 9.0) };
    for seed in [3, 4] {
        let run = Run::new(Room::furnished(), walk, seed, 22.0);
        let is_silent = |measurement: &Measurement| match measurement {
            Measurement::Lidar(scan) => (9e9..16e9).contains(&(scan.stamp.nanos() as f64)),
            Measurement::Imu(_) => false,
        };
        let measurements = run.measurements().into_iter().filter(|measurement| !is_silent(measurement));
        let result = estimate_all(&load("default").unwrap(), &calibration(), measurements).unwrap();
        let ambiguity_m = |kind: &EventKind| match kind {
            EventKind::Relocalised { ambiguity_m, .. } => Some(*ambiguity_m),
            _ => None,
        };
        let relocalised: Vec<f64> = result.warnings.iter().filter_map(|warning| ambiguity_m(&warning.kind)).collect();
        assert!(matches!(relocalised[..], [ambiguity_m] if ambiguity_m < 1.5), "{:?}", result.warnings);
        let score = Score::of(&result, &run);
        assert!(score.worst_m < 0.03, "{score:?}");
    }
}
