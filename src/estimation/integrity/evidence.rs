//! Tests of the estimator's assumptions, and the findings from them.

use crate::{Event, EventKind, Severity, WindowReport, grouped};
use zsim_base::time::Stamp;

/// If more than this fraction of the samples is clipped, a loss of tracking is attributed to it.
const LOST_CLIPPED_FRACTION: f64 = 0.02;

/// Measures are evaluated over intervals of this length, s, or half of a shorter run.
const INTERVAL_S: f64 = 5.0;
/// Contradiction between IMU and lidar above which one of them is wrong, as a multiple of the IMU noise. 0.12 to 0.35 in
/// 24 sound runs of all scenes, at most 0.61 in a window.
///
/// Noise causes less: the trajectory follows the IMU, and `noise_inflation` enlarges the assumed noise by half.
pub(crate) const MAX_CONTRADICTION: f64 = 0.6;
/// Contradiction above which a result is degraded or lost.
const CONTRADICTION_LIMITS: Limits = Limits { degraded: MAX_CONTRADICTION, lost: 3.0 };
/// Residual of matched surfaces above which a result is degraded or lost, m. 2 to 4.5 mm in sound runs, up to 6 mm in
/// a window.
const RESIDUAL_M: Limits = Limits { degraded: 0.010, lost: 0.018 };
/// A result is lost if in one interval the contradiction, and the residual or the IMU scale, exceed their limits of a
/// degraded result.
///
/// The trajectory then follows a wrong motion: that of a large moving surface, which neither fits the static ones nor the
/// IMU, or that of wrong sensor data. The ratio is at most 0.8 in sound runs, 1.04 to 3.8 in a cabin or along a wall that
/// moves by metres.
const INCONSISTENT: Limits = Limits { degraded: 1.0, lost: 1.0 };
/// Fraction of an interval with too few matches or unsolved windows, above which a result is degraded or lost.
const UNTRACKED_FRACTIONS: Limits = Limits { degraded: 0.35, lost: 0.6 };
/// Fraction of a run without any match, and not at rest, above which the result is lost.
const MAX_UNMATCHED_FRACTION: f64 = 0.5;
/// Longer IMU gaps degrade a result, s.
const GAP_S: f64 = 0.2;
/// Longer lidar gaps degrade a result, s.
const LIDAR_GAP_S: f64 = 1.0;
/// Fraction of clipped samples above which a result is degraded.
const CLIPPED_FRACTION: f64 = 0.005;
/// Fraction of the recording without an estimate above which a result is degraded.
const MISSING_FRACTION: f64 = 0.05;
/// More repeated IMU samples or lidar scans than this are a frozen sensor.
const MAX_REPEATED: (usize, usize) = (30, 10);
/// Correction of all ranges above which a result is degraded or lost, m.
const RANGE_CORRECTION_M: Limits = Limits { degraded: 0.06, lost: 0.1 };
/// IMU scale or misalignment over its standard deviation, above which a result is degraded or lost.
///
/// Of 18 entries, one is above 4 standard deviations in 0.1 % of the IMUs that are as specified.
const IMU_SCALE: Limits = Limits { degraded: 4.0, lost: 18.0 };
/// Implausible drift between the clocks, s/s: no quartz oscillator drifts by so much.
const CLOCK_RATE: Limits = Limits { degraded: 5e-4, lost: f64::INFINITY };
/// Implausible speed, m/s: a result of dead reckoning.
const SPEED_M_PER_S: Limits = Limits { degraded: 60.0, lost: 60.0 };

/// Limits of a measure above which a result is degraded or lost.
#[derive(Debug, Clone, Copy)]
struct Limits {
    degraded: f64,
    lost: f64,
}

impl Limits {
    /// Returns the severity of a value above the first limit.
    fn severity(&self, value: f64) -> Severity {
        if value > self.lost { Severity::Lost } else { Severity::Degraded }
    }
}

/// The data used to assess an estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence<'a> {
    /// The windows' reports, in order.
    pub windows: &'a [WindowReport],
    /// Warnings of the estimator.
    pub warnings: &'a [Event],
    /// Number of IMU samples.
    pub samples: usize,
    /// First and last stamp of the recording, lidar time.
    pub recorded: (Stamp, Stamp),
    /// First and last stamp of the estimate.
    pub estimated: (Stamp, Stamp),
}

