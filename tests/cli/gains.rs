//! The commands `gains` and `spring`.

use crate::command::{exits_with, zsim};
use serde_json::Value;
use std::path::Path;

/// Runs zsim, which must succeed; returns stdout.
fn printed(arguments: &[&str]) -> String {
    exits_with(0, zsim().args(arguments)).0
}

/// Runs zsim, which must find the usage or a spec invalid; returns stderr.
fn complaint(arguments: &[&str]) -> String {
    exits_with(2, zsim().args(arguments)).1
}

fn json(arguments: &[&str]) -> Value {
    serde_json::from_str(&printed(arguments)).unwrap()
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
    // The odd multiples of 0.1 Hz up to 3 Hz.
    assert_eq!(table.lines().count(), 1 + 6 * 15);
    assert!(table.contains("\nx_rot,") && table.contains("\nx,"));
    let words = printed(&[&quick[..], &["--out", here.path().join("words").to_str().unwrap()]].concat());
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
    assert!(printed(&["spring", file.to_str().unwrap()]).contains("cannot stand"));
}

/// Runs `spring` on a head or spring with `--out`; returns the page and the figures.
fn spring_files(of: &str, out: &Path) -> (String, Value) {
    printed(&["spring", of, "--out", out.to_str().unwrap()]);
    let figures = std::fs::read_to_string(out.join("spring.json")).unwrap();
    (std::fs::read_to_string(out.join("report.html")).unwrap(), serde_json::from_str(&figures).unwrap())
}

#[test]
fn the_page_of_a_hanging_head_has_a_longer_spring_and_six_named_modes() {
    let here = tempfile::tempdir().unwrap();
    let out = here.path().join("hanging");
    let (page, figures) = spring_files("hanging", &out);
    // k = G d^4 / (8 D^3 n) = 79.3e9 * 0.002^4 / (8 * 0.025^3 * 12) = 845.9 N/m. The wire of pi^2 D n d^2 / 4 = 2.961e-6 m^3
    // has 23.2 g, half of which hangs with the head of 350 g: 0.3616 kg * 9.80665 / 845.9 = 4.19 mm.
    assert!(page.contains("Free length 100.0 mm, 104.2 mm under the head"), "{}", summary(&page));
    // 12 coils of 2 mm leave (104.19 - 24) / 12 = 6.68 mm between them.
    let coil = &figures["coil"];
    assert!((coil["gap_mm"].as_f64().unwrap() - 6.68).abs() < 0.005, "{coil}");
    assert!((coil["load_n"].as_f64().unwrap() + 0.3616 * 9.80665).abs() < 0.002, "{coil}");
    assert!(coil["buckling_margin"].is_null() && page.contains("cannot buckle"), "{coil}");
    let names: Vec<_> =
        figures["modes"].as_array().unwrap().iter().map(|mode| mode["name"].as_str().unwrap()).collect();
    assert_eq!(page.matches("name=\"mode\"").count(), 1 + names.len());
    // The helix has no axis of symmetry, so that it rocks and sways about axes between x and y.
    for (start, count) in [("rocking about", 2), ("sway along", 2), ("bounce along z", 1), ("yaw about z", 1)] {
        assert_eq!(names.iter().filter(|name| name.starts_with(start)).count(), count, "{start}: {names:?}");
    }
    assert!(page.contains("Reference point: the centre of mass of the head"));
    assert!(out.join("modes.svg").is_file());
}

#[test]
fn the_page_of_a_head_that_falls_says_so_and_has_no_modes() {
    let here = tempfile::tempdir().unwrap();
    let file = here.path().join("soft.ron");
    let soft = "coil(coil_diameter_mm: 25, wire_diameter_mm: 2.0, active_coils: 10, free_length_mm: 100, material: spring_steel)";
    std::fs::write(&file, soft).unwrap();
    let (page, figures) = spring_files(file.to_str().unwrap(), &here.path().join("out"));
    assert_eq!(figures["stands"], false);
    assert!(page.contains("<h1>Spring and modes of soft under handheld</h1>"));
    assert!(
        summary(&page).contains("no stable rest pose") && summary(&page).contains("use a thicker wire"),
        "{}",
        summary(&page)
    );
    assert!(page.contains("No modes") && !page.contains("name=\"mode\"") && !page.contains("id=\"play\""));
}

/// The first paragraph of a page.
fn summary(page: &str) -> &str {
    page.split("<p class=\"summary\">").nth(1).and_then(|rest| rest.split("</p>").next()).unwrap()
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
    assert!(printed(&still).contains("observed fraction of the sphere"));
}

#[test]
fn invalid_usage_exits_with_2_and_a_message() {
    for (arguments, sentence) in [
        (&["gains", "--head", "nowhere"][..], "no such head"),
        (&["gains", "--up-to", "0"][..], "above 0 Hz"),
        (&["gains", "--realisations", "1"][..], "2 or more"),
        (&["spring", "nowhere"][..], "no such head"),
        (&["spring", "design", "nowhere"][..], "no such study"),
        (&["spring", "handheld", "--pitch", "0"][..], "--pitch 0"),
        (&["coverage", "--motion", "nowhere"][..], "no such motion"),
        (&["coverage", "--duration", "0s"][..], "above 0 s"),
        (&["coverage", "--duration", "10ms"][..], "less than two scans"),
    ] {
        let stderr = complaint(arguments);
        assert!(stderr.contains(sentence), "{stderr}");
    }
}

#[test]
fn the_shipped_studies_and_springs_are_valid() {
    printed(&["check", "specs/studies/spring_design.ron", "specs/studies/spring_stock.ron"]);
}

#[test]
fn gains_and_spring_refuse_a_mount_without_a_spring() {
    for arguments in [["gains", "--head", "spinning"], ["gains", "--head", "trawling"]] {
        assert!(complaint(&arguments).contains("there is no spring, hence nothing to characterise"));
    }
    assert!(complaint(&["spring", "nodding"]).contains("a motor turns the head"));
    printed(&["check", "spinning", "nodding", "trawling"]);
}
