//! The bound with an unknown map: the planes that the beams hit are unknowns too, with three parameters each.
//!
//! The information of the run is assembled in segments. Each segment keeps some epochs, and marginalises the others and the
//! planes that no other segment sees. The sum over the segments is the information on the planes of the whole run, the
//! constants and the states at the kept epochs; the planes are marginalised, and the rest is inverted.
//!
//! Beams and IMU do not observe the position of the whole map nor its heading. The first pose is therefore the reference:
//! its position and heading are known. The errors are reported after the rigid alignment that the evaluation uses, which
//! removes the choice of the reference.

mod block;
mod block_triangle;
mod chain;
mod dense;
mod division;
mod errors;
mod joint_planes;
mod problem;
mod segment;
mod sightings;

pub(super) use problem::MapPrior;
pub(super) use sightings::Sightings;

use super::epoch::Epoch;
use super::model::{BoundModel, EPOCH, InformationBound};
use super::state::prior;
use crate::EvaluationError;
use chain::{CONSTANTS, HEADING, OWN, POSITION, prior_sigmas, with_minimum_noise};
use dense::Information;
use division::{kept_epochs, segments};
use joint_planes::JointPlanes;
use problem::Problem;
use rayon::prelude::*;
use segment::{Kept, keep};
use zsim_base::time::Stamp;

/// Maximum length of a run, s. Bounds time and memory.
const MAX_S: f64 = 300.0;
/// Excess over the maximum that is allowed, s: a recording of 300 s has a few scans more.
const EXCESS_S: f64 = 1.0;
/// Number of segments that are in memory at a time.
const BATCH: usize = 4;

/// Information on the constants and on the states of the kept epochs, with all planes marginalised. `None` if it is
/// singular.
fn information(problem: &Problem<'_>) -> Option<Information> {
    let planes = 3 * problem.joint.count();
    let mut sum = Information::zeros(planes, CONSTANTS + OWN * problem.kept.len());
    let mut states = planes + CONSTANTS;
    for batch in problem.segments.chunks(BATCH) {
        let kept: Vec<Option<Kept>> = batch.par_iter().map(|segment| keep(problem, segment)).collect();
        for (segment, kept) in batch.iter().zip(kept) {
            let Kept { planes: seen, information } = kept?;
            let seen = seen.into_iter().flat_map(|rank| 3 * rank..3 * rank + 3);
            let own = states..states + OWN * segment.kept.len();
            let at = own.chain(planes..planes + CONSTANTS).chain(seen);
            sum.add_all(&at.collect::<Vec<_>>(), &information);
            // The last epoch of a segment is the first one of the next.
            states += OWN * (segment.kept.len() - 1);
        }
    }
    add_priors(problem, &mut sum);
    sum.marginalised()
}

fn add_priors(problem: &Problem<'_>, sum: &mut Information) {
    let planes = 3 * problem.joint.count();
    (0..planes).for_each(|k| sum.add_prior(k, problem.prior.plane[k % 3]));
    let (own, constants) = prior_sigmas(&prior(&problem.model));
    let first = planes + CONSTANTS;
    constants.iter().enumerate().for_each(|(k, sigma)| sum.add_prior(planes + k, *sigma));
    own.iter().enumerate().for_each(|(k, sigma)| sum.add_prior(first + k, *sigma));
    if let Some((position_m, heading_rad)) = problem.prior.first_pose {
        (0..3).for_each(|k| sum.add_prior(first + POSITION + k, position_m));
        sum.add_prior(first + HEADING, heading_rad);
    }
}

/// Computes the bound over `epochs`, at least two, at the kept ones.
///
/// # Errors
/// When the run is too long, or the information is singular.
pub(super) fn bound(
    model: &BoundModel,
    start: Stamp,
    epochs: &[Epoch],
    sightings: &Sightings,
    prior: MapPrior,
) -> Result<InformationBound, EvaluationError> {
    let seconds = epochs.len() as f64 * EPOCH.seconds();
    if seconds > MAX_S + EXCESS_S {
        return Err(EvaluationError::TooLong { measure: MEASURE, limit_s: MAX_S, found_s: seconds });
    }
    let segments = segments(epochs.len());
    let joint = JointPlanes::of(sightings, &segments, prior.max_joint_planes);
    let kept = kept_epochs(&segments);
    let model = with_minimum_noise(model, seconds);
    let problem = Problem { model, epochs, sightings, segments, kept, joint, prior };
    let information = information(&problem).ok_or(EvaluationError::Singular { measure: MEASURE })?;
    errors::bound(&problem, start, information).ok_or(EvaluationError::Singular { measure: MEASURE })
}

const MEASURE: &str = "the information bound with an unknown map";

#[cfg(test)]
mod tests {
    use super::super::epoch::BeamObservation;
    use super::super::smoother;
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::Vector3;
    use zsim_base::geometry::{Pose, STANDARD_GRAVITY_M_PER_S2, Vector};
    use zsim_base::measurement::ImuSample;

