//! A trajectory followed smoothly.

use super::{Pose, Rotation, Trajectory, Vector};
use crate::time::Stamp;

/// Tells a trajectory's pose at any instant, smoothly between its poses: for beams that are fired between the poses of
/// an IMU's rate, where straight lines would cut the corners of a swing.
///
/// Between two poses it is a cubic in position and in the rotation vector from the first of the two, with the slopes
/// that parabolas through three neighbouring poses have (Bessel tangents): exact for motion with constant acceleration,
/// of third order in the poses' spacing for any other. Made for instants that go forward in time: the cubic is kept.
#[derive(Debug, Clone)]
pub struct SmoothCursor<'a> {
    trajectory: &'a Trajectory,
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
    /// A cursor over `trajectory`.
    pub fn new(trajectory: &'a Trajectory) -> Self {
        Self { trajectory, segment: None }
    }

    /// The pose at `stamp`, or `None` outside the trajectory's span.
    pub fn at(&mut self, stamp: Stamp) -> Option<Pose> {
        if !self.segment.as_ref().is_some_and(|segment| (segment.start..=segment.end).contains(&stamp)) {
            self.segment = Segment::around(self.trajectory, stamp);
        }
        self.segment.as_ref().map(|segment| segment.at(stamp))
    }
}

impl Segment {
    fn around(trajectory: &Trajectory, stamp: Stamp) -> Option<Self> {
        let (stamps, poses) = (trajectory.stamps(), trajectory.poses());
        let after = stamps.partition_point(|s| *s <= stamp);
        let one = after.checked_sub(1)?;
        if after == stamps.len() && stamps[one] != stamp {
            return None;
        }
        // The last pose itself belongs to the segment before it, where there is one.
        let one = one.min(stamps.len().checked_sub(2)?);
        let two = one + 1;
        let (from, origin) = (poses[one].rotation, stamps[one]);
        let neighbour = |index: usize| {
            let turn = (from.inverse() * poses[index].rotation).scaled_axis();
            (stamps[index].seconds_since(origin), poses[index].translation.vector, turn)
        };
        let before = one.checked_sub(1).map(neighbour);
        let beyond = (two + 1 < stamps.len()).then(|| neighbour(two + 1));
        let (start, end) = (neighbour(one), neighbour(two));
        let position =
            cubic(before.map(|n| (n.0, n.1)), [(start.0, start.1), (end.0, end.1)], beyond.map(|n| (n.0, n.1)));
        let turn = cubic(before.map(|n| (n.0, n.2)), [(start.0, start.2), (end.0, end.2)], beyond.map(|n| (n.0, n.2)));
        Some(Self { start: origin, end: stamps[two], from, position, turn })
    }

    fn at(&self, stamp: Stamp) -> Pose {
        let u = stamp.seconds_since(self.start) / self.end.seconds_since(self.start);
        let value = |c: &[Vector; 4]| c[0] + (c[1] + (c[2] + c[3] * u) * u) * u;
        Pose::from_parts(value(&self.position).into(), self.from * Rotation::from_scaled_axis(value(&self.turn)))
    }
}

/// Coefficients by powers of `u` of the cubic between `ends`, with Bessel tangents where a neighbour is there.
fn cubic(before: Option<(f64, Vector)>, ends: [(f64, Vector); 2], beyond: Option<(f64, Vector)>) -> [Vector; 4] {
    let [(t1, x1), (t2, x2)] = ends;
    let step = t2 - t1;
    let slope = (x2 - x1) / step;
    // Slope at a pose: that of the parabola through it and its neighbours.
    let at_start = before.map_or(slope, |(t0, x0)| ((x1 - x0) / (t1 - t0) * step + slope * (t1 - t0)) / (t2 - t0));
    let at_end = beyond.map_or(slope, |(t3, x3)| (slope * (t3 - t2) + (x3 - x2) / (t3 - t2) * step) / (t3 - t1));
    let (d1, d2, rise) = (at_start * step, at_end * step, x2 - x1);
    [x1, d1, rise * 3.0 - d1 * 2.0 - d2, d1 + d2 - rise * 2.0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::from_roll_pitch_yaw;
    use approx::assert_relative_eq;

    /// A head that pitches by 45 degrees at 1.3 Hz and sways with it.
    fn swing(t_s: f64) -> Pose {
        let angle = std::f64::consts::FRAC_PI_4 * (8.17 * t_s).sin();
        Pose::from_parts(Vector::new(0.1 * angle, t_s, 0.0).into(), from_roll_pitch_yaw(0.0, angle, 0.3 * t_s))
    }

    fn sampled(step_ms: i64) -> Trajectory {
        let pose = |k: i64| (Stamp::from_nanos(k * step_ms * 1_000_000), swing((k * step_ms) as f64 * 1e-3));
        Trajectory::from_poses((0..=1000 / step_ms).map(pose)).unwrap()
    }

    /// Greatest angle between the swing and what is told of it, rad, away from the ends.
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
    fn a_swing_between_poses_of_100_hz_is_followed_to_ten_microradians() {
        // Bessel slopes are off by f''' h^2 / 6, which a cubic passes on as 0.096 f''' h^3 / 6 at most: with
        // f''' = (pi/4) 8.17^3 = 428 rad/s^3 and h = 10 ms, 6.8e-6 rad. A straight line would miss by 6.5e-4.
        assert!(worst(10) < 8e-6, "{}", worst(10));
        assert_relative_eq!(worst(20) / worst(10), 8.0, epsilon = 1.0);
    }

    #[test]
    fn at_its_poses_it_is_exact_and_outside_it_is_silent() {
        let trajectory = sampled(10);
        let mut cursor = SmoothCursor::new(&trajectory);
        for (stamp, pose) in trajectory.iter() {
            assert_relative_eq!(cursor.at(stamp).unwrap().to_homogeneous(), pose.to_homogeneous(), epsilon = 1e-12);
        }
        assert_eq!(cursor.at(Stamp::from_nanos(-1)), None);
        assert_eq!(cursor.at(Stamp::from_nanos(1_000_000_001)), None);
        assert_eq!(SmoothCursor::new(&Trajectory::new()).at(Stamp::from_nanos(0)), None);
    }
}
