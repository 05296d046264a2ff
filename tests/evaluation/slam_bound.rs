//! The information bound with an unknown map, compared with dense least squares on small problems.

use super::bound::{exact, stamp};
use approx::assert_relative_eq;
use nalgebra::{DMatrix, DVector};
use rand_distr::{Distribution, StandardNormal};
use zsim::evaluation::{BeamObservation, BoundModel, FisherInformation, InformationBound, MapKnowledge};
use zsim::geometry::{Pose, Rotation, STANDARD_GRAVITY_M_PER_S2, Vector};
use zsim::measurement::ImuSample;
use zsim::random::Seed;

/// Standard deviation of a range, m.
pub(super) const SIGMA_M: f64 = 0.01;
/// Interval between the epochs of the bound, s.
pub(super) const EPOCH_S: f64 = 0.02;

/// A beam of the room: time, direction in the head, wall.
#[derive(Clone, Copy)]
struct Beam {
    epoch: usize,
    direction_in_head: Vector,
    wall: usize,
}

/// A wall: `normal . x = offset`.
#[derive(Clone, Copy)]
struct Wall {
    normal: Vector,
    offset_m: f64,
}

/// A head that moves and turns in a room, in a world that is turned about the vertical and shifted.
struct Room {
    walls: Vec<Wall>,
    beams: Vec<Beam>,
    seconds: f64,
    world_from_room: Pose,
}

/// True pose in the room.
fn room_from_head(t: f64) -> Pose {
    let position = Vector::new(0.5 * t.sin(), 0.4 * (1.0 - t.cos()), 0.1 * (2.0 * t).sin());
    let yaw = Rotation::from_axis_angle(&Vector::z_axis(), 0.8 * (0.9 * t).sin());
    let pitch = Rotation::from_axis_angle(&Vector::y_axis(), 0.3 * (1.3 * t).sin());
    Pose::from_parts(position.into(), yaw * pitch)
}

impl Room {
    /// A box of 5 x 4 x 3 m with a slanted roof, and random beams at each epoch; each wall is seen for a part of the run.
    fn new(seconds: f64) -> Self {
        let wall = |x: f64, y: f64, z: f64, offset_m: f64| Wall { normal: Vector::new(x, y, z).normalize(), offset_m };
        let walls = vec![
            wall(1.0, 0.0, 0.0, 2.5),
            wall(-1.0, 0.0, 0.0, 2.5),
            wall(0.0, 1.0, 0.0, 2.0),
            wall(0.0, -1.0, 0.0, 2.0),
            wall(0.2, 0.1, 1.0, 1.5),
            wall(0.0, 0.0, -1.0, 1.3),
        ];
        let mut stream = Seed(4).stream("beams");
        let mut room = Self { walls, beams: Vec::new(), seconds, world_from_room: Pose::identity() };
        for epoch in 0..room.epochs() {
            let pose = room_from_head(epoch as f64 * EPOCH_S);
            for _ in 0..15 {
                let mut draw = || StandardNormal.sample(&mut stream);
                let direction = Vector::new(draw(), draw(), draw()).normalize();
                let along = pose.rotation * direction;
                let position = pose.translation.vector;
                // The first wall that the beam meets.
                let range = |wall: &Wall| (wall.offset_m - wall.normal.dot(&position)) / wall.normal.dot(&along);
                let ranges = room.walls.iter().map(range).enumerate().filter(|(_, range)| *range > 0.0);
                let (wall, _) = ranges.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
                let is_grazing = room.walls[wall].normal.dot(&along).abs() < 0.2;
                if !is_grazing && (wall + epoch / 30) % 3 != 0 {
                    room.beams.push(Beam { epoch, direction_in_head: direction, wall });
                }
            }
        }
        room
    }

    fn epochs(&self) -> usize {
        (self.seconds / EPOCH_S) as usize + 1
    }

    fn pose(&self, t: f64) -> Pose {
        self.world_from_room * room_from_head(t)
    }

    /// Velocity, m/s, and acceleration, m/s^2, by central differences.
    fn derivatives(&self, t: f64) -> (Vector, Vector) {
        let at = |t: f64| self.pose(t).translation.vector;
        let h = 1e-4;
        ((at(t + h) - at(t - h)) / (2.0 * h), (at(t + h) - at(t) * 2.0 + at(t - h)) / (h * h))
    }

