//! A sweep as an Indexed Job, run by a stand-in for Kubernetes that kills pods.

use crate::command::run;
use crate::study::slurm::SWEEP;
use serde_json::Value;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

fn zsim(folder: &Path, arguments: &str) -> String {
    let (code, stdout, stderr) = run(folder, arguments);
    assert_eq!(code, 0, "`{arguments}`: {stderr}");
    stdout
}

/// Starts a pod of `job` as Kubernetes does: the arguments of the container, for the image's entry point, and the index.
fn pod(job: &Value, index: u64) -> Child {
    let container = &job["spec"]["template"]["spec"]["containers"][0];
    let arguments = container["args"].as_array().unwrap().iter().map(|argument| argument.as_str().unwrap());
    let mut command = Command::new(env!("CARGO_BIN_EXE_zsim"));
    command.args(arguments).env("JOB_COMPLETION_INDEX", index.to_string());
    command.current_dir("/").stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

#[test]
fn an_indexed_job_with_killed_pods_gives_the_bytes_of_a_local_run() {
    let here = tempfile::tempdir().unwrap();
    std::fs::write(here.path().join("s.ron"), SWEEP.replace("seeds: [1]", "seeds: [1, 2]")).unwrap();
    for name in ["cluster", "local"] {
        zsim(here.path(), &format!("sweep plan s.ron -o {name}"));
    }
    let submit = "sweep submit cluster --kubernetes --image registry.example.org/zsim --claim sweeps --elements 3 --dry-run --json";
    let submitted: Value = serde_json::from_str(&zsim(here.path(), submit)).unwrap();
    assert_eq!((submitted["elements"].as_u64(), &submitted["job"]), (Some(3), &Value::Null));
    let manifest = std::fs::read_to_string(here.path().join("cluster/kubernetes/job.json")).unwrap();
    let job: Value = serde_json::from_str(&manifest).unwrap();
    let spec = &job["spec"];
    assert_eq!((spec["completionMode"].as_str(), spec["completions"].as_u64()), (Some("Indexed"), Some(3)));
    // `backoffLimitPerIndex` is valid only with this policy.
    assert_eq!(spec["template"]["spec"]["restartPolicy"], "Never");
    let container = &spec["template"]["spec"]["containers"][0];
    assert_eq!(container["resources"]["limits"]["memory"], "1280Mi");
    let mounted = Path::new(container["volumeMounts"][0]["mountPath"].as_str().unwrap());
    assert_eq!(mounted, here.path().canonicalize().unwrap());

    for index in 0..spec["completions"].as_u64().unwrap() {
        let repeats = spec["backoffLimitPerIndex"].as_u64().unwrap();
        // All attempts but the last are killed, each a little later.
        for attempt in 0..repeats {
            let mut killed = pod(&job, index);
            std::thread::sleep(Duration::from_millis(200 + 300 * attempt));
            killed.kill().unwrap();
            killed.wait().unwrap();
        }
        assert!(pod(&job, index).wait().unwrap().success(), "index {index}");
    }
    zsim(here.path(), "sweep merge cluster");
    zsim(here.path(), "sweep run local");
    zsim(here.path(), "sweep merge local");
    for file in ["table.csv", "table.schema.json"] {
        let table = |name: &str| std::fs::read(here.path().join(name).join(file)).unwrap();
        assert!(table("cluster") == table("local"), "{file}");
    }
    let (code, _, stderr) = run(here.path(), "sweep submit cluster --kubernetes --dry-run");
    assert!(code == 2 && stderr.contains("--image"), "{stderr}");
}
