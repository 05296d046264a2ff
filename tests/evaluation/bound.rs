//! The information bound compared with closed forms.

use approx::assert_relative_eq;
use zsim::evaluation::{BeamObservation, BoundModel, FisherInformation, InformationBound, MapKnowledge};
use zsim::geometry::{Pose, STANDARD_GRAVITY_M_PER_S2, Vector};
use zsim::measurement::{ImuNoise, ImuSample};
use zsim::time::{Span, Stamp};

/// Standard deviation of a range, m.
const SIGMA_M: f64 = 0.01;
/// Interval between beams in each direction, s.
const BEAM_S: f64 = 0.005;

/// A model with an error-free IMU.
pub(super) fn exact() -> BoundModel {
    BoundModel {
        head_from_imu: Pose::identity(),
        imu: ImuNoise {
            gyro_density_rad_per_s_per_sqrt_hz: 0.0,
            accel_density_m_per_s2_per_sqrt_hz: 0.0,
            gyro_bias_walk_rad_per_s_per_sqrt_s: 0.0,
            accel_bias_walk_m_per_s2_per_sqrt_s: 0.0,
            gyro_turn_on_bias_rad_per_s: 0.0,
            accel_turn_on_bias_m_per_s2: 0.0,
            gyro_scale_error: 0.0,
            gyro_misalignment_rad: 0.0,
            accel_scale_error: 0.0,
            accel_misalignment_rad: 0.0,
            gyro_limit_rad_per_s: 10.0,
            accel_limit_m_per_s2: 50.0,
        },
        gyro_matrix: (0.0, 0.0),
        accel_matrix: (0.0, 0.0),
        range_offset_m: 0.0,
        clock_offset_s: 0.0,
        clock_rate: 0.0,
    }
}

pub(super) fn stamp(t_s: f64) -> Stamp {
    Stamp::from_nanos(1_000_000_000) + Span::from_seconds(t_s)
}

/// A motion along x: position, velocity and acceleration at a time.
type Along = fn(f64) -> (f64, f64, f64);

fn at_rest(_: f64) -> (f64, f64, f64) {
    (0.0, 0.0, 0.0)
}

/// Swings by 0.3 m at 2 rad/s.
fn swinging(t: f64) -> (f64, f64, f64) {
    let (sin, cos) = (2.0 * t).sin_cos();
    (0.3 * sin, 0.6 * cos, -1.2 * sin)
}

/// The bound of a head that moves along x for `seconds` in a box of 4 m, with beams along `towards`, normal to the
/// walls.
fn bound(model: BoundModel, along: Along, seconds: f64, towards: &[Vector]) -> InformationBound {
    let steps = (seconds * 1e3) as i64;
    let pose = |t_s: f64| Pose::translation(along(t_s).0, 0.0, 0.0);
    let mut information = FisherInformation::new(model, MapKnowledge::Known);
    (0..=steps).map(|ms| ms as f64 * 1e-3).for_each(|t_s| information.add_head(stamp(t_s), &pose(t_s)));
    for k in 0..=(seconds / 0.01) as i64 {
        let t_s = k as f64 * 0.01;
        let force = Vector::new(along(t_s).2, 0.0, STANDARD_GRAVITY_M_PER_S2);
        let sample = ImuSample {
            stamp: stamp(t_s),
            angular_velocity_rad_per_s: Vector::zeros(),
            specific_force_m_per_s2: force,
        };
        information.add_imu_sample(stamp(t_s), &sample);
    }
    for k in 0..beams(seconds) {
        let t_s = k as f64 * BEAM_S;
        for direction in towards {
            let origin = pose(t_s).translation.vector;
            information.add_beam(&BeamObservation {
                stamp: stamp(t_s),
                world_from_head: pose(t_s),
                velocity_in_world: Vector::x() * along(t_s).1,
                angular_velocity_in_world: Vector::zeros(),
                hit_in_world: origin + direction * (2.0 - origin.dot(direction)),
                direction_in_world: *direction,
                normal_in_world: -direction,
                range_sigma_m: SIGMA_M,
                plane: 0,
            });
        }
    }
    information.bound().unwrap()
}

