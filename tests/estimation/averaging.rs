//! Strapdown integration of a noise-free IMU on a head that swings on its spring, for each kind of averaging.

use zsim::dynamics::{self, HeadModel, HeadSimulation};
use zsim::estimation::{integrate_imu, load};
use zsim::geometry::{Route, Vector};
use zsim::measurement::{ImuAveraging, ImuSample};
use zsim::motion;
use zsim::random::Seed;
use zsim::sensors::{Imu, ImuSpec, Track, ideal_reading};
use zsim::spec::{self, Kind, Source};
use zsim::time::{NANOS_PER_SECOND, Stamp};

const DURATION_S: f64 = 30.0;
const PERIOD_S: f64 = 0.01;
const STEP_S: f64 = 1e-3;

/// The handheld head, carried by hand, from the middle of a walk: it swings by 40 degrees at over 1 Hz.
fn swinging_imu() -> Track {
    let (head, source) = dynamics::load("handheld").unwrap();
    let model = HeadModel::new(&head, &source).unwrap();
    let (hand, source) = motion::load("hand").unwrap();
    let points = [[1.0, 1.0, 0.0], [15.0, 1.0, 0.0], [15.0, 8.0, 0.0], [1.0, 8.0, 0.0]];
    let route = Route { points_in_world: points.map(Vector::from).to_vec(), closed: true };
    let base = hand.build(&source, Some(&route), DURATION_S + 12.0, Seed(3)).unwrap();
    let simulation = HeadSimulation::new(&model, base.as_ref(), STEP_S).unwrap();
    let steps = (DURATION_S / STEP_S) as usize + 200;
    let nodes = simulation.skip(10_000).take(steps).map(|state| state.unwrap().head).collect();
    Track::new(0, STEP_S, nodes).unwrap().of_frame(model.head_from_imu())
}

/// Noise-free samples of `made_as`, stamped in the middle of their intervals.
fn samples(imu: &Track, made_as: ImuAveraging) -> Vec<ImuSample> {
    let sample = |k: i64| {
        let from_s = k as f64 * PERIOD_S;
        let reading = ideal_reading(made_as, |t_s| imu.kinematics(t_s), (from_s, from_s + PERIOD_S));
        ImuSample {
            stamp: Stamp::from_nanos(k * NANOS_PER_SECOND / 100 + NANOS_PER_SECOND / 200),
            angular_velocity_rad_per_s: reading.angular_velocity_rad_per_s,
            specific_force_m_per_s2: reading.specific_force_m_per_s2,
        }
    };
    (0..(DURATION_S / PERIOD_S) as i64 + 10).map(sample).collect()
}

/// Largest position error, m, and rotation error, rad, over 30 s.
fn errors(imu: &Track, made_as: ImuAveraging, taken_as: ImuAveraging) -> (f64, f64) {
    let ideal: ImuSpec = spec::load(Kind::Imu, "ideal_1khz").unwrap();
    let noise = Imu::new(&ideal, &Source::in_memory("test.ron", "")).unwrap().noise();
    let estimator = load("default").unwrap();
    let start = imu.kinematics(0.0);
    let integrated = integrate_imu(&samples(imu, made_as), (&noise, taken_as), &start, &estimator).unwrap();
    let mut most = (0.0_f64, 0.0_f64);
    for (stamp, pose) in integrated.iter() {
        let truth = imu.pose(stamp.nanos() as f64 * 1e-9);
        let error: Vector = pose.translation.vector - truth.translation.vector;
        most = (most.0.max(error.norm()), most.1.max(pose.rotation.angle_to(&truth.rotation)));
    }
    most
}

#[test]
fn each_kind_of_averaging_integrates_to_the_motion() {
    let imu = swinging_imu();
    let fastest = (0..3000).map(|k| imu.kinematics(f64::from(k) * 0.01).angular_velocity_in_world.norm());
    assert!(fastest.fold(0.0, f64::max) > 4.0, "the head does not swing vigorously");
    for kind in [ImuAveraging::ConingCorrected, ImuAveraging::BodyMean, ImuAveraging::None] {
        let (position_m, rotation_rad) = errors(&imu, kind, kind);
        println!("{kind:?}: {:.4} mm, {:.3} mdeg", position_m * 1e3, rotation_rad.to_degrees() * 1e3);
    }
    for (made, taken) in [
        (ImuAveraging::ConingCorrected, ImuAveraging::BodyMean),
        (ImuAveraging::BodyMean, ImuAveraging::ConingCorrected),
        (ImuAveraging::None, ImuAveraging::BodyMean),
    ] {
        let (position_m, rotation_rad) = errors(&imu, made, taken);
        println!("{made:?} as {taken:?}: {:.4} mm, {:.3} mdeg", position_m * 1e3, rotation_rad.to_degrees() * 1e3);
    }
    panic!("measure");
}
