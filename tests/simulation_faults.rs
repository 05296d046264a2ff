//! Faults of sensors: what each of them does to a simulation that is otherwise the same.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use std::sync::OnceLock;
use zsim::geometry::{Vector, from_roll_pitch_yaw, gravity_in_world};
use zsim::measurement::{ImuSample, LidarScan, Sink, SinkError};
use zsim::random::Seed;
use zsim::simulation::{EPOCH, FaultsSpec, Scenario, Simulation, Specs};
use zsim::spec::{Kind, Source, SpecError, find, names, parse};
use zsim::time::{Span, Stamp};
use zsim::truth::{ClockTruth, TruthSample, TruthSink};

/// Keeps everything, with its arrival.
#[derive(Default, PartialEq, Debug)]
struct Kept {
    samples: Vec<(Stamp, ImuSample)>,
    scans: Vec<(Stamp, LidarScan)>,
    truth: Vec<(Stamp, TruthSample)>,
    clocks: Vec<(Stamp, ClockTruth)>,
    last: Stamp,
}

impl Kept {
    fn arrive(&mut self, now: Stamp) {
        assert!(now >= self.last, "arrivals never decrease");
        self.last = now;
    }
}

impl Sink for Kept {
    fn imu(&mut self, arrival: Stamp, sample: &ImuSample) -> Result<(), SinkError> {
        self.arrive(arrival);
        self.samples.push((arrival, *sample));
        Ok(())
    }

    fn lidar(&mut self, arrival: Stamp, scan: &LidarScan) -> Result<(), SinkError> {
        self.arrive(arrival);
        self.scans.push((arrival, scan.clone()));
        Ok(())
    }
}

impl TruthSink for Kept {
    fn truth(&mut self, now: Stamp, sample: &TruthSample) -> Result<(), SinkError> {
        self.arrive(now);
        self.truth.push((now, *sample));
        Ok(())
    }

    fn clock(&mut self, now: Stamp, clock: &ClockTruth) -> Result<(), SinkError> {
        self.arrive(now);
        self.clocks.push((now, *clock));
        Ok(())
    }
}

const DURATION_S: f64 = 8.0;

fn scenario(scene: &str, imu: &str, seed: u64) -> Scenario {
    let (lidar, imu) = ("utm30lx".to_owned(), imu.to_owned());
    Scenario { duration_s: DURATION_S, seed: Seed(seed), lidar, imu, ..Scenario::in_scene(scene) }
}

fn faults(list: &str) -> Source {
    Source::in_memory("test.ron", format!("(faults: [\n{list}\n])"))
}

/// The simulation of `scenario` with faults.
fn simulation(scenario: &Scenario, list: Option<&str>) -> Result<Simulation, String> {
    let (mut specs, mut sources) = Specs::load(scenario).unwrap();
    let wrong = |error: SpecError| error.to_string();
    if let Some(list) = list {
        let source = faults(list);
        specs.faults = Some(parse::<FaultsSpec>(&source).and_then(|spec| spec.with_files(&source)).map_err(wrong)?);
        sources.faults = Some(source);
    }
    Simulation::build(scenario, specs, &sources).map_err(|error| error.to_string())
}

fn run(scenario: &Scenario, list: Option<&str>) -> Kept {
    let mut kept = Kept::default();
    simulation(scenario, list).unwrap().run(&mut kept, &mut |_| ()).unwrap();
    kept
}

/// The run without faults that all others are compared with.
fn without() -> &'static Kept {
    static KEPT: OnceLock<Kept> = OnceLock::new();
    KEPT.get_or_init(|| run(&usual(), None))
}

fn usual() -> Scenario {
    scenario("mocap_room", "3dm_gx2", 1)
}

fn with(list: &str) -> Kept {
    run(&usual(), Some(list))
}

fn since_start_s(stamp: Stamp) -> f64 {
    stamp.seconds_since(EPOCH)
}

fn seconds(s: f64) -> Span {
    Span::from_seconds(s)
}

