//! Lost, late, reordered and incorrectly stamped measurements.

use super::{DURATION_S, MemorySink, reference, since_start_s, usual, with};
use zsim::measurement::ImuSample;
use zsim::simulation::{Scenario, Simulation};
use zsim::spec::{Kind, find};
use zsim::time::{Span, Stamp};

fn seconds(s: f64) -> Span {
    Span::from_seconds(s)
}

#[test]
fn random_losses_have_the_specified_fraction_and_do_not_change_the_rest() {
    let recorded = with("(sensor: imu, fault: drop(share: 0.3))");
    let whole = reference();
    let count = whole.samples.len() as f64;
    // Binomial: mean n p, variance n p (1 - p).
    let off = recorded.samples.len() as f64 - 0.7 * count;
    assert!(count > 700.0 && off.abs() < 4.0 * (count * 0.21).sqrt(), "{off} of {count}");
    let mut rest = whole.samples.iter();
    assert!(recorded.samples.iter().all(|sample| rest.any(|other| other == sample)), "a subsequence");
    assert!(recorded.scans == whole.scans && recorded.truth == whole.truth && recorded.clocks == whole.clocks);
}

#[test]
fn a_gap_removes_its_interval_and_a_cut_everything_outside() {
    let (gap, repeated, cut) = (
        with("(sensor: imu, from_s: 2, to_s: 3.5, fault: gap)"),
        with("(sensor: lidar, from_s: 1, every_s: 2, lasts_s: 0.5, fault: gap)"),
        with("(sensor: lidar, fault: cut(start_s: 1, end_s: 6)), (sensor: imu, fault: cut(end_s: 4))"),
    );
    let times = |all: &[(Stamp, ImuSample)]| all.iter().map(|(t, _)| since_start_s(*t)).collect::<Vec<_>>();
    let scan_times = |recorded: &MemorySink| recorded.scans.iter().map(|(t, _)| since_start_s(*t)).collect::<Vec<_>>();
    let (samples, scans) = (times(&reference().samples), scan_times(reference()));
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
    let recorded = with(&format!("(sensor: imu, fault: thin(arrivals_s: {arrivals_s:?}, repeat_s: 3.0))"));
    let times: Vec<f64> = reference().samples.iter().map(|(t, _)| since_start_s(*t)).collect();
    let mut nearest: Vec<usize> = (0..3)
        .flat_map(|round| arrivals_s.map(|s| s + 3.0 * f64::from(round)))
        .filter(|s| *s < DURATION_S)
        .map(|s| (0..times.len()).min_by(|a, b| (times[*a] - s).abs().total_cmp(&(times[*b] - s).abs())).unwrap())
        .collect();
    nearest.dedup();
    assert_eq!(recorded.samples, nearest.iter().map(|k| reference().samples[*k]).collect::<Vec<_>>());
}

#[test]
fn the_arrivals_of_the_micro_controller_are_as_recorded() {
    let source = find(Kind::Faults, "imu_arrivals_mcu").unwrap();
    let scenario = Scenario { faults: Some("imu_arrivals_mcu".to_owned()), ..usual() };
    let mut recorded = MemorySink::default();
    Simulation::prepare(&scenario).unwrap().run(&mut recorded, &mut |_| ()).unwrap();
    let text = std::fs::read_to_string("specs/faults/imu_arrivals_mcu.txt").unwrap();
    let arrivals_s: Vec<f64> = text.lines().filter_map(|line| line.parse().ok()).filter(|s| *s < DURATION_S).collect();
    for (arrival, _) in &recorded.samples {
        // At 100 Hz the nearest sample is within 5 ms of its arrival time.
        let off = arrivals_s.iter().map(|s| (s - since_start_s(*arrival)).abs()).fold(f64::INFINITY, f64::min);
        assert!(off <= 5.1e-3, "{}: {off}", source.name);
    }
    assert!(recorded.samples.len() > arrivals_s.len() / 2 && recorded.samples.len() <= arrivals_s.len());
}

