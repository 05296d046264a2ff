//! The estimator, fed by the caller.

use crate::arrays::{rows, stamps_ns};
use crate::calibration::Calibration;
use crate::failure::Failure;
use crate::trajectory::Trajectory;
use crate::window::Window;
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use zsim::estimation::{self, EstimatedPose, Event};
use zsim::geometry;
use zsim::measurement::{ForceUnitCheck, ImuSample, LidarReturn, LidarScan, Measurement};
use zsim::time::Stamp;

/// The open-loop estimator.
#[pyclass(module = "zsim")]
pub struct Estimator {
    /// `None` after the end.
    running: Option<estimation::Estimator>,
    unit: ForceUnitCheck,
    warnings: Vec<String>,
}

#[pymethods]
impl Estimator {
    #[new]
    #[pyo3(signature = (calibration, estimator="default"))]
    fn new(calibration: &Calibration, estimator: &str) -> Result<Self, Failure> {
        let running = estimation::Estimator::new(&estimation::load(estimator)?, &calibration.0)?;
        Ok(Self { running: Some(running), unit: ForceUnitCheck::default(), warnings: Vec::new() })
    }

    /// Adds an IMU sample: stamp on the IMU's clock, ns; rad/s and m/s^2 in the frame of the IMU.
    fn push_imu(
        &mut self,
        stamp_ns: i64,
        angular_velocity_rad_per_s: [f64; 3],
        specific_force_m_per_s2: [f64; 3],
    ) -> Result<(), Failure> {
        let sample = ImuSample {
            stamp: Stamp::from_nanos(stamp_ns),
            angular_velocity_rad_per_s: angular_velocity_rad_per_s.into(),
            specific_force_m_per_s2: specific_force_m_per_s2.into(),
        };
        self.unit.add(&sample).map_err(Failure::input)?;
        Ok(self.running()?.push(Measurement::Imu(sample))?)
    }

    /// Adds a scan: the stamp that the lidar sent, the stamp of each return, ns on the lidar's clock, and its point in the
    /// frame of the lidar, m, shape (n, 3).
    fn push_scan(
        &mut self,
        py: Python<'_>,
        stamp_ns: i64,
        return_stamp_ns: &Bound<'_, PyAny>,
        point_in_laser_m: &Bound<'_, PyAny>,
    ) -> Result<(), Failure> {
        let stamps = stamps_ns("return_stamp_ns", return_stamp_ns)?;
        let points = rows::<f32>("point_in_laser_m", point_in_laser_m, 3)?;
        let scan = scan(Stamp::from_nanos(stamp_ns), &stamps, &points)?;
        let running = self.running()?;
        py.detach(|| running.push(Measurement::Lidar(scan)))?;
        Ok(())
    }

    /// Adds all measurements of a window.
    fn push(&mut self, py: Python<'_>, window: &Window) -> Result<(), Failure> {
        for measurement in &window.0 {
            py.check_signals()?;
            let running = self.running()?;
            py.detach(|| running.push(measurement.clone()))?;
        }
        Ok(())
    }

    /// The poses `map_from_head` that became final since the last call, in lidar time.
    fn take_poses(&mut self) -> Result<Trajectory, Failure> {
        let poses = self.running()?.take_poses();
        let stamped = poses.iter().map(|EstimatedPose { stamp, map_from_head, .. }| (*stamp, *map_from_head));
        Ok(Trajectory(geometry::Trajectory::from_poses(stamped)?))
    }

    /// Processes the remaining data and ends the estimate; returns the poses that were not taken.
    fn finish(&mut self, py: Python<'_>) -> Result<Trajectory, Failure> {
        let running = self.running.take().ok_or_else(ended)?;
        let result = py.detach(|| running.finish())?;
        self.warnings = result.warnings.iter().map(Event::to_string).collect();
        Ok(Trajectory(result.trajectory))
    }

    /// The warnings so far, a sentence each; those that concern the whole run come with `finish`.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        match &self.running {
            Some(running) => running.warnings().iter().map(Event::to_string).collect(),
            None => self.warnings.clone(),
        }
    }
}

impl Estimator {
    fn running(&mut self) -> Result<&mut estimation::Estimator, Failure> {
        self.running.as_mut().ok_or_else(ended)
    }
}

fn ended() -> Failure {
    Failure::input("the estimate is finished: create another Estimator")
}

/// A scan of returns with their stamps and points; `sent` is the stamp of the lidar itself.
fn scan(
    sent: Stamp,
    stamps: &PyReadonlyArray1<'_, i64>,
    points: &PyReadonlyArray2<'_, f32>,
) -> Result<LidarScan, Failure> {
    let (stamps, points) = (stamps.as_array(), points.as_array());
    if points.nrows() != stamps.len() {
        let (count, rows) = (stamps.len(), points.nrows());
        return Err(Failure::input(format!("{count} stamps, but {rows} points: expected one stamp per point")));
    }
    let Some(first) = stamps.iter().min().map(|stamp| Stamp::from_nanos(*stamp)) else {
        return Err(Failure::input("a scan needs at least one return"));
    };
    let of_return = |(stamp, point): (&i64, numpy::ndarray::ArrayView1<'_, f32>)| LidarReturn {
        offset: Stamp::from_nanos(*stamp) - first,
        point_in_laser: [point[0], point[1], point[2]].into(),
        intensity: 0.0,
    };
    let returns = stamps.iter().zip(points.rows()).map(of_return).collect();
    Ok(LidarScan { stamp: first, stamped_after: sent - first, returns, planar: None })
}