/// Number of beams in each direction.
fn beams(seconds: f64) -> usize {
    (seconds / BEAM_S) as usize
}

/// Mean variance of a fit of `unknowns` parameters to `n` measurements, m^2.
///
/// `p sigma^2 / n` for any choice of parameters: the trace of a projection.
fn mean_variance(unknowns: f64, n: usize) -> f64 {
    unknowns * SIGMA_M * SIGMA_M / n as f64
}

const AXES: fn() -> [Vector; 3] = || [Vector::x(), Vector::y(), Vector::z()];

#[test]
fn a_sensor_at_rest_in_a_box_has_the_variance_of_its_unknowns() {
    // With an exact IMU the path along x and y has three unknowns each: position, velocity, and tilt, by which gravity
    // accelerates; along z it has two. Beams normal to the walls do not observe attitude.
    let seconds = 8.0;
    let found = bound(exact(), at_rest, seconds, &AXES());
    let n = beams(seconds);
    for (axis, unknowns) in [(0, 3.0), (1, 3.0), (2, 2.0)] {
        assert_relative_eq!(found.axis_rmse_m[axis].powi(2), mean_variance(unknowns, n), max_relative = 0.01);
    }
    assert_relative_eq!(found.position_rmse_m.powi(2), mean_variance(8.0, n), max_relative = 0.01);
    // An alignment removes the three unknown positions.
    assert_relative_eq!(found.aligned_position_rmse_m.powi(2), mean_variance(5.0, n), max_relative = 0.01);
}

#[test]
fn a_range_offset_is_observable_with_walls_on_two_sides_and_not_on_one() {
    let model = BoundModel { range_offset_m: 0.005, ..exact() };
    let n = beams(4.0);
    let one = bound(model.clone(), at_rest, 4.0, &[Vector::x()]);
    assert_relative_eq!(one.axis_rmse_m.x.powi(2), mean_variance(3.0, n) + 0.005_f64.powi(2), max_relative = 0.01);
    assert_relative_eq!(one.range_offset_m, 0.005, max_relative = 1e-3);
    // With walls on both sides the difference observes the position, and the sum the offset: 2 n ranges each.
    let two = bound(model, at_rest, 4.0, &[Vector::x(), -Vector::x()]);
    assert_relative_eq!(two.axis_rmse_m.x.powi(2), mean_variance(3.0, 2 * n), max_relative = 0.01);
    let information = 2.0 * n as f64 / (SIGMA_M * SIGMA_M) + 1.0 / 0.005_f64.powi(2);
    assert_relative_eq!(two.range_offset_m.powi(2), 1.0 / information, max_relative = 0.01);
}

#[test]
fn an_unknown_clock_offset_adds_one_unknown() {
    // The beams observe position + velocity t + tilt g t^2 / 2 + swing velocity times clock offset, which is also the
    // head's position in lidar time: four unknowns, or five with the clock's rate.
    let n = beams(10.0);
    let offset = BoundModel { clock_offset_s: 0.1, ..exact() };
    let found = bound(offset.clone(), swinging, 10.0, &[Vector::x()]);
    assert_relative_eq!(found.axis_rmse_m.x.powi(2), mean_variance(4.0, n), max_relative = 0.01);
    // The swing's velocity is a cosine of 0.6 m/s, nearly orthogonal to a parabola: 1 / var = n 0.6^2 / 2 / sigma^2.
    let alone = SIGMA_M / (n as f64 * 0.18).sqrt();
    assert!((1.0..1.1).contains(&(found.clock_offset_s / alone)), "{} {alone}", found.clock_offset_s);
    let both = bound(BoundModel { clock_rate: 1.0, ..offset }, swinging, 10.0, &[Vector::x()]);
    assert_relative_eq!(both.axis_rmse_m.x.powi(2), mean_variance(5.0, n), max_relative = 0.01);
}

