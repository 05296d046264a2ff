//! Evidence for and against a result.

use super::finding::{Cause, Finding, Status};
use crate::estimation::{Discarded, Warning, WarningKind, WindowReport};
use crate::time::{Span, Stamp};

/// Above this fraction of clipped samples the head may be lost.
const MUCH_CLIPPED: f64 = 0.02;

/// Evidence is weighed over stretches of this length, s, or half of a shorter run.
const STRETCH_S: f64 = 5.0;
/// Contradiction between IMU and lidar, as a multiple of the IMU's noise, from which a result is degraded, and lost.
/// 0.12 to 0.35 in 24 sound runs of all scenes, at most 0.61 in a window.
const CONTRADICTION: (f64, f64) = (0.6, 3.0);
/// Residual of matched surfaces, m. 2 to 4.5 mm in sound runs, 6 in a window.
const RESIDUAL_M: (f64, f64) = (0.010, 0.018);
/// Fraction of an interval with too few matched surfaces, or with unsolved windows.
const NOT_TRACKED: (f64, f64) = (0.35, 0.6);
/// Fraction of a run without any match, and not at rest, above which the result is lost.
const UNOBSERVED: f64 = 0.5;
/// Gaps longer than this degrade a result, s.
const GAP_S: f64 = 0.2;
const LIDAR_GAP_S: f64 = 1.0;
/// Fraction of clipped samples, and of the recording without an estimate.
const CLIPPED: f64 = 0.005;
const NOT_COVERED: f64 = 0.05;
/// More repeated readings than this are a frozen sensor.
const FROZEN: (usize, usize) = (30, 10);
/// Corrections of the calibration that are not plausible: of all ranges, m, and of the IMU's scale and misalignment.
const RANGE_CORRECTION_M: (f64, f64) = (0.06, 0.1);
const IMU_SCALE: (f64, f64) = (0.009, 0.04);
/// Drift between the clocks that no crystals have, s/s.
const CLOCK_RATE: f64 = 5e-4;
/// A head that is faster than this was integrated without being observed, m/s.
const SPEED_M_PER_S: f64 = 60.0;

/// Contradiction, residual (m) and IMU scale up to which the covariance is used without enlargement.
const SOUND: (f64, f64, f64) = (0.4, 0.006, 0.004);
/// The settling of solutions is evaluated over this many windows, 20 s at the usual step.
const SETTLING_WINDOWS: usize = 40;
/// Last correction of a window's iterations, m and rad, up to which its matches are settled: root mean square. 0.1 to
/// 0.5 mm where errors are a few millimetres; 1 to 4 mm where they are centimetres, because another choice of matches
/// would give another solution.
const SETTLED: f64 = 0.0005;
/// Limit on the contribution of a window: after a gap or a shock the first one jumps.
const LARGEST_STEP: f64 = 0.02;
/// A window whose last correction is larger has not settled. 3 to 15 % of the windows in most places, 40 to 60 % on
/// stairs; the bound grows with this fraction by [`PER_SHARE`].
const UNSETTLED: f64 = 0.0002;
const UNSETTLED_SHARE: f64 = 0.15;
const PER_SHARE: f64 = 4.0;
/// Conditioning, median over the same windows, from which on errors of normals are a good part of the information along
/// the weakest direction, and the worst that counts.
const CONDITIONED: (f64, f64) = (0.002, 0.0001);
/// Where so many windows in a row do not constrain some direction, errors of normals pass for information: the
/// covariance along it is too small by this factor.
const WEAK_WINDOWS: usize = 12;
const WEAK_DOUBT: f64 = 4.0;
const MOST_DOUBT: f64 = 1000.0;
/// Limit on the factor from the IMU scale: after a shock the scale says little about the trajectory.
const MOST_BY_SCALE: f64 = 10.0;

/// The data that an estimate is judged by.
#[derive(Debug, Clone, Copy)]
pub struct Evidence<'a> {
    /// The windows' reports, in order.
    pub windows: &'a [WindowReport],
    /// Warnings of the estimator.
    pub warnings: &'a [Warning],
    /// How many IMU samples there were.
    pub samples: usize,
    /// First and last stamp of the recording, lidar time.
    pub recorded: (Stamp, Stamp),
    /// First and last stamp of the estimate.
    pub estimated: (Stamp, Stamp),
}