/// Samples whose values differ between two runs with the same arrivals.
fn changed(faulty: &Kept) -> Vec<usize> {
    let pairs = faulty.samples.iter().zip(&without().samples).enumerate();
    assert_eq!(faulty.samples.len(), without().samples.len());
    pairs.filter(|(_, (a, b))| a != b).map(|(k, _)| k).collect()
}

#[test]
fn an_empty_list_changes_nothing() {
    assert!(with("") == *without());
}

#[test]
fn random_losses_have_their_share_and_leave_the_rest_as_it_was() {
    let kept = with("(sensor: imu, fault: drop(share: 0.3))");
    let whole = without();
    let count = whole.samples.len() as f64;
    // Binomial: mean n p, variance n p (1 - p).
    let off = kept.samples.len() as f64 - 0.7 * count;
    assert!(count > 700.0 && off.abs() < 4.0 * (count * 0.21).sqrt(), "{off} of {count}");
    let mut rest = whole.samples.iter();
    assert!(kept.samples.iter().all(|sample| rest.any(|other| other == sample)), "a subsequence");
    assert!(kept.scans == whole.scans && kept.truth == whole.truth && kept.clocks == whole.clocks);
}

#[test]
fn draws_are_those_of_the_seed_with_any_number_of_threads() {
    let list = "(sensor: both, fault: drop(share: 0.2)), (sensor: imu, fault: delay(mean_s: 0.02)),
        (sensor: lidar, fault: reorder(share: 0.3)), (sensor: imu, fault: duplicate(share: 0.1))";
    let once = with(list);
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert!(pool.install(|| with(list)) == once);
    }
    // Of the two seeds other samples are lost: a share of 0.2 twice has so many in common only by chance of 1e-100.
    let other = run(&scenario("mocap_room", "3dm_gx2", 2), Some(list));
    let arrivals = |kept: &Kept| kept.scans.iter().map(|(arrival, _)| *arrival).collect::<Vec<_>>();
    assert_ne!(arrivals(&once), arrivals(&other));
}

#[test]
fn faults_share_physics_and_rays() {
    let lists =
        [None, Some("(sensor: imu, fault: drop(share: 0.5))"), Some("(sensor: lidar, fault: delay(mean_s: 0.1))")];
    let simulations: Vec<_> = lists.iter().map(|list| simulation(&usual(), *list).unwrap()).collect();
    let mut kept: Vec<Kept> = lists.iter().map(|_| Kept::default()).collect();
    Simulation::run_together(&simulations, &mut kept.iter_mut().collect::<Vec<_>>(), &mut |_| ()).unwrap();
    for (together, list) in kept.iter().zip(lists) {
        assert!(*together == run(&usual(), list), "{list:?}");
    }
}

#[test]
fn a_gap_takes_its_interval_and_a_cut_what_lies_outside() {
    let (gap, repeated, cut) = (
        with("(sensor: imu, from_s: 2, to_s: 3.5, fault: gap)"),
        with("(sensor: lidar, from_s: 1, every_s: 2, lasts_s: 0.5, fault: gap)"),
        with("(sensor: lidar, fault: cut(start_s: 1, end_s: 6)), (sensor: imu, fault: cut(end_s: 4))"),
    );
    let times = |all: &[(Stamp, ImuSample)]| all.iter().map(|(t, _)| since_start_s(*t)).collect::<Vec<_>>();
    let scan_times = |kept: &Kept| kept.scans.iter().map(|(t, _)| since_start_s(*t)).collect::<Vec<_>>();
    let (samples, scans) = (times(&without().samples), scan_times(without()));
    let those =
        |all: &[f64], is_kept: &dyn Fn(f64) -> bool| all.iter().copied().filter(|t| is_kept(*t)).collect::<Vec<_>>();
    assert_eq!(times(&gap.samples), those(&samples, &|t| !(2.0..3.5).contains(&t)));
    assert_eq!(scan_times(&repeated), those(&scans, &|t| t < 1.0 || (t - 1.0) % 2.0 >= 0.5));
    assert_eq!(scan_times(&cut), those(&scans, &|t| (1.0..=6.0).contains(&t)));
    assert_eq!(times(&cut.samples), those(&samples, &|t| t <= 4.0));
}

