//! The commands for maps and clouds: files and errors.

use crate::command::run;
use serde_json::Value;

#[test]
fn a_recording_is_localised_in_the_map_of_another_and_maps_are_merged() {
    let here = tempfile::tempdir().unwrap();
    let done = |arguments: &str| {
        let (code, out, stderr) = run(here.path(), arguments);
        assert_eq!(code, 0, "{arguments}: {stderr}");
        out
    };
    let has = |file: &str| here.path().join(file).exists();
    for (name, seed) in [("a", 3), ("b", 4)] {
        done(&format!("simulate --scene mocap_room --duration 12s --seed {seed} --out {name}.mcap"));
        done(&format!("estimate {name}.mcap --out {name} --quiet"));
        assert!(has(&format!("{name}/map.ply")) && has(&format!("{name}/cloud.ply")));
    }
    // Localised at rest with a level scan, the head's height in the map is uncertain until it swings.
    let localise = "estimate b.mcap --map a/map.ply --start 0.3,0.2,0,5 --extend-map --cloud-format las --out c --json";
    let (code, metrics, stderr) = run(here.path(), localise);
    assert_eq!(code, 3, "{stderr}");
    assert!(has("c/map.ply") && has("c/cloud.las") && !has("c/cloud.ply") && !has("c/closed_loop.tum"));
    let metrics: Value = serde_json::from_str(&metrics).unwrap();
    let causes = metrics["integrity"]["causes"].as_array().unwrap();
    assert!(causes.len() == 1 && causes[0]["kind"] == "uncertain" && metrics["status"] == "degraded", "{causes:?}");
    assert_eq!(metrics["integrity"]["within_bound"].as_f64(), Some(1.0));
    // Worst of ten pairs of seeds: 3.1 mm.
    assert!(metrics["open_loop"]["position_rmse_m"].as_f64().unwrap() < 0.0095, "{metrics}");
    let cloud = &metrics["cloud"];
    let count = |key: &str| cloud["filter"][key].as_u64().unwrap();
    let dropped = count("dropped_mixed") + count("dropped_isolated") + count("dropped_moving");
    assert_eq!(count("kept") + dropped, cloud["points"].as_u64().unwrap());
    assert!(cloud["judged"].as_str().unwrap().contains("before filtering"));
    // Worst of ten pairs of seeds: 0.19 %.
    assert!(cloud["filter"]["standing_dropped_fraction"].as_f64().unwrap() < 0.0056, "{cloud}");

    let merged: Value = serde_json::from_str(&done("map merge a/map.ply b/map.ply --out both.ply --json")).unwrap();
    assert!(has("both.ply") && merged["residual_rms_m"].as_f64().unwrap() < 0.02, "{merged}");
    let surfels = |which: &str| merged["surfels"][which].as_u64().unwrap();
    assert!(surfels("both") < surfels("first") + surfels("second"), "{merged}");
}

#[test]
fn people_are_removed_from_a_cloud_and_static_surfaces_are_not() {
    let here = tempfile::tempdir().unwrap();
    let done = |arguments: &str| {
        let (code, out, stderr) = run(here.path(), arguments);
        assert_eq!(code, 0, "{arguments}: {stderr}");
        out
    };
    done("simulate --scene office_people --duration 20s --seed 9 --out people.mcap");
    let metrics: Value = serde_json::from_str(&done("estimate people.mcap --open-loop --out a --json")).unwrap();
    let dropped = |of: &str| metrics["cloud"]["filter"][of].as_f64().unwrap();
    assert!(dropped("movers_dropped_fraction") > 0.6, "{metrics}");
    assert!(dropped("standing_dropped_fraction") < 0.01, "{metrics}");
    // The same errors of the cloud in both commands; the run evaluates a sample of its points.
    let evaluate =
        "evaluate --estimate a/open_loop.tum --truth people.tum --cloud a/cloud.ply --scene office_people --json";
    let evaluated: Value = serde_json::from_str(&done(evaluate)).unwrap();
    let ratio = evaluated["sigma_m"].as_f64().unwrap() / dropped("kept_all_sigma_m");
    assert!((ratio - 1.0).abs() < 0.03, "{ratio}: {evaluated} {metrics}");
}

#[test]
fn invalid_maps_and_starts_are_errors_and_create_no_folder() {
    let here = tempfile::tempdir().unwrap();
    std::fs::write(here.path().join("broken.ply"), "ply\nformat ascii 1.0\nelement vertex 0\nend_header\n").unwrap();
    std::fs::write(here.path().join("a.mcap"), "").unwrap();
    let (code, _, stderr) = run(here.path(), "estimate a.mcap --map broken.ply --out out");
    assert!(
        code == 1 && stderr.contains("broken.ply:4: this is a PLY file, but not a surfel map of zsim"),
        "{code} {stderr}"
    );
    let (code, _, stderr) = run(here.path(), "map merge broken.ply absent.ply --out both.ply");
    assert!(code == 1 && stderr.contains("broken.ply:4"), "{code} {stderr}");
    let (code, _, stderr) = run(here.path(), "estimate a.mcap --map broken.ply --start 1,2");
    assert!(
        code == 2 && stderr.contains("x,y,z,yaw are needed, as in 4.2,0.5,0,90; here are 2 numbers"),
        "{code} {stderr}"
    );
    let (code, _, _) = run(here.path(), "estimate a.mcap --extend-map");
    assert_eq!(code, 2, "without a map there is nothing to extend");
    assert!(!here.path().join("out").exists() && !here.path().join("both.ply").exists());
}
