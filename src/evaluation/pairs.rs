use super::EvaluationError;
use zsim_base::geometry::{Pose, Trajectory, Vector};
use zsim_base::time::{Span, Stamp};

/// Estimated poses, each with the true pose of the same time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pairs {
    stamps: Vec<Stamp>,
    estimate: Vec<Pose>,
    truth: Vec<Pose>,
    /// Whether the true rotations are not known.
    positions_only: bool,
    /// Median interval of the trajectory that was interpolated; `None` if all stamps are in both.
    interpolated: Option<Span>,
}

impl Pairs {
    /// Pairs the poses of the sparser trajectory with those of the denser one.
    ///
    /// The denser trajectory is interpolated at the stamps of the sparser one. Interpolation cuts the corners of a
    /// path, so that a sparse truth would seem to be an error of the estimate. The sparser trajectory is that with the
    /// larger median interval in the common time. Nothing is interpolated over a gap of more than two of these
    /// intervals.
    ///
    /// # Errors
    /// When the trajectories have no time in common.
    pub fn associate(estimate: &Trajectory, truth: &Trajectory) -> Result<Self, EvaluationError> {
        // A trajectory with one pose in the common time is sparse.
        let interval = |of| median_interval(stamps_within(of, estimate, truth)).map_or(i64::MAX, Span::nanos);
        let (of_estimate, of_truth) = (interval(estimate), interval(truth));
        let limit = Span::from_nanos(of_estimate.max(of_truth).saturating_mul(MAX_INTERVALS));
        let is_truth_sparse = of_truth > of_estimate;
        let (dense, sparse) = if is_truth_sparse { (estimate, truth) } else { (truth, estimate) };
        let pairs = Self::of(sparse, &interpolated(dense, sparse.stamps(), limit));
        if pairs.is_empty() {
            return Err(EvaluationError::NothingInCommon { estimate: span_of(estimate), truth: span_of(truth) });
        }
        let is_known = |stamp| dense.stamps().binary_search(stamp).is_ok();
        let interval = Span::from_nanos(of_estimate.min(of_truth));
        let pairs = Self { interpolated: (!pairs.stamps.iter().all(is_known)).then_some(interval), ..pairs };
        Ok(if is_truth_sparse { Self { estimate: pairs.truth, truth: pairs.estimate, ..pairs } } else { pairs })
    }

    /// Returns the median interval of the trajectory that was interpolated linearly.
    ///
    /// [`associate`](Self::associate) interpolates it; `None` if all stamps are in both.
    pub fn interpolated_over(&self) -> Option<Span> {
        self.interpolated
    }

    /// Marks the truth as one without attitudes.
    ///
    /// Nothing that depends on the true rotation is evaluated.
    #[must_use]
    pub fn with_positions_only(self) -> Self {
        Self { positions_only: true, ..self }
    }

    /// Whether the true rotations are not known.
    pub fn have_positions_only(&self) -> bool {
        self.positions_only
    }

    /// Pairs the estimate's poses with the true poses at the same stamps.
    ///
    /// A [`PoseSampler`] returns such true poses. Poses without a true pose are not paired; the result may be empty.
    pub fn of(estimate: &Trajectory, truth: &[(Stamp, Pose)]) -> Self {
        let mut pairs = Self::default();
        let mut poses = estimate.iter().peekable();
        for (stamp, true_pose) in truth {
            while poses.next_if(|(at, _)| at < stamp).is_some() {}
            if let Some((_, pose)) = poses.next_if(|(at, _)| at == stamp) {
                pairs.stamps.push(*stamp);
                pairs.estimate.push(*pose);
                pairs.truth.push(*true_pose);
            }
        }
        pairs
    }

    /// Returns the number of pairs.
    pub fn len(&self) -> usize {
        self.stamps.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.stamps.is_empty()
    }

    /// Returns the times, increasing.
    pub fn stamps(&self) -> &[Stamp] {
        &self.stamps
    }

    /// Returns the estimated poses, `map_from_head`.
    pub fn estimate(&self) -> &[Pose] {
        &self.estimate
    }

    /// Returns the true poses, `world_from_head`.
    pub fn truth(&self) -> &[Pose] {
        &self.truth
    }

    /// Seconds from the first pair to the last.
    pub fn duration_s(&self) -> f64 {
        match (self.stamps.first(), self.stamps.last()) {
            (Some(first), Some(last)) => last.seconds_since(*first),
            _ => 0.0,
        }
    }

    /// Returns the pairs of the first `seconds`.
    #[must_use]
    pub fn first_seconds(&self, seconds: f64) -> Self {
        let Some(start) = self.stamps.first() else { return self.clone() };
        let end = *start + Span::from_seconds(seconds);
        self.slice(0, self.stamps.partition_point(|stamp| *stamp <= end))
    }

