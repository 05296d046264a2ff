//! Motion of the hand: route, speed, corners, stairs, turns, stops, rests and drops.

use zsim::geometry::{Route, Vector, roll_pitch_yaw};
use zsim::motion::{BaseMotion, MotionError, MotionSpec};
use zsim::random::Seed;
use zsim::spec::{Kind, Source, SpecError, find, parse};

const HEIGHT_M: f64 = 1.1;

fn route(points: &[[f64; 3]], closed: bool) -> Route {
    Route { points_in_world: points.iter().copied().map(Vector::from).collect(), closed }
}

fn square() -> Route {
    route(&[[0.0, 0.0, 0.0], [6.0, 0.0, 0.0], [6.0, 6.0, 0.0], [0.0, 6.0, 0.0]], true)
}

/// The shipped spec with `from` replaced by `to`, for a run along `route`.
fn edited(name: &str, edits: &[(&str, &str)], route: Option<&Route>) -> Result<Box<dyn BaseMotion>, MotionError> {
    let mut text = find(Kind::Motion, name).unwrap().text;
    for (from, to) in edits {
        assert!(text.contains(from), "no {from} in {name}");
        text = text.replacen(from, to, 1);
    }
    let source = Source::in_memory(name, text);
    let spec: MotionSpec = parse(&source)?;
    spec.build(&source, route, 120.0, Seed(4))
}

/// Replacements for a walk without gait and shaking, so that the base follows the walker.
const PLAIN: [(&str, &str); 3] = [
    ("gait: (step_hz: 1.9, bob_m: 0.015, sway_m: 0.015, surge_m: 0.006, irregularity_rad: 0.4)", "gait: None"),
    ("pitch_deg: 1.8", "pitch_deg: 0.0"),
    ("roll_deg: 1.0", "roll_deg: 0.0"),
];

fn distance_to(route: &Route, point: &Vector) -> f64 {
    let points = &route.points_in_world;
    let legs = if route.closed { points.len() } else { points.len() - 1 };
    let to_leg = |k: usize| {
        let (a, way) = (points[k], points[(k + 1) % points.len()] - points[k]);
        let along = ((point - a).dot(&way) / way.norm_squared()).clamp(0.0, 1.0);
        (point - a - way * along).norm()
    };
    (0..legs).map(to_leg).fold(f64::INFINITY, f64::min)
}

#[test]
fn the_walk_follows_its_route_below_its_speed() {
    // A right-angled corner at 0.6 m/s changes each component of the velocity by 0.6 m/s. Smoothing over 0.8 s gives a
    // distance of 0.6 * 0.8 * 35/256 = 65.6 mm from the route. Between corners the walker is on the route at 1 m/s.
    let square = square();
    let walk = edited("hand", &PLAIN, Some(&square)).unwrap();
    let (mut farthest, mut fastest, mut far): (f64, f64, f64) = (0.0, 0.0, 0.0);
    for k in 0..12_000 {
        let now = walk.at(0.01 * f64::from(k));
        let mut floor = now.world_from_body.translation.vector;
        assert!((floor.z - HEIGHT_M).abs() < 1e-12);
        floor.z = 0.0;
        farthest = farthest.max(distance_to(&square, &floor));
        fastest = fastest.max(now.velocity_in_world.norm());
        far = far.max(floor.norm());
    }
    assert!((farthest - 0.6 * 0.8 * 35.0 / 256.0).abs() < 1e-4, "farthest from the route: {farthest}");
    assert!((0.999..1.0 + 1e-12).contains(&fastest), "fastest: {fastest}");
    assert!(far > 8.0, "did not reach the far corner: {far}");
}

