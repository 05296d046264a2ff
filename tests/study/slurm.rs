//! A sweep on a real Slurm cluster of two nodes that the test starts and stops.

use crate::skip::run_or_skip;
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};
use std::time::Duration;

struct Cluster {
    folder: tempfile::TempDir,
    conf: String,
}

fn script(verb: &str, folder: &Path) -> Option<Output> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/slurm/cluster.sh");
    run_or_skip("slurm", Command::new("bash").arg(script).arg(verb).arg(folder))
}

impl Cluster {
    /// Starts the cluster; `None`, reported as skipped, if it cannot run on this machine.
    fn start() -> Option<Self> {
        let folder = tempfile::tempdir().unwrap();
        let output = script("up", folder.path())?;
        // Its destructor stops the daemons that started, even if the others did not.
        let mut cluster = Self { folder, conf: String::new() };
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let stdout = String::from_utf8(output.stdout).unwrap();
        cluster.conf = stdout.lines().find_map(|line| line.strip_prefix("SLURM_CONF=")).unwrap().to_owned();
        Some(cluster)
    }

    fn command(&self, program: &str) -> Command {
        let mut command = Command::new(program);
        command.env("SLURM_CONF", &self.conf);
        command
    }
}

impl Drop for Cluster {
    fn drop(&mut self) {
        script("down", self.folder.path());
    }
}

fn zsim(cluster: Option<&Cluster>, folder: &Path, arguments: &str) -> String {
    let program = env!("CARGO_BIN_EXE_zsim");
    let mut command = cluster.map_or_else(|| Command::new(program), |cluster| cluster.command(program));
    let output = command.current_dir(folder).args(arguments.split_whitespace()).output().unwrap();
    assert!(output.status.success(), "`{arguments}`: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// A sweep of four runs, one of which fails.
pub(crate) const SWEEP: &str = r#"(
    base: journey(
        scene: "mocap_room", head: "handheld", motion: "hand", lidar: "utm30lx", imu: "3dm_gx2", clock: "drifting",
        estimator: "default", duration_s: 6.0, limit: (time_s: 300.0, memory_mib: 1024),
    ),
    axes: [values(path: "head.wire_diameter_mm", values: [0.5, 2.8, 3.0, 3.2])],
    sampling: grid,
    seeds: [1],
    measures: [position_rmse_m, fraction_seen],
)"#;

#[test]
fn a_job_array_gives_the_bytes_of_a_local_run() {
    let Some(cluster) = Cluster::start() else { return };
    let here = tempfile::tempdir().unwrap();
    std::fs::write(here.path().join("s.ron"), SWEEP).unwrap();
    for name in ["slurm", "local"] {
        zsim(None, here.path(), &format!("sweep plan s.ron -o {name}"));
    }
    let stdout = zsim(Some(&cluster), here.path(), "sweep submit slurm --slurm --elements 2 --json");
    let submitted: Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!(submitted["elements"], 2);
    let job = submitted["job"].as_u64().unwrap().to_string();
    let mut nodes = Vec::new();
    for _ in 0..3000 {
        let queue = cluster.command("squeue").args(["-h", "-j", &job, "-o", "%T %N"]).output().unwrap();
        let queue = String::from_utf8(queue.stdout).unwrap();
        if queue.trim().is_empty() {
            break;
        }
        nodes.extend(queue.lines().filter_map(|line| line.strip_prefix("RUNNING ")).map(str::to_owned));
        std::thread::sleep(Duration::from_millis(100));
    }
    nodes.sort();
    nodes.dedup();
    assert_eq!(nodes, ["n0", "n1"]);
    zsim(None, here.path(), "sweep merge slurm");
    zsim(None, here.path(), "sweep run local");
    zsim(None, here.path(), "sweep merge local");
    let table = |name: &str, file: &str| std::fs::read(here.path().join(name).join(file)).unwrap();
    for file in ["table.csv", "table.schema.json"] {
        assert!(table("slurm", file) == table("local", file), "{file}");
    }
    let stdout = zsim(Some(&cluster), here.path(), "sweep submit slurm --slurm --json");
    assert_eq!(serde_json::from_str::<Value>(&stdout).unwrap()["elements"], 0, "no run is missing");
}
