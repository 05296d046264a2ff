//! The estimator on closed-form walks: accuracy, repeatability, and imperfect recordings.

use crate::estimation::fixture::{Room, Run, Score, Walk, calibration};
use zsim::estimation::{EstimationError, Estimator, EstimatorSpec, EventKind, OpenLoop, estimate_all, load};
use zsim::geometry::{Pose, Vector, from_roll_pitch_yaw};
use zsim::measurement::Measurement;
use zsim::time::{Span, Stamp};

fn hall(seed: u64, duration_s: f64) -> Run {
    Run::new(Room::furnished(), Walk { start_s: 1.5, ..Walk::new((1.8, 1.2), 25.0) }, seed, duration_s)
}

fn spec() -> EstimatorSpec {
    load("default").unwrap()
}

fn estimate(measurements: Vec<Measurement>) -> OpenLoop {
    estimate_all(&spec(), &calibration(), measurements.into_iter()).unwrap()
}

fn stamp_of(measurement: &mut Measurement) -> &mut Stamp {
    match measurement {
        Measurement::Imu(sample) => &mut sample.stamp,
        Measurement::Lidar(scan) => &mut scan.stamp,
    }
}

fn seconds(measurement: &Measurement) -> f64 {
    match measurement {
        Measurement::Imu(sample) => sample.stamp.nanos() as f64 * 1e-9,
        Measurement::Lidar(scan) => scan.stamp.nanos() as f64 * 1e-9,
    }
}

#[test]
fn a_walk_through_a_hall_is_estimated_to_5_mm_and_the_clock_to_0_2_ms() {
    let run = hall(11, 14.0);
    let result = estimate(run.measurements());
    let score = Score::of(&result, &run);
    assert!(score.rmse_m < 0.0045, "{score:?}");
    assert!(score.clock_end_s.abs() < 2e-4, "{score:?}");
    // Poses are at multiples of the IMU's period, without gaps, over the full recording.
    let stamps = result.trajectory.stamps();
    assert!(stamps.iter().all(|stamp| stamp.nanos() % 10_000_000 == 0));
    assert!(stamps.windows(2).all(|pair| (pair[1] - pair[0]).nanos() == 10_000_000));
    let (first, last) = result.trajectory.span().unwrap();
    assert!(first < Stamp::from_nanos(100_000_000) && last > Stamp::from_nanos(13_800_000_000), "{first:?} {last:?}");
}

#[test]
fn without_noise_the_walk_is_estimated_below_a_millimetre() {
    let run = Run { noise: 0.0, jitter_s: 0.0, ..hall(1, 10.0) };
    let score = Score::of(&estimate(run.measurements()), &run);
    assert!(score.rmse_m < 0.0007 && score.rotation_deg < 0.035, "{score:?}");
}

#[test]
fn the_estimate_is_the_same_to_the_bit_with_one_thread_and_with_three() {
    let measurements = hall(5, 7.0).measurements();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| estimate(measurements.clone())).poses
    };
    assert!(with(1) == with(3));
}

#[test]
fn the_estimate_is_invariant_to_rotation_and_translation_of_the_world() {
    let here = hall(6, 8.0);
    let mut there = here.clone();
    there.walk.world_from_room =
        Pose::from_parts(Vector::new(40.0, -25.0, 3.0).into(), from_roll_pitch_yaw(0.0, 0.0, 2.1));
    let (a, b) = (estimate(here.measurements()), estimate(there.measurements()));
    // The map's origin is the initial head pose in any world; only the rounding of ranges can differ.
    for (p, q) in a.poses.iter().zip(&b.poses) {
        let apart = p.map_from_head.translation.vector - q.map_from_head.translation.vector;
        assert!(apart.norm() < 1e-4, "{:?}: {apart}", p.stamp);
    }
}