    /// Epochs and beams of a head that swings along x in a box of 4 m, with 27 beams at each epoch.
    fn swing(seconds: f64) -> (Vec<Epoch>, Sightings) {
        let model = BoundModel::for_tests();
        let (mut epochs, mut sightings) = (Vec::new(), Sightings::default());
        for k in 0..=(seconds / EPOCH.seconds()) as usize {
            let at = |t: f64| Pose::translation(0.3 * (2.0 * t).sin(), 0.0, 0.0);
            let t = k as f64 * EPOCH.seconds();
            let imu = |t: f64| at(t) * model.head_from_imu;
            let mut epoch = Epoch::new(&imu(t), &imu(t - 1e-3), 1e-3);
            let force = Vector::new(-1.2 * (2.0 * t).sin(), 0.0, STANDARD_GRAVITY_M_PER_S2);
            let rate = Vector::zeros();
            let sample =
                ImuSample { stamp: Stamp::default(), angular_velocity_rad_per_s: rate, specific_force_m_per_s2: force };
            epoch.add_imu_sample(&sample);
            for beam in 0..27 {
                let beam = observation(t, &at(t), beam);
                let by_clock = epoch.add_beam(&beam, &model.head_from_imu).unwrap();
                sightings.add(k, &beam, by_clock);
            }
            epochs.push(epoch);
        }
        (epochs, sightings)
    }

    /// Beam `number` at a time, on a wall of the box.
    fn observation(t: f64, head: &Pose, number: usize) -> BeamObservation {
        let spread = Vector::new(1.0, (number % 3) as f64 * 0.3 - 0.2, (number / 3 % 3) as f64 * 0.4 - 0.3).normalize();
        let axis = number / 9;
        let sign = if ((t * 4.0) as usize).is_multiple_of(2) { 1.0 } else { -1.0 };
        let direction = Vector::from_fn(|row, _| spread[(row + 3 - axis) % 3]) * sign;
        let origin = head.translation.vector;
        let range = (2.0 - sign * origin[axis]) / (sign * direction[axis]);
        BeamObservation {
            stamp: Stamp::default(),
            world_from_head: *head,
            velocity_in_world: Vector::x() * (0.6 * (2.0 * t).cos()),
            angular_velocity_in_world: Vector::zeros(),
            hit_in_world: origin + direction * range,
            direction_in_world: direction,
            normal_in_world: Vector::ith(axis, -sign),
            range_sigma_m: 0.01,
            plane: (2 * axis) as u32 + u32::from(sign > 0.0),
        }
    }

    #[test]
    fn with_planes_that_are_known_the_bound_is_that_of_the_smoother() {
        // Of 5 s, all kept epochs are 0.2 s apart.
        let (epochs, sightings) = swing(5.0);
        let known = MapPrior { plane: Vector3::repeat(1e-7), first_pose: None, ..MapPrior::UNKNOWN };
        let found = bound(&BoundModel::for_tests(), Stamp::default(), &epochs, &sightings, known).unwrap();
        let expected = smoother::bound(&BoundModel::for_tests(), Stamp::default(), &epochs);
        // The mean over the kept epochs differs from that over all epochs.
        let at_kept =
            expected.stamps.iter().zip(&expected.position_sigma_m).filter(|(at, _)| found.stamps.contains(at));
        let at_kept: Vec<f64> = at_kept.map(|(_, sigma)| sigma.norm_squared()).collect();
        let ends = 0.5 * (at_kept[0] + at_kept[at_kept.len() - 1]);
        let mean = (at_kept.iter().sum::<f64>() - ends) / (at_kept.len() - 1) as f64;
        let aligned_m = expected.aligned_position_rmse_m * mean.sqrt() / expected.position_rmse_m;
        assert_relative_eq!(found.aligned_position_rmse_m, aligned_m, max_relative = 2e-3);
        assert_relative_eq!(found.clock_offset_s, expected.clock_offset_s, max_relative = 1e-4);
        assert_relative_eq!(found.range_offset_m, expected.range_offset_m, max_relative = 1e-4);
    }

    #[test]
    fn planes_that_are_new_in_each_segment_give_less_information() {
        let (epochs, sightings) = swing(8.0);
        let aligned = |max_joint_planes: usize| {
            let prior = MapPrior { max_joint_planes, ..MapPrior::UNKNOWN };
            bound(&BoundModel::for_tests(), Stamp::default(), &epochs, &sightings, prior).unwrap()
        };
        let [all, some, none] = [6, 3, 0].map(aligned);
        assert!(all.aligned_position_rmse_m < some.aligned_position_rmse_m);
        assert!(some.aligned_position_rmse_m < none.aligned_position_rmse_m);
        let [all, some, none] = [all, some, none].map(|bound| bound.unknown_map.unwrap());
        assert_eq!((all.planes, none.planes), (6, 6));
        assert_eq!((all.joint_beam_fraction, none.joint_beam_fraction), (1.0, 0.0));
        assert_relative_eq!(some.joint_beam_fraction, 0.5, max_relative = 0.05);
    }

    #[test]
    fn the_result_does_not_depend_on_the_number_of_threads() {
        let (epochs, sightings) = swing(8.0);
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| bound(&BoundModel::for_tests(), Stamp::default(), &epochs, &sightings, MapPrior::UNKNOWN))
                .unwrap()
        };
        assert_eq!(on(1), on(3));
    }
}
