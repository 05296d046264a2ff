//! The Python module `zsim._zsim`: converts arguments and results of the library; the package `zsim` documents it.

#![allow(clippy::needless_pass_by_value, reason = "PyO3 converts each argument to a value of the function")]

mod arguments;
mod arrays;
mod background;
mod calibration;
mod estimate;
mod estimator;
mod evaluate;
mod failure;
mod recording;
mod simulate;
mod spring;
mod sweep;
mod trajectory;
mod window;

/// The compiled part of the package `zsim`.
#[pyo3::pymodule]
mod _zsim {
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }

    #[pymodule_export]
    use super::calibration::Calibration;
    #[pymodule_export]
    use super::estimate::{Estimate, estimate};
    #[pymodule_export]
    use super::estimator::Estimator;
    #[pymodule_export]
    use super::evaluate::{Evaluation, evaluate};
    #[pymodule_export]
    use super::failure::{Error, InputError};
    #[pymodule_export]
    use super::recording::{Recording, Windows};
    #[pymodule_export]
    use super::simulate::simulate;
    #[pymodule_export]
    use super::spring::Spring;
    #[pymodule_export]
    use super::sweep::sweep;
    #[pymodule_export]
    use super::trajectory::Trajectory;
    #[pymodule_export]
    use super::window::Window;
}