/// Determines the causes of the status of a run, one for each kind.
///
/// They are ordered by severity, then time.
pub fn findings(evidence: &Evidence) -> Vec<Event> {
    let mut all = window_findings(evidence);
    all.extend(evidence.warnings.iter().filter_map(|warning| warning_finding(warning, evidence)));
    all.extend(calibration_findings(evidence.windows));
    all.extend(coverage_finding(evidence));
    let merged = |group: Vec<&Event>| {
        let span = |(from, to): (Stamp, Stamp), event: &&Event| (from.min(event.from), to.max(event.to));
        let (from, to) = group.iter().fold((group[0].from, group[0].to), span);
        Event { from, to, ..group[0].clone() }
    };
    let mut causes: Vec<Event> = grouped(&all).into_iter().map(merged).collect();
    attribute_loss_to_clipping(&mut causes);
    causes.sort_by_key(|cause| (std::cmp::Reverse(cause.severity), !cause.kind.is_sensor_fault(), cause.from));
    causes
}

/// Marks clipping of many samples as a cause of loss if the result is lost.
fn attribute_loss_to_clipping(causes: &mut [Event]) {
    let is_lost = causes.iter().any(|cause| cause.severity == Severity::Lost);
    let is_severe =
        |kind: &EventKind| matches!(kind, EventKind::Clipped { fraction } if *fraction > LOST_CLIPPED_FRACTION);
    let severe = causes.iter_mut().filter(|cause| is_lost && is_severe(&cause.kind));
    severe.for_each(|cause| cause.severity = Severity::Lost);
}

/// Evaluates a measure over intervals of windows: the cause of the `kind`, if the measure is above its limits.
///
/// `kind` receives the largest value, and start and end of the event.
fn over_intervals(
    windows: &[WindowReport],
    measure: impl Fn(&[WindowReport]) -> f64,
    limits: Limits,
    kind: impl Fn(f64, Stamp, Stamp) -> EventKind,
) -> Option<Event> {
    let step_s = median(windows.windows(2).map(|pair| pair[1].stamp.seconds_since(pair[0].stamp)).collect());
    let length = ((INTERVAL_S / step_s.clamp(0.1, INTERVAL_S)).round() as usize).min(windows.len() / 2).max(1);
    let mut found: Option<(Severity, f64, Stamp, Stamp)> = None;
    for interval in windows.windows(length) {
        let value = measure(interval);
        if value <= limits.degraded {
            continue;
        }
        let severity = limits.severity(value);
        let (from, to) = (interval[0].stamp, interval[length - 1].stamp);
        found = Some(match found {
            // A loss lasts from the first lost interval.
            Some((worst, magnitude, starts, ends)) if worst >= severity => {
                let ends = if worst > severity { ends } else { to };
                (worst, magnitude.max(value), starts, ends)
            }
            Some((_, magnitude, ..)) => (severity, magnitude.max(value), from, to),
            None => (severity, value, from, to),
        });
    }
    found.map(|(severity, value, from, to)| Event { from, to, severity, kind: kind(value, from, to) })
}

pub(super) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}

/// Whether a window is dead reckoning with the IMU although surfaces should have been matched.
fn is_untracked(window: &WindowReport) -> bool {
    window.problem.as_ref().is_some_and(EventKind::is_untracked)
}

