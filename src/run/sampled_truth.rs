//! The truth of a recording at the stamps of an estimate.

use super::bound::BoundAccumulator;
use super::open_loop::OpenLoopRun;
use super::true_clock::true_offset;
use zsim_base::geometry::{Pose, Trajectory};
use zsim_base::time::Stamp;
use zsim_evaluation::PoseSampler;
use zsim_recording::{Reader, RecordingError, Truth};

/// The truth at the stamps of an estimate, from one pass over the recording.
///
/// Memory grows as that of the estimate; the recorded truth is many times longer.
pub(super) struct SampledTruth {
    /// `world_from_head` at the stamps of the estimate.
    pub heads: Vec<(Stamp, Pose)>,
    /// `world_from_base` at the stamps of the estimate; empty if the recording does not contain it.
    pub bases: Vec<(Stamp, Pose)>,
    /// `world_from_head` at the stamps of the dead reckoning.
    pub dead_reckoned_heads: Vec<(Stamp, Pose)>,
    /// The true clock offset over lidar time, s: IMU stamp minus lidar stamp of the same time.
    pub clock_offsets: Vec<(Stamp, f64)>,
}

impl SampledTruth {
    /// Reads the truth at the stamps of `run`, and adds all of it to `bound`; `None` if there is none at these stamps.
    pub(super) fn read(
        reader: &Reader,
        run: &OpenLoopRun,
        mut bound: Option<&mut BoundAccumulator>,
    ) -> Result<Option<Self>, RecordingError> {
        let stamps = run.estimate.trajectory.stamps();
        let (mut heads, mut bases) = (PoseSampler::at(stamps), PoseSampler::at(stamps));
        let mut dead_reckoned = PoseSampler::at(run.dead_reckoning.as_ref().map_or(&[], Trajectory::stamps));
        let mut clock_offsets = Vec::new();
        for truth in reader.truth() {
            let truth = truth?;
            bound.iter_mut().for_each(|bound| bound.add_truth(&truth));
            match truth {
                Truth::Head(stamp, pose) => {
                    heads.add(stamp, pose);
                    dead_reckoned.add(stamp, pose);
                }
                Truth::Base(stamp, pose) => bases.add(stamp, pose),
                Truth::Clock(now, clock) => clock_offsets.push(true_offset(now, &clock)),
            }
        }
        let (heads, bases, dead_reckoned_heads) = (heads.finish(), bases.finish(), dead_reckoned.finish());
        Ok((!heads.is_empty()).then_some(Self { heads, bases, dead_reckoned_heads, clock_offsets }))
    }
}