#[test]
fn thinning_keeps_the_sample_nearest_to_each_arrival() {
    let arrivals_s = [0.013, 0.5, 0.5, 0.504, 1.237, 2.9];
    let kept = with(&format!("(sensor: imu, fault: thin(arrivals_s: {arrivals_s:?}, repeat_s: 3.0))"));
    let times: Vec<f64> = without().samples.iter().map(|(t, _)| since_start_s(*t)).collect();
    let mut nearest: Vec<usize> = (0..3)
        .flat_map(|round| arrivals_s.map(|s| s + 3.0 * f64::from(round)))
        .filter(|s| *s < DURATION_S)
        .map(|s| (0..times.len()).min_by(|a, b| (times[*a] - s).abs().total_cmp(&(times[*b] - s).abs())).unwrap())
        .collect();
    nearest.dedup();
    assert_eq!(kept.samples, nearest.iter().map(|k| without().samples[*k]).collect::<Vec<_>>());
}

#[test]
fn the_micro_controllers_arrivals_are_as_irregular_as_recorded() {
    let source = find(Kind::Faults, "imu_arrivals_mcu").unwrap();
    let scenario = Scenario { faults: Some("imu_arrivals_mcu".to_owned()), ..usual() };
    let mut kept = Kept::default();
    Simulation::prepare(&scenario).unwrap().run(&mut kept, &mut |_| ()).unwrap();
    let text = std::fs::read_to_string("specs/faults/imu_arrivals_mcu.txt").unwrap();
    let recorded: Vec<f64> = text.lines().filter_map(|line| line.parse().ok()).filter(|s| *s < DURATION_S).collect();
    for (arrival, _) in &kept.samples {
        // A sample of 100 Hz is within 5 ms of the arrival that it is kept for.
        let off = recorded.iter().map(|s| (s - since_start_s(*arrival)).abs()).fold(f64::INFINITY, f64::min);
        assert!(off <= 5.1e-3, "{}: {off}", source.name);
    }
    assert!(kept.samples.len() > recorded.len() / 2 && kept.samples.len() <= recorded.len());
}

#[test]
fn delays_are_one_sided_with_their_mean_and_keep_order() {
    // A mean of a twelfth of the period: that a scan waits for the one before has a probability of 6e-6.
    let mean_s = 0.002;
    let kept = with("(sensor: lidar, fault: delay(mean_s: 0.002))");
    let pairs = || kept.scans.iter().zip(&without().scans);
    let delays: Vec<f64> = pairs().map(|((_, a), (_, b))| a.stamp.seconds_since(b.stamp)).collect();
    let (count, mean) = (delays.len() as f64, delays.iter().sum::<f64>() / delays.len() as f64);
    assert!(delays.iter().all(|s| *s >= 0.0));
    // The standard deviation of an exponential distribution is its mean.
    assert!((mean - mean_s).abs() < 4.0 * mean_s / count.sqrt(), "{mean}");
    let above = delays.iter().filter(|s| **s > 2.0 * mean_s).count() as f64 / count;
    assert!((above - (-2.0_f64).exp()).abs() < 0.08, "a share of exp(-2) exceeds twice the mean: {above}");
    assert!(pairs().all(|((at, a), (was, b))| *at - *was == a.stamp - b.stamp), "log times are as late");

    // A mean of five periods: a queue.
    let queue = with("(sensor: imu, fault: delay(mean_s: 0.05))");
    assert_eq!(queue.samples.len(), without().samples.len());
    assert!(queue.samples.windows(2).all(|pair| pair[0].1.stamp < pair[1].1.stamp));
    let rates = |kept: &Kept| kept.samples.iter().map(|(_, s)| s.angular_velocity_rad_per_s).collect::<Vec<_>>();
    assert_eq!(rates(&queue), rates(without()), "no sample overtakes another");
}

