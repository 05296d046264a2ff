//! Times of the points of a lidar's clouds: their encoding, and which of them are impossible.

mod cloud_times;
mod encoding;
mod raw_cloud;
mod unit;

use crate::message::scan::sort_by_firing_time;
use crate::quantile::quantile;
pub use cloud_times::CloudTimes;
use encoding::{MAX_CLOUD_S, TimeEncoding};
pub use raw_cloud::{RawCloud, TimedScan};
pub use unit::TimeUnit;
use zsim_base::measurement::{LidarReturn, LidarScan};
use zsim_base::time::{Span, Stamp};

/// Maximum difference of a time from the median of its cloud, in durations of a cloud.
///
/// The returns of a cloud may be concentrated at one of its ends.
const REACH: f64 = 1.5;

/// How to convert the times of a lidar's points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PointTimes {
    /// All points of a cloud are assumed to be fired at its stamp.
    AtStamp,
    /// Each point has a time.
    Encoded {
        /// Number of the name of the time field.
        source: usize,
        /// Encoding of the times.
        encoding: TimeEncoding,
        /// Maximum difference from the median of the cloud.
        reach: Span,
    },
}

impl PointTimes {
    /// Detects the times of a lidar: what holds for most of its first clouds.
    ///
    /// `None` without clouds.
    ///
    /// The second result is the unit of times after the stamp, if it is not the usual one.
    pub fn detect(clouds: &[CloudTimes]) -> Option<(Self, Option<TimeUnit>)> {
        let source = most_frequent(&clouds.iter().map(|cloud| cloud.source).collect::<Vec<_>>())?;
        let of_source = || clouds.iter().filter(|cloud| cloud.source == source);
        let equal: Vec<bool> = of_source().filter_map(|cloud| cloud.is_equal).collect();
        if !equal.is_empty() && equal.iter().all(|is_equal| *is_equal) {
            return Some((Self::AtStamp, None));
        }
        let usual = most_frequent(&of_source().map(TimeEncoding::detect).collect::<Vec<_>>())?;
        let same: Vec<CloudTimes> = of_source().filter(|cloud| TimeEncoding::detect(cloud) == usual).copied().collect();
        let unit = if let TimeEncoding::AfterStamp(unit) = usual { TimeUnit::detect(&same, unit) } else { None };
        let encoding = unit.map_or(usual, TimeEncoding::AfterStamp);
        let spreads_s = same.iter().map(|cloud| cloud.spread() / encoding.per_second()).collect();
        let period_s = unit::period_s(clouds).unwrap_or(MAX_CLOUD_S).min(MAX_CLOUD_S);
        // Most clouds are at most this long: the upper quartile, because many lidars see little in some clouds.
        let reach = Span::from_seconds(REACH * quantile(spreads_s, 0.75).max(period_s));
        Some((Self::Encoded { source, encoding, reach }, unit))
    }

    /// Number of the name of the time field, if the points have times.
    pub fn source(&self) -> Option<usize> {
        if let Self::Encoded { source, .. } = self { Some(*source) } else { None }
    }

    /// Whether the times are absolute times of another clock than the stamp's.
    pub fn is_other_clock(&self) -> bool {
        matches!(self, Self::Encoded { encoding: TimeEncoding::OtherClock(_), .. })
    }

    /// Converts a cloud to a scan in firing order, without the returns whose time is impossible.
    pub fn scan(&self, cloud: RawCloud) -> TimedScan {
        let RawCloud { stamp, mut returns, times, .. } = cloud;
        let mut impossible_times = 0;
        if let (Self::Encoded { encoding, reach, .. }, false) = (self, times.is_empty()) {
            let all = returns.len();
            returns = timed(returns, &times, stamp, *encoding);
            keep_near_median(&mut returns, *reach);
            impossible_times = (all - returns.len()) as u64;
            if self.is_other_clock() {
                // The first point is assumed to be fired at the stamp.
                let first = returns.iter().map(|point| point.offset).min().unwrap_or_default();
                returns.iter_mut().for_each(|point| point.offset = point.offset - first);
            }
        }
        let stamped_after = sort_by_firing_time(&mut returns);
        let scan = LidarScan { stamp: stamp - stamped_after, stamped_after, returns, planar: None };
        TimedScan { scan, impossible_times }
    }
}

/// Sets the times of `returns`; those without a finite time near their cloud are left out.
fn timed(returns: Vec<LidarReturn>, times: &[f64], stamp: Stamp, encoding: TimeEncoding) -> Vec<LidarReturn> {
    let reference = match encoding {
        TimeEncoding::OtherClock(_) => quantile(times.iter().copied().filter(|time| time.is_finite()).collect(), 0.5),
        _ => 0.0,
    };
    let timed = returns.into_iter().zip(times).filter_map(|(point, time)| {
        let offset = encoding.offset(*time, stamp, reference)?;
        Some(LidarReturn { offset, ..point })
    });
    timed.collect()
}

/// Removes returns whose time differs from the median by more than `reach`.
fn keep_near_median(returns: &mut Vec<LidarReturn>, reach: Span) {
    let mut offsets: Vec<Span> = returns.iter().map(|point| point.offset).collect();
    let (first, last) = offsets.iter().fold((None, None), |(first, last): (Option<Span>, Option<Span>), offset| {
        (Some(first.map_or(*offset, |first| first.min(*offset))), last.max(Some(*offset)))
    });
    if first.zip(last).is_none_or(|(first, last)| last - first <= reach) {
        return;
    }
    let middle = offsets.len() / 2;
    let median = *offsets.select_nth_unstable(middle).1;
    returns.retain(|point| point.offset - median <= reach && median - point.offset <= reach);
}

/// The most frequent of `items`; of several the first.
fn most_frequent<T: PartialEq + Copy>(items: &[T]) -> Option<T> {
    let count = |item: &&T| items.iter().filter(|other| other == item).count();
    items.iter().rev().max_by_key(count).copied()
}
