//! A vertical cross-section through the map.

use nalgebra::Matrix2;
use zsim_base::geometry::{Trajectory, Vector};
use zsim_base::time::{Span, Stamp};

/// Half the thickness of the section, m: thin enough that walls appear as lines.
const HALF_THICKNESS_M: f64 = 0.12;
/// Half the length of the section, m.
const HALF_LENGTH_M: f64 = 5.0;
/// Half the height of the section, m.
const HALF_HEIGHT_M: f64 = 2.4;
/// Half the interval of the central difference for angular rates.
const HALF_INTERVAL: Span = Span::from_nanos(5_000_000);

/// A vertical plane through the head's position at the middle of a run.
///
/// Its normal is the horizontal axis with the largest mean square angular rate, so that the head's swing moves beams
/// within the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CrossSection {
    centre_in_world: Vector,
    normal_in_world: Vector,
    along_in_world: Vector,
    from: Stamp,
    to: Stamp,
}

impl CrossSection {
    /// The section through a run; it contains the returns of the middle `seconds`. `None` for an empty trajectory.
    pub(super) fn through(truth: &Trajectory, seconds: f64) -> Option<Self> {
        let (first, last) = truth.span()?;
        let half_s = 0.5 * last.seconds_since(first);
        let middle = first + Span::from_seconds(half_s);
        let shown = Span::from_seconds((0.5 * seconds).min(half_s));
        let (from, to) = (middle - shown, middle + shown);
        let mut level = Matrix2::zeros();
        for stamp in truth.stamps().iter().copied().filter(|stamp| (from..=to).contains(stamp)).step_by(10) {
            let rate = rate_in_world(truth, stamp).unwrap_or_default().xy();
            level += rate * rate.transpose();
        }
        let eigen = level.symmetric_eigen();
        let axis = eigen.eigenvectors.column(eigen.eigenvalues.imax());
        // An eigenvector's sign is arbitrary: choose the one that points north, for reproducibility.
        let axis = if axis.y < 0.0 { -axis } else { axis.into_owned() };
        let normal_in_world = Vector::new(axis.x, axis.y, 0.0);
        let centre_in_world = truth.at(middle)?.translation.vector;
        Some(Self { centre_in_world, normal_in_world, along_in_world: normal_in_world.cross(&Vector::z()), from, to })
    }

    /// Whether the section contains a point with the true position `point_in_world`, measured at `stamp`.
    pub(super) fn contains(&self, point_in_world: &Vector, stamp: Stamp) -> bool {
        let from_centre = point_in_world - self.centre_in_world;
        (self.from..=self.to).contains(&stamp)
            && from_centre.dot(&self.normal_in_world).abs() < HALF_THICKNESS_M
            && from_centre.dot(&self.along_in_world).abs() < HALF_LENGTH_M
            && from_centre.z.abs() < HALF_HEIGHT_M
    }

    /// Coordinates of a point from the section's centre, m: along the section, and up.
    pub(super) fn coordinates(&self, point_in_world: &Vector) -> (f64, f64) {
        let from_centre = point_in_world - self.centre_in_world;
        (from_centre.dot(&self.along_in_world), from_centre.z)
    }

    /// Angular rate of the head in the section's plane, degrees/s; positive if points ahead along the section move up.
    pub(super) fn rate_deg_per_s(&self, truth: &Trajectory, stamp: Stamp) -> Option<f64> {
        let upward = self.along_in_world.cross(&Vector::z());
        Some(rate_in_world(truth, stamp)?.dot(&upward).to_degrees())
    }
}

/// Angular rate in the world frame, rad/s.
fn rate_in_world(truth: &Trajectory, stamp: Stamp) -> Option<Vector> {
    let (before, after) = (truth.at(stamp - HALF_INTERVAL)?, truth.at(stamp + HALF_INTERVAL)?);
    Some((after.rotation * before.rotation.inverse()).scaled_axis() / (2.0 * HALF_INTERVAL.seconds()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::geometry::{Pose, from_roll_pitch_yaw};

    /// Moves east along y = 2 m at 0.1 m/s, and pitches by 0.5 rad at 1 Hz.
    fn nodding() -> Trajectory {
        let pose = |ms: i64| {
            let t = ms as f64 * 1e-3;
            let nod = from_roll_pitch_yaw(0.0, 0.5 * (std::f64::consts::TAU * t).sin(), 0.0);
            (Stamp::from_nanos(ms * 1_000_000), Pose::from_parts(Vector::new(0.1 * t, 2.0, 1.0).into(), nod))
        };
        Trajectory::from_poses((0..=20_000).map(pose)).unwrap()
    }

    #[test]
    fn the_section_of_a_pitching_head_is_along_its_heading() {
        let truth = nodding();
        let section = CrossSection::through(&truth, 4.0).unwrap();
        let middle = Stamp::from_nanos(10_000_000_000);
        // The section passes through (1, 2, 1), along x.
        assert!(
            section.contains(&Vector::new(3.0, 2.1, 0.0), middle)
                && !section.contains(&Vector::new(3.0, 2.2, 0.0), middle)
        );
        assert!(!section.contains(&Vector::new(3.0, 2.0, 0.0), Stamp::from_nanos(7_900_000_000)));
        let (along, up) = section.coordinates(&Vector::new(3.0, 2.0, 0.5));
        assert_relative_eq!(along.abs(), 2.0, epsilon = 1e-9);
        assert_relative_eq!(up, -0.5, epsilon = 1e-9);
        // At whole seconds the head pitches down at 0.5 * 2 pi rad/s = 180 degrees/s (a rotation about +y lowers the nose).
        let rate = section.rate_deg_per_s(&truth, middle).unwrap();
        assert_relative_eq!(rate * along.signum(), -180.0, epsilon = 0.2);
    }
}