#[test]
fn a_burst_is_stamped_when_its_last_message_arrives() {
    for (spacing_us, list) in [
        (1, "(sensor: imu, fault: burst(size: 4, spacing_us: 1))"),
        (0, "(sensor: imu, fault: burst(size: 4, spacing_us: 0))"),
    ] {
        let kept = with(list);
        assert_eq!(kept.samples.len(), without().samples.len());
        for (group, was) in kept.samples.chunks(4).zip(without().samples.chunks(4)) {
            let (arrival, last) = was.last().unwrap();
            for (k, (at, sample)) in group.iter().enumerate() {
                assert_eq!(at, arrival);
                assert_eq!(sample.stamp, last.stamp + Span::from_nanos(1000 * spacing_us * k as i64));
                assert_eq!(sample.angular_velocity_rad_per_s, was[k].1.angular_velocity_rad_per_s);
            }
        }
    }
}

#[test]
fn clipping_limits_what_is_measured_and_not_what_is_published() {
    let list = "(sensor: imu, fault: clip(gyro_deg_per_s: 60, accel_m_per_s2: 9.5))";
    let kept = with(list);
    let limit = 60_f64.to_radians();
    for ((_, sample), (_, was)) in kept.samples.iter().zip(&without().samples) {
        assert_eq!(sample.angular_velocity_rad_per_s, was.angular_velocity_rad_per_s.map(|x| x.clamp(-limit, limit)));
        assert_eq!(sample.specific_force_m_per_s2, was.specific_force_m_per_s2.map(|x| x.clamp(-9.5, 9.5)));
    }
    assert!(changed(&kept).len() > 10, "the head swings faster than that");
    let calibration = |list| simulation(&usual(), list).unwrap().calibration();
    assert_eq!(calibration(Some(list)), calibration(None));
}

#[test]
fn a_frozen_sensor_repeats_its_last_measurement_with_new_stamps() {
    let kept = with("(sensor: both, from_s: 3, to_s: 4, fault: freeze)");
    let whole = without();
    let last = whole.samples.iter().rev().find(|(at, _)| since_start_s(*at) < 3.0).unwrap().1;
    for ((at, sample), (_, was)) in kept.samples.iter().zip(&whole.samples) {
        let expected = if (3.0..4.0).contains(&since_start_s(*at)) { last } else { *was };
        assert_eq!(*sample, ImuSample { stamp: was.stamp, ..expected });
    }
    let last = &whole.scans.iter().rev().find(|(at, _)| since_start_s(*at) < 3.0).unwrap().1;
    let frozen: Vec<_> = kept.scans.iter().filter(|(at, _)| (3.0..4.0).contains(&since_start_s(*at))).collect();
    assert!((38..=41).contains(&frozen.len()));
    assert!(frozen.iter().all(|(_, scan)| scan.returns == last.returns && scan.planar == last.planar));
    assert!(kept.scans.iter().zip(&whole.scans).all(|((_, a), (_, b))| a.stamp == b.stamp));
}

#[test]
fn a_constant_range_is_that_of_every_beam() {
    let kept = with("(sensor: lidar, from_s: 1, to_s: 2, fault: constant_range(range_m: 2.5))");
    for ((at, scan), (_, was)) in kept.scans.iter().zip(&without().scans) {
        if !(1.0..2.0).contains(&since_start_s(*at)) {
            assert!(scan == was);
            continue;
        }
        let planar = scan.planar.as_ref().unwrap();
        assert!(planar.ranges_m.iter().all(|range| *range == 2.5) && scan.returns.len() == planar.ranges_m.len());
        assert!(scan.returns.iter().all(|beam| (beam.point_in_laser.norm() - 2.5).abs() < 1e-5));
        // Where the beam did return, its direction and time stay.
        for beam in &was.returns {
            let same = scan.returns.iter().find(|other| other.offset == beam.offset).unwrap();
            assert!((same.point_in_laser.normalize() - beam.point_in_laser.normalize()).norm() < 1e-5);
        }
    }
}