#[test]
fn delays_are_one_sided_with_their_mean_and_keep_order() {
    // The mean is a twelfth of the period: a scan waits for the previous one with a probability of 6e-6.
    let mean_s = 0.002;
    let recorded = with("(sensor: lidar, fault: delay(mean_s: 0.002))");
    let pairs = || recorded.scans.iter().zip(&reference().scans);
    let delays: Vec<f64> = pairs().map(|((_, a), (_, b))| a.stamp.seconds_since(b.stamp)).collect();
    let (count, mean) = (delays.len() as f64, delays.iter().sum::<f64>() / delays.len() as f64);
    assert!(delays.iter().all(|s| *s >= 0.0));
    // The standard deviation of an exponential distribution is its mean.
    assert!((mean - mean_s).abs() < 4.0 * mean_s / count.sqrt(), "{mean}");
    let above = delays.iter().filter(|s| **s > 2.0 * mean_s).count() as f64 / count;
    assert!((above - (-2.0_f64).exp()).abs() < 0.08, "the expected fraction above twice the mean is exp(-2): {above}");
    assert!(pairs().all(|((at, a), (was, b))| *at - *was == a.stamp - b.stamp), "log times have the same delay");

    // With a mean of five periods messages queue up.
    let queue = with("(sensor: imu, fault: delay(mean_s: 0.05))");
    assert_eq!(queue.samples.len(), reference().samples.len());
    assert!(queue.samples.windows(2).all(|pair| pair[0].1.stamp < pair[1].1.stamp));
    let rates =
        |recorded: &MemorySink| recorded.samples.iter().map(|(_, s)| s.angular_velocity_rad_per_s).collect::<Vec<_>>();
    assert_eq!(rates(&queue), rates(reference()), "no sample overtakes another");
}

#[test]
fn a_burst_is_stamped_when_its_last_message_arrives() {
    for (spacing_us, list) in [
        (1, "(sensor: imu, fault: burst(size: 4, spacing_us: 1))"),
        (0, "(sensor: imu, fault: burst(size: 4, spacing_us: 0))"),
    ] {
        let recorded = with(list);
        assert_eq!(recorded.samples.len(), reference().samples.len());
        for (group, was) in recorded.samples.chunks(4).zip(reference().samples.chunks(4)) {
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
fn a_clock_jump_applies_to_the_ground_truth_too() {
    let day_s = 86_400.0;
    let recorded = with(
        "(sensor: both, from_s: 3, fault: clock_jump(jump_s: 86400)),
        (sensor: imu, fault: clock_offset(offset_s: -0.4))",
    );
    let whole = reference();
    let jump = |at: Stamp| if since_start_s(at) >= 3.0 { seconds(day_s) } else { Span::ZERO };
    for ((at, sample), (was_at, was)) in recorded.samples.iter().zip(&whole.samples) {
        assert_eq!((*at, sample.stamp), (*was_at, was.stamp + jump(*at) + seconds(-0.4)));
    }
    for ((at, scan), (was_at, was)) in recorded.scans.iter().zip(&whole.scans) {
        assert_eq!((*at, scan.stamp), (*was_at, was.stamp + jump(*at)));
    }
    for ((at, sample), (_, was)) in recorded.truth.iter().zip(&whole.truth) {
        assert_eq!(sample.lidar_stamp, was.lidar_stamp + jump(*at));
        assert_eq!(sample.head, was.head);
    }
    for ((_, clock), (_, was)) in recorded.clocks.iter().zip(&whole.clocks) {
        assert_eq!(clock.imu_after_lidar(), was.imu_after_lidar() + seconds(-0.4));
    }
}

#[test]
fn duplicates_and_exchanges_have_the_specified_fraction() {
    let twice = with("(sensor: imu, fault: duplicate(share: 0.2))");
    let whole = reference();
    let count = whole.samples.len() as f64;
    let repeated = twice.samples.windows(2).filter(|pair| pair[0] == pair[1]).count() as f64;
    assert!((repeated - 0.2 * count).abs() < 4.0 * (0.16 * count).sqrt());
    let mut once = twice.samples.clone();
    once.dedup();
    assert!(once == whole.samples);

    let swapped = with("(sensor: imu, fault: reorder(share: 0.2))");
    let stamps = |recorded: &MemorySink| recorded.samples.iter().map(|(_, sample)| sample.stamp).collect::<Vec<_>>();
    let (mut now, was) = (stamps(&swapped), stamps(whole));
    let falls = now.windows(2).filter(|pair| pair[0] > pair[1]).count() as f64;
    // An exchanged message is skipped: a fraction of p / (1 + p) starts an exchange.
    let expected = count * 0.2 / 1.2;
    assert!((falls - expected).abs() < 4.0 * expected.sqrt(), "{falls}, {expected}");
    now.sort_unstable();
    assert_eq!(now, was);
}