/// The findings of a run, each kind of cause once, the worst first, equal ones in order of time.
pub fn findings(evidence: &Evidence) -> Vec<Finding> {
    let mut all = of_windows(evidence.windows);
    all.extend(evidence.warnings.iter().filter_map(|warning| of_warning(warning, evidence)));
    all.extend(of_calibration(evidence.windows));
    all.extend(of_coverage(evidence));
    let mut merged: Vec<Finding> = Vec::new();
    for finding in all {
        let same = |other: &&mut Finding| other.status == finding.status && other.cause.kind() == finding.cause.kind();
        match merged.iter_mut().find(same) {
            Some(other) => {
                (other.from, other.to) = (other.from.min(finding.from), other.to.max(finding.to));
                if finding.cause.size() > other.cause.size() {
                    other.cause = finding.cause;
                }
            }
            None => merged.push(finding),
        }
    }
    blame_clipping(&mut merged);
    merged.sort_by_key(|finding| (std::cmp::Reverse(finding.status), !finding.is_of_sensor(), finding.from));
    merged
}

/// Where a result is lost while the IMU was clipped for a good part of it, that is why.
fn blame_clipping(findings: &mut [Finding]) {
    let is_lost = findings.iter().any(|finding| finding.status == Status::Lost);
    let is_much = |cause: &Cause| matches!(cause, Cause::Clipped { share } if *share > MUCH_CLIPPED);
    findings
        .iter_mut()
        .filter(|finding| is_lost && is_much(&finding.cause))
        .for_each(|finding| finding.status = Status::Lost);
}

/// A sequence of windows with the median of a measure, or a fraction.
fn over_stretches(
    windows: &[WindowReport],
    measure: impl Fn(&[WindowReport]) -> f64,
    (degraded, lost): (f64, f64),
) -> Option<(Status, f64, Stamp, Stamp)> {
    let step_s = median(windows.windows(2).map(|pair| pair[1].stamp.seconds_since(pair[0].stamp)).collect());
    let length = ((STRETCH_S / step_s.clamp(0.1, STRETCH_S)).round() as usize).min(windows.len() / 2).max(1);
    let mut found: Option<(Status, f64, Stamp, Stamp)> = None;
    for stretch in windows.windows(length) {
        let value = measure(stretch);
        if value <= degraded {
            continue;
        }
        let status = if value > lost { Status::Lost } else { Status::Degraded };
        let (from, to) = (stretch[0].stamp, stretch[length - 1].stamp);
        found = Some(match found {
            // A lost result is lost from the first stretch that is.
            Some((worst, most, begins, ends)) if worst >= status => {
                let ends = if worst > status { ends } else { to };
                (worst, most.max(value), begins, ends)
            }
            Some((_, most, ..)) => (status, most.max(value), from, to),
            None => (status, value, from, to),
        });
    }
    found
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}

/// Whether only the IMU determined a window's position although surfaces should have been matched.
fn is_untracked(window: &WindowReport) -> bool {
    matches!(window.trouble, Some(WarningKind::FewMatches { .. } | WarningKind::NotSolved { .. }))
}

fn of_windows(windows: &[WindowReport]) -> Vec<Finding> {
    let contradiction = |stretch: &[WindowReport]| median(stretch.iter().map(|w| w.imu_contradiction).collect());
    let residual = |stretch: &[WindowReport]| median(stretch.iter().map(|w| w.residual_rms_m).collect());
    let untracked =
        |stretch: &[WindowReport]| stretch.iter().filter(|w| is_untracked(w)).count() as f64 / stretch.len() as f64;
    let fastest = |stretch: &[WindowReport]| stretch.iter().map(|w| w.speed_m_per_s).fold(0.0, f64::max);
    let mut all = Vec::new();
    let mut add = |found: Option<(Status, f64, Stamp, Stamp)>, cause: &dyn Fn(f64, Stamp, Stamp) -> Cause| {
        all.extend(found.map(|(status, value, from, to)| Finding { status, cause: cause(value, from, to), from, to }));
    };
    add(over_stretches(windows, contradiction, CONTRADICTION), &|times, _, _| Cause::Contradiction { times });
    add(over_stretches(windows, residual, RESIDUAL_M), &|residual_m, _, _| Cause::PoorFit { residual_m });
    add(over_stretches(windows, untracked, NOT_TRACKED), &|_, from, to| Cause::FewMatches {
        seconds: to.seconds_since(from),
    });
    add(over_stretches(windows, fastest, (SPEED_M_PER_S, SPEED_M_PER_S)), &|speed_m_per_s, _, _| Cause::Speed {
        speed_m_per_s,
    });
    // A head that neither rests nor matches any surface for most of the run: the path is unknown.
    let (unobserved, assumed) = (for_most(windows, |w| !w.resting), for_most(windows, |w| w.resting && !w.sees_rest));
    all.extend(unobserved.map(|(seconds, from, to)| Finding {
        status: Status::Lost,
        cause: Cause::FewMatches { seconds },
        from,
        to,
    }));
    all.extend(assumed.map(|(seconds, from, to)| Finding {
        status: Status::Degraded,
        cause: Cause::RestAssumed { seconds },
        from,
        to,
    }));
    all
}

