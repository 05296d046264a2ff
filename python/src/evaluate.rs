//! Errors of a trajectory.

use crate::arrays::{as_python, matrix, vector};
use crate::failure::Failure;
use crate::trajectory::Trajectory;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use zsim::evaluation::{Errors, Pairs, TrajectoryErrors};
use zsim::report::trajectory_figures;

/// Errors of an estimate, as figures and over time.
#[pyclass(frozen, module = "zsim")]
pub struct Evaluation {
    errors: TrajectoryErrors,
    over_time: Errors,
}

/// Compares an estimate with the truth.
#[pyfunction]
pub fn evaluate(py: Python<'_>, estimate: &Trajectory, truth: &Trajectory) -> Result<Evaluation, Failure> {
    py.detach(|| {
        let pairs = Pairs::associate(&estimate.0, &truth.0)?;
        let (errors, over_time) = TrajectoryErrors::of(&pairs, &truth.0)?;
        Ok(Evaluation { errors, over_time })
    })
}

#[pymethods]
impl Evaluation {
    /// The figures by key, as `zsim compare --json`; units are in the keys, None where the trajectory is too short.
    #[getter]
    fn figures<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>, Failure> {
        as_python(py, &trajectory_figures(&self.errors))
    }

    /// Stamps of the errors, ns, in lidar time.
    #[getter]
    fn stamp_ns<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        vector(py, self.over_time.stamps.iter().map(|stamp| stamp.nanos()))
    }

    /// Estimated minus true position, m, in the world: shape (n, 3).
    #[getter]
    fn position_error_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, self.over_time.position_m.iter().map(|error| (*error).into()))
    }

    /// Rotation vector from the true to the estimated attitude, rad, in the world: shape (n, 3).
    #[getter]
    fn rotation_error_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, self.over_time.rotation_rad.iter().map(|error| (*error).into()))
    }

    fn __repr__(&self) -> String {
        let errors = &self.errors;
        let rotation_rmse_rad = errors.rotation_rmse_rad.unwrap_or(f64::NAN);
        format!(
            "<zsim.Evaluation: position RMSE {:.2} mm, rotation RMSE {:.3} deg, {:.1} % of the truth>",
            1e3 * errors.position_rmse_m,
            rotation_rmse_rad.to_degrees(),
            100.0 * errors.coverage
        )
    }
}
