use nalgebra::{Quaternion, Unit};
use zsim_base::geometry::{Kinematics, Pose, Rotation, Vector};

/// Motion of a frame over an interval: kinematics at evenly spaced nodes, interpolated between them.
///
/// Position and rotation vector are interpolated by cubic Hermite polynomials from node to node (as by
/// [`Kinematics::pose_towards`]); the coefficients are computed once per step. For a sinusoid of frequency `f` and
/// amplitude `A` the error is at most `A (2 pi f h)^4 / 384`: 0.4 um at 100 Hz, 1 mm and steps of 1 ms. A head on a
/// spring moves at 20 Hz at most. A step must rotate by less than 0.1 rad, otherwise the series used here lose
/// accuracy.
#[derive(Debug, Clone)]
pub struct Track {
    first: u64,
    step_s: f64,
    nodes: Vec<Kinematics>,
    segments: Vec<Segment>,
}

/// Polynomials from one node to the next: position, and rotation vector from the node's rotation, in `u` from 0 to 1.
#[derive(Debug, Clone, Copy)]
struct Segment {
    position: [Vector; 4],
    turn: [Vector; 3],
    rotation: Rotation,
}

impl Track {
    /// The track through `nodes` at the times `first step_s`, `(first + 1) step_s`, ... after the start.
    ///
    /// Times are computed from the step count, so that a time has the same bits in all tracks. `None` for fewer than
    /// two nodes.
    pub fn new(first: u64, step_s: f64, nodes: Vec<Kinematics>) -> Option<Self> {
        if nodes.len() < 2 {
            return None;
        }
        let segments = nodes.windows(2).map(|pair| Segment::between(&pair[0], &pair[1], step_s)).collect();
        Some(Self { first, step_s, nodes, segments })
    }

    /// Time of the first and the last node, s after the start.
    pub fn span_s(&self) -> (f64, f64) {
        let last = self.first + self.segments.len() as u64;
        (self.first as f64 * self.step_s, last as f64 * self.step_s)
    }

    /// The track of another frame that is fixed to the same body.
    pub fn of_frame(&self, body_from_frame: &Pose) -> Self {
        let nodes: Vec<Kinematics> = self.nodes.iter().map(|node| node.of_frame(body_from_frame)).collect();
        let segments = nodes.windows(2).map(|pair| Segment::between(&pair[0], &pair[1], self.step_s)).collect();
        Self { nodes, segments, ..*self }
    }

    /// `world_from_frame` at `t_s`; outside the interval the first or last polynomial is extrapolated.
    pub fn pose(&self, t_s: f64) -> Pose {
        let (index, u) = self.locate(t_s);
        self.segments[index].pose(u)
    }

    /// Pose, velocities and accelerations at `t_s`: velocities interpolated by cubics, accelerations linearly.
    pub fn kinematics(&self, t_s: f64) -> Kinematics {
        let (index, u) = self.locate(t_s);
        let (a, b) = (&self.nodes[index], &self.nodes[index + 1]);
        let hermite = |p0: &Vector, v0: &Vector, p1: &Vector, v1: &Vector| {
            let (h10, h01, h11) = (u * (1.0 - u) * (1.0 - u), u * u * (3.0 - 2.0 * u), u * u * (u - 1.0));
            p0 + (p1 - p0) * h01 + (v0 * h10 + v1 * h11) * self.step_s
        };
        Kinematics {
            world_from_body: self.segments[index].pose(u),
            velocity_in_world: hermite(
                &a.velocity_in_world,
                &a.acceleration_in_world,
                &b.velocity_in_world,
                &b.acceleration_in_world,
            ),
            angular_velocity_in_world: hermite(
                &a.angular_velocity_in_world,
                &a.angular_acceleration_in_world,
                &b.angular_velocity_in_world,
                &b.angular_acceleration_in_world,
            ),
            acceleration_in_world: a.acceleration_in_world.lerp(&b.acceleration_in_world, u),
            angular_acceleration_in_world: a.angular_acceleration_in_world.lerp(&b.angular_acceleration_in_world, u),
        }
    }

    /// Upper bound of the displacement, m, of points fixed to the frame and at most `reach_m` from its origin, from where
    /// they are with the frame at `world_from_frame` to where they are at any time from `from_s` to `to_s`.
    pub fn displacement_m(&self, (from_s, to_s): (f64, f64), world_from_frame: &Pose, reach_m: f64) -> f64 {
        let ((first, _), (last, _)) = (self.locate(from_s), self.locate(to_s));
        let of = |segment: &Segment| {
            let start = segment.pose(0.0);
            let shift_m = (start.translation.vector - world_from_frame.translation.vector).norm();
            let turn_rad = start.rotation.angle_to(&world_from_frame.rotation);
            shift_m + segment.length_m() + (turn_rad + segment.turn_rad()) * reach_m
        };
        self.segments[first..=last].iter().map(of).fold(0.0, f64::max)
    }

    fn locate(&self, t_s: f64) -> (usize, f64) {
        let steps = t_s / self.step_s - self.first as f64;
        let index = (steps.max(0.0) as usize).min(self.segments.len() - 1);
        (index, steps - index as f64)
    }
}

