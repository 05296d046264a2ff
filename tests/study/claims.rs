//! Claims of a study: verdicts, exit code, and errors in a claim.

use crate::command::run;
use serde_json::Value;
use std::path::Path;

/// A study of four springs. The stiffness of a coil grows with the fourth power of its wire's diameter, and so does the rocking
/// frequency with it.
fn study(claims: &str) -> String {
    format!(
        r#"(
    base: spring(head: "handheld"),
    axes: [
        values(path: "head.wire_diameter_mm", values: [2.6, 3.2]),
        values(path: "head.active_coils", values: [10.0, 12.0]),
    ],
    measures: [rocking_hz, spring_mass_g],
    claims: [
        {claims}
    ],
)"#
    )
}

/// Runs a study with claims; returns its exit code, its claims and the errors.
fn judged(folder: &Path, claims: &str) -> (i32, Vec<Value>, String) {
    std::fs::write(folder.join("springs.ron"), study(claims)).unwrap();
    let (code, out, stderr) = run(folder, "study springs.ron -o out --force --json");
    let printed: Value = serde_json::from_str(&out).unwrap_or(Value::Null);
    (code, printed["claims"].as_array().cloned().unwrap_or_default(), stderr)
}

#[test]
fn a_missed_claim_is_exit_code_1_after_all_files_are_written() {
    let here = tempfile::tempdir().unwrap();
    let thicker_is_faster = r#"smaller(what: "thin wire rocks slower", measure: rocking_hz, at: {"wire_diameter_mm": 2.6}, than: {"wire_diameter_mm": 3.2}),"#;
    let (code, claims, _) = judged(here.path(), thicker_is_faster);
    assert_eq!((code, claims[0]["comparison"]["verdict"].as_str()), (0, Some("met")), "{claims:?}");

    let reversed = thicker_is_faster.replace("2.6", "x").replace("3.2", "2.6").replace('x', "3.2");
    let (code, claims, stderr) = judged(here.path(), &reversed);
    assert_eq!((code, claims[0]["comparison"]["verdict"].as_str()), (1, Some("missed")), "{claims:?}");
    assert!(stderr.contains("1 of 1 claims missed, the first: thin wire rocks slower"), "{stderr}");
    for name in ["table.csv", "study.md", "report.html"] {
        let text = std::fs::read_to_string(here.path().join("out").join(name)).unwrap();
        assert_eq!(text.contains("thin wire rocks slower"), name != "table.csv", "{name}");
    }
    assert_eq!(run(here.path(), "sweep merge out").0, 1);
}

#[test]
fn a_claim_takes_median_and_worst_of_the_runs_at_its_place() {
    let here = tempfile::tempdir().unwrap();
    let (_, _, _) = judged(here.path(), "");
    let table = std::fs::read_to_string(here.path().join("out/table.csv")).unwrap();
    let masses: Vec<f64> = table.lines().skip(1).map(|line| line.split(',').nth(4).unwrap().parse().unwrap()).collect();
    // The last axis varies fastest: the second and the fourth run have 12 coils.
    let (thin, thick) = (masses[1], masses[3]);
    let median = 0.5 * (thin + thick);
    let verdict = |limits: &str| {
        let claim = format!(r#"median(what: "mass", at: {{"active_coils": 12.0}}, measure: spring_mass_g, {limits}),"#);
        let (code, claims, _) = judged(here.path(), &claim);
        let comparison = &claims[0]["comparison"];
        assert!((comparison["median"].as_f64().unwrap() / median - 1.0).abs() < 1e-9, "{comparison}");
        let worst = if limits.contains("most") { thick } else { thin };
        assert!((comparison["worst"].as_f64().unwrap() / worst - 1.0).abs() < 1e-9, "{comparison}");
        assert_eq!(code == 0, comparison["verdict"] == "met");
        code == 0
    };
    assert!(verdict(&format!("most: {}", median + 0.01)) && !verdict(&format!("most: {}", median - 0.01)));
    assert!(verdict(&format!("least: {}", median - 0.01)) && !verdict(&format!("least: {}", median + 0.01)));
    assert!(
        verdict(&format!("most: 900, worst: {}", thick + 0.01))
            && !verdict(&format!("most: 900, worst: {}", thick - 0.01))
    );
    assert!(
        verdict(&format!("least: 1, worst: {}", thin - 0.01)) && !verdict(&format!("least: 1, worst: {}", thin + 0.01))
    );
}

#[test]
fn an_error_in_a_claim_has_its_line() {
    let here = tempfile::tempdir().unwrap();
    for (claim, sentence) in [
        (r#"median(what: "w", measure: sag_mm, most: 1)"#, "sag_mm is not in `measures`"),
        (r#"median(what: "w", measure: rocking_hz)"#, "one of `most` and `least`"),
        (r#"median(what: "w", measure: rocking_hz, most: 1, least: 1)"#, "one of `most` and `least`"),
        (
            r#"median(what: "w", at: {"scene": "attic"}, measure: rocking_hz, most: 1)"#,
            "the axes are wire_diameter_mm, active_coils",
        ),
        (r#"median(what: "w", at: {"active_coils": 11}, measure: rocking_hz, most: 1)"#, "has no level \"11\""),
        (r#"warned(what: "w")"#, "status is not in `measures`"),
    ] {
        std::fs::write(here.path().join("springs.ron"), study(claim)).unwrap();
        let (code, _, stderr) = run(here.path(), "check springs.ron");
        assert!(code == 2 && stderr.contains(sentence) && stderr.contains("springs.ron:9:"), "{claim}: {stderr}");
    }
}

#[test]
fn a_claim_about_a_place_without_runs_is_missed() {
    let here = tempfile::tempdir().unwrap();
    let place = r#"at: {"wire_diameter_mm": 2.6, "active_coils": 10.0}"#;
    let other = r#"than: {"wire_diameter_mm": 3.2, "active_coils": 12.0}"#;
    // A single sample is at one of the four places only.
    let met = |claim: &str| {
        let text = study(claim).replace("measures:", "sampling: latin_hypercube(count: 1), measures:");
        let places = [("2.6", "10.0"), ("2.6", "12.0"), ("3.2", "10.0"), ("3.2", "12.0")];
        places.map(|(wire, coils)| {
            let there = format!(r#"at: {{"wire_diameter_mm": {wire}, "active_coils": {coils}}}"#);
            std::fs::write(here.path().join("springs.ron"), text.replace(place, &there)).unwrap();
            run(here.path(), "study springs.ron -o out --force").0 == 0
        })
    };
    let at_one = met(&format!(r#"median(what: "m", {place}, measure: spring_mass_g, most: 900)"#));
    assert_eq!(at_one.iter().filter(|met| **met).count(), 1, "{at_one:?}");
    let [before @ .., _itself] = met(&format!(r#"smaller(what: "s", measure: spring_mass_g, {place}, {other})"#));
    assert_eq!(before, [false; 3]);
}
