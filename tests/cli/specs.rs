//! `zsim spec`: schemas and reference agree with the types and with the shipped specs.

use assert_cmd::Command;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use std::path::Path;
use zsim::dynamics::HeadSpec;
use zsim::elasticity::SpringSpec;
use zsim::estimation::EstimatorSpec;
use zsim::motion::MotionSpec;
use zsim::sensors::{ClocksSpec, ImuSpec, LidarSpec};
use zsim::simulation::FaultsSpec;
use zsim::spec::{Kind, find, names, parse};
use zsim::study::reproduction::ExperimentSpec;
use zsim::study::spring::design::DesignSpec;
use zsim::study::sweep::SweepSpec;
use zsim::world::SceneSpec;

fn printed(verb: &str, kind: Kind) -> String {
    let kind = kind.noun().to_lowercase();
    let output = Command::new(env!("CARGO_BIN_EXE_zsim")).args(["spec", verb, &kind]).output().unwrap();
    assert!(output.status.success(), "{verb} {kind}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// The shipped spec `name` as JSON; `None` if the text is not a `T`.
fn as_json<T: DeserializeOwned + Serialize>(kind: Kind, name: &str) -> Option<Value> {
    Some(serde_json::to_value(parse::<T>(&find(kind, name).unwrap()).ok()?).unwrap())
}

fn shipped(kind: Kind, name: &str) -> Value {
    let json = match kind {
        Kind::Scene => as_json::<SceneSpec>(kind, name),
        Kind::Head => as_json::<HeadSpec>(kind, name),
        Kind::Spring => as_json::<SpringSpec>(kind, name),
        Kind::Lidar => as_json::<LidarSpec>(kind, name),
        Kind::Imu => as_json::<ImuSpec>(kind, name),
        Kind::Clock => as_json::<ClocksSpec>(kind, name),
        Kind::Faults => as_json::<FaultsSpec>(kind, name),
        Kind::Motion => as_json::<MotionSpec>(kind, name),
        Kind::Estimator => as_json::<EstimatorSpec>(kind, name),
        Kind::Study => as_json::<SweepSpec>(kind, name).or_else(|| as_json::<DesignSpec>(kind, name)),
        Kind::Experiment => as_json::<ExperimentSpec>(kind, name),
    };
    json.unwrap_or_else(|| panic!("{}/{name} does not parse", kind.folder()))
}

#[test]
fn every_shipped_spec_matches_the_schema_of_its_kind() {
    for kind in Kind::ALL {
        let schema: Value = serde_json::from_str(&printed("schema", kind)).unwrap();
        let validator = jsonschema::validator_for(&schema).unwrap();
        for name in names(kind) {
            let errors: Vec<String> =
                validator.iter_errors(&shipped(kind, &name)).map(|error| error.to_string()).collect();
            assert!(errors.is_empty(), "{}/{name}: {errors:?}", kind.folder());
        }
    }
}

#[test]
fn a_schema_rejects_what_the_parser_rejects() {
    let schema: Value = serde_json::from_str(&printed("schema", Kind::Imu)).unwrap();
    let validator = jsonschema::validator_for(&schema).unwrap();
    let valid = shipped(Kind::Imu, "3dm_gx2");
    assert!(validator.is_valid(&valid));
    for (key, value) in [("rate_hz", json!(0.0)), ("rate_hz", json!("fast")), ("unknown_key", json!(1.0))] {
        let mut changed = valid.clone();
        changed[key] = value.clone();
        assert!(!validator.is_valid(&changed), "{key}: {value}");
    }
}

/// Update with `for kind in $(ls docs/reference); do zsim spec reference ${kind%.md} > docs/reference/$kind; done`.
#[test]
fn the_reference_in_docs_is_current() {
    for kind in Kind::ALL {
        let path =
            Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("docs/reference/{}.md", kind.noun().to_lowercase()));
        let written = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(written == printed("reference", kind), "{} is not current", path.display());
    }
}

#[test]
fn list_and_show_print_the_shipped_specs() {
    let zsim = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_zsim")).args(arguments).output().unwrap();
        (output.status.code(), String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap())
    };
    let (code, list, _) = zsim(&["spec", "list", "imu"]);
    assert!(code == Some(0) && list.contains("specs/imus") && list.contains("3dm_gx2"), "{list}");
    let (_, text, _) = zsim(&["spec", "show", "imu", "3dm_gx2"]);
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("specs/imus/3dm_gx2.ron");
    assert_eq!(text, std::fs::read_to_string(shipped).unwrap());
    let (code, _, message) = zsim(&["spec", "show", "imu", "no_such_imu"]);
    assert!(code == Some(2) && message.contains("3dm_gx2"), "{code:?} {message}");
}
