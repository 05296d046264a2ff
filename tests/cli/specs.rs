//! `zsim spec`: schemas and reference agree with the types and with the shipped specs.

use crate::command::run;
use crate::command::{exits_with, zsim};
use crate::recording::readers::python;
use crate::skip::run_or_skip;
use serde_json::{Value, json};
use std::path::Path;
use zsim::spec::{Kind, names};
use zsim::study::spec_types;

fn printed(verb: &str, kind: Kind) -> String {
    let kind = kind.key();
    exits_with(0, zsim().args(["spec", verb, kind])).0
}

/// The shipped spec `name` as JSON.
fn shipped(kind: Kind, name: &str) -> Value {
    spec_types::types(kind).find_map(|of| (of.load)(name).ok()).unwrap()["spec"].take()
}

/// The errors of each value by the schema of its kind, by an independent validator; `None` if it is not installed.
fn validated(values: &[(Kind, Value)]) -> Option<Vec<Vec<String>>> {
    let schema = |kind| serde_json::from_str::<Value>(&printed("schema", kind)).unwrap();
    let schemas: serde_json::Map<String, Value> =
        Kind::ALL.into_iter().map(|kind| (kind.noun().to_owned(), schema(kind))).collect();
    let values: Vec<Value> = values.iter().map(|(kind, value)| json!([kind.noun(), value])).collect();
    let here = tempfile::tempdir().unwrap();
    let file = here.path().join("specs.json");
    std::fs::write(&file, json!({ "schemas": schemas, "values": values }).to_string()).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/check_schemas.py");
    let output = run_or_skip("jsonschema", python().args([&script, &file]))?;
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(serde_json::from_slice(&output.stdout).unwrap())
}

#[test]
fn every_shipped_spec_matches_the_schema_of_its_kind() {
    let of_kind = |kind| names(kind).into_iter().map(move |name| (kind, name));
    let specs: Vec<(Kind, String)> = Kind::ALL.into_iter().flat_map(of_kind).collect();
    let values: Vec<(Kind, Value)> = specs.iter().map(|(kind, name)| (*kind, shipped(*kind, name))).collect();
    for ((kind, name), errors) in specs.iter().zip(validated(&values).into_iter().flatten()) {
        assert!(errors.is_empty(), "{}/{name}: {errors:?}", kind.folder());
    }
}

#[test]
fn a_schema_rejects_what_the_parser_rejects() {
    let valid = shipped(Kind::Imu, "3dm_gx2");
    let mut values = vec![(Kind::Imu, valid.clone())];
    for (key, value) in [("rate_hz", json!(0.0)), ("rate_hz", json!("fast")), ("unknown_key", json!(1.0))] {
        let mut changed = valid.clone();
        changed[key] = value;
        values.push((Kind::Imu, changed));
    }
    let Some(errors) = validated(&values) else { return };
    assert_eq!(errors.iter().map(Vec::is_empty).collect::<Vec<_>>(), [true, false, false, false], "{errors:?}");
}

/// Update with `for kind in $(ls docs/reference); do zsim spec reference ${kind%.md} > docs/reference/$kind; done`.
#[test]
fn the_reference_in_docs_is_current() {
    for kind in Kind::ALL {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("docs/reference/{}.md", kind.key()));
        let written = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(written == printed("reference", kind), "{} is not current", path.display());
    }
}

#[test]
fn list_and_show_print_the_shipped_specs() {
    let (list, _) = exits_with(0, zsim().args(["spec", "list", "imu"]));
    assert!(list.contains("specs/imus") && list.contains("3dm_gx2"), "{list}");
    let (text, _) = exits_with(0, zsim().args(["spec", "show", "imu", "3dm_gx2"]));
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("specs/imus/3dm_gx2.ron");
    assert_eq!(text, std::fs::read_to_string(shipped).unwrap());
    let (_, message) = exits_with(2, zsim().args(["spec", "show", "imu", "no_such_imu"]));
    assert!(message.contains("3dm_gx2"), "{message}");
}