    fn imu(&self, t: f64) -> ImuSample {
        let (rotation, h) = (self.pose(t).rotation, 1e-4);
        let turn = self.pose(t - h).rotation.inverse() * self.pose(t + h).rotation;
        let up = Vector::z() * STANDARD_GRAVITY_M_PER_S2;
        ImuSample {
            stamp: stamp(t),
            angular_velocity_rad_per_s: turn.scaled_axis() / (2.0 * h),
            specific_force_m_per_s2: rotation.inverse() * (self.derivatives(t).1 + up),
        }
    }

    /// A wall in the world.
    fn wall(&self, wall: usize) -> Wall {
        let Wall { normal, offset_m } = self.walls[wall];
        let normal = self.world_from_room.rotation * normal;
        Wall { normal, offset_m: offset_m + normal.dot(&self.world_from_room.translation.vector) }
    }

    /// The bound.
    fn bound(&self, model: BoundModel, map: MapKnowledge) -> InformationBound {
        let mut information = FisherInformation::new(model, map);
        for ms in 0..=(self.seconds * 1e3).round() as i64 {
            let t = ms as f64 * 1e-3;
            information.add_head(stamp(t), &self.pose(t));
        }
        // At the middles of intervals of 5 ms, so that the mean of an epoch is that at its stamp.
        for k in 0..(self.seconds / 0.005).round() as usize {
            let t = (k as f64 + 0.5) * 0.005;
            information.add_imu_sample(stamp(t), &self.imu(t));
        }
        for beam in &self.beams {
            let t = beam.epoch as f64 * EPOCH_S;
            let (pose, wall) = (self.pose(t), self.wall(beam.wall));
            let direction = pose.rotation * beam.direction_in_head;
            let origin = pose.translation.vector;
            let range = (wall.offset_m - wall.normal.dot(&origin)) / wall.normal.dot(&direction);
            information.add_beam(&BeamObservation {
                stamp: stamp(t),
                world_from_head: pose,
                velocity_in_world: self.derivatives(t).0,
                angular_velocity_in_world: pose.rotation * self.imu(t).angular_velocity_rad_per_s,
                hit_in_world: origin + direction * range,
                direction_in_world: direction,
                normal_in_world: wall.normal,
                range_sigma_m: SIGMA_M,
                plane: 10 * beam.wall as u32,
            });
        }
        information.bound().unwrap()
    }
}

/// Pose at a time if the IMU is exact, for errors of the start: rotation vector, velocity, position.
///
/// The IMU gives the specific force in the head; its double integral is the path less the start and free fall.
fn pose_with(room: &Room, t: f64, start: &[f64]) -> Pose {
    let turn = Rotation::from_scaled_axis(Vector::new(start[0], start[1], start[2]));
    let [velocity, position] = [3, 6].map(|k| Vector::new(start[k], start[k + 1], start[k + 2]));
    let (pose, first) = (room.pose(t), room.pose(0.0).translation.vector);
    let fall = Vector::z() * (0.5 * STANDARD_GRAVITY_M_PER_S2 * t * t);
    let forced = pose.translation.vector - first - room.derivatives(0.0).0 * t + fall;
    let moved = first + room.derivatives(0.0).0 * t - fall + position + velocity * t + turn * forced;
    Pose::from_parts(moved.into(), turn * pose.rotation)
}

/// Central differences of `f` about zero.
fn jacobian(unknowns: usize, rows: usize, f: &dyn Fn(&[f64]) -> Vec<f64>) -> DMatrix<f64> {
    let mut jacobian = DMatrix::zeros(rows, unknowns);
    let h = 1e-5;
    for column in 0..unknowns {
        let mut at = vec![0.0; unknowns];
        at[column] = h;
        let ahead = f(&at);
        at[column] = -h;
        let difference = DVector::from_vec(ahead) - DVector::from_vec(f(&at));
        jacobian.set_column(column, &(difference / (2.0 * h)));
    }
    jacobian
}

