//! Properties of every base motion: exact derivatives, rest at the start, repeatability, and error messages.

use rand::RngExt;
use zsim::geometry::{Kinematics, Route, Vector};
use zsim::motion::{BaseMotion, MotionSpec, SignalSpec, load};
use zsim::random::Seed;
use zsim::spec::{Kind, Source, names, parse};

const DURATION_S: f64 = 80.0;

/// A loop through rooms with right, sharp and blunt corners, and a few steps up and down.
fn route() -> Route {
    let points = [[1.0, 1.0, 0.0], [9.0, 1.0, 0.0], [9.0, 6.0, 0.0], [6.0, 7.0, 0.8], [3.0, 3.0, 0.8], [1.0, 5.0, 0.0]];
    Route { points_in_world: points.map(Vector::from).to_vec(), closed: true }
}

fn built(name: &str, seed: u64) -> Box<dyn BaseMotion> {
    let (spec, source) = load(name).unwrap();
    spec.build(&source, Some(&route()), DURATION_S, Seed(seed)).unwrap()
}

fn shipped() -> Vec<String> {
    names(Kind::Motion)
}

/// Random times over the run, and after its end.
fn times(seed: u64, count: usize) -> Vec<f64> {
    let mut stream = Seed(seed).stream("times");
    (0..count).map(|_| stream.random::<f64>() * (DURATION_S + 5.0)).collect()
}

/// The fourth-order central difference of `f`, with the step `h`.
fn slope(f: impl Fn(f64) -> Vector, t: f64, h: f64) -> Vector {
    ((f(t + h) - f(t - h)) * 8.0 - (f(t + 2.0 * h) - f(t - 2.0 * h))) / (12.0 * h)
}

fn assert_close(measured: &Vector, expected: &Vector, name: &str) {
    let error = (measured - expected).norm();
    assert!(error < 1e-5 * (1.0 + expected.norm()), "{name}: differs by {error} from {expected:?}");
}

#[test]
fn velocities_and_accelerations_are_derivatives_of_the_pose() {
    for name in shipped() {
        let motion = built(&name, 3);
        for t in times(5, 400) {
            let now: Kinematics = motion.at(t);
            let back = now.world_from_body.rotation.inverse();
            let at = |s: f64| motion.at(s);
            let what = |kind: &str| format!("{name}: {kind} at {t} s");
            let h = 1e-4;
            let velocity = slope(|s| at(s).world_from_body.translation.vector, t, h);
            assert_close(&velocity, &now.velocity_in_world, &what("velocity"));
            let turning = slope(|s| (at(s).world_from_body.rotation * back).scaled_axis(), t, h);
            assert_close(&turning, &now.angular_velocity_in_world, &what("angular velocity"));
            let acceleration = slope(|s| at(s).velocity_in_world, t, h);
            assert_close(&acceleration, &now.acceleration_in_world, &what("acceleration"));
            let turning_up = slope(|s| at(s).angular_velocity_in_world, t, h);
            assert_close(&turning_up, &now.angular_acceleration_in_world, &what("angular acceleration"));
        }
    }
}

#[test]
fn accelerations_are_continuous() {
    for name in shipped() {
        let motion = built(&name, 3);
        let change = |t: f64, h: f64| {
            let (a, b) = (motion.at(t), motion.at(t + h));
            (a.acceleration_in_world - b.acceleration_in_world).norm()
                + (a.angular_acceleration_in_world - b.angular_acceleration_in_world).norm()
        };
        let step_s = 4e-3;
        let mut steps: Vec<f64> = (0..(DURATION_S / step_s) as i64).map(|k| k as f64 * step_s).collect();
        steps.sort_by_cached_key(|t| std::cmp::Reverse((change(*t, step_s) * 1e9) as u64));
        // Bisects the steps of largest change: a jump keeps its size, a slope vanishes.
        for mut t in steps.into_iter().take(30) {
            let mut h = step_s;
            while h > 1e-9 {
                h /= 2.0;
                t += if change(t, h) < change(t + h, h) { h } else { 0.0 };
            }
            assert!(change(t, h) < 1e-3, "{name}: acceleration jumps by {} at {t} s", change(t, h));
        }
    }
}

#[test]
fn the_base_starts_at_rest() {
    for name in shipped().into_iter().filter(|name| name != "vehicle_cruise") {
        for seed in [1, 2] {
            let start = built(&name, seed).at(0.0);
            assert_eq!(start, Kinematics::at_rest(start.world_from_body), "{name}");
        }
    }
}

#[test]
fn an_imu_on_a_cruising_base_measures_rest() {
    let cruise = built("vehicle_cruise", 1);
    for t in [0.0, 0.5, 7.0] {
        let now = cruise.at(t);
        assert!((now.velocity_in_world - Vector::x() * 8.0).norm() < 1e-12);
        assert_eq!((now.acceleration_in_world, now.angular_velocity_in_world), (Vector::zeros(), Vector::zeros()));
    }
}

#[test]
fn motions_depend_only_on_the_seed() {
    for name in shipped() {
        let (first, again, other) = (built(&name, 7), built(&name, 7), built(&name, 8));
        let mut differs = false;
        for t in times(1, 50) {
            assert_eq!(first.at(t), again.at(t), "{name}");
            differs |= first.at(t) != other.at(t);
        }
        let (spec, _) = load(&name).unwrap();
        assert_eq!(differs, is_random(&spec), "{name}: dependence on the seed");
    }
}

/// Whether a motion has random parts.
fn is_random(spec: &MotionSpec) -> bool {
    match spec {
        MotionSpec::Stand(_) | MotionSpec::Cruise(_) | MotionSpec::Replay(_) => false,
        MotionSpec::Shaker(spec) => {
            spec.drives.iter().any(|drive| matches!(drive.signal, SignalSpec::BandNoise { .. }))
        }
        _ => true,
    }
}

#[test]
fn the_hand_holds_the_head_only_in_stops() {
    for name in shipped() {
        let motion = built(&name, 3);
        let holds = times(9, 2000).into_iter().map(|t| motion.hold(t)).fold(0.0, f64::max);
        assert_eq!(
            holds,
            if ["hand_stops", "hand_rest_middle"].contains(&name.as_str()) { 1.0 } else { 0.0 },
            "{name}"
        );
    }
}

#[test]
fn a_motion_needs_a_positive_duration() {
    let (spec, source) = load("stand").unwrap();
    for duration_s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = spec.build(&source, None, duration_s, Seed(1)).err().unwrap().to_string();
        assert!(error.contains("more than 0 s"), "{error}");
    }
}

#[test]
fn every_shipped_motion_survives_writing_and_reading() {
    for name in shipped() {
        let (spec, _) = load(&name).unwrap();
        let text = zsim::spec::to_text(&spec).unwrap();
        let again: MotionSpec = parse(&Source::in_memory("again", text)).unwrap();
        assert_eq!(spec, again, "{name}");
    }
}