    /// Returns the pairs of the last `seconds`.
    #[must_use]
    pub fn last_seconds(&self, seconds: f64) -> Self {
        let Some(end) = self.stamps.last() else { return self.clone() };
        let start = *end - Span::from_seconds(seconds);
        self.slice(self.stamps.partition_point(|stamp| *stamp < start), self.len())
    }

    fn slice(&self, from: usize, to: usize) -> Self {
        Self {
            stamps: self.stamps[from..to].to_vec(),
            estimate: self.estimate[from..to].to_vec(),
            truth: self.truth[from..to].to_vec(),
            positions_only: self.positions_only,
            interpolated: self.interpolated,
        }
    }

    /// Computes `world_from_map` by aligning the estimated with the true positions.
    ///
    /// # Errors
    /// When there are fewer than three pairs, or positions on a line.
    pub fn world_from_map(&self) -> Result<Pose, EvaluationError> {
        let positions = |poses: &[Pose]| poses.iter().map(|pose| pose.translation.vector).collect::<Vec<Vector>>();
        super::align(&positions(&self.truth), &positions(&self.estimate))
    }

    /// The mean time of the pairs, seconds after `origin`.
    pub(super) fn mean_time_s(&self, origin: Stamp) -> f64 {
        self.stamps.iter().map(|stamp| stamp.seconds_since(origin)).sum::<f64>() / self.len() as f64
    }
}

/// Maximum number of median intervals of the sparser trajectory over which the denser one is interpolated.
const MAX_INTERVALS: i64 = 2;

/// The stamps of a trajectory within the common time of two.
fn stamps_within<'a>(of: &'a Trajectory, a: &Trajectory, b: &Trajectory) -> &'a [Stamp] {
    let (Some(a), Some(b)) = (a.span(), b.span()) else { return &[] };
    let (first, last) = (a.0.max(b.0), a.1.min(b.1));
    let stamps = of.stamps();
    let from = stamps.partition_point(|stamp| *stamp < first);
    &stamps[from..stamps.partition_point(|stamp| *stamp <= last).max(from)]
}

/// The median interval between stamps; `None` with fewer than two.
pub(super) fn median_interval(stamps: &[Stamp]) -> Option<Span> {
    let mut intervals: Vec<Span> = stamps.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let middle = intervals.len() / 2;
    (!intervals.is_empty()).then(|| *intervals.select_nth_unstable(middle).1)
}

/// The poses of a trajectory at stamps, without those in an interval of more than `limit`.
fn interpolated(trajectory: &Trajectory, at: &[Stamp], limit: Span) -> Vec<(Stamp, Pose)> {
    let known = trajectory.stamps();
    let is_close = |stamp: &&Stamp| {
        let after = known.partition_point(|known| known < *stamp);
        let before = after.checked_sub(1).map(|before| known[before]);
        known.get(after).is_some_and(|after| after == *stamp || before.is_some_and(|before| *after - before <= limit))
    };
    at.iter().filter(is_close).filter_map(|stamp| Some((*stamp, trajectory.at(*stamp)?))).collect()
}

/// Interpolates a trajectory at given stamps while it is read pose by pose, and never stored in full.
#[derive(Debug, Clone)]
pub struct PoseSampler<'a> {
    /// Stamps after the last pose.
    waiting: &'a [Stamp],
    before: Option<(Stamp, Pose)>,
    sampled: Vec<(Stamp, Pose)>,
}

impl<'a> PoseSampler<'a> {
    /// Creates a sampler at these increasing stamps.
    pub fn at(stamps: &'a [Stamp]) -> Self {
        Self { waiting: stamps, before: None, sampled: Vec::with_capacity(stamps.len()) }
    }

    /// Adds the next pose, in order of time.
    pub fn add(&mut self, now: Stamp, pose: Pose) {
        while let [stamp, later @ ..] = self.waiting
            && *stamp <= now
        {
            self.waiting = later;
            let adjacent = self.before.into_iter().filter(|(before, _)| *before < now).chain([(now, pose)]);
            // A stamp before the first pose has no partner.
            let interpolated = Trajectory::from_poses(adjacent).unwrap_or_default().at(*stamp);
            self.sampled.extend(interpolated.map(|interpolated| (*stamp, interpolated)));
        }
        self.before = Some((now, pose));
    }

    /// Returns the poses at the stamps that the trajectory covers.
    pub fn finish(self) -> Vec<(Stamp, Pose)> {
        self.sampled
    }
}