/// RMSE of position, m, and attitude, rad, after the alignment, and standard deviation of the position at the end, m: by the
/// inverse of the dense information matrix, over poses at `times`.
fn dense(room: &Room, map: MapKnowledge, times: &[f64]) -> (f64, f64, Vector) {
    let unknowns = if map == MapKnowledge::Unknown { 9 + 4 * room.walls.len() } else { 9 };
    let ranges = |at: &[f64]| -> Vec<f64> {
        let range = |beam: &Beam| {
            let pose = pose_with(room, beam.epoch as f64 * EPOCH_S, at);
            let Wall { mut normal, mut offset_m } = room.wall(beam.wall);
            if at.len() > 9 {
                let errors = &at[9 + 4 * beam.wall..][..4];
                normal += Vector::new(errors[0], errors[1], errors[2]);
                offset_m += errors[3];
            }
            let direction = pose.rotation * beam.direction_in_head;
            (offset_m - normal.dot(&pose.translation.vector)) / normal.dot(&direction)
        };
        room.beams.iter().map(range).collect()
    };
    let sensed = jacobian(unknowns, room.beams.len(), &ranges) / SIGMA_M;
    let mut information = sensed.transpose() * &sensed;
    if map == MapKnowledge::Unknown {
        // Reference: heading and position of the start. The scale of the equation of a wall is no unknown.
        [2, 6, 7, 8].iter().for_each(|k| information[(*k, *k)] += 1e12);
        (0..unknowns).for_each(|k| information[(k, k)] += 1e-2);
    }
    let covariance = information.cholesky().unwrap().inverse();
    let poses = |at: &[f64]| -> Vec<f64> {
        let error = |t: &f64| {
            let (pose, truth) = (pose_with(room, *t, at), room.pose(*t));
            let shift = pose.translation.vector - truth.translation.vector;
            let turn = (pose.rotation * truth.rotation.inverse()).scaled_axis();
            [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z]
        };
        times.iter().flat_map(error).collect()
    };
    let errors = jacobian(unknowns, 6 * times.len(), &poses);
    let joint = &errors * covariance * errors.transpose();
    let weights = weights(times);
    let alignment = alignment(room, times, &weights);
    let aligned = &alignment * &joint * alignment.transpose();
    let mean_square = |of: std::ops::Range<usize>| {
        (0..aligned.nrows()).filter(|k| of.contains(&(k % 6))).map(|k| weights[k / 6] * aligned[(k, k)]).sum::<f64>()
    };
    let end = joint.nrows() - 6;
    let at_end = Vector::from_fn(|axis, _| aligned[(end + axis, end + axis)].sqrt());
    (mean_square(0..3).sqrt(), mean_square(3..6).sqrt(), at_end)
}

/// Weights of a mean over time, by the trapezoidal rule.
pub(super) fn weights(times: &[f64]) -> Vec<f64> {
    let last = times.len() - 1;
    (0..=last).map(|k| (times[(k + 1).min(last)] - times[k.max(1) - 1]) / 2.0 / (times[last] - times[0])).collect()
}

/// Times of the errors of a bound since the start, s.
pub(super) fn times(bound: &InformationBound) -> Vec<f64> {
    bound.stamps.iter().map(|at| at.seconds_since(stamp(0.0))).collect()
}

/// Errors of position and attitude after a rigid alignment of the positions, from those before: a least-squares fit.
fn alignment(room: &Room, times: &[f64], weights: &[f64]) -> DMatrix<f64> {
    let heads: Vec<Vector> = times.iter().map(|t| room.pose(*t).translation.vector).collect();
    let mut rigid = DMatrix::<f64>::zeros(6 * times.len(), 6);
    let mut positions = DMatrix::<f64>::zeros(3 * times.len(), 6 * times.len());
    for (k, head) in heads.iter().enumerate() {
        for axis in 0..3 {
            rigid[(6 * k + axis, axis)] = 1.0;
            rigid[(6 * k + 3 + axis, 3 + axis)] = 1.0;
            positions[(3 * k + axis, 6 * k + axis)] = 1.0;
            let turn = Vector::ith(axis, 1.0).cross(head);
            (0..3).for_each(|row| rigid[(6 * k + row, 3 + axis)] = turn[row]);
        }
    }
    let weights =
        DMatrix::from_diagonal(&DVector::from_iterator(3 * times.len(), (0..3 * times.len()).map(|k| weights[k / 3])));
    let moved = &positions * &rigid;
    let fit = (moved.transpose() * &weights * &moved).try_inverse().unwrap() * moved.transpose() * weights * positions;
    DMatrix::identity(6 * times.len(), 6 * times.len()) - rigid * fit
}

#[test]
fn a_room_has_the_covariance_of_dense_least_squares() {
    // An exact IMU leaves the pose and velocity of the start unknown, and the walls. The reference differentiates the exact
    // ranges numerically and inverts one dense matrix.
    let room = Room::new(4.0);
    let found = room.bound(exact(), MapKnowledge::Unknown);
    let (position_m, attitude_rad, end_m) = dense(&room, MapKnowledge::Unknown, &times(&found));
    assert_relative_eq!(found.aligned_position_rmse_m, position_m, max_relative = 0.002);
    assert_relative_eq!(found.attitude_rmse_rad, attitude_rad, max_relative = 0.002);
    assert_relative_eq!(found.position_sigma_m.last().unwrap(), &end_m, max_relative = 0.005);
    assert_eq!(found.unknown_map.as_ref().unwrap().planes, 6);
    // The same for the known map.
    let known = room.bound(exact(), MapKnowledge::Known);
    let (position_m, ..) = dense(&room, MapKnowledge::Known, &times(&found));
    assert_relative_eq!(known.aligned_position_rmse_m, position_m, max_relative = 0.01);
}