#[test]
fn accelerometer_and_range_noise_give_the_variance_of_the_wiener_filter() {
    // Along z, where tilt has no effect: position is white acceleration noise (density q) integrated twice, measured with
    // white noise of density r = sigma^2 * 5 ms. The variance of the Wiener smoother is the integral over frequency of
    // S r / (S + r), S = q / w^4: r^(3/4) q^(1/4) / (2 sqrt 2), away from the ends.
    let density: f64 = 0.05;
    let mut model = exact();
    model.imu.accel_density_m_per_s2_per_sqrt_hz = density;
    let found = bound(model, at_rest, 20.0, &[Vector::z()]);
    let (q, r) = (density * density, SIGMA_M * SIGMA_M * BEAM_S);
    let expected = r.powf(0.75) * q.powf(0.25) / 8.0_f64.sqrt();
    let middle = found.position_sigma_m[found.position_sigma_m.len() / 2].z;
    assert_relative_eq!(middle * middle, expected, max_relative = 0.01);
    // At the end only past measurements exist: the variance of the filter, four times that of the smoother.
    let end = found.position_sigma_m.last().unwrap().z;
    assert_relative_eq!(end * end, 4.0 * expected, max_relative = 0.05);
}

#[test]
fn an_unknown_gyroscope_bias_adds_a_cubic_to_the_path() {
    // An unknown constant rate about y gives a linear tilt and so a cubic in x: a fourth unknown.
    let mut model = exact();
    model.imu.gyro_turn_on_bias_rad_per_s = 0.5;
    let found = bound(model, at_rest, 8.0, &[Vector::x()]);
    assert_relative_eq!(found.axis_rmse_m.x.powi(2), mean_variance(4.0, beams(8.0)), max_relative = 0.01);
}

#[test]
fn oblique_beams_observe_position_and_yaw() {
    // The same box with beams at 60 degrees to the walls' normals: a range changes with position by 1 / cos 60, which is
    // four times the information. Such a beam observes rotation too, so a second one from the other side separates both.
    let askew = |side: f64| Vector::new(0.5, side * 0.75_f64.sqrt(), 0.0);
    let n = beams(4.0);
    let mut information = FisherInformation::new(exact(), MapKnowledge::Known);
    (0..=4000).for_each(|ms| information.add_head(stamp(f64::from(ms) * 1e-3), &Pose::identity()));
    for k in 0..n {
        let t_s = k as f64 * BEAM_S;
        for side in [-1.0, 1.0] {
            information.add_beam(&BeamObservation {
                stamp: stamp(t_s),
                world_from_head: Pose::identity(),
                velocity_in_world: Vector::zeros(),
                angular_velocity_in_world: Vector::zeros(),
                hit_in_world: askew(side) * 4.0,
                direction_in_world: askew(side),
                normal_in_world: Vector::x(),
                range_sigma_m: SIGMA_M,
                plane: 0,
            });
        }
        let force = Vector::z() * STANDARD_GRAVITY_M_PER_S2;
        let sample = ImuSample {
            stamp: stamp(t_s),
            angular_velocity_rad_per_s: Vector::zeros(),
            specific_force_m_per_s2: force,
        };
        information.add_imu_sample(stamp(t_s), &sample);
    }
    let found = information.bound().unwrap();
    assert_relative_eq!(found.axis_rmse_m.x.powi(2), mean_variance(3.0, 2 * n) / 4.0, max_relative = 0.01);
    // Yaw: the difference of both ranges, each of which changes by rho x n / (n u) = 4 sin 60 / cos 60 m/rad.
    let yaw = SIGMA_M / (4.0 * 3.0_f64.sqrt() * (2.0 * n as f64).sqrt());
    assert_relative_eq!(found.attitude_sigma_rad[0].z, yaw, max_relative = 0.01);
}