/// A misspelt key of an IMU was blamed on `SceneSpec`.
#[test]
fn a_spec_outside_its_folder_is_judged_as_the_kind_that_has_its_keys() {
    let here = tempfile::tempdir().unwrap();
    let imu = include_str!("../../specs/imus/consumer.ron");
    std::fs::write(here.path().join("mine.ron"), imu.replacen("rate_hz", "rate_hx", 1)).unwrap();
    std::fs::write(here.path().join("lidar.ron"), include_str!("../../specs/lidars/utm30lx.ron")).unwrap();
    let error = |arguments: &str| {
        let (code, _, stderr) = run(here.path(), arguments);
        assert_eq!(code, 2, "{stderr}");
        stderr
    };
    let misspelt = error("check mine.ron");
    assert!(misspelt.contains("`rate_hx` in `ImuSpec` (did you mean rate_hz?)"), "{misspelt}");
    let lidar = error("simulate --scene office --imu lidar.ron --duration 1s --out run.mcap");
    assert!(lidar.contains("its keys are those of a spec of kind lidar"), "{lidar}");
    // A misspelt nested key says nothing about the kind.
    std::fs::write(here.path().join("nested.ron"), imu.replacen("scale_percent", "scale_percnt", 1)).unwrap();
    let nested = error("check nested.ron");
    assert!(nested.contains("(did you mean scale_percent?)") && !nested.contains("of kind"), "{nested}");
}

#[test]
fn misspelt_names_and_values_out_of_their_domain_are_errors_with_a_remedy() {
    let here = tempfile::tempdir().unwrap();
    for (arguments, expected) in [
        ("check offcie", "did you mean office?"),
        ("--scene offcie", "did you mean office?"),
        ("--scene office --head handhold", "did you mean handheld?"),
        ("--scene office --duration -5s", "the duration must be above 0 s"),
        ("spring handheld --pitch 2parsecs", "`parsecs` is not a unit of angle"),
        ("gains --up-to -3Hz", "the frequency must be above 0 Hz"),
    ] {
        let (code, _, stderr) = run(here.path(), arguments);
        assert!(code == 2 && stderr.contains(expected), "{arguments}: {stderr}");
    }
    let compare = "compare --truth t.tum e.tum --fail-above position_rsme=5mm";
    let (code, _, stderr) = run(here.path(), compare);
    assert!(code == 2 && stderr.contains("did you mean position_rmse?"), "{stderr}");
    assert_eq!(run(here.path(), "simulate --scene mocap_room --duration 1s --quiet --out run.mcap").0, 0);
    let (code, _, stderr) = run(here.path(), "estimate run.mcap --lidar-topic /scna");
    assert!(code == 1 && stderr.contains("did you mean /scan?"), "{code}: {stderr}");
    let of = |pitch: &str| {
        let (code, out, stderr) = run(here.path(), &format!("spring handheld --pitch {pitch}"));
        assert_eq!(code, 0, "{stderr}");
        out
    };
    assert_eq!(of("3deg"), of("3"));
    assert_eq!(of("3deg"), of("0.05235987755982988rad"));
}

#[test]
fn a_study_may_have_a_name_and_needs_of_a_journey_the_scene_only() {
    let here = tempfile::tempdir().unwrap();
    let study = "(base: journey(scene: \"office\"), axes: [values(path: \"imu\", values: [\"consumer\"])],\n\
                 sampling: grid, seeds: [1], measures: [position_rmse_m])";
    std::fs::write(here.path().join("study.ron"), study).unwrap();
    let (code, out, stderr) = run(here.path(), "check study.ron");
    assert!(code == 0 && out.contains("study, OK"), "{out}{stderr}");
    let named = |name: &str| {
        let spring = "base: spring(head: \"handheld\", shake: (pitch_deg: 2.0)), measures: [rocking_hz], sampling: grid,\n\
                      axes: [linear(path: \"head.wire_diameter_mm\", from: 2.9, to: 3.1, steps: 2)]";
        std::fs::write(here.path().join("named.ron"), format!("(name: \"{name}\",\n{spring})")).unwrap();
        run(here.path(), "study named.ron")
    };
    let (code, out, stderr) = named("my springs");
    assert!(code == 0 && out.ends_with("results/my springs\n"), "{out}{stderr}");
    for hostile in ["../up", "a/b", "", ".", "a\u{7}"] {
        let (code, _, stderr) = named(hostile);
        assert!(code == 2 && stderr.contains("must be the name of a folder"), "{hostile:?}: {stderr}");
    }
}