#[test]
fn poses_are_output_in_order_while_measurements_arrive() {
    let mut estimator = Estimator::new(&spec(), &calibration()).unwrap();
    let (mut taken, mut latest_s) = (Vec::new(), 0.0_f64);
    for measurement in hall(7, 8.0).measurements() {
        latest_s = latest_s.max(seconds(&measurement));
        estimator.push(measurement).unwrap();
        taken.extend(estimator.take_poses());
        if let Some(last) = taken.last() {
            // Specified latency: window_s + step_s, 0.1 s for late measurements, and one scan period.
            let behind_s = latest_s - last.stamp.nanos() as f64 * 1e-9;
            assert!(behind_s < 4.0 + 2.0 * 0.5 + 0.15, "{behind_s}");
        }
    }
    assert!(taken.len() > 250, "{}", taken.len());
    let rest = estimator.finish().unwrap();
    taken.extend(rest.poses);
    assert!(taken.windows(2).all(|pair| (pair[1].stamp - pair[0].stamp).nanos() == 10_000_000));
}

#[test]
fn slightly_out_of_order_arrivals_do_not_change_the_estimate() {
    let tidy = hall(8, 6.0).measurements();
    let mut untidy = tidy.clone();
    for three in untidy[3..].chunks_exact_mut(3) {
        three.swap(0, 2);
    }
    assert!(tidy != untidy);
    assert!(estimate(tidy).poses == estimate(untidy).poses);
}

/// The measurements of a run as a driver publishes them: in order, with increasing stamps for each sensor.
fn in_order(run: &Run) -> Vec<Measurement> {
    let mut measurements = run.measurements();
    for is_imu in [true, false] {
        let sensor = |m: &&mut Measurement| matches!(m, Measurement::Imu(_)) == is_imu;
        let mut stamps: Vec<Stamp> = measurements.iter_mut().filter(sensor).map(|m| *stamp_of(m)).collect();
        stamps.sort();
        measurements.iter_mut().filter(sensor).zip(stamps).for_each(|(m, stamp)| *stamp_of(m) = stamp);
    }
    measurements
}

#[test]
fn jitter_of_a_full_period_is_smoothed() {
    let run = Run { jitter_s: 1e-2, ..hall(19, 20.0) };
    let result = estimate(in_order(&run));
    let score = Score::of(&result, &run);
    // A tenth of the jitter at up to 400 degrees/s is 0.4 degrees, or 1 cm at 2 m.
    assert!(score.rmse_m < 0.02, "{score:?}");
}

#[test]
fn invalid_stamps_do_not_cause_a_panic() {
    for (seed, jitter_s) in [(20, 0.05), (21, 0.2), (22, 1.0)] {
        let run = Run { jitter_s, ..hall(seed, 8.0) };
        for measurements in [in_order(&run), run.measurements()] {
            let result = estimate_all(&spec(), &calibration(), measurements.into_iter());
            let is_finite = |open: &OpenLoop| open.poses.iter().all(|pose| pose.covariance.iter().all(|x| !x.is_nan()));
            match result {
                Ok(open) => assert!(is_finite(&open), "jitter of {jitter_s} s"),
                // Stamps out of order by a second leave no interval for a pose.
                Err(error) => assert!(jitter_s >= 1.0, "jitter of {jitter_s} s: {error}"),
            }
        }
    }
}

/// The estimate aborted for want of memory: the period of the IMU was taken for years.
#[test]
fn a_sample_long_before_all_others_is_not_used() {
    let run = hall(23, 8.0);
    let mut measurements = in_order(&run);
    let Some(Measurement::Imu(first)) = measurements.iter_mut().find(|m| matches!(m, Measurement::Imu(_))) else {
        panic!("there are samples")
    };
    first.stamp = Stamp::from_nanos(0);
    let score = Score::of(&estimate(measurements), &run);
    assert!(score.rmse_m < 0.003, "{score:?}");
}

