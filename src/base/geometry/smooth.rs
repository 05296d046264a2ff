//! Smooth interpolation of a trajectory.

use super::{Pose, Rotation, Trajectory, Vector};
use crate::time::{Span, Stamp};

/// Interpolates a trajectory with cubics, for beams fired between poses at the IMU rate.
///
/// Linear interpolation would cut the corners of a swing. Between two poses, position and the rotation vector from the
/// first of the two are cubics; the slopes at the poses are those of parabolas through three neighbouring poses (Bessel
/// tangents). Exact for constant acceleration, otherwise of third order in the pose spacing. The last cubic is cached,
/// so queries with increasing stamps are fastest.
#[derive(Debug, Clone)]
pub struct SmoothCursor<'a> {
    trajectory: &'a Trajectory,
    max_gap: Option<Span>,
    segment: Option<Segment>,
}

/// The cubics between two poses, in `u` from 0 to 1.
#[derive(Debug, Clone)]
struct Segment {
    start: Stamp,
    end: Stamp,
    from: Rotation,
    position: [Vector; 4],
    turn: [Vector; 4],
}

impl<'a> SmoothCursor<'a> {
    /// Creates a cursor over `trajectory`.
    pub fn new(trajectory: &'a Trajectory) -> Self {
        Self { trajectory, max_gap: None, segment: None }
    }

    /// Creates a cursor that has no poses within longer gaps of the trajectory.
    pub fn with_max_gap(trajectory: &'a Trajectory, max_gap: Span) -> Self {
        Self { max_gap: Some(max_gap), ..Self::new(trajectory) }
    }

    /// The pose at `stamp`; `None` outside the time span of the trajectory and within a gap.
    pub fn at(&mut self, stamp: Stamp) -> Option<Pose> {
        if !self.segment.as_ref().is_some_and(|segment| (segment.start..=segment.end).contains(&stamp)) {
            self.segment = Segment::around(self.trajectory, stamp);
        }
        let segment = self.segment.as_ref()?;
        let is_end = stamp == segment.start || stamp == segment.end;
        let is_gap = self.max_gap.is_some_and(|max_gap| segment.end - segment.start > max_gap);
        (is_end || !is_gap).then(|| segment.at(stamp))
    }
}

impl Segment {
    fn around(trajectory: &Trajectory, stamp: Stamp) -> Option<Self> {
        let (stamps, poses) = (trajectory.stamps(), trajectory.poses());
        let after = stamps.partition_point(|s| *s <= stamp);
        let first = after.checked_sub(1)?;
        if after == stamps.len() && stamps[first] != stamp {
            return None;
        }
        // The last pose belongs to the last segment, if there is one.
        let first = first.min(stamps.len().checked_sub(2)?);
        let second = first + 1;
        let (from, origin) = (poses[first].rotation, stamps[first]);
        let neighbour = |index: usize| {
            let turn = (from.inverse() * poses[index].rotation).scaled_axis();
            (stamps[index].seconds_since(origin), poses[index].translation.vector, turn)
        };
        let before = first.checked_sub(1).map(neighbour);
        let after = (second + 1 < stamps.len()).then(|| neighbour(second + 1));
        let (start, end) = (neighbour(first), neighbour(second));
        let position =
            cubic(before.map(|n| (n.0, n.1)), [(start.0, start.1), (end.0, end.1)], after.map(|n| (n.0, n.1)));
        let turn = cubic(before.map(|n| (n.0, n.2)), [(start.0, start.2), (end.0, end.2)], after.map(|n| (n.0, n.2)));
        Some(Self { start: origin, end: stamps[second], from, position, turn })
    }

    fn at(&self, stamp: Stamp) -> Pose {
        let u = stamp.seconds_since(self.start) / self.end.seconds_since(self.start);
        let value = |c: &[Vector; 4]| c[0] + (c[1] + (c[2] + c[3] * u) * u) * u;
        Pose::from_parts(value(&self.position).into(), self.from * Rotation::from_scaled_axis(value(&self.turn)))
    }
}

