//! The evaluation compared with evo (Grupp, <https://github.com/MichaelGrupp/evo>).

use crate::skip::run_or_skip;
use std::path::{Path, PathBuf};
use std::process::Command;
use zsim::evaluation::{Errors, Pairs, relative_error, relative_error_over_path};
use zsim::geometry::{Pose, Rotation, Trajectory, Vector};
use zsim::time::{Span, Stamp};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/evo").join(name)
}

fn tum(path: &Path) -> Trajectory {
    let text = std::fs::read_to_string(path).unwrap();
    let poses = text.lines().map(|line| {
        let n: Vec<f64> = line.split_whitespace().map(|word| word.parse().unwrap()).collect();
        let rotation = Rotation::from_quaternion(nalgebra::Quaternion::new(n[7], n[4], n[5], n[6]));
        let stamp = Stamp::from_nanos(0) + Span::from_seconds(n[0]);
        (stamp, Pose::from_parts(Vector::new(n[1], n[2], n[3]).into(), rotation))
    });
    Trajectory::from_poses(poses).unwrap()
}

/// Position RMSE in metres and rotation RMSE in degrees, after alignment.
fn ours(truth: &Path, estimate: &Path) -> [f64; 2] {
    let pairs = Pairs::associate(&tum(estimate), &tum(truth)).unwrap();
    let errors = Errors::after(&pairs, &pairs.world_from_map().unwrap());
    [errors.position_rmse_m(), errors.rotation_rmse_rad().to_degrees()]
}

fn assert_agree(ours: [f64; 2], evo: [f64; 2]) {
    for (ours, evo) in ours.iter().zip(evo) {
        assert!((ours / evo - 1.0).abs() < 1e-3, "ours {ours}, evo {evo}");
    }
}

#[test]
fn errors_agree_with_stored_results_of_evo() {
    // evo 1.38.1, in tests/data/evo: `evo_ape tum truth.tum estimate.tum -a` gives rmse 0.029285, and with
    // `-r angle_deg` rmse 0.901246.
    assert_agree(ours(&data("truth.tum"), &data("estimate.tum")), [0.029_285, 0.901_246]);
}

#[test]
fn errors_agree_with_evo_if_it_is_installed() {
    // A minute of walking with a drift, noise from a recurrence, and an estimate in a separate frame.
    let folder = tempfile::tempdir().unwrap();
    let (truth, estimate) = (folder.path().join("truth.tum"), folder.path().join("estimate.tum"));
    std::fs::write(&truth, walk(0.0)).unwrap();
    std::fs::write(&estimate, walk(1.0)).unwrap();
    let Some(position) = evo_ape(&truth, &estimate, "trans_part") else { return };
    let rotation = evo_ape(&truth, &estimate, "angle_deg").unwrap();
    assert_agree(ours(&truth, &estimate), [position, rotation]);
}

#[test]
fn relative_errors_agree_with_evo_if_it_is_installed() {
    let folder = tempfile::tempdir().unwrap();
    let (truth, estimate) = (folder.path().join("truth.tum"), folder.path().join("estimate.tum"));
    std::fs::write(&truth, walk(0.0)).unwrap();
    std::fs::write(&estimate, walk(1.0)).unwrap();
    let pairs = Pairs::associate(&tum(&estimate), &tum(&truth)).unwrap();
    let per_metre = relative_error_over_path(&pairs, 1.0).unwrap();
    // evo counts no time: at 100 Hz, 100 poses are a second.
    let per_second = relative_error(&pairs, Span::from_seconds(1.0)).unwrap();
    for (ours, options) in
        [(per_metre, ["-d", "1", "-u", "m", "--pairs_from_reference"]), (per_second, ["-d", "100", "-u", "f", "-v"])]
    {
        let rmse = |relation: &str| {
            let mut command = Command::new("evo_rpe");
            command.arg("tum").args([&truth, &estimate]).args(["--all_pairs", "-r", relation]).args(options);
            rmse(&mut command)
        };
        let Some(position) = rmse("trans_part") else { return };
        let rotation = rmse("angle_deg").unwrap();
        assert_agree([ours.position_rmse_m, ours.rotation_rmse_rad.to_degrees()], [position, rotation]);
    }
}

fn walk(error: f64) -> String {
    let mut noise = 0.5_f64;
    let mut text = String::new();
    for k in 0..6000 {
        // Logistic map with r = 4: chaotic, and the same on every platform.
        noise = 4.0 * noise.mul_add(-noise, noise) + if k == 0 { -0.3 } else { 0.0 };
        let t = f64::from(k) * 0.01;
        let at = Vector::new(4.0 * (0.3 * t).sin(), 3.0 * (0.41 * t).cos(), 0.1 * (12.0 * t).sin());
        let wrong = Vector::new(0.02 * (noise - 0.5), 0.01 * (0.2 * t).sin(), 0.001 * t) * error;
        let turn = Rotation::from_euler_angles(0.1 * t.sin(), 0.6 * (7.0 * t).sin(), 0.3 * t);
        let wrong_turn = Rotation::from_scaled_axis(Vector::new(0.01, -0.02, 0.03) * error * noise);
        let map = Pose::from_parts(
            Vector::new(error, -2.0 * error, 0.0).into(),
            Rotation::from_euler_angles(0.0, 0.1 * error, error),
        );
        let pose = map * Pose::from_parts((at + wrong).into(), wrong_turn * turn);
        let (p, q) = (pose.translation.vector, pose.rotation);
        text +=
            &format!("{:.9} {:.9} {:.9} {:.9} {:.9} {:.9} {:.9} {:.9}\n", 50.0 + t, p.x, p.y, p.z, q.i, q.j, q.k, q.w);
    }
    text
}

fn evo_ape(truth: &Path, estimate: &Path, relation: &str) -> Option<f64> {
    rmse(Command::new("evo_ape").arg("tum").args([truth, estimate]).args(["-a", "-r", relation]))
}

/// The RMSE that evo prints; `None` if it is not installed.
fn rmse(command: &mut Command) -> Option<f64> {
    let output = run_or_skip("evo", command)?;
    let text = String::from_utf8(output.stdout).unwrap();
    let line = text.lines().find(|line| line.trim().starts_with("rmse"));
    Some(line.unwrap_or_else(|| panic!("no rmse in:\n{text}")).split_whitespace().nth(1).unwrap().parse().unwrap())
}