/// Findings from the window reports.
fn window_findings(evidence: &Evidence) -> Vec<Event> {
    let windows = evidence.windows;
    let is_clipped = evidence.warnings.iter().any(|warning| matches!(warning.kind, EventKind::Saturated { .. }));
    let contradiction = |interval: &[WindowReport]| median(interval.iter().map(|w| w.imu_contradiction).collect());
    let residual = |interval: &[WindowReport]| median(interval.iter().map(|w| w.residual_rms_m).collect());
    let untracked =
        |interval: &[WindowReport]| interval.iter().filter(|w| is_untracked(w)).count() as f64 / interval.len() as f64;
    let fastest = |interval: &[WindowReport]| interval.iter().map(|w| w.speed_m_per_s).fold(0.0, f64::max);
    let both = |interval: &[WindowReport]| {
        // Clipped samples explain an implausible scale.
        let scales = interval.iter().map(|w| w.imu_matrix.over_model() / IMU_SCALE.degraded);
        let scale = if is_clipped { 0.0 } else { median(scales.collect()) };
        let lidar = (residual(interval) / RESIDUAL_M.degraded).max(scale);
        lidar.min(contradiction(interval) / CONTRADICTION_LIMITS.degraded)
    };
    let untracked_for = |_, from, to| EventKind::Untracked { seconds: untracked_s(windows, from, to) };
    // The head matches no surface for most of the run, and does not rest, or might move at constant velocity where the
    // lidar would not show it: the trajectory is unknown.
    let unobserved = mostly_unmatched(windows, |w| !w.resting);
    let assumed = mostly_unmatched(windows, |w| w.resting && !w.sees_rest);
    let causes = [
        over_intervals(windows, contradiction, CONTRADICTION_LIMITS, |times, _, _| EventKind::Contradiction { times }),
        over_intervals(windows, residual, RESIDUAL_M, |residual_m, _, _| EventKind::PoorFit { residual_m }),
        over_intervals(windows, both, INCONSISTENT, |ratio, _, _| EventKind::Inconsistent { ratio }),
        over_intervals(windows, untracked, UNTRACKED_FRACTIONS, untracked_for),
        over_intervals(windows, fastest, SPEED_M_PER_S, |speed_m_per_s, _, _| EventKind::Speed { speed_m_per_s }),
        unobserved.map(|(seconds, from, to)| Event::over(from, to, EventKind::Untracked { seconds })),
        assumed.map(|(seconds, from, to)| Event::over(from, to, EventKind::RestAssumed { seconds })),
    ];
    causes.into_iter().flatten().collect()
}

/// Returns the duration of the untracked windows from `from` to `to`, s.
fn untracked_s(windows: &[WindowReport], from: Stamp, to: Stamp) -> f64 {
    let within = windows.iter().filter(|window| (from..=to).contains(&window.stamp));
    let (all, untracked) =
        within.fold((0, 0), |(all, found), window| (all + 1, found + i32::from(is_untracked(window))));
    f64::from(untracked) / f64::from(all.max(1)) * to.seconds_since(from)
}

/// If most windows have no match and fulfil `condition`: their total duration (s), and start and end of the run.
fn mostly_unmatched(
    windows: &[WindowReport],
    condition: impl Fn(&WindowReport) -> bool,
) -> Option<(f64, Stamp, Stamp)> {
    let (from, to) = (windows.first()?.stamp, windows.last()?.stamp);
    let without = windows.iter().filter(|w| w.matches + w.view_matches == 0 && condition(w)).count();
    let fraction = without as f64 / windows.len() as f64;
    (fraction > MAX_UNMATCHED_FRACTION).then_some((fraction * to.seconds_since(from), from, to))
}

/// Determines the cause that follows from a warning, if any.
fn warning_finding(warning: &Event, evidence: &Evidence) -> Option<Event> {
    let (samples, end) = (evidence.samples, evidence.recorded.1);
    let (kind, to) = match warning.kind {
        EventKind::Restarted { seconds } => (EventKind::Gap { sensor: "IMU", seconds }, warning.to),
        EventKind::ImuGap { seconds } if seconds > GAP_S => (EventKind::Gap { sensor: "IMU", seconds }, warning.to),
        EventKind::LidarGap { seconds } if seconds > LIDAR_GAP_S => {
            (EventKind::Gap { sensor: "lidar", seconds }, warning.to)
        }
        EventKind::Lost { seconds, .. } => (EventKind::Untracked { seconds }, end),
        EventKind::NotRelocalised { .. } | EventKind::LostInMap => (EventKind::UnknownOffset, end),
        EventKind::Saturated { samples: clipped } if clipped as f64 > CLIPPED_FRACTION * samples as f64 => {
            (EventKind::Clipped { fraction: clipped as f64 / samples.max(1) as f64 }, end)
        }
        EventKind::RepeatedSamples { count } if count > MAX_REPEATED.0 => (EventKind::FrozenImu { count }, end),
        EventKind::RepeatedScans { count } if count > MAX_REPEATED.1 => (EventKind::FrozenLidar { count }, end),
        _ => return None,
    };
    Some(Event::over(warning.from, to, kind))
}

