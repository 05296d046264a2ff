//! Base trajectory from the head's motion, compared with the true base motion.

use zsim::dynamics::{DynamicsError, HeadModel, HeadSimulation, load};
use zsim::geometry::{Pose, Route, Trajectory, Vector};
use zsim::motion;
use zsim::random::Seed;
use zsim::time::{Span, Stamp};

fn model(head: &str) -> HeadModel {
    let (spec, source) = load(head).unwrap();
    HeadModel::new(&spec, &source).unwrap()
}

/// Head model and true trajectories of head and base on a 10 s walk, with `rate_hz` poses/s.
fn walk(head: &str, rate_hz: i64) -> (HeadModel, Trajectory, Trajectory) {
    let model = model(head);
    let route = Route { points_in_world: vec![Vector::zeros(), Vector::new(20.0, 0.0, 0.0)], closed: false };
    let (hand, source) = motion::load("hand").unwrap();
    let motion = hand.build(&source, Some(&route), 10.0, Seed(4)).unwrap();
    let every = 1000 / rate_hz;
    let (mut heads, mut bases) = (Trajectory::new(), Trajectory::new());
    for (k, state) in HeadSimulation::new(&model, motion.as_ref(), 0.001).unwrap().take(10_000).enumerate() {
        let state = state.unwrap();
        if k as i64 % every == 0 {
            let stamp = Stamp::default() + Span::from_nanos(k as i64 * 1_000_000);
            heads.push(stamp, state.head.world_from_body).unwrap();
            bases.push(stamp, state.base.world_from_body).unwrap();
        }
    }
    (model, heads, bases)
}

/// Largest distance and angle between two trajectories at common stamps, m and degrees.
fn largest_difference(a: &[(Stamp, Pose)], b: &Trajectory) -> (f64, f64) {
    let pairs = a.iter().map(|(stamp, pose)| (pose, b.at(*stamp).unwrap()));
    pairs.fold((0.0, 0.0), |(shift, turn), (a, b)| {
        let angle = a.rotation.angle_to(&b.rotation).to_degrees();
        (f64::max(shift, (a.translation.vector - b.translation.vector).norm()), f64::max(turn, angle))
    })
}

#[test]
fn the_spring_model_determines_the_base_and_a_rigid_link_does_not() {
    let (model, heads, bases) = walk("handheld", 1000);
    let by_spring = largest_difference(&model.base_from_force_law(&heads).unwrap(), &bases);
    let by_link = largest_difference(&model.base_from_rigid_link(&heads), &bases);
    println!("spring {by_spring:?}, rigid link {by_link:?}");
    assert!(by_spring.0 < 0.001 && by_spring.1 < 0.2, "{by_spring:?}");
    assert!(by_link.0 > 0.03 && by_link.1 > 30.0, "{by_link:?}");
}

#[test]
fn differences_at_the_imu_rate_lose_little_accuracy() {
    let (model, heads, bases) = walk("handheld", 100);
    let by_spring = largest_difference(&model.base_from_force_law(&heads).unwrap(), &bases);
    println!("{by_spring:?}");
    assert!(by_spring.0 < 0.02 && by_spring.1 < 3.0, "{by_spring:?}");
}

#[test]
fn a_pose_without_a_base_solution_affects_only_its_neighbours() {
    let (model, heads, _) = walk("handheld", 100);
    let whole = model.base_from_force_law(&heads).unwrap();
    let thrown = heads.iter().enumerate().map(|(k, (stamp, pose))| {
        let shift = if k == 500 { Vector::x() * 2.0 } else { Vector::zeros() };
        (stamp, Pose::from_parts((pose.translation.vector + shift).into(), pose.rotation))
    });
    let estimated = model.base_from_force_law(&Trajectory::from_poses(thrown).unwrap()).unwrap();
    assert!((whole.len() - 10..whole.len()).contains(&estimated.len()), "{} of {}", estimated.len(), whole.len());
    let far = |stamp: Stamp| stamp.seconds_since(Stamp::default()) > 5.1 || stamp.seconds_since(Stamp::default()) < 4.9;
    let whole = Trajectory::from_poses(whole).unwrap();
    let estimated: Vec<_> = estimated.into_iter().filter(|(stamp, _)| far(*stamp)).collect();
    let (shift, turn) = largest_difference(&estimated, &whole);
    assert!(shift < 1e-3 && turn < 0.1, "{shift} m, {turn} degrees");
}

#[test]
fn a_motor_does_not_tell_its_base() {
    let error = model("spinning").base_from_force_law(&Trajectory::new()).unwrap_err();
    assert!(matches!(error, DynamicsError::BaseUnknown { .. }), "{error}");
}