#[test]
fn spikes_spoil_so_many_single_samples() {
    let random = with("(sensor: imu, from_s: 1, to_s: 6, fault: spike(gyro_rad_per_s: (30, 0, -30), count: 9))");
    let spoiled = changed(&random);
    assert_eq!(spoiled.len(), 9);
    for k in spoiled {
        let ((at, sample), (_, was)) = (random.samples[k], without().samples[k]);
        assert!((1.0..6.1).contains(&since_start_s(at)));
        assert_eq!(sample.angular_velocity_rad_per_s, Vector::new(30.0, 0.0, -30.0));
        assert_eq!(sample.specific_force_m_per_s2, was.specific_force_m_per_s2);
    }
    let given = with("(sensor: imu, fault: spike(accel_m_per_s2: (0, 0, 100), times_s: [2.0, 3.333]))");
    let first_after = |s: f64| without().samples.iter().position(|(at, _)| since_start_s(*at) >= s).unwrap();
    assert_eq!(changed(&given), [first_after(2.0), first_after(3.333)]);
}

#[test]
fn a_bias_steps_at_its_time() {
    let kept =
        with("(sensor: imu, from_s: 3, fault: bias_step(gyro_deg_per_s: (1, 0, -2), accel_m_per_s2: (0, 0.5, 0)))");
    for ((at, sample), (_, was)) in kept.samples.iter().zip(&without().samples) {
        let on = if since_start_s(*at) >= 3.0 { 1.0 } else { 0.0 };
        let rate = Vector::new(1_f64.to_radians(), 0.0, -2_f64.to_radians()) * on;
        assert!((sample.angular_velocity_rad_per_s - was.angular_velocity_rad_per_s - rate).norm() < 1e-12);
        let force = Vector::new(0.0, 0.5, 0.0) * on;
        assert!((sample.specific_force_m_per_s2 - was.specific_force_m_per_s2 - force).norm() < 1e-12);
    }
}

type IsEncoded = fn(f32) -> bool;

#[test]
fn misses_are_encoded_as_asked_and_returns_stay() {
    let outdoors = Scenario { duration_s: 1.0, ..scenario("open_field", "3dm_gx2", 1) };
    let clean = run(&outdoors, None);
    let is_miss = |range: f32| range == f32::INFINITY;
    let misses =
        |kept: &Kept| kept.scans.iter().flat_map(|(_, s)| s.planar.clone().unwrap().ranges_m).collect::<Vec<_>>();
    assert!(misses(&clean).into_iter().filter(|range| is_miss(*range)).count() > 1000);
    let checks: [(&str, IsEncoded); 6] = [
        ("range_max", |range| range == 30.0),
        ("above_max", |range| range == 31.0),
        ("zero", |range| range == 0.0),
        ("nan", f32::is_nan),
        ("inf", |range| range == f32::INFINITY),
        ("minus_inf", |range| range == f32::NEG_INFINITY),
    ];
    for (encoding, is_encoded) in checks {
        let kept = run(&outdoors, Some(&format!("(sensor: lidar, fault: misses(encoding: {encoding}))")));
        let pairs = misses(&kept).into_iter().zip(misses(&clean));
        assert!(
            pairs.into_iter().all(|(now, was)| if is_miss(was) { is_encoded(now) } else { now == was }),
            "{encoding}"
        );
        assert!(kept.scans.iter().zip(&clean.scans).all(|((_, a), (_, b))| a.returns == b.returns));
    }
}