#[test]
fn the_walker_slows_down_and_turns_in_corners() {
    let walk = edited("hand", &PLAIN, Some(&square())).unwrap();
    let samples: Vec<_> = (0..12_000).map(|k| walk.at(0.01 * f64::from(k))).collect();
    let near_corner = samples.iter().filter(|now| {
        let p = now.world_from_body.translation.vector;
        (p.x - 3.0).abs() > 2.85 && (p.y - 3.0).abs() > 2.85 && p.xy().norm() > 1.0
    });
    let slowest = near_corner.map(|now| now.velocity_in_world.norm()).fold(f64::INFINITY, f64::min);
    // The mean of two velocities of 0.6 m/s at right angles is 0.6 / sqrt(2).
    assert!((0.42..0.5).contains(&slowest), "slowest at a corner: {slowest}");
    for now in samples.iter().filter(|now| now.velocity_in_world.norm() > 0.999) {
        let (_, _, yaw) = roll_pitch_yaw(&now.world_from_body.rotation);
        let course = now.velocity_in_world.y.atan2(now.velocity_in_world.x);
        assert!((yaw - course).sin().abs() < 0.25 && (yaw - course).cos() > 0.0, "faces {yaw}, walks {course}");
    }
    // 90 degrees at 110 degrees/s at most, or over 0.9 s: 90 * 35/32 / 0.9 = 109 degrees/s.
    let quickest = samples.iter().map(|now| now.angular_velocity_in_world.norm()).fold(0.0, f64::max);
    assert!((105.0..110.01).contains(&quickest.to_degrees()), "quickest turn: {}", quickest.to_degrees());
}

#[test]
fn at_the_end_of_an_open_route_the_walker_turns_round() {
    let corridor = route(&[[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]], false);
    let walk = edited("hand", &PLAIN, Some(&corridor)).unwrap();
    let samples: Vec<_> = (0..12_000).map(|k| walk.at(0.01 * f64::from(k))).collect();
    let x = |now: &zsim::geometry::Kinematics| now.world_from_body.translation.vector.x;
    assert!(samples.iter().all(|now| (-1e-9..10.0 + 1e-9).contains(&x(now))));
    let backwards = samples.iter().filter(|now| now.velocity_in_world.x < -0.999);
    let mut returning = 0;
    for now in backwards {
        assert!((now.world_from_body.rotation * Vector::x()).x < -0.9, "walks backwards at {}", x(now));
        returning += 1;
    }
    assert!(returning > 1000, "walks back for {returning} samples");
    let quickest = samples.iter().map(|now| now.angular_velocity_in_world.norm()).fold(0.0, f64::max);
    assert!(quickest.to_degrees() < 110.01, "turns at {} degrees/s", quickest.to_degrees());
}

