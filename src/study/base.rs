//! Where the base was, by an IMU of its own beside what the head tells.

use super::StudyError;
use super::calibration::base_imu_noise;
use crate::dynamics::{DynamicsError, HeadModel};
use crate::estimation::{BaseEstimate, BaseFix, BaseImu, EstimatorSpec, FixSigmas, load, smooth_base};
use crate::geometry::{Pose, Rotation, Trajectory, Vector};
use crate::measurement::ImuSample;
use crate::recording::{BaseImuRecord, Reader};
use crate::time::Stamp;

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
/// When the law fails, or the IMU and the trajectory have too little in common or contradict each other.
pub fn base_by_imu(
    head: &HeadModel,
    world_from_head: &Trajectory,
    (reader, record): (&Reader, &BaseImuRecord),
    clock_offset_s: Option<f64>,
) -> Result<BaseEstimate, StudyError> {
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