/// Both sensors cover eight seconds, but never a whole one: the error said that they had no time in common.
#[test]
fn data_with_a_gap_in_each_second_are_an_error_that_says_so() {
    let mut kept = in_order(&hall(24, 8.0));
    kept.retain(|m| seconds(m).fract() < 0.3);
    let error = estimate_all(&spec(), &calibration(), kept.into_iter()).unwrap_err();
    let EstimationError::Interrupted { common_s, .. } = &error else { panic!("{error}") };
    assert!((6.0..8.0).contains(common_s), "{error}");
}

#[test]
fn a_start_in_motion_is_reported_and_estimated() {
    let mut run = hall(9, 12.0);
    run.walk.start_s = -10.0;
    let result = estimate(run.measurements());
    assert!(result.warnings.iter().any(|w| w.kind == EventKind::StartedInMotion), "{:?}", result.warnings);
    let score = Score::of(&result, &run);
    assert!(score.rmse_m < 0.002, "{score:?}");
}

#[test]
fn the_estimator_tolerates_ten_percent_lost_messages() {
    let run = hall(10, 10.0);
    let kept = run.measurements().into_iter().enumerate().filter(|(k, _)| k % 10 != 4).map(|(_, m)| m).collect();
    let score = Score::of(&estimate(kept), &run);
    assert!(score.rmse_m < 0.005, "{score:?}");
}

/// Estimate and errors of a 14 s walk through the hall without the messages for which `is_lost`.
fn lossy(seed: u64, is_lost: impl Fn(&Measurement) -> bool) -> (OpenLoop, Score) {
    let run = hall(seed, 14.0);
    let result = estimate(run.measurements().into_iter().filter(|m| !is_lost(m)).collect());
    let score = Score::of(&result, &run);
    (result, score)
}

fn warned(result: &OpenLoop, of: fn(&EventKind) -> bool) -> usize {
    result.warnings.iter().filter(|warning| of(&warning.kind)).count()
}

#[test]
fn after_a_gap_of_two_seconds_the_head_is_relocalised() {
    let (result, score) = lossy(12, |m| (6.0..8.0).contains(&seconds(m)));
    let gap = |kind: &EventKind| matches!(kind, EventKind::Restarted { seconds } if (1.9..2.1).contains(seconds));
    assert_eq!(warned(&result, gap), 1, "{:?}", result.warnings);
    assert_eq!(warned(&result, |kind| matches!(kind, EventKind::Relocalised { .. })), 1, "{:?}", result.warnings);
    assert!(result.trajectory.span().unwrap().1 > Stamp::from_nanos(13_500_000_000));
    // There are no poses during the gap.
    let silence = Stamp::from_nanos(6_200_000_000)..Stamp::from_nanos(7_900_000_000);
    assert!(!result.trajectory.stamps().iter().any(|stamp| silence.contains(stamp)));
    assert!(score.worst_m < 0.009, "{score:?}");
}

#[test]
fn the_relocalisation_waits_until_there_are_enough_data() {
    // The lidar returns 5 s after the IMU: no window in between can be relocalised.
    let is_lost = |m: &Measurement| match m {
        Measurement::Imu(_) => (6.0..7.0).contains(&seconds(m)),
        _ => (6.0..12.0).contains(&seconds(m)),
    };
    let (result, score) = lossy(12, is_lost);
    assert_eq!(warned(&result, |kind| matches!(kind, EventKind::TooShortToRelocalise { .. })), 1);
    assert_eq!(warned(&result, |kind| matches!(kind, EventKind::Relocalised { .. })), 1, "{:?}", result.warnings);
    assert!(score.worst_m < 0.08, "{score:?}");
}

#[test]
fn short_gaps_of_the_imu_are_bridged() {
    for (seed, gap_s) in [(15, 0.06), (16, 0.1)] {
        let silent = |t_s: f64| [5.2, 8.3, 10.9].iter().any(|from_s| (*from_s..from_s + gap_s).contains(&t_s));
        let (result, score) = lossy(seed, |m| matches!(m, Measurement::Imu(_)) && silent(seconds(m)));
        let count = warned(&result, |kind| matches!(kind, EventKind::ImuGap { .. }));
        assert_eq!(count, 3, "{:?}", result.warnings);
        assert!(score.rmse_m < 0.0085, "{gap_s} s: {score:?}");
    }
}

