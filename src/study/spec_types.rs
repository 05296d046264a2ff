//! The types of the specs of all kinds: this room is the lowest that knows them.

use crate::StudyError;
use crate::design::DesignSpec;
use crate::reproduction::ExperimentSpec;
use crate::sweep::SweepSpec;
use schemars::{Schema, SchemaGenerator, json_schema, schema_for};
use serde_json::Value;
use zsim_base::spec::{Kind, Named, NamedSpec, Source, SpecError, to_json};
use zsim_dynamics::HeadSpec;
use zsim_elasticity::SpringSpec;
use zsim_estimation::EstimatorSpec;
use zsim_motion::MotionSpec;
use zsim_sensors::{ClocksSpec, ImuSpec, LidarSpec};
use zsim_simulation::FaultsSpec;
use zsim_world::SceneSpec;

/// A type of specs, and what is done with any of them.
struct SpecType {
    kind: Kind,
    parse: fn(&Source) -> Result<(), SpecError>,
    check: fn(&Source) -> Result<Vec<String>, SpecError>,
    load: fn(&str) -> Result<Value, StudyError>,
    schema: fn() -> Schema,
    /// The schema as one of several.
    subschema: fn(&mut SchemaGenerator) -> Schema,
}

/// All types. A study is a sweep or the search for a spring.
const TYPES: [SpecType; 12] = [
    SpecType::of::<SceneSpec>(),
    SpecType::of::<HeadSpec>(),
    SpecType::of::<SpringSpec>(),
    SpecType::of::<LidarSpec>(),
    SpecType::of::<ImuSpec>(),
    SpecType::of::<ClocksSpec>(),
    SpecType::of::<FaultsSpec>(),
    SpecType::of::<MotionSpec>(),
    SpecType::of::<EstimatorSpec>(),
    SpecType::of::<SweepSpec>(),
    SpecType::of::<DesignSpec>(),
    SpecType::of::<ExperimentSpec>(),
];

impl SpecType {
    const fn of<T: NamedSpec>() -> Self
    where
        StudyError: From<T::Error>,
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

fn types(kind: Kind) -> impl Iterator<Item = &'static SpecType> {
    TYPES.iter().filter(move |of| of.kind == kind)
}

/// Parses a text as a spec of `kind`, and builds the model that it describes, as a run does; returns warnings.
///
/// # Errors
/// If it is none; of several types of the kind, the error that is farthest in the text.
pub fn check(kind: Kind, source: &Source) -> Result<Vec<String>, SpecError> {
    (parsing_type(kind, source)?.check)(source)
}

/// Checks that a text is a spec of `kind`, without building its model.
///
/// # Errors
/// As [`check`].
pub fn parse(kind: Kind, source: &Source) -> Result<(), SpecError> {
    parsing_type(kind, source).map(drop)
}

/// The type of `kind` as which the text is a spec.
fn parsing_type(kind: Kind, source: &Source) -> Result<&'static SpecType, SpecError> {
    let mut errors = Vec::new();
    for of in types(kind) {
        match (of.parse)(source) {
            Ok(()) => return Ok(of),
            Err(error) => errors.push(error),
        }
    }
    let farthest = errors.into_iter().max_by_key(SpecError::line_and_column);
    Err(farthest.unwrap_or_else(|| SpecError::plain(&source.name, format!("is not a spec of kind {}", kind.noun()))))
}

/// Finds and parses the spec of `kind` called `name`; returns it as JSON, with its name and its folder.
///
/// # Errors
/// If the spec is missing or invalid.
pub fn load(kind: Kind, name: &str) -> Result<Value, StudyError> {
    let types = types(kind).map(|of| (of.load)(name));
    types.reduce(Result::or).unwrap_or(Ok(Value::Null))
}

/// The JSON schema of a kind of spec.
pub fn schema(kind: Kind) -> Schema {
    let types: Vec<&SpecType> = types(kind).collect();
    if let [only] = types[..] {
        return (only.schema)();
    }
    let mut generator = SchemaGenerator::default();
    let alternatives: Vec<Schema> = types.iter().map(|of| (of.subschema)(&mut generator)).collect();
    json_schema!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "anyOf": alternatives,
        "$defs": generator.take_definitions(true)
    })
}
