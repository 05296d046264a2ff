use super::EvaluationError;
use zsim_base::geometry::{Pose, Trajectory, Vector};
use zsim_base::time::{Span, Stamp};

/// Estimated poses, each with the true pose of the same time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pairs {
    stamps: Vec<Stamp>,
    estimate: Vec<Pose>,
    truth: Vec<Pose>,
}

impl Pairs {
    /// The estimate's poses that lie within the truth's time, with the truth interpolated at their stamps.
    ///
    /// # Errors
    /// When no pose does.
    pub fn associate(estimate: &Trajectory, truth: &Trajectory) -> Result<Self, EvaluationError> {
        let mut sampler = PoseSampler::at(estimate.stamps());
        truth.iter().for_each(|(stamp, pose)| sampler.add(stamp, *pose));
        let pairs = Self::of(estimate, &sampler.finish());
        if pairs.is_empty() {
            return Err(EvaluationError::NothingInCommon { estimate: span_of(estimate), truth: span_of(truth) });
        }
        Ok(pairs)
    }

    /// Pairs the estimate's poses with the true poses at the same stamps, as a [`PoseSampler`] returns them.
    ///
    /// Poses without a true pose are not paired; the result may be empty.
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

    /// How many pairs.
    pub fn len(&self) -> usize {
        self.stamps.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.stamps.is_empty()
    }

    /// The times, increasing.
    pub fn stamps(&self) -> &[Stamp] {
        &self.stamps
    }

    /// The estimated poses, `map_from_head`.
    pub fn estimate(&self) -> &[Pose] {
        &self.estimate
    }

    /// The true poses, `world_from_head`.
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

    /// The pairs of the first `seconds`.
    #[must_use]
    pub fn first_seconds(&self, seconds: f64) -> Self {
        let Some(start) = self.stamps.first() else { return self.clone() };
        let end = *start + Span::from_seconds(seconds);
        self.slice(0, self.stamps.partition_point(|stamp| *stamp <= end))
    }

    /// The pairs of the last `seconds`.
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
        }
    }

    /// The rigid transform `world_from_map` that brings the estimated positions nearest to the true ones.
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

    /// The poses at the stamps that the trajectory covers.
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
        assert!((pairs.duration_s() - 1.0).abs() < 1e-12);
    }
}
