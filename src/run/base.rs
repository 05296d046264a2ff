//! Trajectory of the base from a base-mounted IMU and the head's trajectory.

use super::RunError;
use super::calibration::base_imu;
use zsim_base::geometry::{Pose, Rotation, Trajectory, Vector};
use zsim_base::measurement::ImuSample;
use zsim_base::time::Stamp;
use zsim_dynamics::{DynamicsError, HeadModel};
use zsim_estimation::{BaseEstimate, BaseFix, BaseImu, EstimationError, EstimatorSpec, FixSigmas, load, smooth_base};
use zsim_recording::{BaseImuRecord, Reader};

/// Minimum gap between base IMU samples that counts as missing time, s, and maximum total missing time, s.
const SHORT_GAP_S: f64 = 1.0;
const MAX_MISSING_S: f64 = 600.0;

/// Convergence threshold of the levelling, rad, and maximum number of passes.
const LEVEL_RAD: f64 = 1e-4;
const MAX_PASSES: usize = 8;

/// Estimates the base trajectory from the base IMU in `record` and the head trajectory `world_from_head`.
///
/// The head trajectory gives fixes of the base: by the spring law, or by the rigid link if the law gives no pose. The
/// IMU model is that in the manifest of `reader`, else that of a typical IMU. The IMU pose in the base is that in
/// `record`, else the identity.
///
/// The spring bends under gravity, so a map that is not level gives an incorrect base attitude: by half of the map's
/// tilt for the handheld head. The base IMU observes the vertical. The map is levelled by that vertical and the base is
/// smoothed a second time, until the level converges. The returned trajectory is in the world of `world_from_head`.
///
/// # Errors
/// When the law fails, the IMU samples have long gaps, or the IMU and the trajectory overlap too little or contradict
/// each other.
pub fn base_by_imu(
    head: &HeadModel,
    world_from_head: &Trajectory,
    reader: &Reader,
    record: &BaseImuRecord,
    clock_offset_s: Option<f64>,
) -> Result<BaseEstimate, RunError> {
    check_gaps(&record.samples)?;
    let (noise, averaging) = base_imu(reader)?;
    let base_from_imu = record.base_from_imu.unwrap_or_else(Pose::identity);
    let imu = BaseImu { base_from_imu, noise, averaging, clock_offset_s };
    let spec = load("default")?;
    let mut level_from_world = Rotation::identity();
    let mut estimate = smooth_in_level_world(head, world_from_head, &record.samples, &imu, &spec)?;
    for _ in 1..MAX_PASSES {
        let Some(level) = Rotation::rotation_between(&estimate.up_in_world, &Vector::z()) else { break };
        if level.angle() < LEVEL_RAD {
            break;
        }
        level_from_world = level * level_from_world;
        let turned = world_from_head.transformed(&rotation_only(level_from_world));
        estimate = smooth_in_level_world(head, &turned, &record.samples, &imu, &spec)?;
    }
    let world_from_level = level_from_world.inverse();
    estimate.trajectory = estimate.trajectory.transformed(&rotation_only(world_from_level));
    estimate.up_in_world = world_from_level * estimate.up_in_world;
    Ok(estimate)
}

/// Rejects samples with long gaps: the smoother fills gaps, so memory would grow with the gap instead of the data.
fn check_gaps(samples: &[ImuSample]) -> Result<(), EstimationError> {
    let gaps = samples.windows(2).map(|pair| (pair[1].stamp.seconds_since(pair[0].stamp), pair[0].stamp));
    let gaps: Vec<(f64, Stamp)> = gaps.filter(|(gap_s, _)| *gap_s > SHORT_GAP_S).collect();
    let missing_s: f64 = gaps.iter().map(|(gap_s, _)| gap_s).sum();
    match gaps.iter().max_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((longest_s, stamp)) if missing_s > MAX_MISSING_S => Err(EstimationError::Base(format!(
            "the base IMU has gaps of {missing_s:.0} s in total (maximum {MAX_MISSING_S} s), the longest gap of \
             {longest_s:.0} s after the stamp {} ns; if the clock was set while recording, cut the recording there",
            stamp.nanos()
        ))),
        _ => Ok(()),
    }
}

/// Smooths the base trajectory, with the world's z axis as the vertical.
fn smooth_in_level_world(
    head: &HeadModel,
    world_from_head: &Trajectory,
    samples: &[ImuSample],
    imu: &BaseImu,
    spec: &EstimatorSpec,
) -> Result<BaseEstimate, RunError> {
    let by_law = base_by_law(head, world_from_head)?;
    let mut law_poses = by_law.iter().peekable();
    let fix = |(stamp, linked)| match law_poses.next_if(|(at, _)| *at == stamp) {
        Some((_, pose)) => BaseFix { stamp, world_from_base: *pose, sigmas: FixSigmas::SPRING },
        None => BaseFix { stamp, world_from_base: linked, sigmas: FixSigmas::RIGID_LINK },
    };
    let fixes: Vec<BaseFix> = head.base_from_rigid_link(world_from_head).into_iter().map(fix).collect();
    Ok(smooth_base(&fixes, samples, imu, spec)?)
}

/// Poses of the base by the spring law, as fixes for a base IMU; empty if a joint carries the head.
///
/// # Errors
/// When the law fails, or a motor turns the head: the head is then too distant from the rest pose.
fn base_by_law(head: &HeadModel, world_from_head: &Trajectory) -> Result<Vec<(Stamp, Pose)>, DynamicsError> {
    match head.base_from_force_law(world_from_head) {
        Err(DynamicsError::BaseUnknown { .. }) if head.rigid_mount_reason().is_none() => Ok(Vec::new()),
        poses => poses,
    }
}

fn rotation_only(rotation: Rotation) -> Pose {
    Pose::from_parts(Vector::zeros().into(), rotation)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_jump_of_a_day_is_rejected_with_the_time_of_the_jump() {
        let sample = |nanos| ImuSample {
            stamp: Stamp::from_nanos(nanos),
            angular_velocity_rad_per_s: Vector::zeros(),
            specific_force_m_per_s2: Vector::zeros(),
        };
        let second = 1_000_000_000;
        let with_gap = |gap_s: i64| [0, second, (1 + gap_s) * second, (2 + gap_s) * second].map(sample);
        assert!(check_gaps(&with_gap(600)).is_ok());
        let error = check_gaps(&with_gap(86_400)).unwrap_err().to_string();
        assert!(error.contains("longest gap of 86400 s after the stamp 1000000000 ns"), "{error}");
    }
}
