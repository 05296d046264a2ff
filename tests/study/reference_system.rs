//! Maps compared with that of a reference system.

use crate::command::run;
use std::path::Path;

/// A walk of 14 s through the motion capture room, with a reference system of these specs.
fn study(reference: &str, measures: &str) -> String {
    format!(
        r#"(
    base: journey(
        scene: "mocap_room", head: "handheld", motion: "hand", lidar: "utm30lx", imu: "3dm_gx2", clock: "drifting",
        estimator: "default",{reference}
        duration_s: 14.0, limit: (time_s: 600.0, memory_mib: 4096),
    ),
    axes: [levels(name: "manifest", levels: [(name: "used"), (name: "ignored", set: {{ "ignore_manifest": true }})])],
    sampling: grid,
    seeds: [5],
    measures: [{measures}],
)"#
    )
}

fn column(folder: &Path, name: &str) -> Vec<f64> {
    let text = std::fs::read_to_string(folder.join("swept/table.csv")).unwrap();
    let mut lines = text.lines();
    let place = lines.next().unwrap().split(',').position(|cell| cell == name).unwrap();
    lines.map(|line| line.split(',').nth(place).unwrap().parse().unwrap()).collect()
}

#[test]
fn the_map_of_an_equal_reference_system_is_the_same_map() {
    let here = tempfile::tempdir().unwrap();
    let measures = "closed_position_rmse_m, reference_rmse_m, reference_sigma_m, reference_bias_m, cloud_sigma_m, cloud_over_truth";
    let text = study(r#" reference: (head: "handheld", motion: "hand", lidar: "utm30lx"),"#, measures);
    std::fs::write(here.path().join("equal.ron"), text).unwrap();
    let (code, _, stderr) = run(here.path(), "study equal.ron -o swept --quiet");
    assert_eq!(code, 0, "{stderr}");
    let of = |name| column(here.path(), name);
    let [errors, reference] = ["closed_position_rmse_m", "reference_rmse_m"].map(of);
    // Both levels have one reference, whose estimator uses the manifest: it is the first run again.
    assert_eq!(reference[0], reference[1]);
    assert!((reference[0] / errors[0] - 1.0).abs() < 0.01, "{reference:?} m, run {errors:?} m");
    // Edges give a bias of 1 mm. The distances exceed those to the true surfaces (the range noise of 10 mm) by what the
    // measure adds at edges and furniture, where the nearest surfel is not that of the point's surface: 21 mm in all.
    let [sigma, bias, to_surfaces, over_truth] =
        ["reference_sigma_m", "reference_bias_m", "cloud_sigma_m", "cloud_over_truth"].map(of);
    for run in 0..2 {
        assert!(bias[run].abs() < 3e-3, "bias {bias:?} m");
        assert!((to_surfaces[run]..0.03).contains(&sigma[run]), "{sigma:?} m, from surfaces {to_surfaces:?} m");
        assert!((0.95..1.1).contains(&over_truth[run]), "{over_truth:?}");
    }
}

#[test]
fn a_measure_of_the_reference_needs_a_reference_system() {
    let here = tempfile::tempdir().unwrap();
    for (reference, measure, known) in [
        ("", "reference_sigma_m", "the run in `base` does not measure reference_sigma_m"),
        (r#" reference: (head: "no_such", motion: "cart", lidar: "lms291"),"#, "reference_sigma_m", "no_such"),
    ] {
        std::fs::write(here.path().join("wrong.ron"), study(reference, measure)).unwrap();
        let (code, _, stderr) = run(here.path(), "study wrong.ron -o swept --quiet");
        assert!(code != 0 && stderr.contains(known), "{code}: {stderr}");
    }
}