#[test]
fn height_on_stairs_is_smooth() {
    // 3 m up over 4 m of floor: a slope of 5 m in 5 s, so 0.6 m/s upwards.
    let stairs = route(&[[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [9.0, 0.0, 3.0], [14.0, 0.0, 3.0]], false);
    let walk = edited("hand", &PLAIN, Some(&stairs)).unwrap();
    let samples: Vec<_> = (0..3_000).map(|k| walk.at(0.01 * f64::from(k))).collect();
    let rise = samples.iter().map(|now| now.velocity_in_world.z).fold(0.0, f64::max);
    assert!((0.5..=0.6 + 1e-9).contains(&rise), "rises at {rise}");
    let top = samples.iter().map(|now| now.world_from_body.translation.vector.z).fold(0.0, f64::max);
    assert!((top - HEIGHT_M - 3.0).abs() < 1e-9, "climbs to {top}");
    let bump = samples.iter().map(|now| now.acceleration_in_world.z.abs()).fold(0.0, f64::max);
    assert!(bump < 1.0, "a bump of {bump} m/s^2");
}

#[test]
fn the_wrist_shakes_at_the_specified_frequency_and_amplitude() {
    let straight = route(&[[0.0, 0.0, 0.0], [500.0, 0.0, 0.0]], false);
    let hand = edited("hand", &[], Some(&straight)).unwrap();
    let pitch: Vec<f64> =
        (500..12_000).map(|k| roll_pitch_yaw(&hand.at(0.01 * f64::from(k)).world_from_body.rotation).1).collect();
    // An amplitude of 1.8 degrees with 15 % variation: RMS of 1.8 sqrt((1 + 0.0225) / 2) = 1.29 degrees.
    let rms = (pitch.iter().map(|p| p * p).sum::<f64>() / pitch.len() as f64).sqrt().to_degrees();
    assert!((1.15..1.45).contains(&rms), "rms pitch {rms} degrees");
    // A frequency of 1.2 Hz crosses zero 2.4 times a second; the phase varies slowly.
    let crossings = pitch.windows(2).filter(|pair| pair[0] * pair[1] < 0.0).count();
    let rate = crossings as f64 / 115.0;
    assert!((2.3..2.5).contains(&rate), "{rate} crossings a second");
}

#[test]
fn the_lasso_shake_moves_the_tilt_in_a_circle() {
    let straight = route(&[[0.0, 0.0, 0.0], [500.0, 0.0, 0.0]], false);
    let hand = edited("hand", &[("lasso: false", "lasso: true"), ("roll_deg: 1.0", "roll_deg: 1.8")], Some(&straight))
        .unwrap();
    // Roll follows pitch by a quarter period with the same amplitude: the tilt equals the amplitude, which
    // stays within sqrt(12) standard deviations of 15 % about 1.8 degrees.
    for k in 600..12_000 {
        let (roll, pitch, _) = roll_pitch_yaw(&hand.at(0.01 * f64::from(k)).world_from_body.rotation);
        let tilt = roll.hypot(pitch).to_degrees();
        assert!((0.8..2.8).contains(&tilt), "tilts by {tilt} degrees");
    }
}

#[test]
fn in_a_stop_the_head_is_held_while_the_walk_continues() {
    let hand = edited("hand", &[("At([])", "At([(20.0, 4.0), (40.0, 5.0)])")], Some(&square())).unwrap();
    assert_eq!(hand.hold(19.9), 0.0);
    assert_eq!(hand.hold(20.25), 0.5);
    assert_eq!((hand.hold(20.5), hand.hold(23.4), hand.hold(24.0)), (1.0, 1.0, 0.0));
    let mut moved = 0.0;
    for k in 0..250 {
        let now = hand.at(20.75 + 0.01 * f64::from(k));
        let (roll, pitch, _) = roll_pitch_yaw(&now.world_from_body.rotation);
        assert!(roll.abs() + pitch.abs() < 1e-12, "the wrist turns in a stop");
        moved += now.velocity_in_world.norm() * 0.01;
    }
    assert!(moved > 1.5, "walked {moved} m in 2.5 s");
}

#[test]
fn in_a_rest_the_walker_stands_still_and_then_continues_the_route() {
    let rests = [PLAIN[0], PLAIN[1], PLAIN[2], ("grip_s: 0.5,", "grip_s: 0.5, rests: [(20.0, 40.0)],")];
    let hand = edited("hand", &rests, Some(&square())).unwrap();
    let through = edited("hand", &PLAIN, Some(&square())).unwrap();
    for t in [20.0, 41.3, 60.0] {
        assert!(hand.at(t).velocity_in_world.norm() < 1e-9 && hand.at(t).angular_velocity_in_world.norm() < 1e-9);
    }
    // The walk is delayed by the rest and by half of the 1.5 s before and after it.
    for t in [5.0, 15.0, 70.0, 100.0] {
        let late_s = if t > 60.0 { 41.5 } else { 0.0 };
        let (now, then) = (hand.at(t), through.at(t - late_s));
        assert!((now.world_from_body.translation.vector - then.world_from_body.translation.vector).norm() < 1e-9);
    }
}

#[test]
fn after_a_drop_the_hand_is_lower_by_its_height() {
    let drop = ("grip_s: 0.5,", "grip_s: 0.5, drops: [(at_s: 15.0, height_m: 0.25, landing_s: 0.035)],");
    let hand = edited("hand", &[PLAIN[0], PLAIN[1], PLAIN[2], drop], Some(&square())).unwrap();
    let height = |t: f64| hand.at(t).world_from_body.translation.vector.z;
    // 0.226 s of free fall from 0.25 m, and 35 ms of landing.
    assert!((height(14.9) - HEIGHT_M).abs() < 1e-9 && (height(15.27) - HEIGHT_M + 0.25).abs() < 1e-9);
    let hardest = (0..300).map(|k| hand.at(15.0 + 1e-3 * f64::from(k)).acceleration_in_world.z).fold(0.0, f64::max);
    assert!((8.0..12.0).contains(&(hardest / 9.81)), "{hardest} m/s^2");
}

#[test]
fn random_stops_have_the_specified_frequency() {
    let (mut held, mut begins, mut before) = (0, 0, 0.0);
    let hand = edited("hand_stops", &[], Some(&square())).unwrap();
    for k in 0..12_000 {
        let hold = hand.hold(0.01 * f64::from(k));
        held += usize::from(hold > 0.0);
        begins += usize::from(before == 0.0 && hold > 0.0);
        before = hold;
    }
    // 120 s with stops of 3 to 6 s about every 25 s: about four stops.
    assert!((2..=7).contains(&begins), "{begins} stops");
    assert!((0.01 * held as f64 / begins as f64 - 4.5).abs() < 1.5);
}

#[test]
fn the_wave_goes_twice_round_its_box_with_constant_heading() {
    let hand =
        edited("wave", &[("pitch_deg: 2.1", "pitch_deg: 0.0"), ("roll_deg: 1.0", "roll_deg: 0.0")], None).unwrap();
    let samples: Vec<_> = (0..6_000).map(|k| hand.at(0.01 * f64::from(k))).collect();
    let path: f64 = samples.iter().map(|now| now.velocity_in_world.norm() * 0.01).sum();
    // Twice 2 (0.6 + 0.5) m, with cut corners.
    assert!((4.0..4.4).contains(&path), "path of {path} m");
    for now in &samples {
        let p = now.world_from_body.translation.vector;
        assert!((-1e-9..0.6 + 1e-9).contains(&p.x) && (-1e-9..0.5 + 1e-9).contains(&p.y));
        assert!(now.world_from_body.rotation.angle() < 1e-12);
    }
}

#[test]
fn an_invalid_route_is_an_error_with_the_reason() {
    let error_of = |route: Option<&Route>| edited("hand", &[], route).err().unwrap().to_string();
    let line = |points: &[[f64; 3]]| route(points, false);
    assert!(error_of(None).contains("the scene has no default route"));
    assert!(error_of(Some(&line(&[[0.0; 3]]))).contains("has 1 point"));
    assert!(error_of(Some(&line(&[[0.0; 3], [0.3, 0.0, 0.0]]))).contains("0.30 m long"));
    assert!(error_of(Some(&line(&[[0.0; 3], [0.0; 3], [5.0, 0.0, 0.0]]))).contains("points 0 and 1"));
    assert!(error_of(Some(&line(&[[0.0; 3], [f64::NAN, 0.0, 0.0]]))).contains("point 1 of the route"));
    let closed = route(&[[0.0; 3], [5.0, 0.0, 0.0], [5.0, 5.0, 0.0], [0.0; 3]], true);
    assert!(error_of(Some(&closed)).contains("points 3 and 0"));
}

#[test]
fn an_invalid_spec_is_an_error_with_line_and_column() {
    let square = square();
    let fault = |from: &str, to: &str| match edited("hand", &[(from, to)], Some(&square)) {
        Err(MotionError::Spec(error)) => error,
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("{to} is accepted"),
    };
    let place = |error: &SpecError| error.line_and_column().unwrap_or_else(|| panic!("{error} has no line"));
    let negative = fault("speed_m_per_s: 1.0", "speed_m_per_s: -1.0");
    assert!(negative.message().contains("above 0, found -1"), "{negative}");
    assert!(fault("pitch_deg: 1.8", "pitch_deg: NaN").message().contains("NaN"));
    assert!(fault("height_m", "height").message().contains("height"));
    let overlap = fault("At([])", "At([(10.0, 5.0), (14.0, 3.0)])");
    assert!(overlap.message().contains("stop at 14 s begins before 15 s"), "{overlap}");
    assert!(place(&overlap).0 > 10);
    assert!(fault("At([])", "At([(10.0, 0.5)])").message().contains("too short to grasp"));
    assert!(fault("At([])", "At([(-1.0, 5.0)])").message().contains("begins before 0 s"));
    assert!(fault("At([])", "At([(NaN, 5.0)])").message().contains("not finite"));
    let quick = fault("corner_speed_m_per_s: 0.6", "corner_speed_m_per_s: 1.6");
    assert!(quick.message().contains("faster than the straight"), "{quick}");
    let rest = |list: &str| fault("grip_s: 0.5,", &format!("grip_s: 0.5, rests: [{list}],"));
    assert!(rest("(1.0, 5.0)").message().contains("3 s is the earliest"));
    assert!(rest("(10.0, 5.0), (16.0, 1.0)").message().contains("18 s is the earliest"));
    assert!(rest("(10.0, NaN)").message().contains("lasts NaN s"));
    let random = "Random(every_s: 20.0, shortest_s: 5.0, longest_s: 4.0)";
    assert!(fault("At([])", random).message().contains("more than the longest"));
}