fn span_of(trajectory: &Trajectory) -> String {
    match trajectory.span() {
        Some((first, last)) => {
            let seconds = |stamp: Stamp| stamp.nanos() as f64 * 1e-9;
            format!("{} poses from {:.3} s to {:.3} s", trajectory.len(), seconds(first), seconds(last))
        }
        None => "no pose".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(from_ms: i64, count: i64) -> Trajectory {
        let pose = |k: i64| (Stamp::from_nanos((from_ms + 10 * k) * 1_000_000), Pose::translation(k as f64, 0.0, 0.0));
        Trajectory::from_poses((0..count).map(pose)).unwrap()
    }

    #[test]
    fn poses_outside_the_truth_are_not_paired() {
        // Truth covers 0..90 ms with x = t / 10 ms; the estimate's stamps are 45, 55, ..., 135 ms: five lie within.
        let pairs = Pairs::associate(&line(45, 10), &line(0, 10)).unwrap();
        assert_eq!(pairs.len(), 5);
        assert!((pairs.truth()[0].translation.x - 4.5).abs() < 1e-12);
    }

    #[test]
    fn the_denser_trajectory_is_interpolated_at_the_stamps_of_the_sparser_one() {
        // On a circle of 1 m at 1 rad/s: a chord over 1 s is 1 - cos(0.5) = 122 mm inside the circle in its middle, one over
        // 10 ms 0.0125 mm.
        let circle = |from_ms: i64, step_ms: i64, count: i64| {
            let pose = |k: i64| {
                let ms = from_ms + step_ms * k;
                let (y, x) = (1e-3 * ms as f64).sin_cos();
                (Stamp::from_nanos(ms * 1_000_000), Pose::translation(x, y, 0.0))
            };
            Trajectory::from_poses((0..count).map(pose)).unwrap()
        };
        let (dense, sparse) = (circle(0, 10, 1000), circle(505, 1000, 9));
        for (estimate, truth) in [(&dense, &sparse), (&sparse, &dense)] {
            let pairs = Pairs::associate(estimate, truth).unwrap();
            assert_eq!(pairs.stamps(), sparse.stamps());
            let error = |(a, b): (&Pose, &Pose)| (a.translation.vector - b.translation.vector).norm();
            let largest = pairs.estimate().iter().zip(pairs.truth()).map(error).fold(0.0, f64::max);
            assert!(largest < 1.3e-5, "{largest}");
            let is_on_circle = |pose: &Pose| (pose.translation.vector.norm() - 1.0).abs() < 1e-12;
            let of_sparse = if std::ptr::eq(estimate, &sparse) { pairs.estimate() } else { pairs.truth() };
            assert!(of_sparse.iter().all(is_on_circle), "the sparser one is not interpolated");
            assert_eq!(pairs.interpolated_over(), Some(Span::from_nanos(10_000_000)));
        }
    }

    #[test]
    fn nothing_is_interpolated_over_a_gap_of_the_denser_trajectory() {
        // The estimate has 0 to 1 s and 5 to 6 s at 100 Hz; the truth has every quarter of a second.
        let dense =
            line(0, 101).iter().chain(line(5000, 101).iter()).map(|(stamp, pose)| (stamp, *pose)).collect::<Vec<_>>();
        let quarter = |k: i64| (Stamp::from_nanos(250_000_000 * k + 1), Pose::translation(k as f64, 0.0, 0.0));
        let truth = Trajectory::from_poses((0..24).map(quarter)).unwrap();
        let pairs = Pairs::associate(&Trajectory::from_poses(dense).unwrap(), &truth).unwrap();
        let quarters: Vec<i64> = pairs.stamps().iter().map(|stamp| stamp.nanos() / 250_000_000).collect();
        assert_eq!(quarters, [0, 1, 2, 3, 20, 21, 22, 23]);
    }

    #[test]
    fn poses_with_gaps_in_the_truth_are_paired_by_stamp() {
        // The truth has the stamps 10, 30 and 45 ms; the estimate 0, 10, ..., 90 ms with x = t / 10 ms.
        let at = |ms: i64| (Stamp::from_nanos(ms * 1_000_000), Pose::translation(0.0, ms as f64, 0.0));
        let pairs = Pairs::of(&line(0, 10), &[at(10), at(30), at(45)]);
        let x: Vec<f64> = pairs.estimate().iter().map(|pose| pose.translation.x).collect();
        let y: Vec<f64> = pairs.truth().iter().map(|pose| pose.translation.y).collect();
        assert_eq!((x, y), (vec![1.0, 3.0], vec![10.0, 30.0]));
    }

    #[test]
    fn the_error_for_trajectories_without_overlap_has_both_spans() {
        let error = Pairs::associate(&line(1_000_000, 10), &line(0, 10)).unwrap_err().to_string();
        assert!(error.contains("10 poses from 1000.000 s to 1000.090 s") && error.contains("from 0.000 s"), "{error}");
    }

    #[test]
    fn the_first_and_last_seconds_include_their_ends() {
        let pairs = Pairs::associate(&line(0, 101), &line(0, 101)).unwrap();
        assert_eq!((pairs.first_seconds(0.2).len(), pairs.last_seconds(0.2).len()), (21, 21));
        assert_eq!(pairs.interpolated_over(), None);
        assert!((pairs.duration_s() - 1.0).abs() < 1e-12);
    }
}