#[test]
fn a_clock_that_jumps_takes_the_truth_with_it() {
    let day_s = 86_400.0;
    let kept = with(
        "(sensor: both, from_s: 3, fault: clock_jump(jump_s: 86400)),
        (sensor: imu, fault: clock_offset(offset_s: -0.4))",
    );
    let whole = without();
    let jump = |at: Stamp| if since_start_s(at) >= 3.0 { seconds(day_s) } else { Span::ZERO };
    for ((at, sample), (was_at, was)) in kept.samples.iter().zip(&whole.samples) {
        assert_eq!((*at, sample.stamp), (*was_at, was.stamp + jump(*at) + seconds(-0.4)));
    }
    for ((at, scan), (was_at, was)) in kept.scans.iter().zip(&whole.scans) {
        assert_eq!((*at, scan.stamp), (*was_at, was.stamp + jump(*at)));
    }
    for ((at, sample), (_, was)) in kept.truth.iter().zip(&whole.truth) {
        assert_eq!(sample.lidar_stamp, was.lidar_stamp + jump(*at));
        assert_eq!(sample.head, was.head);
    }
    for ((_, clock), (_, was)) in kept.clocks.iter().zip(&whole.clocks) {
        assert_eq!(clock.imu_after_lidar(), was.imu_after_lidar() + seconds(-0.4));
    }
}

#[test]
fn duplicates_and_exchanges_have_their_share() {
    let twice = with("(sensor: imu, fault: duplicate(share: 0.2))");
    let whole = without();
    let count = whole.samples.len() as f64;
    let repeated = twice.samples.windows(2).filter(|pair| pair[0] == pair[1]).count() as f64;
    assert!((repeated - 0.2 * count).abs() < 4.0 * (0.16 * count).sqrt());
    let mut once = twice.samples.clone();
    once.dedup();
    assert!(once == whole.samples);

    let swapped = with("(sensor: imu, fault: reorder(share: 0.2))");
    let stamps = |kept: &Kept| kept.samples.iter().map(|(_, sample)| sample.stamp).collect::<Vec<_>>();
    let (mut now, was) = (stamps(&swapped), stamps(whole));
    let falls = now.windows(2).filter(|pair| pair[0] > pair[1]).count() as f64;
    // A message that was exchanged is passed over: p / (1 + p) of all begin an exchange.
    let expected = count * 0.2 / 1.2;
    assert!((falls - expected).abs() < 4.0 * expected.sqrt(), "{falls}, {expected}");
    now.sort_unstable();
    assert_eq!(now, was);
}

#[test]
fn another_convention_of_axes_and_units() {
    let kept = with("(sensor: imu, fault: axes(negate_gyro: true, accel_scale: 0.5))");
    for ((_, sample), (_, was)) in kept.samples.iter().zip(&without().samples) {
        assert_eq!(sample.angular_velocity_rad_per_s, -was.angular_velocity_rad_per_s);
        assert_eq!(sample.specific_force_m_per_s2, was.specific_force_m_per_s2 * 0.5);
    }
    // Without gravity an ideal IMU measures its acceleration: what remains of the specific force is f - R^T (-g).
    let ideal = Scenario { duration_s: 3.0, clock: "exact".to_owned(), ..scenario("mocap_room", "ideal_1khz", 1) };
    let list = "(sensor: imu, fault: axes(remove_gravity: true))";
    let (free, clean) = (run(&ideal, Some(list)), run(&ideal, None));
    let imu = simulation(&ideal, None).unwrap().calibration().head_from_imu.rotation;
    for ((at, sample), (_, was)) in free.samples.iter().zip(&clean.samples) {
        let (_, truth) = clean.truth.iter().rev().find(|(t, _)| t <= at).unwrap();
        let world_from_imu = truth.head.world_from_body.rotation * imu;
        let at_rest = world_from_imu.inverse() * -gravity_in_world();
        let removed = was.specific_force_m_per_s2 - sample.specific_force_m_per_s2;
        // Within the millisecond of a sample the head turns by 10 mrad at most.
        assert!((removed - at_rest).norm() < 0.1, "{removed} {at_rest}");
    }
}

