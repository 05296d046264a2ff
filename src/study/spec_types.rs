//! The types of the specs of all kinds.

use crate::design::DesignSpec;
use crate::reproduction::ExperimentSpec;
use crate::sweep::SweepSpec;
use schemars::{Schema, SchemaGenerator, json_schema};
use zsim_base::spec::{Kind, Source, SpecError};
use zsim_run::{INPUT_TYPES, SpecType};

/// The types of studies: a study is a sweep or the search for a spring.
const STUDY_TYPES: [SpecType; 3] =
    [SpecType::of::<SweepSpec>(), SpecType::of::<DesignSpec>(), SpecType::of::<ExperimentSpec>()];

/// Returns the types of a kind.
pub fn types(kind: Kind) -> impl Iterator<Item = &'static SpecType> {
    INPUT_TYPES.iter().chain(&STUDY_TYPES).filter(move |of| of.kind == kind)
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
