//! A sweep as an Indexed Job of Kubernetes.
//!
//! The manifest is JSON, which Kubernetes reads as it reads YAML. It uses `backoffLimitPerIndex` (Kubernetes 1.29): an element that
//! fails is repeated on its own, and finds its finished runs.

use super::super::usage::Usage;
use super::submission::{Submission, output_of};
use anyhow::Context;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Maximum length of a job's name: with the index and a random suffix it names pods, of at most 63 characters.
const MAX_NAME_LENGTH: usize = 45;
/// Number of times that an element is repeated after a failure.
const REPEATS: u64 = 3;
/// Maximum number of pods at the same time; the scheduler starts them as nodes have room.
const MAX_PARALLEL: u64 = 1000;

/// The name of a persistent volume claim: a DNS subdomain (RFC 1123).
pub(super) fn claim(text: &str) -> Result<String, String> {
    let is_label = |label: &str| {
        let is_inner = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        !label.is_empty() && label.chars().all(is_inner) && !label.starts_with('-') && !label.ends_with('-')
    };
    if text.len() <= 253 && text.split('.').all(is_label) {
        return Ok(text.to_owned());
    }
    Err("expected lower-case letters, digits, dots and inner hyphens, at most 253".to_owned())
}

/// The name of a container image.
pub(super) fn image(text: &str) -> Result<String, String> {
    let is_valid = |c: char| c.is_ascii_alphanumeric() || "._-/:@+".contains(c);
    if !text.is_empty() && text.chars().all(is_valid) {
        return Ok(text.to_owned());
    }
    Err("expected the name of an image, such as registry.example/zsim:1".to_owned())
}

/// Writes the manifest; returns its path.
pub(super) fn write(submission: &Submission, image: &str, claim: &str) -> anyhow::Result<PathBuf> {
    let manifest = manifest(submission, image, claim)?;
    submission.write("kubernetes", "job.json", &(serde_json::to_string_pretty(&manifest)? + "\n"))
}

/// Creates the job; returns its name.
pub(super) fn submit(manifest: &Path) -> anyhow::Result<String> {
    output_of(Command::new("kubectl").args(["create", "--output=name", "--filename"]).arg(manifest), "kubectl")
}

fn manifest(submission: &Submission, image: &str, claim: &str) -> anyhow::Result<Value> {
    let Submission { sweep, folder, elements, threads } = submission;
    let path = text(folder)?;
    let volume = folder.parent().filter(|parent| parent.parent().is_some());
    let volume = volume.ok_or_else(|| {
        Usage(format!("{path}: a volume cannot be mounted at /: move the folder of the sweep into another one"))
    })?;
    let arguments =
        ["sweep", "run", path, "--count", &elements.to_string(), "--threads", &threads.to_string(), "--quiet"];
    let resources = json!({ "cpu": threads.to_string(), "memory": format!("{}Mi", submission.memory_mib()) });
    let container = json!({
        "name": "zsim",
        "image": image,
        "args": arguments,
        "resources": { "requests": resources, "limits": { "memory": resources["memory"] } },
        "volumeMounts": [{ "name": "sweeps", "mountPath": text(volume)? }],
    });
    Ok(json!({
        "apiVersion": "batch/v1",
        "kind": "Job",
        "metadata": { "generateName": format!("{}-", job_name(sweep.plan().name())), "labels": { "app.kubernetes.io/name": "zsim" } },
        "spec": {
            "completionMode": "Indexed",
            "completions": elements,
            "parallelism": elements.min(&MAX_PARALLEL),
            "backoffLimitPerIndex": REPEATS,
            "template": {
                "spec": {
                    "restartPolicy": "Never",
                    "containers": [container],
                    "volumes": [{ "name": "sweeps", "persistentVolumeClaim": { "claimName": claim } }],
                },
            },
        },
    }))
}

/// The job's name: lower-case letters, digits and `-`, as names of Kubernetes (RFC 1123).
fn job_name(sweep: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' };
    let name: String = format!("zsim-{sweep}").chars().map(plain).take(MAX_NAME_LENGTH).collect();
    name.trim_end_matches('-').to_owned()
}

fn text(path: &Path) -> anyhow::Result<&str> {
    path.to_str().with_context(|| format!("{} is not UTF-8", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_kubernetes() {
        assert_eq!(job_name("Spring_sweep 2.b"), "zsim-spring-sweep-2-b");
        assert_eq!(job_name("ä/"), "zsim");
        let long = job_name(&"a".repeat(200));
        assert!(long.len() <= MAX_NAME_LENGTH && long.starts_with("zsim-aaa"), "{long}");
    }

    #[test]
    fn invalid_claims_and_images_are_refused() {
        assert!(["data", "data-1.lab", "0"].iter().all(|name| claim(name).is_ok()));
        assert!(
            ["", "Data", "a_b", "-a", "a-", "a..b", "a/b", &"a".repeat(254)].iter().all(|name| claim(name).is_err())
        );
        assert!(["zsim:1", "registry.example:5000/lab/zsim@sha256:0a"].iter().all(|name| image(name).is_ok()));
        assert!(["", "zsim 1", "zsim:1\n"].iter().all(|name| image(name).is_err()));
    }
}