impl Segment {
    fn between(a: &Kinematics, b: &Kinematics, step_s: f64) -> Self {
        let start = a.world_from_body.translation.vector;
        let (v0, v1) = (a.velocity_in_world * step_s, b.velocity_in_world * step_s);
        let offset = b.world_from_body.translation.vector - start;

        let rotation = a.world_from_body.rotation;
        let turn = (b.world_from_body.rotation * rotation.inverse()).scaled_axis();
        // Rate of the rotation vector at the end, J_l(turn)^-1 omega, as a series: the next term is turn^4 / 720.
        let omega = b.angular_velocity_in_world * step_s;
        let cross = turn.cross(&omega);
        let rate_at_end = omega - cross * 0.5 + turn.cross(&cross) / 12.0;
        let rate_at_start = a.angular_velocity_in_world * step_s;
        Self {
            position: [start, v0, offset * 3.0 - v0 * 2.0 - v1, v0 + v1 - offset * 2.0],
            turn: [
                rate_at_start,
                turn * 3.0 - rate_at_start * 2.0 - rate_at_end,
                rate_at_start + rate_at_end - turn * 2.0,
            ],
            rotation,
        }
    }

    /// Upper bound of the shift from the start within the step, m.
    fn length_m(&self) -> f64 {
        self.position[1..].iter().map(Vector::norm).sum()
    }

    /// Upper bound of the rotation from the start within the step, rad.
    fn turn_rad(&self) -> f64 {
        self.turn.iter().map(Vector::norm).sum()
    }

    fn pose(&self, u: f64) -> Pose {
        let [p0, p1, p2, p3] = &self.position;
        let [r1, r2, r3] = &self.turn;
        let position = p0 + (p1 + (p2 + p3 * u) * u) * u;
        let turn = (r1 + (r2 + r3 * u) * u) * u;
        Pose::from_parts(position.into(), small_rotation(&turn) * self.rotation)
    }
}

/// Rotation by a rotation vector below 0.1 rad: series of cosine and sine of the half angle, exact to 1e-15.
fn small_rotation(turn: &Vector) -> Rotation {
    let h2 = turn.norm_squared() * 0.25;
    let cos = 1.0 - h2 * (0.5 - h2 * (1.0 / 24.0 - h2 / 720.0));
    let half_sinc = 0.5 - h2 * (1.0 / 12.0 - h2 * (1.0 / 240.0 - h2 / 10_080.0));
    Unit::new_unchecked(Quaternion::from_parts(cos, turn * half_sinc))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::geometry::from_roll_pitch_yaw;

    /// A body that rotates about y and moves along y, both as sinusoids at 2 Hz.
    fn nodding(t_s: f64) -> Kinematics {
        let w = 4.0 * std::f64::consts::PI;
        let (sin, cos) = (w * t_s).sin_cos();
        Kinematics {
            world_from_body: Pose::from_parts(
                Vector::new(0.0, 0.3 * sin, 1.0).into(),
                from_roll_pitch_yaw(0.0, 0.8 * sin, 0.0),
            ),
            velocity_in_world: Vector::y() * (0.3 * w * cos),
            angular_velocity_in_world: Vector::y() * (0.8 * w * cos),
            acceleration_in_world: Vector::y() * (-0.3 * w * w * sin),
            angular_acceleration_in_world: Vector::y() * (-0.8 * w * w * sin),
        }
    }

    fn track(first: u64, steps: usize) -> Track {
        Track::new(first, 1e-3, (0..=steps).map(|k| nodding((first + k as u64) as f64 * 1e-3)).collect()).unwrap()
    }

    #[test]
    fn the_track_reproduces_the_motion_between_nodes() {
        // Cubic Hermite: A (w h)^4 / 384 = 0.8 (0.01257)^4 / 384 = 5e-11 in the angle, less in position.
        let track = track(100, 200);
        for t in [0.1, 0.1234567, 0.2, 0.29999, 0.3] {
            let (expected, found) = (nodding(t), track.kinematics(t));
            assert_relative_eq!(found.world_from_body, expected.world_from_body, epsilon = 1e-10);
            assert_relative_eq!(track.pose(t), expected.world_from_body, epsilon = 1e-10);
            assert_relative_eq!(found.velocity_in_world, expected.velocity_in_world, epsilon = 1e-8);
            assert_relative_eq!(found.angular_velocity_in_world, expected.angular_velocity_in_world, epsilon = 1e-8);
            // Linear: A w^4 h^2 / 8 = 2.5e-3 / 1e3 m/s^2 at most.
            assert_relative_eq!(found.acceleration_in_world, expected.acceleration_in_world, epsilon = 3e-3);
        }
    }

    #[test]
    fn the_track_of_another_frame_is_the_motion_of_that_frame() {
        let arm = Pose::from_parts(Vector::new(0.1, -0.2, 0.05).into(), from_roll_pitch_yaw(0.4, 0.1, 2.0));
        let laser = track(0, 50).of_frame(&arm);
        let expected = nodding(0.0203).of_frame(&arm);
        assert_relative_eq!(laser.pose(0.0203), expected.world_from_body, epsilon = 1e-9);
        assert_relative_eq!(laser.kinematics(0.0203).velocity_in_world, expected.velocity_in_world, epsilon = 1e-7);
    }

    #[test]
    fn the_track_agrees_with_pose_towards() {
        let (a, b) = (nodding(0.4), nodding(0.401));
        let ours = Track::new(400, 1e-3, vec![a, b]).unwrap().pose(0.4007);
        assert_relative_eq!(ours, a.pose_towards(&b, 1e-3, 0.7), epsilon = 1e-12);
    }

    #[test]
    fn a_single_node_is_not_a_track() {
        assert!(Track::new(0, 1e-3, vec![nodding(0.0)]).is_none());
    }
}
