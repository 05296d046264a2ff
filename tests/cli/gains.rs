//! The commands `gains` and `spring`.

use assert_cmd::Command;
use predicates::prelude::*;
use serde_json::Value;

fn zsim(arguments: &[&str]) -> Command {
    let mut command = Command::cargo_bin("zsim").unwrap();
    command.args(arguments);
    command
}

fn json(arguments: &[&str]) -> Value {
    let output = zsim(arguments).assert().success().get_output().stdout.clone();
    serde_json::from_slice(&output).unwrap()
}

#[test]
fn gains_writes_a_table_and_plots() {
    let here = tempfile::tempdir().unwrap();
    let out = here.path().join("gains");
    let quick = ["gains", "--head", "handheld", "--period", "10", "--up-to", "3", "--realisations", "2"];
    let figures = json(&[&quick[..], &["--json", "--out", out.to_str().unwrap()]].concat());
    assert_eq!(figures["axes"].as_array().unwrap().len(), 6);
    assert_eq!(figures["out"], out.to_str().unwrap());
    let table = std::fs::read_to_string(out.join("gains.csv")).unwrap();
    assert!(table.starts_with("axis,freq_hz,gain,coherence,gain_model,gain_sigma,phase_deg,phase_model_deg\n"));
    assert_eq!(table.lines().count(), 1 + 6 * 30);
    assert!(table.contains("\nx_rot,") && table.contains("\nx,"));
    let words = zsim(&quick).args(["--out", here.path().join("words").to_str().unwrap()]).assert().success();
    let words = String::from_utf8(words.get_output().stdout.clone()).unwrap();
    assert!(words.contains("rotation about x") && words.contains("translation along x"), "{words}");
    assert!(!words.contains("x_rot"), "{words}");
    for file in ["plots/gains.svg", "plots/gains.png", "plots/coherence.svg", "plots/coherence.png", "report.html"] {
        assert!(out.join(file).is_file(), "{file}");
    }
}

#[test]
fn spring_describes_a_head_and_a_single_spring() {
    let here = tempfile::tempdir().unwrap();
    let head = json(&["spring", "handheld", "--json"]);
    assert_eq!(head["stands"], true);
    assert_eq!(head["modes"].as_array().unwrap().len(), 6);
    let file = here.path().join("soft.ron");
    let soft = "coil(coil_diameter_mm: 25, wire_diameter_mm: 2.0, active_coils: 10, free_length_mm: 100, material: spring_steel)";
    std::fs::write(&file, soft).unwrap();
    let fallen = json(&["spring", file.to_str().unwrap(), "--json"]);
    assert_eq!(fallen["stands"], false);
    assert!(fallen["heaviest_head_kg"].as_f64().unwrap() < 0.35);
    zsim(&["spring", file.to_str().unwrap()]).assert().success().stdout(predicate::str::contains("cannot stand"));
}

#[test]
fn coverage_needs_no_scene() {
    let here = tempfile::tempdir().unwrap();
    let out = here.path().join("seen");
    let walked = ["coverage", "--motion", "hand", "--duration", "3s", "--json", "--out", out.to_str().unwrap()];
    let seen = json(&walked);
    assert!(seen["fraction_seen"].as_f64().unwrap() > 0.1, "{seen}");
    assert_eq!(seen["gyro"]["limit_deg_per_s"], 600.0);
    assert_eq!(seen["out"], out.to_str().unwrap());
    let lines = |name: &str| std::fs::read_to_string(out.join(name)).unwrap().lines().count();
    // 40 scans a second; 32 by 64 cells.
    assert_eq!((lines("coverage.csv"), lines("density.csv")), (1 + 120, 1 + 2048));
    assert!(out.join("coverage.png").is_file());
    let still = ["coverage", "--head", "rigid", "--motion", "stand", "--duration", "1s"];
    zsim(&still).assert().success().stdout(predicate::str::contains("observed fraction of the sphere"));
}

#[test]
fn invalid_usage_exits_with_2_and_a_message() {
    for (arguments, sentence) in [
        (&["gains", "--head", "nowhere"][..], "no such head"),
        (&["gains", "--up-to", "0"][..], "--up-to 0"),
        (&["gains", "--realisations", "1"][..], "2 or more"),
        (&["spring", "nowhere"][..], "no such head"),
        (&["spring", "design", "nowhere"][..], "no such study"),
        (&["spring", "handheld", "--pitch", "0"][..], "--pitch 0"),
        (&["coverage", "--motion", "nowhere"][..], "no such motion"),
        (&["coverage", "--duration", "0s"][..], "above 0 s"),
        (&["coverage", "--duration", "10ms"][..], "less than two scans"),
    ] {
        zsim(arguments).assert().code(2).stderr(predicate::str::contains(sentence));
    }
}

#[test]
fn the_shipped_studies_and_springs_are_valid() {
    zsim(&["check", "specs/studies/spring_design.ron", "specs/studies/spring_stock.ron"]).assert().success();
}

#[test]
fn gains_and_spring_refuse_a_mount_without_a_spring() {
    for arguments in [["gains", "--head", "spinning"], ["gains", "--head", "trawling"]] {
        let message = predicate::str::contains("there is no spring, hence nothing to characterise");
        zsim(&arguments).assert().code(2).stderr(message);
    }
    zsim(&["spring", "nodding"]).assert().code(2).stderr(predicate::str::contains("a motor turns the head"));
    zsim(&["check", "spinning", "nodding", "trawling"]).assert().success();
}
