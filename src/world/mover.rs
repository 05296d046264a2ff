//! Movers: rigid groups of triangles that follow timed waypoints.

use super::MaterialId;
use super::caster::{Caster, Crossing};
use super::triangle::Triangle;
use zsim_base::geometry::{Pose, Vector};

/// A rigid group of triangles that follows waypoints.
pub(super) struct Mover {
    surfaces: Caster,
    path: Path,
    /// Radius of the bounding sphere about the origin of the mover's frame, m.
    radius: f64,
}

impl Mover {
    pub fn new(surfaces: Caster, path: Path) -> Self {
        let (lower, upper) = surfaces.bounds();
        let radius = lower.abs().sup(&upper.abs()).norm();
        Self { surfaces, path, radius }
    }

    /// The triangles at `time_s`: corners in the world, and material.
    pub fn triangles(&self, time_s: f64) -> impl Iterator<Item = (Triangle, MaterialId)> + '_ {
        let world_from_body = self.path.at(time_s);
        let place = move |corner: Vector| world_from_body.transform_point(&corner.into()).coords;
        self.surfaces.triangles().map(move |(triangle, material)| (triangle.map(place), material))
    }

    /// The first intersection with a ray at `time_s`, within `reach`.
    pub fn cast(&self, origin: &Vector, direction: &Vector, reach: f64, time_s: f64) -> Option<Crossing> {
        let world_from_body = self.path.at(time_s);
        // Skip the mover if the ray misses the bounding sphere, or the sphere is behind the origin or out of range.
        let to_middle = world_from_body.translation.vector - origin;
        let along = to_middle.dot(direction);
        let distance2 = to_middle.norm_squared() - along * along;
        if distance2 > self.radius * self.radius || along < -self.radius || along > reach + self.radius {
            return None;
        }
        let origin = world_from_body.inverse_transform_point(&(*origin).into()).coords;
        let direction = world_from_body.inverse_transform_vector(direction);
        let mut crossing = self.surfaces.cast(&origin, &direction, reach)?;
        crossing.normal = world_from_body * crossing.normal;
        Some(crossing)
    }

    /// Distance of a point from the surfaces at `time_s`; `None` above `reach`.
    pub fn distance(&self, point: &Vector, reach: f64, time_s: f64) -> Option<f64> {
        let world_from_body = self.path.at(time_s);
        if (point - world_from_body.translation.vector).norm() > self.radius + reach {
            return None;
        }
        let in_body = world_from_body.inverse_transform_point(&(*point).into()).coords;
        Some((self.surfaces.nearest(&in_body, reach)?.0.point_in_world - in_body).norm())
    }
}

/// Poses at increasing times.
pub(super) struct Path {
    times: Vec<f64>,
    poses: Vec<Pose>,
    repeats: bool,
}

impl Path {
    /// A path through at least one pose; times in seconds, increasing.
    pub fn new(waypoints: &[(f64, Pose)], repeats: bool) -> Self {
        let (times, poses) = waypoints.iter().copied().unzip();
        Self { times, poses, repeats }
    }

    /// The pose at a time, interpolated linearly; constant before the first and after the last waypoint unless it
    /// repeats.
    pub fn at(&self, time_s: f64) -> Pose {
        let (first, last) = (self.times[0], self.times[self.times.len() - 1]);
        let time = if self.repeats && last > first {
            first + (time_s - first).rem_euclid(last - first)
        } else {
            time_s.clamp(first, last)
        };
        let next = self.times.partition_point(|t| *t <= time).min(self.times.len() - 1);
        let before = next.saturating_sub(1);
        if next == before {
            return self.poses[next];
        }
        let fraction = (time - self.times[before]) / (self.times[next] - self.times[before]);
        let (from, to) = (&self.poses[before], &self.poses[next]);
        let position = from.translation.vector.lerp(&to.translation.vector, fraction);
        // Shorter rotation. Half a turn has none: then the rotation jumps at the end.
        let rotation = from.rotation.try_slerp(&to.rotation, fraction, 1e-9).unwrap_or(from.rotation);
        Pose::from_parts(position.into(), rotation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::geometry::from_roll_pitch_yaw;

    fn path(repeats: bool) -> Path {
        let pose =
            |x: f64, yaw: f64| Pose::from_parts(Vector::new(x, 0.0, 0.0).into(), from_roll_pitch_yaw(0.0, 0.0, yaw));
        Path::new(&[(1.0, pose(0.0, 0.0)), (3.0, pose(4.0, 1.0)), (4.0, pose(4.0, 1.0))], repeats)
    }

    #[test]
    fn a_mover_goes_steadily_between_waypoints_and_holds_at_the_ends() {
        let path = path(false);
        for (time, x, yaw) in [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.5, 1.0, 0.25), (3.0, 4.0, 1.0), (9.0, 4.0, 1.0)] {
            let pose = path.at(time);
            assert_relative_eq!(pose.translation.vector.x, x, epsilon = 1e-12);
            assert_relative_eq!(pose.rotation.angle(), yaw, epsilon = 1e-12);
        }
    }

    #[test]
    fn a_mover_that_repeats_is_where_it_was_a_period_ago() {
        let path = path(true);
        for time in [1.2, 2.0, 3.7] {
            assert_relative_eq!(path.at(time + 3.0), path.at(time), epsilon = 1e-12);
            assert_relative_eq!(path.at(time - 6.0), path.at(time), epsilon = 1e-12);
        }
    }
}