#[test]
fn a_longer_gap_of_the_imu_is_bridged_if_the_motion_is_slow_enough_else_the_head_is_relocalised() {
    // The hall's motion allows 0.15 s; no motion allows more than `max_gap_s`, 0.5 s.
    for (seed, gap_s, relocalised) in [(15, 0.15, 0), (16, 0.55, 1), (17, 1.0, 1)] {
        let is_silent = |m: &Measurement| (6.2..6.2 + gap_s).contains(&seconds(m));
        let (result, score) = lossy(seed, |m| matches!(m, Measurement::Imu(_)) && is_silent(m));
        let count = warned(&result, |kind| matches!(kind, EventKind::Relocalised { .. }));
        assert_eq!(count, relocalised, "{gap_s} s: {:?}", result.warnings);
        let count = warned(&result, |kind| matches!(kind, EventKind::ImuGap { .. }));
        assert_eq!(count, 1 - relocalised, "{gap_s} s: {:?}", result.warnings);
        assert!(score.worst_m < 0.022, "{gap_s} s: {score:?}");
    }
}

/// Whether the IMU is silent during one of `gaps`, each given by start and end, s.
fn imu_is_silent(measurement: &Measurement, gaps: &[(f64, f64)]) -> bool {
    let is_in = |(from_s, to_s): &(f64, f64)| (*from_s..*to_s).contains(&seconds(measurement));
    matches!(measurement, Measurement::Imu(_)) && gaps.iter().any(is_in)
}

#[test]
fn data_after_a_gap_that_are_too_few_to_relocalise_have_no_estimate() {
    let (result, score) = lossy(12, |m| imu_is_silent(m, &[(12.6, 13.6)]));
    let short = |kind: &EventKind| matches!(kind, EventKind::TooShortToRelocalise { seconds } if *seconds < 0.5);
    assert_eq!(warned(&result, short), 1, "{:?}", result.warnings);
    let end = result.trajectory.span().unwrap().1;
    assert!(end <= Stamp::from_nanos(12_600_000_000), "{end:?}");
    assert!(score.worst_m < 0.01, "{score:?}");
}

#[test]
fn a_second_gap_soon_after_the_first_does_not_end_the_relocalisation() {
    for second in [(7.6, 8.4), (9.0, 9.8)] {
        let (result, score) = lossy(12, |m| imu_is_silent(m, &[(6.2, 7.2), second]));
        assert!(warned(&result, |kind| matches!(kind, EventKind::Relocalised { .. })) >= 1, "{:?}", result.warnings);
        assert_eq!(
            warned(&result, |kind| matches!(kind, EventKind::NotRelocalised { .. })),
            0,
            "{:?}",
            result.warnings
        );
        // Worst of ten seeds: 4.8 mm.
        assert!(score.worst_m < 0.0145, "{second:?}: {score:?}");
    }
}

#[test]
fn a_clock_jump_of_a_quarter_of_an_hour_is_a_long_gap() {
    let mut measurements = hall(13, 9.0).measurements();
    for measurement in &mut measurements {
        if seconds(measurement) > 6.0 {
            *stamp_of(measurement) += Span::from_seconds(1000.0);
        }
    }
    let result = estimate(measurements);
    assert!(result.warnings.iter().any(|w| matches!(w.kind, EventKind::Restarted { .. })), "{:?}", result.warnings);
    let end = result.trajectory.span().unwrap().1;
    assert!(end > Stamp::from_nanos(1_008_000_000_000), "{end:?}");
    assert!(result.trajectory.len() < 900, "{}", result.trajectory.len());
}

