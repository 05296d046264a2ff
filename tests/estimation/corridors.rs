//! A corridor in which only narrow faces show the motion along it.

use crate::command::run;
use serde_json::Value;

/// The shipped settings with and without fine surfels, for the same recording (docs/decisions/0022-fine-surfels.md).
#[test]
fn fine_surfels_show_the_motion_along_a_corridor() {
    let here = tempfile::tempdir().unwrap();
    let shipped = include_str!("../../specs/estimators/default.ron");
    let without = shipped.replacen("below_conditioning: 0.03,", "below_conditioning: 0,", 1);
    assert_ne!(without, shipped);
    std::fs::write(here.path().join("without.ron"), without).unwrap();
    let seeds = [5, 6];
    let mut mean_m = [0.0; 2];
    for seed in seeds {
        let simulated = format!("simulate --scene corridors --duration 45s --seed {seed} --quiet -o run.mcap --force");
        let (code, _, stderr) = run(here.path(), &simulated);
        assert_eq!(code, 0, "{stderr}");
        for (mean_m, estimator) in mean_m.iter_mut().zip(["default", "without.ron"]) {
            let options = "--open-loop --metrics-only --quiet --json --force";
            let (_, figures, stderr) =
                run(here.path(), &format!("estimate run.mcap {options} --estimator {estimator} --out estimated"));
            let figures: Value = serde_json::from_str(&figures).unwrap_or_else(|_| panic!("{stderr}"));
            *mean_m += figures["open_loop"]["position_rmse_m"].as_f64().unwrap() / seeds.len() as f64;
        }
    }
    let [with_m, without_m] = mean_m;
    // Ten seeds: 36 mm on average, at most 72 mm.
    assert!(with_m < 0.11 && without_m > 2.0 * with_m, "{with_m} m with fine surfels, {without_m} m without");
}
