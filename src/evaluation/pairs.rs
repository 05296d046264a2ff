use super::EvaluationError;
use crate::geometry::{Pose, Trajectory, Vector};
use crate::time::{Span, Stamp};
use std::convert::Infallible;

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
        let poses = truth.iter().map(|(stamp, pose)| Ok::<_, Infallible>((stamp, *pose)));
        let Ok(pairs) = Self::gather(estimate, poses);
        if pairs.is_empty() {
            return Err(EvaluationError::NothingInCommon { estimate: span_of(estimate), truth: span_of(truth) });
        }
        Ok(pairs)
    }

    /// The same, for a truth that is read pose by pose in order of time and never stored in full. The result may be
    /// empty.
    ///
    /// # Errors
    /// When reading the truth fails.
    pub fn gather<E>(
        estimate: &Trajectory,
        truth: impl IntoIterator<Item = Result<(Stamp, Pose), E>>,
    ) -> Result<Self, E> {
        let capacity = estimate.len();
        let (estimated, truths) = (Vec::with_capacity(capacity), Vec::with_capacity(capacity));
        let mut pairs = Self { stamps: Vec::with_capacity(capacity), estimate: estimated, truth: truths };
        let mut waiting = estimate.iter().peekable();
        let mut before: Option<(Stamp, Pose)> = None;
        for pose in truth {
            let now = pose?;
            // Poses before the first true pose have no partner.
            while let Some((stamp, pose)) = waiting.next_if(|(stamp, _)| *stamp <= now.0) {
                let around = before.into_iter().filter(|before| before.0 < now.0).chain([now]);
                let between = Trajectory::from_poses(around).unwrap_or_default();
                if let Some(true_pose) = between.at(stamp) {
                    pairs.stamps.push(stamp);
                    pairs.estimate.push(*pose);
                    pairs.truth.push(true_pose);
                }
            }
            before = Some(now);
        }
        Ok(pairs)
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