/// Coefficients in powers of `u` of the cubic between `ends`.
///
/// Bessel tangents; at an end without neighbour, the slope of the chord.
fn cubic(before: Option<(f64, Vector)>, ends: [(f64, Vector); 2], after: Option<(f64, Vector)>) -> [Vector; 4] {
    let [(t1, x1), (t2, x2)] = ends;
    let step = t2 - t1;
    let slope = (x2 - x1) / step;
    // Slope at a pose: that of the parabola through the pose and both neighbours.
    let at_start = before.map_or(slope, |(t0, x0)| ((x1 - x0) / (t1 - t0) * step + slope * (t1 - t0)) / (t2 - t0));
    let at_end = after.map_or(slope, |(t3, x3)| (slope * (t3 - t2) + (x3 - x2) / (t3 - t2) * step) / (t3 - t1));
    let (d1, d2, rise) = (at_start * step, at_end * step, x2 - x1);
    [x1, d1, rise * 3.0 - d1 * 2.0 - d2, d1 + d2 - rise * 2.0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::from_roll_pitch_yaw;
    use approx::assert_relative_eq;

    /// A head that pitches by 45 degrees at 1.3 Hz and sways in phase.
    fn swing(t_s: f64) -> Pose {
        let angle = std::f64::consts::FRAC_PI_4 * (8.17 * t_s).sin();
        Pose::from_parts(Vector::new(0.1 * angle, t_s, 0.0).into(), from_roll_pitch_yaw(0.0, angle, 0.3 * t_s))
    }

    fn sampled(step_ms: i64) -> Trajectory {
        let pose = |k: i64| (Stamp::from_nanos(k * step_ms * 1_000_000), swing((k * step_ms) as f64 * 1e-3));
        Trajectory::from_poses((0..=1000 / step_ms).map(pose)).unwrap()
    }

    /// Largest angle between the exact and the interpolated rotation, rad, except near the ends.
    fn worst(step_ms: i64) -> f64 {
        let trajectory = sampled(step_ms);
        let mut cursor = SmoothCursor::new(&trajectory);
        let error = |us: i64| {
            let pose = cursor.at(Stamp::from_nanos(us * 1000)).unwrap();
            pose.rotation.angle_to(&swing(us as f64 * 1e-6).rotation)
        };
        (100_000..900_000).step_by(313).map(error).fold(0.0, f64::max)
    }

    #[test]
    fn a_swing_sampled_at_100_hz_is_interpolated_within_10_microradians() {
        // Error bound: Bessel slopes have an error of f''' h^2 / 6, which the cubic turns into at most 0.096 f''' h^3 /
        // 6. With f''' = (pi/4) 8.17^3 = 428 rad/s^3 and h = 10 ms that is 6.8e-6 rad. Linear interpolation would have
        // 6.5e-4 rad.
        assert!(worst(10) < 8e-6, "{}", worst(10));
        assert_relative_eq!(worst(20) / worst(10), 8.0, epsilon = 1.0);
    }

    #[test]
    fn interpolation_is_exact_at_poses_and_none_outside_the_span() {
        let trajectory = sampled(10);
        let mut cursor = SmoothCursor::new(&trajectory);
        for (stamp, pose) in trajectory.iter() {
            assert_relative_eq!(cursor.at(stamp).unwrap().to_homogeneous(), pose.to_homogeneous(), epsilon = 1e-12);
        }
        assert_eq!(cursor.at(Stamp::from_nanos(-1)), None);
        assert_eq!(cursor.at(Stamp::from_nanos(1_000_000_001)), None);
        assert_eq!(SmoothCursor::new(&Trajectory::new()).at(Stamp::from_nanos(0)), None);
    }

    #[test]
    fn there_are_no_poses_within_a_gap() {
        let stamp = |ms: i64| Stamp::from_nanos(ms * 1_000_000);
        let poses = [0, 10, 20, 1020, 1030].map(|ms| (stamp(ms), swing(ms as f64 * 1e-3)));
        let trajectory = Trajectory::from_poses(poses).unwrap();
        let mut cursor = SmoothCursor::with_max_gap(&trajectory, Span::from_seconds(0.1));
        let known = [0, 5, 20, 21, 500, 1019, 1020, 1025].map(|ms| cursor.at(stamp(ms)).is_some());
        assert_eq!(known, [true, true, true, false, false, false, true, true]);
        assert!(SmoothCursor::new(&trajectory).at(stamp(500)).is_some());
    }
}