#[test]
fn measurements_with_decreasing_stamps_are_dropped_with_a_warning() {
    let mut measurements = hall(14, 9.0).measurements();
    for measurement in &mut measurements {
        if seconds(measurement) > 6.0 {
            *stamp_of(measurement) += Span::from_seconds(-5.0);
        }
    }
    let result = estimate(measurements);
    let discarded = |kind: &EventKind| matches!(kind, EventKind::LateSamples { count } if *count > 50);
    assert!(result.warnings.iter().any(|w| discarded(&w.kind)), "{:?}", result.warnings);
    assert!(result.trajectory.len() > 300);
}

#[test]
fn without_lidar_returns_the_imu_is_integrated_with_a_warning() {
    let mut measurements = hall(15, 8.0).measurements();
    for measurement in &mut measurements {
        if let Measurement::Lidar(scan) = measurement {
            scan.returns.clear();
        }
    }
    let result = estimate(measurements);
    assert!(result.trajectory.len() > 700);
    assert!(result.windows.iter().all(|window| window.matches == 0));
    let lost = |kind: &EventKind| matches!(kind, EventKind::Lost { seconds, of_seconds } if seconds <= of_seconds);
    assert!(result.warnings.iter().any(|w| lost(&w.kind)), "{:?}", result.warnings);
}

/// Outdoors the first beams of a revolution often have no return. The time of the first return is then irregular,
/// while the sensor's stamps are regular. The estimator must smooth the stamps.
#[test]
fn missing_returns_do_not_shift_the_times_of_other_beams() {
    let run = hall(20, 7.0);
    let estimated = |by_first_return: bool| {
        let mut measurements = run.measurements();
        for (k, measurement) in measurements.iter_mut().enumerate() {
            let Measurement::Lidar(scan) = measurement else { continue };
            scan.returns.drain(..scan.returns.len() * (k * 7 % 10) / 20);
            if by_first_return {
                let late = scan.returns[0].offset;
                scan.returns.iter_mut().for_each(|hit| hit.offset = hit.offset - late);
                (scan.stamp, scan.stamped_after) = (scan.stamp + late, Span::ZERO - late);
            }
        }
        estimate(measurements).trajectory
    };
    let (even, uneven) = (estimated(false), estimated(true));
    assert!(even.len() > 600);
    for ((_, a), (_, b)) in even.iter().zip(uneven.iter()) {
        assert!((a.translation.vector - b.translation.vector).norm() < 1e-6, "{a} {b}");
    }
}

