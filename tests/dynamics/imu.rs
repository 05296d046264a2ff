use crate::dynamics::heads::{Nodding, shipped, states};
use zsim::dynamics::HeadState;
use zsim::geometry::{Kinematics, Pose, Rotation, Route, Vector, gravity_in_world};
use zsim::motion::BaseMotion;
use zsim::random::Seed;

/// Integration rule from gyroscope samples to the rotation of a step.
#[derive(Clone, Copy, PartialEq)]
enum Rule {
    /// The mean of both ends of the step: error `h^2/12` of the change of angular acceleration.
    Trapezoid,
    /// The cubic through four samples, and the coning term `h^2/12 w x w'`.
    Cubic,
}

/// Strapdown integration of a noise-free IMU from its second sample on: worst pose errors, m and degrees.
fn worst_error(path: &[HeadState], head_from_imu: &Pose, step_s: f64, rule: Rule) -> (f64, f64) {
    let imu: Vec<Kinematics> = path.iter().map(|state| state.head.of_frame(head_from_imu)).collect();
    let (mut rotation, mut position) = (imu[1].world_from_body.rotation, imu[1].world_from_body.translation.vector);
    let mut velocity = imu[1].velocity_in_world;
    let (mut metres, mut degrees): (f64, f64) = (0.0, 0.0);
    for four in imu.windows(4) {
        let gyro: Vec<Vector> = four.iter().map(Kinematics::angular_velocity_in_body).collect();
        let mean = match rule {
            Rule::Trapezoid => (gyro[1] + gyro[2]) / 2.0,
            Rule::Cubic => {
                ((gyro[1] + gyro[2]) * 13.0 - gyro[0] - gyro[3]) / 24.0 + gyro[1].cross(&gyro[2]) * (step_s / 12.0)
            }
        };
        let turned = rotation * Rotation::from_scaled_axis(mean * step_s);
        let before = rotation * four[1].specific_force_in_body() + gravity_in_world();
        let after = turned * four[2].specific_force_in_body() + gravity_in_world();
        position += velocity * step_s + (before * 2.0 + after) * (step_s * step_s / 6.0);
        velocity += (before + after) * (0.5 * step_s);
        rotation = turned;
        let truth = &four[2].world_from_body;
        metres = metres.max((position - truth.translation.vector).norm());
        degrees = degrees.max(rotation.angle_to(&truth.rotation).to_degrees());
    }
    (metres, degrees)
}

fn walked(seed: u64) -> Box<dyn BaseMotion> {
    let corners = [(0.0, 0.0), (12.0, 0.0), (12.0, 8.0), (0.0, 8.0)];
    let points_in_world = corners.map(|(x, y)| Vector::new(x, y, 0.0)).to_vec();
    let (spec, source) = zsim::motion::load("hand").unwrap();
    spec.build(&source, Some(&Route { points_in_world, closed: true }), 60.0, Seed(seed)).unwrap()
}

#[test]
fn a_noise_free_imu_integrates_to_the_true_poses() {
    let model = shipped("handheld");
    let nodding = Nodding { amount_rad: 0.05 };
    let by_hand = walked(1);
    for motion in [&nodding as &dyn BaseMotion, by_hand.as_ref()] {
        let path = states(&model, motion, 1e-3, 20.0);
        // From rest with the simplest rule; from mid-swing with a rule of negligible error.
        for (part, rule) in [(&path[..10_001], Rule::Trapezoid), (&path[8_000..18_001], Rule::Cubic)] {
            let (metres, degrees) = worst_error(part, model.head_from_imu(), 1e-3, rule);
            assert!(metres < 1e-3 && degrees < 0.005, "{metres} m, {degrees} degrees");
        }
    }
}

#[test]
fn velocity_and_acceleration_are_derivatives_of_the_pose() {
    // Compared with fourth-order differences of five poses: (-1, 8, 0, -8, 1) / 12 h and (-1, 16, -30, 16, -1) / 12 h^2.
    let step_s = 1e-3;
    let path = states(&shipped("handheld"), &Nodding { amount_rad: 0.05 }, step_s, 3.0);
    for five in path.windows(5) {
        let x = |k: usize| five[k].head.world_from_body.translation.vector;
        let middle = &five[2].head;
        let velocity = ((x(3) - x(1)) * 8.0 - (x(4) - x(0))) / (12.0 * step_s);
        let acceleration = ((x(3) + x(1)) * 16.0 - (x(4) + x(0)) - x(2) * 30.0) / (12.0 * step_s * step_s);
        let turn = |k: usize| {
            let rotation = five[k].head.world_from_body.rotation * middle.world_from_body.rotation.inverse();
            rotation.scaled_axis()
        };
        let turning = ((turn(3) - turn(1)) * 8.0 - (turn(4) - turn(0))) / (12.0 * step_s);
        assert!((velocity - middle.velocity_in_world).norm() < 1e-5);
        assert!((acceleration - middle.acceleration_in_world).norm() < 1e-2);
        assert!((turning - middle.angular_velocity_in_world).norm() < 1e-4);
    }
}

#[test]
fn poses_between_steps_agree_with_a_finer_simulation() {
    // A different step would change the path by its second-order error. So one fine path is used, and every second
    // state is interpolated from the others.
    let path = states(&shipped("handheld"), &Nodding { amount_rad: 0.05 }, 5e-4, 3.0);
    for three in path.windows(3).step_by(2) {
        let middle = three[0].head.pose_towards(&three[2].head, 1e-3, 0.5);
        let truth = &three[1].head.world_from_body;
        assert!((middle.translation.vector - truth.translation.vector).norm() < 1e-7);
        assert!(middle.rotation.angle_to(&truth.rotation) < 1e-6);
    }
}
