//! Trajectories.

use crate::arrays::{matrix, rows, stamps_ns, vector};
use crate::failure::Failure;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use std::path::PathBuf;
use zsim::geometry::{self, Pose, Rotation, Vector};
use zsim::recording::{read_tum, write_tum};
use zsim::time::Stamp;

/// Poses by time.
#[pyclass(frozen, module = "zsim")]
pub struct Trajectory(pub geometry::Trajectory);

#[pymethods]
impl Trajectory {
    #[new]
    fn new(
        stamp_ns: &Bound<'_, PyAny>,
        position_m: &Bound<'_, PyAny>,
        quaternion_xyzw: &Bound<'_, PyAny>,
    ) -> Result<Self, Failure> {
        let stamps = stamps_ns("stamp_ns", stamp_ns)?;
        let positions = rows::<f64>("position_m", position_m, 3)?;
        let quaternions = rows::<f64>("quaternion_xyzw", quaternion_xyzw, 4)?;
        let (stamps, positions, quaternions) = (stamps.as_array(), positions.as_array(), quaternions.as_array());
        if positions.nrows() != stamps.len() || quaternions.nrows() != stamps.len() {
            let message = format!(
                "{} stamps, but {} positions and {} quaternions: expected one of each per pose",
                stamps.len(),
                positions.nrows(),
                quaternions.nrows()
            );
            return Err(Failure::input(message));
        }
        let poses = stamps.iter().zip(positions.rows()).zip(quaternions.rows()).map(|((stamp, at), q)| {
            let attitude = rotation([q[0], q[1], q[2], q[3]]);
            (Stamp::from_nanos(*stamp), Pose::from_parts(Vector::new(at[0], at[1], at[2]).into(), attitude))
        });
        Ok(Self(geometry::Trajectory::from_poses(poses)?))
    }

    /// Reads a TUM file.
    #[staticmethod]
    fn read(path: PathBuf) -> Result<Self, Failure> {
        Ok(Self(read_tum(&path)?))
    }

    /// Writes a TUM file, replacing an existing one.
    fn write(&self, path: PathBuf) -> Result<(), Failure> {
        Ok(write_tum(&path, &self.0)?)
    }

    /// Stamps, ns.
    #[getter]
    fn stamp_ns<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        vector(py, self.0.stamps().iter().map(|stamp| stamp.nanos()))
    }

    /// Positions, m, in the frame of the trajectory: shape (n, 3).
    #[getter]
    fn position_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, self.0.poses().iter().map(|pose| pose.translation.vector.into()))
    }

    /// Attitudes as quaternions x, y, z, w: shape (n, 4).
    #[getter]
    fn quaternion_xyzw<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, self.0.poses().iter().map(|pose| pose.rotation.coords.into()))
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }

    fn __repr__(&self) -> String {
        let duration_s = self.0.span().map_or(0.0, |(first, last)| last.seconds_since(first));
        format!("<zsim.Trajectory: {} poses, {duration_s:.3} s>", self.0.len())
    }
}

/// A rotation from the components x, y, z, w.
pub fn rotation([x, y, z, w]: [f64; 4]) -> Rotation {
    Rotation::from_quaternion([x, y, z, w].into())
}
