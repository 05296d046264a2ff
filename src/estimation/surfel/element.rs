//! A surfel and the returns that it is built from.

use super::super::nominal::Nominal;
use super::super::spline::Basis;
use super::super::unknowns::Unknowns;
use zsim_base::geometry::Matrix;
use zsim_base::geometry::Vector;
use zsim_base::measurement::LidarCorrection;

/// Resolution of half the finest voxel, of which surfels are built where the geometry is weak; the others are 0 to 5.
pub(crate) const FINE: usize = 6;

/// Edge of the voxels of resolution `level`, m, if those of resolution 0 have `finest_m`.
pub(crate) fn voxel_edge_m(finest_m: f64, level: usize) -> f64 {
    if level == FINE { 0.5 * finest_m } else { finest_m * f64::from(1_u32 << level) }
}

/// A lidar return in the IMU frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TimedReturn {
    /// Time of emission, lidar time, s.
    pub(crate) tau_s: f64,
    /// Measured point in the IMU frame, m.
    pub(crate) point_in_imu: nalgebra::Vector3<f32>,
    /// Measured range, m.
    pub(crate) range_m: f32,
    /// Inverse square of the intensity, in the unit of the sensor; 0 without intensity.
    pub(crate) weakness: f32,
}

/// A planar patch as measured by the calibrated lidar at the patch's mean time, in IMU axes.
///
/// The estimated correction of the lidar's calibration is applied when the surfel is placed in the map.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Surfel {
    /// Mean time of the points, lidar time, s.
    pub(crate) tau_s: f64,
    /// Vector from the lidar to the mean of the points, by the calibration, m.
    pub(crate) ray_in_imu: Vector,
    /// Unit normal towards the lidar, by the calibration.
    pub(crate) normal_in_imu: Vector,
    /// Second central moment of the points, by the calibration, m^2.
    pub(crate) covariance_in_imu: Matrix,
    /// Additional variance of the position along the normal because the surface is not flat, m^2.
    pub(crate) roughness_variance: f64,
    /// Number of points.
    pub(crate) points: f64,
    /// Mean weakness of the returns.
    pub(crate) weakness: f64,
    /// Resolution: 0 for the finest voxels, or [`FINE`].
    pub(crate) level: usize,
}

/// How the lidar saw a patch, and so how the patch moves with the lidar's calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sighting {
    /// Unit vector from the lidar to the centre, in map axes.
    pub(crate) beam: Vector,
    /// Distance from the lidar to the centre, m.
    pub(crate) range_m: f64,
    /// Attitude of the IMU at that time.
    pub(crate) map_from_imu: Matrix,
}

/// A planar patch of surface in the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Patch {
    /// Centre, m.
    pub(crate) centre: Vector,
    /// Unit normal, towards the lidar.
    pub(crate) normal: Vector,
    /// Number of points.
    pub(crate) points: f64,
    /// Second central moment, m^2.
    pub(crate) covariance: Matrix,
    /// Additional variance of the position along the normal because the surface is not flat, m^2.
    pub(crate) roughness_variance: f64,
    /// Resolution: 0 for the finest voxels, or [`FINE`].
    pub(crate) level: usize,
}

/// A surfel placed in the map by the trajectory, with derivatives by the window's unknowns.
#[derive(Debug, Clone)]
pub(crate) struct PlacedSurfel {
    /// The surfel in the map.
    pub(crate) patch: Patch,
    /// Mean time of the points, lidar time, s.
    pub(crate) tau_s: f64,
    /// Vector from the IMU to the centre, in map axes, m.
    pub(crate) arm: Vector,
    /// How the lidar saw it.
    pub(crate) sighting: Sighting,
    /// Derivative of the centre by the clock offset, m/s; zero if the trajectory is in lidar time.
    pub(crate) velocity: Vector,
    /// The correction spline's basis at that time.
    pub(crate) basis: Basis,
}

impl Patch {
    /// Variance of the normal's tilt towards `direction`, rad^2.
    ///
    /// A plane fitted to `N` points of variance `lambda` along the normal and `s^2` along the direction has `lambda / (N s^2)`.
    pub(crate) fn normal_tilt_variance(&self, direction: &Vector) -> f64 {
        let along = direction - self.normal * self.normal.dot(direction);
        let spread = along.dot(&(self.covariance * along)) / along.norm_squared();
        let thin = self.normal.dot(&(self.covariance * self.normal)).max(0.0);
        if spread > 0.0 { thin / (self.points * spread) } else { 0.0 }
    }
}

impl Sighting {
    /// Vector from the lidar to the centre, in map axes, m.
    fn ray(&self) -> Vector {
        self.beam * self.range_m
    }

    /// Derivatives of the position along `normal` by rotation and translation of the lidar, IMU axes.
    #[inline(always)]
    pub(crate) fn by_extrinsics(&self, normal: &Vector) -> [f64; 6] {
        let rotation = self.map_from_imu.tr_mul(&self.ray().cross(normal));
        let translation = self.map_from_imu.tr_mul(normal);
        [rotation.x, rotation.y, rotation.z, translation.x, translation.y, translation.z]
    }

    /// The patch that was placed with the correction `from`, placed with `to`; both are small.
    pub(crate) fn recalibrated(&self, patch: &Patch, from: &LidarCorrection, to: &LidarCorrection) -> Patch {
        let longer = self.beam * (to.range_m - from.range_m);
        if (from.rotation, from.translation) == (to.rotation, to.translation) {
            return Patch { centre: patch.centre + longer, ..*patch };
        }
        let turn = self.map_from_imu * (to.rotation * from.rotation.inverse()).scaled_axis();
        let shift = self.map_from_imu * (to.translation - from.translation) + turn.cross(&self.ray());
        let normal = (patch.normal + turn.cross(&patch.normal)).normalize();
        Patch { centre: patch.centre + longer + shift, normal, ..*patch }
    }
}

/// Trajectory and unknowns that place surfels in the map.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlacementState<'a> {
    pub(crate) nominal: &'a Nominal,
    pub(crate) unknowns: &'a Unknowns,
    /// Calibrated position of the lidar in the IMU frame, m.
    pub(crate) laser_in_imu: &'a Vector,
    pub(crate) knot_spacing_s: f64,
}

impl Surfel {
    /// Places the surfel in the map.
    pub(crate) fn place(&self, by: &PlacementState<'_>) -> PlacedSurfel {
        let Unknowns { biases, clock, lidar, .. } = by.unknowns;
        let u_s = clock.trajectory_s(self.tau_s);
        let motion = by.nominal.at(u_s, &biases.gyro);
        let ray_in_imu = lidar.apply(&self.ray_in_imu);
        let arm = motion.rotation * (by.laser_in_imu + lidar.translation + ray_in_imu);
        let map_from_calibrated = motion.rotation * lidar.rotation.to_rotation_matrix().matrix();
        let patch = Patch {
            centre: motion.position + arm,
            normal: map_from_calibrated * self.normal_in_imu,
            covariance: map_from_calibrated * self.covariance_in_imu * map_from_calibrated.transpose(),
            roughness_variance: self.roughness_variance,
            level: self.level,
            points: self.points,
        };
        let range_m = ray_in_imu.norm();
        PlacedSurfel {
            patch,
            tau_s: self.tau_s,
            arm,
            sighting: Sighting { beam: motion.rotation * ray_in_imu / range_m, range_m, map_from_imu: motion.rotation },
            velocity: motion.velocity + motion.angular_velocity.cross(&arm),
            basis: Basis::at(u_s, by.knot_spacing_s),
        }
    }
}