/// A cheap IMU: a gyroscope bias of 3 degrees/s, and five times the noise of its calibration. The head rests for
/// 1.5 s, in which both are observable.
#[test]
fn bias_and_noise_above_specification_are_estimated_at_rest() {
    let run = hall(19, 12.0);
    let (mut measurements, mut chance) = (run.measurements(), 1_u64);
    // Noise as sums of uniform numbers (Irwin-Hall distribution) from Knuth's generator.
    let mut normal = || {
        let mut uniform = || {
            chance = chance.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (chance >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    };
    let sigma = 5.0 * calibration().imu.gyro_density_rad_per_s_per_sqrt_hz * run.imu_rate_hz.sqrt();
    for measurement in &mut measurements {
        if let Measurement::Imu(sample) = measurement {
            let noise = Vector::new(normal(), normal(), normal()) * sigma;
            sample.angular_velocity_rad_per_s += Vector::new(0.03, -0.03, 0.03) + noise;
        }
    }
    let mut raised = calibration();
    raised.imu.gyro_turn_on_bias_rad_per_s = 0.02;
    let result = estimate_all(&spec(), &raised, measurements.into_iter()).unwrap();
    let noisy = |kind: &EventKind| matches!(kind, EventKind::NoisyImu { gyro, .. } if (2.0..6.0).contains(gyro));
    assert!(result.warnings.iter().any(|w| noisy(&w.kind)), "{:?}", result.warnings);
    assert!(!result.warnings.iter().any(|w| w.kind == EventKind::StartedInMotion), "{:?}", result.warnings);
    let score = Score::of(&result, &run);
    // Worst of ten seeds: 3.9 mm.
    assert!(score.worst_m < 0.012, "{score:?}");
}

#[test]
fn after_loss_of_the_lidar_the_imu_is_integrated_with_a_warning() {
    let all = hall(16, 10.0).measurements();
    let kept = all.into_iter().filter(|m| matches!(m, Measurement::Imu(_)) || seconds(m) < 6.0).collect();
    let result = estimate(kept);
    assert!(result.warnings.iter().any(|w| matches!(w.kind, EventKind::LidarGap { .. })), "{:?}", result.warnings);
    // The estimate stops after three seconds without lidar.
    let end_s = result.trajectory.span().unwrap().1.nanos() as f64 * 1e-9;
    assert!((8.5..9.6).contains(&end_s), "{end_s}");
}

#[test]
fn a_recording_without_one_of_the_sensors_is_an_error() {
    let all = hall(17, 4.0).measurements();
    let (imu, lidar): (Vec<_>, Vec<_>) = all.into_iter().partition(|m| matches!(m, Measurement::Imu(_)));
    let run = |measurements: Vec<Measurement>| estimate_all(&spec(), &calibration(), measurements.into_iter());
    assert_eq!(run(Vec::new()).unwrap_err(), EstimationError::NoImu { scans: 0 });
    assert_eq!(run(lidar).unwrap_err(), EstimationError::NoImu { scans: 160 });
    assert_eq!(run(imu).unwrap_err(), EstimationError::NoLidar { samples: 400 });
    let short = hall(17, 0.4).measurements();
    assert!(matches!(run(short).unwrap_err(), EstimationError::TooShort { .. }));
}

/// The error blamed gaps of both sensors.
#[test]
fn scans_of_equal_ranges_are_an_error_that_says_so() {
    let mut measurements = in_order(&hall(17, 4.0));
    for measurement in &mut measurements {
        if let Measurement::Lidar(scan) = measurement {
            scan.returns.iter_mut().for_each(|hit| hit.point_in_laser = hit.point_in_laser.normalize());
        }
    }
    let error = estimate_all(&spec(), &calibration(), measurements.into_iter()).unwrap_err();
    assert_eq!(error, EstimationError::NoReturns { scans: 160 });
}

#[test]
fn a_point_with_nan_is_refused() {
    let mut estimator = Estimator::new(&spec(), &calibration()).unwrap();
    let mut scan = hall(18, 1.0).measurements().into_iter().find(|m| matches!(m, Measurement::Lidar(_))).unwrap();
    if let Measurement::Lidar(scan) = &mut scan {
        scan.returns[0].point_in_laser.x = f32::NAN;
    }
    assert!(matches!(estimator.push(scan).unwrap_err(), EstimationError::NotFinite { sensor: "lidar", .. }));
}

/// A single outlier of any size in rate or force costs less than 8 mm, and is counted.
#[test]
fn an_outlier_sample_is_removed() {
    for (rate, force) in [(10.0, 0.0), (0.0, 1e4), (1e30, 0.0), (f64::NAN, 0.0)] {
        let run = hall(18, 10.0);
        let mut measurements = run.measurements();
        let samples = measurements.iter_mut().filter_map(|m| if let Measurement::Imu(s) = m { Some(s) } else { None });
        let sample = samples.into_iter().nth(600).unwrap();
        sample.angular_velocity_rad_per_s.x += rate;
        sample.specific_force_m_per_s2.y += force;
        let result = estimate(measurements);
        let counted = |kind: &EventKind| matches!(kind, EventKind::Outliers { count: 1 });
        assert_eq!(warned(&result, counted), 1, "{rate}, {force}: {:?}", result.warnings);
        let score = Score::of(&result, &run);
        assert!(score.worst_m < 0.008, "{rate}, {force}: {score:?}");
    }
}

#[test]
fn a_calibration_without_noise_is_refused() {
    let mut calibration = calibration();
    calibration.imu.gyro_density_rad_per_s_per_sqrt_hz = 0.0;
    assert!(matches!(Estimator::new(&spec(), &calibration).unwrap_err(), EstimationError::Calibration(_)));
}
