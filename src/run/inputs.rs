//! Inputs of a run.

use super::RunError;
use super::timing::TimingSpec;
use schemars::{Schema, SchemaGenerator, schema_for};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use zsim_base::spec::{Kind, Named, NamedSpec, Source, SpecError, to_json};
use zsim_dynamics::HeadSpec;
use zsim_elasticity::SpringSpec;
use zsim_estimation::EstimatorSpec;
use zsim_motion::MotionSpec;
use zsim_sensors::{ClocksSpec, ImuSpec, LidarSpec};
use zsim_simulation::{FaultsSpec, Run};
use zsim_world::SceneSpec;

/// Inputs of a run: the simulation, the estimator, timing errors between them, and a second system.
///
/// A study varies them by their paths in the serialised form.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunInputs {
    /// Inputs of the simulation.
    #[serde(flatten)]
    pub simulation: Run,
    /// Settings of the estimator.
    pub estimator: Named<EstimatorSpec>,
    /// Timing errors between the recording and the estimator.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub timing: Option<TimingSpec>,
    /// A second system, with whose map that of the run is compared.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference: Option<ReferenceInputs>,
    /// Whether the estimator ignores the sensor models in the recording, as for a recording of unknown sensors.
    #[serde(default)]
    pub ignore_manifest: bool,
}

impl RunInputs {
    /// A simulation with an estimator, without timing errors.
    pub fn new(simulation: Run, estimator: Named<EstimatorSpec>) -> Self {
        Self { simulation, estimator, timing: None, reference: None, ignore_manifest: false }
    }
}

/// Specs of a reference system; the others are those of the run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReferenceInputs {
    /// Head and its mount.
    pub head: Named<HeadSpec>,
    /// Motion of the base.
    pub motion: Named<MotionSpec>,
    /// Lidar.
    pub lidar: Named<LidarSpec>,
}

/// A type of specs, and what is done with any of them.
pub struct SpecType {
    /// The kind of spec.
    pub kind: Kind,
    /// Parses a text as a spec of the type.
    pub parse: fn(&Source) -> Result<(), SpecError>,
    /// Parses a text, and builds the model that it describes, as a run does; returns warnings.
    pub check: fn(&Source) -> Result<Vec<String>, SpecError>,
    /// Finds and parses the spec of a name; returns it as JSON, with its name and its folder.
    pub load: fn(&str) -> Result<Value, RunError>,
    /// Returns the JSON schema.
    pub schema: fn() -> Schema,
    /// Returns the JSON schema as one of several.
    pub subschema: fn(&mut SchemaGenerator) -> Schema,
}

/// The types of the inputs of a run, and of the springs of a head.
pub const INPUT_TYPES: [SpecType; 9] = [
    SpecType::of::<SceneSpec>(),
    SpecType::of::<HeadSpec>(),
    SpecType::of::<SpringSpec>(),
    SpecType::of::<LidarSpec>(),
    SpecType::of::<ImuSpec>(),
    SpecType::of::<ClocksSpec>(),
    SpecType::of::<FaultsSpec>(),
    SpecType::of::<MotionSpec>(),
    SpecType::of::<EstimatorSpec>(),
];

impl SpecType {
    /// Returns the entry of a type.
    pub const fn of<T: NamedSpec>() -> Self
    where
        RunError: From<T::Error>,
    {
        Self {
            kind: T::KIND,
            parse: |source| T::parse(source).map(drop),
            check: |source| T::parse(source)?.check_model(source),
            load: |name| Ok(to_json(&Named::<T>::load(name)?)?),
            schema: || schema_for!(T),
            subschema: |generator| generator.subschema_for::<T>(),
        }
    }
}

/// Finds and parses the spec of `kind` called `name`; returns it as JSON, with its name and its folder.
///
/// # Errors
/// If the spec is missing or invalid.
pub fn load_input(kind: Kind, name: &str) -> Result<Value, RunError> {
    let found = INPUT_TYPES.iter().find(|of| of.kind == kind);
    found.map_or(Ok(Value::Null), |of| (of.load)(name))
}
