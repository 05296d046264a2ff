//! Where the base was, by an IMU of its own beside what the head tells.

use super::StudyError;
use super::calibration::base_imu_noise;
use crate::dynamics::{DynamicsError, HeadModel};
use crate::estimation::{BaseEstimate, BaseFix, BaseImu, EstimationError, EstimatorSpec, FixSigmas, load, smooth_base};
use crate::geometry::{Pose, Rotation, Trajectory, Vector};
use crate::measurement::ImuSample;
use crate::recording::{BaseImuRecord, Reader};
use crate::time::Stamp;

/// Gaps between samples of the base's IMU that count as missing time, and the most of that in all, s.
const SHORT_GAP_S: f64 = 1.0;
const MOST_MISSING_S: f64 = 600.0;

/// A map is level enough to this, rad; found in so many passes at most.
const LEVEL_RAD: f64 = 1e-4;
const MOST_PASSES: usize = 8;

/// The base's trajectory from its IMU, which `record` has, and from where the trajectory `world_from_head` puts it: by
/// the spring's law, and where that tells nothing by the rigid link. The IMU's noise is that in the manifest of
/// `reader`, else that of an ordinary one; its pose in the base is that in `record`, else it is at the base's origin
/// and along its axes.
///
/// The spring bends as gravity pulls, so a map that is not level puts the base wrongly: by half of its tilt, with the
/// handheld head. The base's IMU tells which way is up, given where the base is: the map is levelled by that, and both
/// are repeated until it is level. The trajectory told is in the world of `world_from_head` all the same.
///
/// # Errors
/// When the law fails, the IMU's samples have long gaps, or the IMU and the trajectory have too little in common or
/// contradict each other.
pub fn base_by_imu(
    head: &HeadModel,
    world_from_head: &Trajectory,
    (reader, record): (&Reader, &BaseImuRecord),
    clock_offset_s: Option<f64>,
) -> Result<BaseEstimate, StudyError> {
    check_gaps(&record.samples)?;
    let imu = BaseImu {
        base_from_imu: record.base_from_imu.unwrap_or_else(Pose::identity),
        noise: base_imu_noise(reader)?,
        clock_offset_s,
    };
    let spec = load("default")?;
    let mut level_from_world = Rotation::identity();
    let mut estimate = in_level(head, world_from_head, &record.samples, &imu, &spec)?;
    for _ in 1..MOST_PASSES {
        let Some(level) = Rotation::rotation_between(&estimate.up_in_world, &Vector::z()) else { break };
        if level.angle() < LEVEL_RAD {
            break;
        }
        level_from_world = level * level_from_world;
        let turned = world_from_head.transformed(&turn(level_from_world));
        estimate = in_level(head, &turned, &record.samples, &imu, &spec)?;
    }
    let world_from_level = level_from_world.inverse();
    estimate.trajectory = estimate.trajectory.transformed(&turn(world_from_level));
    estimate.up_in_world = world_from_level * estimate.up_in_world;
    Ok(estimate)
}

/// Refuses samples with long gaps, which the smoother fills: its memory would follow the time spanned, not the data.
fn check_gaps(samples: &[ImuSample]) -> Result<(), EstimationError> {
    let gaps = samples.windows(2).map(|pair| (pair[1].stamp.seconds_since(pair[0].stamp), pair[0].stamp));
    let gaps: Vec<(f64, Stamp)> = gaps.filter(|(gap_s, _)| *gap_s > SHORT_GAP_S).collect();
    let missing_s: f64 = gaps.iter().map(|(gap_s, _)| gap_s).sum();
    match gaps.iter().max_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((longest_s, stamp)) if missing_s > MOST_MISSING_S => Err(EstimationError::Base(format!(
            "its IMU has no samples for {missing_s:.0} s in all, the longest gap of {longest_s:.0} s after the stamp {} ns; \
             {MOST_MISSING_S} s at most: if the clock was set while recording, cut the recording there",
            stamp.nanos()
        ))),
        _ => Ok(()),
    }
}

/// The same in a world that is taken to be level.
fn in_level(
    head: &HeadModel,
    world_from_head: &Trajectory,
    samples: &[ImuSample],
    imu: &BaseImu,
    spec: &EstimatorSpec,
) -> Result<BaseEstimate, StudyError> {
    let by_law = base_by_law(head, world_from_head)?;
    let mut told = by_law.iter().peekable();
    let fix = |(stamp, linked)| match told.next_if(|(at, _)| *at == stamp) {
        Some((_, pose)) => BaseFix { stamp, world_from_base: *pose, sigmas: FixSigmas::SPRING },
        None => BaseFix { stamp, world_from_base: linked, sigmas: FixSigmas::RIGID_LINK },
    };
    let fixes: Vec<BaseFix> = head.base_on_rigid_link(world_from_head).into_iter().map(fix).collect();
    Ok(smooth_base(&fixes, samples, imu, spec)?)
}

/// The poses of the base by the spring's law, for one that has an IMU besides: none where a joint holds the head, whose
/// law tells none.
///
/// # Errors
/// When the law fails, or a motor turns the head, which then is nowhere near its rest.
pub fn base_by_law(head: &HeadModel, world_from_head: &Trajectory) -> Result<Vec<(Stamp, Pose)>, DynamicsError> {
    match head.base_under(world_from_head) {
        Err(DynamicsError::BaseUnknown { .. }) if head.unyielding().is_none() => Ok(Vec::new()),
        told => told,
    }
}

fn turn(rotation: Rotation) -> Pose {
    Pose::from_parts(Vector::zeros().into(), rotation)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_jumps_by_a_day_is_refused_with_its_time() {
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