/// Findings from implausible corrections of the calibration.
///
/// They are evaluated in the second half of the run, where the estimates are best, and apply to the full run.
fn calibration_findings(windows: &[WindowReport]) -> Vec<Event> {
    let (Some(first), Some(last)) = (windows.first(), windows.last()) else { return Vec::new() };
    let late = &windows[windows.len() / 2..];
    let of = |value: f64, limits: Limits, kind: EventKind| {
        let (from, to, severity) = (first.stamp, last.stamp, limits.severity(value));
        (value > limits.degraded).then_some(Event { from, to, severity, kind })
    };
    let correction_m = last.range_correction_m;
    let entries = late.iter().map(|window| window.imu_matrix);
    let entry = entries.max_by(|a, b| a.over_model().total_cmp(&b.over_model())).unwrap_or_default();
    let rate = median(late.iter().map(|window| window.clock_rate.abs()).collect());
    [
        of(correction_m.abs(), RANGE_CORRECTION_M, EventKind::RangeCorrection { correction_m }),
        of(entry.over_model(), IMU_SCALE, EventKind::ImuScale { value: entry.value, model_sigma: entry.model_sigma }),
        of(rate, CLOCK_RATE, EventKind::ClockRate { rate }),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// The finding that a part of the recording has no estimate.
fn coverage_finding(evidence: &Evidence) -> Option<Event> {
    let ((from, to), (starts, ends)) = (evidence.recorded, evidence.estimated);
    let (before_s, after_s) = (starts.seconds_since(from).max(0.0), to.seconds_since(ends).max(0.0));
    let seconds = before_s + after_s;
    let (from, to) = if before_s > after_s { (from, starts) } else { (ends, to) };
    let recorded_s = evidence.recorded.1.seconds_since(evidence.recorded.0);
    let is_large = seconds > MISSING_FRACTION * recorded_s && seconds > 0.5;
    is_large.then(|| Event::over(from, to, EventKind::NotCovered { seconds }))
}

#[cfg(test)]
mod tests {
    use super::super::factors::{FACTOR_PER_FRACTION, NOT_CONVERGED_FRACTION, bound_factors};
    use super::*;
    use crate::{MatrixEntry, Timing};

    /// Windows of a sound run, two per second.
    fn sound(count: usize) -> Vec<WindowReport> {
        let report = |k: usize| WindowReport {
            stamp: Stamp::from_nanos(k as i64 * 500_000_000),
            surfels: 2500,
            matches: 7000,
            view_matches: 500,
            views: 5,
            residual_rms_m: 0.003,
            iterations: 3,
            last_correction_m: 1e-4,
            conditioning: 0.1,
            imu_contradiction: 0.2,
            clock_offset_s: 0.003,
            clock_rate: 2e-5,
            range_correction_m: 0.002,
            imu_matrix: MatrixEntry { value: 0.002, model_sigma: 0.001 },
            speed_m_per_s: 1.0,
            moving: true,
            resting: false,
            sees_rest: true,
            problem: None,
            elapsed_s: 0.0,
            timing: Timing::default(),
        };
        (0..count).map(report).collect()
    }

    fn judged(windows: &[WindowReport], warnings: &[Event]) -> Vec<Event> {
        let recorded = (windows[0].stamp, windows[windows.len() - 1].stamp);
        findings(&Evidence { windows, warnings, samples: 6000, recorded, estimated: recorded })
    }

    #[test]
    fn a_sound_run_has_no_findings_and_a_factor_of_one() {
        assert_eq!(judged(&sound(80), &[]), vec![]);
        assert!(bound_factors(&sound(80)).iter().all(|(_, factor)| *factor == 1.0));
    }

    #[test]
    fn large_residuals_lose_a_run_of_any_length() {
        for count in [6, 80] {
            let mut windows = sound(count);
            windows.iter_mut().for_each(|window| window.residual_rms_m = 0.03);
            let found = judged(&windows, &[]);
            assert_eq!((found[0].severity, found[0].kind.key()), (Severity::Lost, "poor_fit"));
        }
    }

    #[test]
    fn a_contradiction_with_surfaces_that_do_not_fit_loses_the_run() {
        // A wall that slides through the view: neither alone would exceed the limit of a lost result.
        let mut windows = sound(80);
        windows[40..60].iter_mut().for_each(|window| window.imu_contradiction = 1.2);
        windows[65..].iter_mut().for_each(|window| window.residual_rms_m = 0.012);
        assert!(judged(&windows, &[]).iter().all(|finding| finding.severity == Severity::Degraded));
        let lost_from = |windows: &[WindowReport]| {
            let found = judged(windows, &[]);
            assert_eq!((found[0].severity, found[0].kind.key()), (Severity::Lost, "inconsistent"));
            found[0].from
        };
        let mut unfit = windows.clone();
        unfit[45..60].iter_mut().for_each(|window| window.residual_rms_m = 0.012);
        assert!(lost_from(&unfit) >= windows[35].stamp);
        // A cabin that moves: the estimated IMU scale absorbs its motion.
        windows[45..60].iter_mut().for_each(|window| window.imu_matrix.value = 0.012);
        assert!(lost_from(&windows) >= windows[35].stamp);
    }

    #[test]
    fn a_contradiction_is_found_at_its_time_and_enlarges_the_later_bound() {
        let mut windows = sound(80);
        windows[40..60].iter_mut().for_each(|window| window.imu_contradiction = 1.2);
        let found = judged(&windows, &[]);
        assert_eq!((found[0].severity, found[0].kind.key()), (Severity::Degraded, "contradiction"));
        assert!(found[0].from >= windows[30].stamp && found[0].to <= windows[70].stamp);
        let factors = bound_factors(&windows);
        assert_eq!(factors[30].1, 1.0);
        assert!((factors[79].1 - 9.0).abs() < 1e-9, "{}", factors[79].1);
    }

    #[test]
    fn poor_convergence_and_weak_conditioning_enlarge_the_bound() {
        let last = |windows: &[WindowReport]| bound_factors(windows)[79].1;
        let mut windows = sound(80);
        windows[40..].iter_mut().for_each(|window| window.last_correction_m = 2e-3);
        assert!((last(&windows) - FACTOR_PER_FRACTION.mul_add(1.0 - NOT_CONVERGED_FRACTION, 1.0)).abs() < 1e-9);
        windows[40..].iter_mut().for_each(|window| window.last_correction_m = 5e-3);
        assert!((last(&windows) - 10.0).abs() < 1e-9);
        // A single window in forty: 5 mm over the square root of 40.
        windows[41..].iter_mut().for_each(|window| window.last_correction_m = 1e-4);
        assert!((1.5..1.7).contains(&last(&windows)), "{}", last(&windows));
        let mut windows = sound(80);
        windows.iter_mut().for_each(|window| window.conditioning = 5e-4);
        assert!((last(&windows) - 2.0).abs() < 1e-9);
    }

    #[test]
    fn only_the_time_without_matches_counts_as_lost() {
        // Two losses of 5 s, 25 s apart.
        let mut windows = sound(80);
        let lose = |window: &mut WindowReport| window.problem = Some(EventKind::FewMatches { matches: 3 });
        windows[10..20].iter_mut().for_each(lose);
        windows[60..70].iter_mut().for_each(lose);
        let found = judged(&windows, &[]);
        let EventKind::Untracked { seconds } = found[0].kind else { panic!("{found:?}") };
        assert!((seconds - 10.0).abs() < 1.0, "{seconds}");
        assert!(found[0].to.seconds_since(found[0].from) > 25.0);
    }

    #[test]
    fn a_head_without_matches_is_lost_unless_the_lidar_shows_that_it_rests() {
        let mut windows = sound(20);
        windows.iter_mut().for_each(|window| (window.matches, window.view_matches, window.moving) = (0, 0, false));
        assert_eq!(judged(&windows, &[])[0].severity, Severity::Lost);
        windows.iter_mut().for_each(|window| window.resting = true);
        assert_eq!(judged(&windows, &[]), vec![]);
        windows.iter_mut().for_each(|window| window.sees_rest = false);
        let found = judged(&windows, &[]);
        assert_eq!((found[0].severity, found[0].kind.key()), (Severity::Lost, "rest_assumed"));
    }

    #[test]
    fn gaps_of_one_sensor_are_merged_into_one_finding_with_the_longest() {
        let windows = sound(80);
        let gap = |k: usize, seconds: f64| Event::lasting(windows[k].stamp, seconds, EventKind::Restarted { seconds });
        let found = judged(&windows, &[gap(10, 0.5), gap(30, 2.0), gap(50, 1.0)]);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].kind, EventKind::Gap { sensor: "IMU", seconds: 2.0 });
        assert_eq!(found[0].from, windows[10].stamp);
    }

    #[test]
    fn half_a_recording_without_an_estimate_is_a_finding() {
        let windows = sound(80);
        let recorded = (windows[0].stamp, windows[79].stamp);
        let evidence = Evidence {
            windows: &windows,
            warnings: &[],
            samples: 6000,
            recorded,
            estimated: (recorded.0, windows[40].stamp),
        };
        let found = findings(&evidence);
        assert_eq!(found[0].kind, EventKind::NotCovered { seconds: 19.5 });
        assert_eq!(found[0].from, windows[40].stamp);
    }
}
