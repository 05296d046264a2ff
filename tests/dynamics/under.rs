//! The base found from the head's motion, against the base that moved it.

use zsim::dynamics::{DynamicsError, HeadModel, HeadSimulation, load};
use zsim::geometry::{Pose, Route, Trajectory, Vector};
use zsim::motion;
use zsim::random::Seed;
use zsim::time::{Span, Stamp};

fn model(head: &str) -> HeadModel {
    let (spec, source) = load(head).unwrap();
    HeadModel::new(&spec, &source).unwrap()
}

/// Head and base on a walk of ten seconds, `rate_hz` poses a second.
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

/// Greatest distance and angle between two trajectories where both have poses, m and degrees.
fn apart(a: &[(Stamp, Pose)], b: &Trajectory) -> (f64, f64) {
    let pairs = a.iter().map(|(stamp, pose)| (pose, b.at(*stamp).unwrap()));
    pairs.fold((0.0, 0.0), |(shift, turn), (a, b)| {
        let angle = a.rotation.angle_to(&b.rotation).to_degrees();
        (f64::max(shift, (a.translation.vector - b.translation.vector).norm()), f64::max(turn, angle))
    })
}

#[test]
fn the_springs_law_finds_the_base_that_a_rigid_link_misses() {
    let (model, heads, bases) = walk("handheld", 1000);
    let by_spring = apart(&model.base_from_force_law(&heads).unwrap(), &bases);
    let by_link = apart(&model.base_from_rigid_link(&heads), &bases);
    println!("spring {by_spring:?}, rigid link {by_link:?}");
    assert!(by_spring.0 < 0.001 && by_spring.1 < 0.2, "{by_spring:?}");
    assert!(by_link.0 > 0.03 && by_link.1 > 30.0, "{by_link:?}");
}

#[test]
fn differences_at_an_imus_rate_lose_little() {
    let (model, heads, bases) = walk("handheld", 100);
    let by_spring = apart(&model.base_from_force_law(&heads).unwrap(), &bases);
    println!("{by_spring:?}");
    assert!(by_spring.0 < 0.02 && by_spring.1 < 3.0, "{by_spring:?}");
}

#[test]
fn a_pose_that_no_base_explains_costs_its_neighbours_alone() {
    let (model, heads, _) = walk("handheld", 100);
    let whole = model.base_from_force_law(&heads).unwrap();
    let thrown = heads.iter().enumerate().map(|(k, (stamp, pose))| {
        let shift = if k == 500 { Vector::x() * 2.0 } else { Vector::zeros() };
        (stamp, Pose::from_parts((pose.translation.vector + shift).into(), pose.rotation))
    });
    let told = model.base_from_force_law(&Trajectory::from_poses(thrown).unwrap()).unwrap();
    assert!((whole.len() - 10..whole.len()).contains(&told.len()), "{} of {}", told.len(), whole.len());
    let far = |stamp: Stamp| stamp.seconds_since(Stamp::default()) > 5.1 || stamp.seconds_since(Stamp::default()) < 4.9;
    let whole = Trajectory::from_poses(whole).unwrap();
    let told: Vec<_> = told.into_iter().filter(|(stamp, _)| far(*stamp)).collect();
    let (shift, turn) = apart(&told, &whole);
    assert!(shift < 1e-3 && turn < 0.1, "{shift} m, {turn} degrees");
}

#[test]
fn a_motor_does_not_tell_its_base() {
    let error = model("spinning").base_from_force_law(&Trajectory::new()).unwrap_err();
    assert!(matches!(error, DynamicsError::BaseUnknown { .. }), "{error}");
}
