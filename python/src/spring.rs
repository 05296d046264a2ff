//! Springs under a head.

use crate::arguments;
use crate::arrays::{as_python, matrix};
use crate::background;
use crate::failure::Failure;
use numpy::PyArray2;
use pyo3::prelude::*;
use serde::Deserialize;
use serde_json::{Map, Value};
use zsim::dynamics::{self, HeadModel, HeadSpec, LinkageSpec};
use zsim::elasticity::SpringSpec;
use zsim::head::coverage::CoveragePlan;
use zsim::head::gains::{AXES, GainCurve, GainPlan, GainWatch, axis_name, gain_curve};
use zsim::head::spring::{Shake, SpringReport, spring_report};
use zsim::random::Seed;
use zsim::sensors::{Imu, Lidar};
use zsim::spec::{Kind, Source, find, parse};

/// Settings of a spring, JSON.
#[derive(Deserialize)]
struct Settings {
    head: String,
    spring: Option<String>,
    coil: Map<String, Value>,
    lidar: String,
    imu: String,
    shake: Shake,
}

/// Settings of a gain measurement, JSON.
#[derive(Deserialize)]
struct GainSettings {
    axis: String,
    up_to_hz: f64,
    realisations: usize,
    seed: u64,
}

/// A head on its spring.
#[pyclass(frozen, module = "zsim")]
pub struct Spring {
    spec: HeadSpec,
    source: Source,
    report: SpringReport,
}

#[pymethods]
impl Spring {
    #[new]
    fn new(py: Python<'_>, settings: &str) -> Result<Self, Failure> {
        let settings: Settings = arguments::read(settings)?;
        settings.shake.check().map_err(Failure::input)?;
        let (spec, source) = head(&settings)?;
        let lidar_source = find(Kind::Lidar, &settings.lidar)?;
        let lidar = Lidar::new(&parse(&lidar_source)?, &lidar_source)?;
        let imu_source = find(Kind::Imu, &settings.imu)?;
        let imu = Imu::new(&parse(&imu_source)?, &imu_source)?;
        let rate_limit_deg_per_s = imu.spec().gyro.limit_deg_per_s;
        let plan = CoveragePlan { from_s: 10.0, rate_limit_deg_per_s, ..CoveragePlan::default() };
        let (known, of) = (spec.clone(), source.clone());
        let report =
            background::run(py, None, move |_| Ok(spring_report(&known, &of, &settings.shake, &lidar, &plan)?))?;
        Ok(Self { spec, source, report })
    }

    /// All figures, as `zsim spring --json`.
    #[getter]
    fn report<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>, Failure> {
        as_python(py, &self.report)
    }

    /// Whether the head has a stable rest pose.
    #[getter]
    fn stands(&self) -> bool {
        self.report.stands
    }

    /// Stiffness at rest, 6 x 6; x y z rx ry rz, N, m, rad.
    #[getter]
    fn stiffness<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        self.report.stiffness.map(|rows| matrix(py, rows.into_iter())).transpose()
    }

    /// Modes about the rest pose, slowest first.
    #[getter]
    fn modes<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>, Failure> {
        as_python(py, &self.report.modes)
    }

    /// Measures a gain curve.
    fn measure_gains<'py>(
        &self,
        py: Python<'py>,
        settings: &str,
        progress: Option<Py<PyAny>>,
    ) -> Result<Bound<'py, PyAny>, Failure> {
        let settings: GainSettings = arguments::read(settings)?;
        let axes = || AXES.map(axis_name).join(", ");
        let axis = AXES.into_iter().find(|axis| axis_name(*axis) == settings.axis);
        let axis = axis.ok_or_else(|| Failure::input(format!("axis \"{}\": use one of {}", settings.axis, axes())))?;
        if !(settings.up_to_hz.is_finite() && settings.up_to_hz > 0.0) {
            return Err(Failure::input(format!("up_to_hz={}: expected a number above 0", settings.up_to_hz)));
        }
        let plan = GainPlan {
            up_to_hz: settings.up_to_hz,
            realisations: settings.realisations,
            seed: Seed(settings.seed),
            ..GainPlan::default()
        };
        let (spec, source) = (self.spec.clone(), self.source.clone());
        let curve: GainCurve = background::run(py, progress.as_ref(), move |progress| {
            let head = HeadModel::new(&spec, &source)?;
            let on_progress = |fraction| progress.set("shaking", fraction);
            Ok(gain_curve(&head, axis, &plan, GainWatch { stop: progress.stop_flag(), on_progress: &on_progress })?)
        })?;
        as_python(py, &curve)
    }

    fn __repr__(&self) -> String {
        let modes: Vec<String> = self.report.modes.iter().map(|mode| format!("{:.3} Hz", mode.frequency_hz)).collect();
        format!("<zsim.Spring: {}>", if self.report.stands { modes.join(", ") } else { "the head falls".to_owned() })
    }
}

/// The head of the settings, with their spring and their changes of the coil.
fn head(settings: &Settings) -> Result<(HeadSpec, Source), Failure> {
    let (mut spec, source) = dynamics::load(&settings.head)?;
    if settings.spring.is_none() && settings.coil.is_empty() {
        return Ok((spec, source));
    }
    let LinkageSpec::Spring { spring, .. } = &mut spec.linkage else {
        return Err(Failure::input(format!("the head \"{}\" has no spring to replace", settings.head)));
    };
    if let Some(name) = &settings.spring {
        *spring = parse(&find(Kind::Spring, name)?)?;
    }
    if !settings.coil.is_empty() {
        *spring = with_coil(spring, &settings.coil)?;
    }
    Ok((spec, source))
}

/// The spring with other values of its coil.
fn with_coil(spring: &SpringSpec, changes: &Map<String, Value>) -> Result<SpringSpec, Failure> {
    let mut value = serde_json::to_value(spring.resolved()?)?;
    let Some(coil) = value.get_mut("coil").and_then(Value::as_object_mut) else {
        return Err(Failure::input("coil: the spring is given by its stiffness and has no coil"));
    };
    coil.extend(changes.clone());
    arguments::from(value)
}