/// For how many seconds, from and to when windows without any match are `such`, where that is most of the run.
fn for_most(windows: &[WindowReport], such: impl Fn(&WindowReport) -> bool) -> Option<(f64, Stamp, Stamp)> {
    let (from, to) = (windows.first()?.stamp, windows.last()?.stamp);
    let without = windows.iter().filter(|w| w.matches + w.view_matches == 0 && such(w)).count();
    let share = without as f64 / windows.len() as f64;
    (share > UNOBSERVED).then_some((share * to.seconds_since(from), from, to))
}

fn of_warning(warning: &Warning, evidence: &Evidence) -> Option<Finding> {
    let end = evidence.recorded.1;
    let from = warning.stamp;
    let lasting = |seconds: f64| from + Span::from_seconds(seconds);
    let (status, cause, to) = match &warning.kind {
        WarningKind::Restarted { seconds } => {
            (Status::Degraded, Cause::Gap { sensor: "IMU", seconds: *seconds }, lasting(*seconds))
        }
        WarningKind::ImuGap { seconds } if *seconds > GAP_S => {
            (Status::Degraded, Cause::Gap { sensor: "IMU", seconds: *seconds }, lasting(*seconds))
        }
        WarningKind::LidarGap { seconds } if *seconds > LIDAR_GAP_S => {
            (Status::Degraded, Cause::Gap { sensor: "lidar", seconds: *seconds }, from)
        }
        WarningKind::Lost { seconds, .. } => (Status::Lost, Cause::FewMatches { seconds: *seconds }, end),
        WarningKind::NotRelocalised { .. } | WarningKind::LostInMap => (Status::Lost, Cause::NotRelocalised, end),
        WarningKind::Saturated { samples } if *samples as f64 > CLIPPED * evidence.samples as f64 => {
            let share = *samples as f64 / evidence.samples.max(1) as f64;
            (Status::Degraded, Cause::Clipped { share }, end)
        }
        WarningKind::Discarded { what: Discarded::RepeatedSamples, count } if *count > FROZEN.0 => {
            (Status::Degraded, Cause::Frozen { sensor: "IMU", count: *count }, end)
        }
        WarningKind::Discarded { what: Discarded::RepeatedScans, count } if *count > FROZEN.1 => {
            (Status::Degraded, Cause::Frozen { sensor: "lidar", count: *count }, end)
        }
        _ => return None,
    };
    Some(Finding { status, cause, from, to })
}