#[test]
fn a_wrong_calibration_is_published_and_the_truth_stays() {
    let list = "(sensor: lidar, fault: extrinsics(position_m: (5, 0, -1))),
        (sensor: imu, fault: extrinsics(roll_pitch_yaw_deg: (0, 10, 90)))";
    let calibration = |list| simulation(&usual(), list).unwrap().calibration();
    let (wrong, right) = (calibration(Some(list)), calibration(None));
    let shift = wrong.head_from_laser.translation.vector - right.head_from_laser.translation.vector;
    assert!((shift - Vector::new(5.0, 0.0, -1.0)).norm() < 1e-12);
    assert_eq!(wrong.head_from_laser.rotation, right.head_from_laser.rotation);
    let turn = right.head_from_imu.rotation.inverse() * wrong.head_from_imu.rotation;
    assert!(turn.angle_to(&from_roll_pitch_yaw(0.0, 10_f64.to_radians(), 90_f64.to_radians())) < 1e-9);
    assert!(with(list) == *without(), "measurements and truth are the same");
}

#[test]
fn faults_act_in_the_order_listed() {
    let clip = "(sensor: imu, fault: clip(gyro_rad_per_s: 0.1))";
    let step = "(sensor: imu, from_s: 0, fault: bias_step(gyro_rad_per_s: (1, 1, 1)))";
    let largest =
        |kept: Kept| kept.samples.iter().map(|(_, s)| s.angular_velocity_rad_per_s.amax()).fold(0.0, f64::max);
    assert!((largest(with(&format!("{clip}, {step}"))) - 1.1).abs() < 1e-12);
    assert!((largest(with(&format!("{step}, {clip}"))) - 0.1).abs() < 1e-12);
}

#[test]
fn every_shipped_list_of_faults_builds_and_runs() {
    for name in names(Kind::Faults) {
        let scenario = Scenario { faults: Some(name.clone()), duration_s: 0.5, ..usual() };
        let simulation = Simulation::prepare(&scenario).unwrap_or_else(|error| panic!("{name}: {error}"));
        simulation.run(&mut Kept::default(), &mut |_| ()).unwrap();
        // A manifest holds the specs whole: what is read back is what was used, files included.
        let text = zsim::spec::to_text(simulation.specs()).unwrap();
        let read: Specs = parse(&Source::in_memory("manifest", text)).unwrap();
        assert_eq!(&read, simulation.specs(), "{name}");
    }
}

