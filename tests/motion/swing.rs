//! The handheld head in the shipped hand motions: swing as in the paper, gyroscope within its range.

use zsim::dynamics::{HeadModel, HeadSimulation, HeadState};
use zsim::geometry::{Route, Vector, from_roll_pitch_yaw};
use zsim::motion::load;
use zsim::random::Seed;

/// Time after which the swing is stationary, s.
const SETTLED_S: f64 = 5.0;

fn run(motion: &str, seed: u64) -> (Vec<HeadState>, Box<dyn zsim::motion::BaseMotion>) {
    let (head, head_source) = zsim::dynamics::load("handheld").unwrap();
    let model = HeadModel::new(&head, &head_source).unwrap();
    let points = [[1.0, 1.0, 0.0], [15.0, 1.0, 0.0], [15.0, 8.0, 0.0], [1.0, 8.0, 0.0]];
    let route = Route { points_in_world: points.map(Vector::from).to_vec(), closed: true };
    let (spec, source) = load(motion).unwrap();
    let base = spec.build(&source, Some(&route), 60.0, Seed(seed)).unwrap();
    let states = HeadSimulation::new(&model, base.as_ref(), 1e-3).unwrap().take(60_000).map(Result::unwrap).collect();
    (states, base)
}

/// Forward inclination of the head from the vertical in the heading plane of the base, degrees.
fn pitch_deg(state: &HeadState) -> f64 {
    let (_, _, yaw) = state.base.world_from_body.rotation.euler_angles();
    let up = from_roll_pitch_yaw(0.0, 0.0, -yaw) * (state.head.world_from_body.rotation * Vector::z());
    up.x.atan2(up.z).to_degrees()
}

/// Amplitudes of all turning points of the swing, ascending.
fn peaks(states: &[HeadState]) -> Vec<f64> {
    let settled = states.iter().filter(|state| state.t_s > SETTLED_S);
    let size: Vec<f64> = settled.map(|state| pitch_deg(state).abs()).collect();
    let mut peaks: Vec<f64> =
        size.windows(3).filter(|w| w[1] > w[0] && w[1] >= w[2] && w[1] > 2.0).map(|w| w[1]).collect();
    peaks.sort_by(f64::total_cmp);
    peaks
}

#[test]
fn the_head_swings_by_forty_to_fifty_degrees() {
    for motion in ["hand", "wave"] {
        for seed in [1, 2, 3, 4] {
            let (states, _) = run(motion, seed);
            let peaks = peaks(&states);
            // Two turning points per cycle of about 1.2 Hz over 55 s.
            assert!((120..145).contains(&peaks.len()), "{motion}, seed {seed}: {} swings", peaks.len());
            let (most, largest) = (peaks[peaks.len() * 9 / 10], peaks[peaks.len() - 1]);
            assert!(
                most > 35.0 && largest < 55.0,
                "{motion}, seed {seed}: 90 % of peaks below {most}, all below {largest}"
            );
            let beyond =
                states.iter().filter(|state| state.head.angular_velocity_in_body().amax().to_degrees() > 600.0);
            assert!(beyond.count() * 200 < states.len(), "{motion}, seed {seed}: the gyro saturates");
        }
    }
}

#[test]
fn a_held_head_hardly_swings_while_the_operator_walks() {
    let (states, base) = run("hand_stops", 2);
    let held: Vec<&HeadState> =
        states.iter().filter(|state| base.hold(state.t_s) == 1.0 && base.hold(state.t_s - 0.7) == 1.0).collect();
    assert!(held.len() > 3000, "held for {} ms", held.len());
    let swing = held.iter().map(|state| pitch_deg(state).abs()).fold(0.0, f64::max);
    assert!(swing < 5.0, "swings by {swing} degrees while held");
    let walked: f64 = held.iter().map(|state| state.base.velocity_in_world.norm() * 1e-3).sum();
    assert!(walked > 0.6 * held.len() as f64 * 1e-3, "walked {walked} m");
}