/// Implausibly large corrections of the calibration. They are evaluated at the run's end, where the estimate is
/// best, and apply to the full run.
fn of_calibration(windows: &[WindowReport]) -> Vec<Finding> {
    let (Some(first), Some(last)) = (windows.first(), windows.last()) else { return Vec::new() };
    let late = &windows[windows.len() / 2..];
    let of = |value: f64, (degraded, lost): (f64, f64), cause: Cause| {
        let status = if value > lost { Status::Lost } else { Status::Degraded };
        (value > degraded).then_some(Finding { status, cause, from: first.stamp, to: last.stamp })
    };
    let correction_m = last.range_correction_m;
    let entry = late.iter().map(|window| window.imu_matrix).fold(0.0, f64::max);
    let rate = median(late.iter().map(|window| window.clock_rate.abs()).collect());
    [
        of(correction_m.abs(), RANGE_CORRECTION_M, Cause::RangeCorrection { correction_m }),
        of(entry, IMU_SCALE, Cause::ImuScale { entry }),
        of(rate, (CLOCK_RATE, f64::INFINITY), Cause::ClockRate { rate }),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn of_coverage(evidence: &Evidence) -> Option<Finding> {
    let ((from, to), (begins, ends)) = (evidence.recorded, evidence.estimated);
    let (before_s, after_s) = (begins.seconds_since(from).max(0.0), to.seconds_since(ends).max(0.0));
    let seconds = before_s + after_s;
    let (from, to) = if before_s > after_s { (from, begins) } else { (ends, to) };
    let recorded_s = evidence.recorded.1.seconds_since(evidence.recorded.0);
    let cause = Cause::NotCovered { seconds };
    (seconds > NOT_COVERED * recorded_s && seconds > 0.5).then_some(Finding {
        status: Status::Degraded,
        cause,
        from,
        to,
    })
}

/// Factor on the bound that follows from the covariance, at each window's end.
///
/// The covariance assumes that IMU, lidar and calibration are as specified. Where IMU and lidar contradict each other,
/// surfaces fit badly, or the IMU's scale leaves the prior, another assumption is violated too, by about as much. An
/// error persists in the map, so the factor never decreases.
pub fn doubt(windows: &[WindowReport]) -> Vec<(Stamp, f64)> {
    let mut most = 1.0_f64;
    let of = SETTLING_WINDOWS.min(windows.len());
    let near = |k: usize| &windows[k.saturating_sub(2)..(k + 3).min(windows.len())];
    let factor = |k: usize| {
        let contradiction = median(near(k).iter().map(|w| w.imu_contradiction).collect());
        let residual_m = median(near(k).iter().map(|w| w.residual_rms_m).collect());
        let is_weak = |w: &WindowReport| matches!(w.trouble, Some(WarningKind::WeakGeometry { .. }));
        let stays_weak = k + 1 >= WEAK_WINDOWS && windows[k + 1 - WEAK_WINDOWS..=k].iter().all(is_weak);
        let weak = if stays_weak { WEAK_DOUBT } else { 1.0 };
        let scale = (windows[k].imu_matrix / SOUND.2).powi(2).min(MOST_BY_SCALE);
        let late = &windows[(k + 1).saturating_sub(of)..=k];
        let unsettled = unsettled(late, of).max(ill_conditioned(late, of));
        // A mismatch that no noise explains moves the estimate by more than in proportion.
        (contradiction / SOUND.0)
            .powi(2)
            .max(residual_m / SOUND.1)
            .max(scale)
            .max(weak)
            .max(unsettled)
            .clamp(1.0, MOST_DOUBT)
    };
    let enlarge = |k: usize| {
        most = most.max(factor(k));
        (windows[k].stamp, most)
    };
    (0..windows.len()).map(enlarge).collect()
}

/// Factor by which the errors of windows that do not settle exceed the covariance, over the last `of` windows.
fn unsettled(windows: &[WindowReport], of: usize) -> f64 {
    let squares: f64 = windows.iter().map(|w| w.last_correction_m.min(LARGEST_STEP).powi(2)).sum();
    let unsettled = windows.iter().filter(|w| w.last_correction_m > UNSETTLED).count();
    let share = unsettled as f64 / of as f64;
    let rms = (squares / of as f64).sqrt();
    (rms / SETTLED).max(1.0 + PER_SHARE * (share - UNSETTLED_SHARE))
}

/// Factor by which the covariance is too small in the weakest direction of badly conditioned windows.
fn ill_conditioned(windows: &[WindowReport], of: usize) -> f64 {
    let matched: Vec<f64> = windows.iter().filter(|w| w.matches > 0 && !w.resting).map(|w| w.conditioning).collect();
    let enough = 2 * matched.len() > of;
    if enough { (CONDITIONED.0 / median(matched).max(CONDITIONED.1)).sqrt() } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation::TimeSpent;

    /// Windows of a sound run, twice a second.
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
            imu_matrix: 0.002,
            speed_m_per_s: 1.0,
            moving: true,
            resting: false,
            sees_rest: true,
            trouble: None,
            elapsed_s: 0.0,
            spent: TimeSpent::default(),
        };
        (0..count).map(report).collect()
    }

    fn judged(windows: &[WindowReport], warnings: &[Warning]) -> Vec<Finding> {
        let recorded = (windows[0].stamp, windows[windows.len() - 1].stamp);
        findings(&Evidence { windows, warnings, samples: 6000, recorded, estimated: recorded })
    }

    #[test]
    fn a_sound_run_has_no_findings_and_no_doubt() {
        assert_eq!(judged(&sound(80), &[]), vec![]);
        assert!(doubt(&sound(80)).iter().all(|(_, factor)| *factor == 1.0));
    }

    #[test]
    fn surfaces_that_do_not_fit_lose_a_run_however_short_it_is() {
        for count in [6, 80] {
            let mut windows = sound(count);
            windows.iter_mut().for_each(|window| window.residual_rms_m = 0.03);
            let found = judged(&windows, &[]);
            assert_eq!((found[0].status, found[0].cause.kind()), (Status::Lost, "poor_fit"));
        }
    }

    #[test]
    fn a_contradiction_is_found_where_it_is_and_enlarges_the_bound_from_there_on() {
        let mut windows = sound(80);
        windows[40..60].iter_mut().for_each(|window| window.imu_contradiction = 1.2);
        let found = judged(&windows, &[]);
        assert_eq!((found[0].status, found[0].cause.kind()), (Status::Degraded, "contradiction"));
        assert!(found[0].from >= windows[30].stamp && found[0].to <= windows[70].stamp);
        let doubts = doubt(&windows);
        assert_eq!(doubts[30].1, 1.0);
        assert!((doubts[79].1 - 9.0).abs() < 1e-9, "{}", doubts[79].1);
    }

    #[test]
    fn solutions_that_do_not_settle_enlarge_the_bound_and_so_does_weak_conditioning() {
        let last = |windows: &[WindowReport]| doubt(windows)[79].1;
        let mut windows = sound(80);
        windows[40..].iter_mut().for_each(|window| window.last_correction_m = 2e-3);
        assert!((last(&windows) - PER_SHARE.mul_add(1.0 - UNSETTLED_SHARE, 1.0)).abs() < 1e-9);
        windows[40..].iter_mut().for_each(|window| window.last_correction_m = 5e-3);
        assert!((last(&windows) - 10.0).abs() < 1e-9);
        // One window in forty is an exception: 5 mm over the root of 40.
        windows[41..].iter_mut().for_each(|window| window.last_correction_m = 1e-4);
        assert!((1.5..1.7).contains(&last(&windows)), "{}", last(&windows));
        let mut windows = sound(80);
        windows.iter_mut().for_each(|window| window.conditioning = 5e-4);
        assert!((last(&windows) - 2.0).abs() < 1e-9);
    }

    #[test]
    fn a_head_that_observes_nothing_is_lost_unless_it_rests() {
        let mut windows = sound(20);
        windows.iter_mut().for_each(|window| (window.matches, window.view_matches, window.moving) = (0, 0, false));
        assert_eq!(judged(&windows, &[])[0].status, Status::Lost);
        windows.iter_mut().for_each(|window| window.resting = true);
        assert_eq!(judged(&windows, &[]), vec![]);
        windows.iter_mut().for_each(|window| window.sees_rest = false);
        let found = judged(&windows, &[]);
        assert_eq!((found[0].status, found[0].cause.kind()), (Status::Degraded, "rest_assumed"));
    }

    #[test]
    fn gaps_of_one_sensor_are_one_finding_with_the_longest() {
        let windows = sound(80);
        let gap =
            |k: usize, seconds: f64| Warning { stamp: windows[k].stamp, kind: WarningKind::Restarted { seconds } };
        let found = judged(&windows, &[gap(10, 0.5), gap(30, 2.0), gap(50, 1.0)]);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].cause, Cause::Gap { sensor: "IMU", seconds: 2.0 });
        assert_eq!(found[0].from, windows[10].stamp);
    }

    #[test]
    fn half_a_recording_without_an_estimate_is_stated() {
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
        assert_eq!(found[0].cause, Cause::NotCovered { seconds: 19.5 });
        assert_eq!(found[0].from, windows[40].stamp);
    }
}
