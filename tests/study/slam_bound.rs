//! The measure of a study that compares an estimate with the bound of SLAM.

use crate::command::run;
use serde_json::Value;

const WALKS: &str = r#"(
    base: journey(
        scene: "mocap_room", head: "handheld", motion: "hand", lidar: "utm30lx", imu: "3dm_gx2", clock: "drifting",
        estimator: "default", duration_s: 7.0, limit: (time_s: 300.0, memory_mib: 2048),
    ),
    axes: [values(path: "imu", values: ["3dm_gx2", "tactical"])],
    sampling: grid,
    seeds: [3],
    measures: [closed_position_rmse_m, error_over_slam_bound],
)"#;

#[test]
fn the_error_over_the_bound_of_slam_uses_the_bound_of_the_recording() {
    let here = tempfile::tempdir().unwrap();
    std::fs::write(here.path().join("walks.ron"), WALKS).unwrap();
    let run_ok = |arguments: &str| -> String {
        let (code, out, stderr) = run(here.path(), arguments);
        assert_eq!(code, 0, "`{arguments}`: {stderr}");
        out
    };
    run_ok("study walks.ron -o walks --threads 2");
    let table = std::fs::read_to_string(here.path().join("walks/table.csv")).unwrap();
    let mut rows = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let names = rows.next().unwrap();
    for (row, imu) in rows.zip(["3dm_gx2", "tactical"]) {
        let figure = |name: &str| {
            let column = names.iter().position(|other| *other == name).unwrap();
            row[column].parse::<f64>().unwrap()
        };
        let simulate = format!("simulate --scene mocap_room --duration 7s --seed 3 --imu {imu} --out {imu}.mcap");
        run_ok(&simulate);
        let bounded: Value = serde_json::from_str(&run_ok(&format!("bound {imu}.mcap --map unknown --json"))).unwrap();
        let ratio = figure("closed_position_rmse_m") / bounded["bound_rmse_m"].as_f64().unwrap();
        assert!((ratio / figure("error_over_slam_bound") - 1.0).abs() < 1e-9, "{ratio}: {table}");
    }
}