#[test]
fn a_wrong_fault_is_refused_with_its_place_and_a_remedy() {
    for (list, place, words) in [
        ("(sensor: imu, fault: gap)", "2:15", "give from_s and to_s"),
        ("(sensor: imu, fault: drop(share: 1.5))", "2:", "a number from 0 to 1"),
        ("(sensor: imu, fault: lose(share: 0.5))", "2:", "lose"),
        ("(sensor: imu, from_s: 3, to_s: 2, fault: freeze)", "2:26", "larger than from_s"),
        ("(sensor: imu, every_s: 3, fault: freeze)", "2:15", "give both or neither"),
        ("(sensor: imu, from_s: 1, every_s: 3, lasts_s: 3, fault: freeze)", "2:38", "smaller than every_s"),
        ("(sensor: imu, to_s: 1e300, fault: freeze)", "2:15", "0 to 1e6 s"),
        ("(sensor: imu, from_s: NaN, fault: freeze)", "2:15", "0 to 1e6 s"),
        ("(sensor: lidar, fault: clip(gyro_deg_per_s: 400))", "2:2", "use `sensor: imu`"),
        ("(sensor: imu, fault: misses(encoding: zero))", "2:2", "use `sensor: lidar`"),
        ("(sensor: both, fault: extrinsics(position_m: (1, 0, 0)))", "2:2", "one fault each"),
        ("(sensor: imu, fault: clip(gyro_deg_per_s: 400, gyro_rad_per_s: 7))", "2:27", "give one of them"),
        ("(sensor: imu, fault: clip(accel_m_per_s2: -1))", "2:22", "larger than 0"),
        ("(sensor: imu, fault: clip())", "2:", "neither a rate nor a specific force"),
        ("(sensor: imu, fault: spike(gyro_deg_per_s: (1, 2, inf), count: 3))", "2:", "finite"),
        ("(sensor: imu, fault: spike(gyro_deg_per_s: (1, 2, 3)))", "2:22", "needs times_s or count"),
        ("(sensor: imu, fault: spike(gyro_deg_per_s: (1, 2, 3), count: 4000000000))", "2:55", "at most 1e6"),
        ("(sensor: imu, fault: bias_step(gyro_deg_per_s: (1, 2, 3)))", "2:", "give from_s"),
        ("(sensor: imu, fault: clock_jump(jump_s: 1))", "2:", "give from_s"),
        ("(sensor: imu, from_s: 1, fault: clock_jump(jump_s: 1e30))", "2:", "at most 1e8"),
        ("(sensor: lidar, from_s: 1, fault: clock_jump(jump_s: -1))", "2:46", "jump forward"),
        ("(sensor: imu, fault: delay(mean_s: 1e9))", "2:28", "at most 2"),
        ("(sensor: imu, fault: burst(size: 1000000000, spacing_us: 1))", "2:28", "2 to 1000"),
        ("(sensor: imu, fault: cut())", "2:22", "start_s"),
        ("(sensor: imu, fault: thin())", "2:22", "give arrivals_s or file"),
        ("(sensor: imu, fault: thin(arrivals_s: [3, 2]))", "2:27", "not in order"),
        ("(sensor: imu, fault: thin(arrivals_s: [1, 2], repeat_s: 2))", "2:47", "larger than the last"),
        ("(sensor: imu, fault: thin(file: \"missing.txt\"))", "2:27", "missing.txt"),
        ("(sensor: imu, fault: axes(gyro_scale: 0))", "2:22", "above 0"),
    ] {
        // A fault before it, and the word in a comment: the place is that of the second fault.
        let Err(first) = simulation(&usual(), Some(list)) else { panic!("{list} is accepted") };
        assert!(first.starts_with(&format!("test.ron:{place}")) && first.contains(words), "{list}: {first}");
        let later = format!(
            "(sensor: imu, fault: clip(gyro_deg_per_s: 1)), // sensor: clip\n(sensor: lidar, fault: drop(share: 0)),\n{list}"
        );
        let Err(error) = simulation(&usual(), Some(&later)) else { panic!("{list} is accepted") };
        assert!(error.starts_with(&format!("test.ron:4:{}", &place[2..])), "{list}: {error}");
    }
    let round = Scenario { lidar: "vlp16".to_owned(), ..usual() };
    let Err(error) = simulation(&round, Some("(sensor: lidar, fault: misses(encoding: zero))")) else {
        panic!("no LaserScan")
    };
    assert!(error.contains("scans no plane"), "{error}");
}

#[test]
fn a_file_of_arrival_times_is_checked_line_by_line() {
    let here = tempfile::tempdir().unwrap();
    let place = here.path().join("thin.ron");
    std::fs::write(&place, "(faults: [(sensor: imu, fault: thin(file: \"times.txt\"))])").unwrap();
    let source = Source::read(&place).unwrap();
    let read = |text: &str| {
        std::fs::write(here.path().join("times.txt"), text).unwrap();
        parse::<FaultsSpec>(&source).unwrap().with_files(&source).map_err(|error| error.to_string())
    };
    assert!(read("# times\n0.1\n0.1\n 0.25 # s\n").is_ok());
    for (text, place) in [("0.1\nten\n", ":2:1"), ("0.2\n0.1\n", ":2:1"), ("nan\n", ":1:1"), ("1\n-2\n", ":2:1")] {
        let error = read(text).unwrap_err();
        assert!(error.contains(&format!("times.txt{place}")), "{error}");
    }
}
