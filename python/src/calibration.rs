//! Calibrations.

use crate::failure::Failure;
use crate::trajectory::rotation;
use pyo3::prelude::*;
use zsim::geometry::{Pose, Vector};
use zsim::measurement;
use zsim::sensors::{Imu, Lidar};
use zsim::spec::{Kind, find, parse};

/// A pose: position, m, and quaternion x, y, z, w.
type PoseNumbers = ([f64; 3], [f64; 4]);

/// Largest difference of a quaternion's squared norm from 1: four digits are enough to state a rotation.
const MAX_SQUARED_NORM_ERROR: f64 = 2e-3;

/// Poses and noise of lidar and IMU.
#[pyclass(frozen, module = "zsim")]
pub struct Calibration(pub measurement::Calibration);

#[pymethods]
impl Calibration {
    #[new]
    #[pyo3(signature = (head_from_laser, head_from_imu, *, lidar="utm30lx", imu="3dm_gx2"))]
    fn new(head_from_laser: PoseNumbers, head_from_imu: PoseNumbers, lidar: &str, imu: &str) -> Result<Self, Failure> {
        let (lidar_source, imu_source) = (find(Kind::Lidar, lidar)?, find(Kind::Imu, imu)?);
        let lidar = Lidar::new(&parse(&lidar_source)?, &lidar_source)?;
        let imu = Imu::new(&parse(&imu_source)?, &imu_source)?;
        Ok(Self(measurement::Calibration {
            head_from_laser: pose("head_from_laser", head_from_laser)?,
            head_from_imu: pose("head_from_imu", head_from_imu)?,
            imu: imu.noise(),
            imu_averaging: imu.averaging(),
            lidar: lidar.noise(),
        }))
    }

    /// Pose of the lidar in the head: position, m, and quaternion x, y, z, w.
    #[getter]
    fn head_from_laser(&self) -> PoseNumbers {
        numbers(&self.0.head_from_laser)
    }

    /// Pose of the IMU in the head: position, m, and quaternion x, y, z, w.
    #[getter]
    fn head_from_imu(&self) -> PoseNumbers {
        numbers(&self.0.head_from_imu)
    }

    fn __repr__(&self) -> String {
        let at = |pose: &Pose| format!("{:?} m", <[f64; 3]>::from(pose.translation.vector));
        let (laser, imu) = (at(&self.0.head_from_laser), at(&self.0.head_from_imu));
        format!("<zsim.Calibration: head_from_laser at {laser}, head_from_imu at {imu}>")
    }
}

/// The pose that the argument `name` gives.
fn pose(name: &str, (position_m, quaternion): PoseNumbers) -> Result<Pose, Failure> {
    let is_finite = position_m.iter().chain(&quaternion).all(|x| x.is_finite());
    let squared_norm: f64 = quaternion.iter().map(|x| x * x).sum();
    if !is_finite || (squared_norm - 1.0).abs() > MAX_SQUARED_NORM_ERROR {
        let message = format!(
            "{name}: expected a finite position (m) and a unit quaternion x, y, z, w; found {position_m:?} and {quaternion:?}"
        );
        return Err(Failure::input(message));
    }
    Ok(Pose::from_parts(Vector::from(position_m).into(), rotation(quaternion)))
}

fn numbers(pose: &Pose) -> PoseNumbers {
    (pose.translation.vector.into(), pose.rotation.coords.into())
}
