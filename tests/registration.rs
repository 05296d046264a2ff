//! The closed loop behind the open loop, on closed-form walks and on scenes.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod estimation_fixture;

use estimation_fixture::{Room, Run, Score, Walk, calibration};
use zsim::estimation::{Estimator, OpenLoop, Travelled, load, register};

/// A recording that ends before loops have much to say, and one that comes round.
fn runs() -> [Run; 3] {
    let walk = |semi_axes_m, lap_s| Walk { start_s: 1.5, ..Walk::new(semi_axes_m, lap_s) };
    [
        Run::new(Room::furnished(), walk((1.8, 1.2), 12.0), 21, 8.0),
        Run::new(Room::furnished(), walk((1.8, 1.2), 12.0), 22, 28.0),
        Run::new(Room::corridor_loop(), walk((7.25, 3.75), 30.0), 23, 34.0),
    ]
}

fn surveyed(run: &Run) -> OpenLoop {
    let mut estimator = Estimator::new(&load("default").unwrap(), &calibration()).unwrap().surveying();
    run.measurements().into_iter().for_each(|measurement| estimator.push(measurement).unwrap());
    estimator.finish().unwrap()
}

fn closed(open: &OpenLoop) -> OpenLoop {
    let covariances: Vec<_> = open.poses.iter().map(|pose| (pose.stamp, pose.covariance)).collect();
    let OpenLoop { trajectory, lidar, survey, .. } = open;
    let travelled = Travelled { map_from_head: trajectory, covariances: &covariances, lidar, survey };
    let closed = register(travelled, &calibration(), &load("default").unwrap());
    assert_eq!(closed.report.left, None, "{:?}", closed.report);
    OpenLoop { trajectory: closed.trajectory, ..open.clone() }
}

#[test]
fn closing_loops_never_costs_more_than_a_twentieth() {
    for (index, run) in runs().iter().enumerate() {
        let open = surveyed(run);
        let (before, after) = (Score::of(&open, run).rmse_m, Score::of(&closed(&open), run).rmse_m);
        assert!(after < 1.05 * before, "run {index}: {before} m before, {after} m after");
    }
}

#[test]
fn keeping_what_is_seen_changes_nothing_of_the_open_loop() {
    let run = Run::new(Room::furnished(), Walk { start_s: 1.5, ..Walk::new((1.8, 1.2), 12.0) }, 24, 7.0);
    let mut plain = Estimator::new(&load("default").unwrap(), &calibration()).unwrap();
    run.measurements().into_iter().for_each(|measurement| plain.push(measurement).unwrap());
    let (plain, with_survey) = (plain.finish().unwrap(), surveyed(&run));
    assert!(plain.poses == with_survey.poses);
    assert!(plain.survey.is_empty() && with_survey.survey.len() > 1000, "{}", with_survey.survey.len());
}
