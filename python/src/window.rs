//! Measurements of a part of a recording as arrays.

use crate::arrays::{matrix, vector};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use zsim::measurement::{ImuSample, LidarReturn, LidarScan, Measurement};

/// Measurements of the IMU and of the lidar, in order of their stamps.
#[pyclass(frozen, module = "zsim")]
#[derive(Default)]
pub struct Window(pub Vec<Measurement>);

impl Window {
    fn imu(&self) -> impl Iterator<Item = &ImuSample> {
        self.0.iter().filter_map(|measurement| match measurement {
            Measurement::Imu(sample) => Some(sample),
            Measurement::Lidar(_) => None,
        })
    }

    fn scans(&self) -> impl Iterator<Item = &LidarScan> {
        self.0.iter().filter_map(|measurement| match measurement {
            Measurement::Lidar(scan) => Some(scan),
            Measurement::Imu(_) => None,
        })
    }

    fn returns(&self) -> impl Iterator<Item = &LidarReturn> {
        self.scans().flat_map(|scan| &scan.returns)
    }
}

#[pymethods]
impl Window {
    /// Stamps of the IMU samples, ns, on the IMU's clock.
    #[getter]
    fn imu_stamp_ns<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        vector(py, self.imu().map(|sample| sample.stamp.nanos()))
    }

    /// Angular velocities, rad/s, in the frame of the IMU: shape (samples, 3).
    #[getter]
    fn angular_velocity_rad_per_s<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, self.imu().map(|sample| sample.angular_velocity_rad_per_s.into()))
    }

    /// Specific forces, m/s^2, in the frame of the IMU (+9.81 along z when level and at rest): shape (samples, 3).
    #[getter]
    fn specific_force_m_per_s2<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, self.imu().map(|sample| sample.specific_force_m_per_s2.into()))
    }

    /// Stamps of the scans as the lidar sent them, ns, on the lidar's clock.
    #[getter]
    fn scan_stamp_ns<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        vector(py, self.scans().map(|scan| (scan.stamp + scan.stamped_after).nanos()))
    }

    /// Index of the first return of each scan, and the number of returns: scan k has the returns `scan_start[k]:scan_start[k + 1]`.
    #[getter]
    fn scan_start<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let ends = self.scans().scan(0, |end, scan| {
            *end += scan.returns.len() as i64;
            Some(*end)
        });
        vector(py, std::iter::once(0).chain(ends))
    }

    /// Stamp of each return, ns, on the lidar's clock.
    #[getter]
    fn return_stamp_ns<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let of_scan = |scan: &LidarScan| {
            let stamp = scan.stamp;
            scan.returns.iter().map(move |each| (stamp + each.offset).nanos()).collect::<Vec<_>>()
        };
        vector(py, self.scans().flat_map(of_scan))
    }

    /// Point of each return, m, in the frame of the lidar: shape (returns, 3).
    #[getter]
    fn point_in_laser_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        matrix(py, self.returns().map(|each| each.point_in_laser.into()))
    }

    /// Intensity of each return, in the unit of the sensor; 0 if it has none.
    #[getter]
    fn intensity<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        vector(py, self.returns().map(|each| each.intensity))
    }

    fn __repr__(&self) -> String {
        let (samples, scans, returns) = (self.imu().count(), self.scans().count(), self.returns().count());
        format!("<zsim.Window: {samples} IMU samples, {scans} scans, {returns} returns>")
    }
}