/// A model with the errors of a cheap IMU, unknown clock and range offset.
fn usual() -> BoundModel {
    let mut model = exact();
    model.imu.gyro_density_rad_per_s_per_sqrt_hz = 1e-3;
    model.imu.accel_density_m_per_s2_per_sqrt_hz = 1e-2;
    model.imu.gyro_bias_walk_rad_per_s_per_sqrt_s = 1e-4;
    model.imu.accel_bias_walk_m_per_s2_per_sqrt_s = 1e-3;
    model.imu.gyro_turn_on_bias_rad_per_s = 0.01;
    model.imu.accel_turn_on_bias_m_per_s2 = 0.1;
    let head_from_imu = Pose::translation(0.03, -0.02, 0.05);
    BoundModel {
        head_from_imu,
        gyro_matrix: (0.01, 0.005),
        accel_matrix: (0.01, 0.005),
        range_offset_m: 0.01,
        clock_offset_s: 0.01,
        clock_rate: 1e-4,
        ..model
    }
}

#[test]
fn an_unknown_map_costs_accuracy_and_more_beams_gain_it() {
    let mut room = Room::new(4.0);
    let known = room.bound(usual(), MapKnowledge::Known);
    let unknown = room.bound(usual(), MapKnowledge::Unknown);
    assert!(unknown.aligned_position_rmse_m > 1.05 * known.aligned_position_rmse_m);
    assert!(unknown.range_offset_m > known.range_offset_m);
    let all = std::mem::take(&mut room.beams);
    let mut before: Option<InformationBound> = None;
    for every in [4, 2, 1] {
        room.beams = all.iter().step_by(every).copied().collect();
        let found = room.bound(usual(), MapKnowledge::Unknown);
        if let Some(before) = before {
            assert!(found.aligned_position_rmse_m < before.aligned_position_rmse_m);
            let sigmas = found.position_sigma_m.iter().zip(&before.position_sigma_m);
            sigmas.for_each(|(with, without)| assert!(with < without, "{with} {without}"));
        }
        before = Some(found);
    }
}

#[test]
fn the_bound_is_that_of_the_room_wherever_it_is_in_the_world() {
    let mut room = Room::new(3.0);
    let here = room.bound(usual(), MapKnowledge::Unknown);
    room.world_from_room =
        Pose::from_parts(Vector::new(40.0, -25.0, 8.0).into(), Rotation::from_axis_angle(&Vector::z_axis(), 2.1));
    let there = room.bound(usual(), MapKnowledge::Unknown);
    assert_relative_eq!(here.aligned_position_rmse_m, there.aligned_position_rmse_m, max_relative = 1e-5);
    assert_relative_eq!(here.attitude_rmse_rad, there.attitude_rmse_rad, max_relative = 1e-5);
    assert_relative_eq!(here.clock_offset_s, there.clock_offset_s, max_relative = 1e-5);
}

#[test]
fn planes_with_too_few_beams_carry_no_information() {
    // Each of three beams on a plane of its own determines one of its unknowns, and nothing else.
    let mut room = Room::new(3.0);
    let without = room.bound(usual(), MapKnowledge::Unknown);
    let first = room.walls.len();
    for k in 0..3 {
        room.walls.push(Wall { normal: Vector::new(1.0, 0.3, 0.2).normalize(), offset_m: 1.5 });
        let direction_in_head = Vector::new(1.0, 0.1 * k as f64, 0.05).normalize();
        // Two in the same segment, one each in others.
        [5, 10, 80]
            .iter()
            .take(k + 1)
            .for_each(|epoch| room.beams.push(Beam { epoch: *epoch, direction_in_head, wall: first + k }));
    }
    let with = room.bound(usual(), MapKnowledge::Unknown);
    assert_relative_eq!(with.aligned_position_rmse_m, without.aligned_position_rmse_m, max_relative = 1e-5);
}

#[test]
fn a_recording_that_is_too_long_is_refused() {
    let mut information = FisherInformation::new(exact(), MapKnowledge::Unknown);
    (0..=31_000).for_each(|step| information.add_head(stamp(f64::from(step) * 0.01), &Pose::identity()));
    let message = information.bound().unwrap_err().to_string();
    assert!(message.contains("limited to 300 s of trajectory, and there are 310 s"), "{message}");
}
