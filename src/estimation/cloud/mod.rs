//! Streaming filter of the point cloud: removes points that are not on a static surface.
//!
//! | class | meaning | criterion |
//! |---|---|---|
//! | [`ReturnClass::MixedPixel`] | mixed pixel: a return of two surfaces, between them | neighbours in the scan: `mixed` |
//! | [`ReturnClass::Dynamic`] | point of a dynamic object | other beams passed through the cell, see `dynamic` |
//! | [`ReturnClass::Isolated`] | isolated point | few points around it, see `density` |
//!
//! Time is divided into blocks of 1 s. A point is classified with the blocks up to 5 s before and after: the head swings
//! about once a second and observes the same spot several times within that period. Memory is bounded by eleven blocks.

mod cell;
mod cell_set;
mod density;
mod dynamic;
mod mixed;
mod projected_return;
mod sigma;

pub use projected_return::ProjectedReturn;
pub use sigma::point_sigma_m;

use density::{BlockCounts, Density, IsolationTest};
use dynamic::{DynamicCells, FreeSpace};
use rayon::prelude::*;
use std::collections::VecDeque;
use zsim_base::measurement::LidarNoise;
use zsim_base::time::{Span, Stamp};

/// Length of a block, 1 s: about one swing of the head.
const BLOCK: Span = Span::from_nanos(1_000_000_000);
/// Number of blocks before, and after, that are used to classify a block.
const CONTEXT_BLOCKS: usize = 5;

/// Number of returns that a thread classifies at once.
const RETURNS_TOGETHER: usize = 2048;

/// Class of a return.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReturnClass {
    /// On a static surface; the only class that stays in the cloud.
    Static,
    /// Mixed pixel: a return of two surfaces, on neither of them.
    MixedPixel,
    /// Too few other points around it.
    Isolated,
    /// On a dynamic object.
    Dynamic,
}

/// Classifies returns in a stream; each return has a payload `T`.
#[derive(Debug)]
pub struct CloudFilter<T> {
    noise: LidarNoise,
    /// The block being filled: start time and returns.
    filling: Option<(Stamp, Vec<PendingReturn<T>>)>,
    /// Complete blocks: the classified ones, then the pending ones.
    complete: VecDeque<Block<T>>,
    /// Number of classified blocks in `complete`.
    classified: usize,
}

/// A return with its payload.
#[derive(Debug)]
struct PendingReturn<T> {
    hit: ProjectedReturn,
    mixed: bool,
    payload: T,
}

/// The returns of one block of time.
#[derive(Debug)]
struct Block<T> {
    returns: Vec<PendingReturn<T>>,
    counts: BlockCounts,
    free_space: FreeSpace,
}

impl<T: Send + Sync> CloudFilter<T> {
    /// Creates a filter for a lidar of the given noise.
    pub fn new(noise: LidarNoise) -> Self {
        Self { noise, filling: None, complete: VecDeque::new(), classified: 0 }
    }

    /// Adds the returns of a scan; returns those that this classifies.
    ///
    /// The returns of a scan are in order of emission, the classified ones in the order of the input. A block is
    /// classified about 6 s after its last return.
    pub fn push(&mut self, scan: Vec<(ProjectedReturn, T)>) -> Vec<(T, ReturnClass)> {
        let Some((first, _)) = scan.first() else { return Vec::new() };
        let stamp = first.stamp;
        let mut classified = Vec::new();
        if self.filling.as_ref().is_some_and(|(start, _)| stamp - *start >= BLOCK) {
            self.close_block();
            if self.complete.len() > self.classified + CONTEXT_BLOCKS {
                classified = self.classify_next();
            }
        }
        let hits: Vec<ProjectedReturn> = scan.iter().map(|(hit, _)| *hit).collect();
        let mixed = mixed::find_mixed(&hits, &self.noise);
        // As many as in the block before, and some more.
        let expected = self.complete.back().map_or(0, |before| before.returns.len() * 9 / 8);
        let (_, returns) = self.filling.get_or_insert_with(|| (stamp, Vec::with_capacity(expected)));
        returns.extend(scan.into_iter().zip(mixed).map(|((hit, payload), mixed)| PendingReturn {
            hit,
            mixed,
            payload,
        }));
        classified
    }

    /// Classifies the remaining returns.
    pub fn finish(mut self) -> Vec<(T, ReturnClass)> {
        self.close_block();
        let mut classified = Vec::new();
        while self.classified < self.complete.len() {
            classified.extend(self.classify_next());
        }
        classified
    }

    fn close_block(&mut self) {
        let Some((_, returns)) = self.filling.take() else { return };
        let hits: Vec<ProjectedReturn> = returns.iter().map(|one| one.hit).collect();
        let counts = BlockCounts::from_returns(&hits);
        let free_space = FreeSpace::from_returns(&hits, &counts);
        self.complete.push_back(Block { returns, counts, free_space });
    }

    /// Classifies the oldest pending block; drops the block that is no longer needed.
    fn classify_next(&mut self) -> Vec<(T, ReturnClass)> {
        let until = (self.classified + CONTEXT_BLOCKS + 1).min(self.complete.len());
        let around = || self.complete.range(..until);
        let density = Density::from_blocks(around().map(|block| &block.counts));
        let free_spaces: Vec<&FreeSpace> = around().map(|block| &block.free_space).collect();
        let block = &self.complete[self.classified];
        let of_block = Density::from_blocks([&block.counts].into_iter());
        let dynamic = DynamicCells::find(&block.counts, &free_spaces);
        let classify = |returns: &[PendingReturn<T>]| -> Vec<ReturnClass> {
            let mut isolation = IsolationTest::new(&of_block, &density);
            let class = |one: &PendingReturn<T>| match one {
                PendingReturn { mixed: true, .. } => ReturnClass::MixedPixel,
                PendingReturn { hit, .. } if !isolation.is_sufficient_at(hit) => ReturnClass::Isolated,
                PendingReturn { hit, .. } if dynamic.contains(&hit.point_in_map) => ReturnClass::Dynamic,
                _ => ReturnClass::Static,
            };
            returns.iter().map(class).collect()
        };
        let classes: Vec<ReturnClass> = block.returns.par_chunks(RETURNS_TOGETHER).flat_map_iter(classify).collect();
        let returns = std::mem::take(&mut self.complete[self.classified].returns);
        self.classified += 1;
        if self.classified > CONTEXT_BLOCKS {
            self.complete.pop_front();
            self.classified -= 1;
        }
        returns.into_iter().map(|one| one.payload).zip(classes).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::geometry::Vector;

    const NOISE: LidarNoise = LidarNoise { near_sigma_m: 0.01, near_m: 10.0, far_sigma_m: 0.03, far_m: 30.0 };

    /// A scan at `ms` of a wall at x = 4, 100 beams over 25 degrees, in a nodding plane; beam 50 ends at `other`.
    fn scan(ms: i64, other: Option<Vector>) -> Vec<(ProjectedReturn, (i64, usize))> {
        let height = (ms as f64 * 0.01).sin();
        let hit = |k: usize| {
            let wall = Vector::new(4.0, (k as f64 - 50.0) * 0.02, height);
            let point_in_map = other.filter(|_| k == 50).unwrap_or(wall);
            let stamp = Stamp::from_nanos(ms * 1_000_000 + k as i64 * 20_000);
            (ProjectedReturn { stamp, point_in_map, origin_in_map: Vector::zeros() }, (ms, k))
        };
        (0..100).map(hit).collect()
    }

    #[test]
    fn returns_keep_their_order_and_a_floating_point_is_isolated() {
        let mut filter = CloudFilter::new(NOISE);
        let (mut classified, mut max_latency_ms) = (Vec::new(), 0);
        for k in 0..800_i64 {
            // One point 20 m above all others.
            let other = (k == 300).then(|| Vector::new(4.0, 0.0, 20.0));
            classified.extend(filter.push(scan(k * 25, other)));
            max_latency_ms = max_latency_ms.max(k * 25 - classified.last().map_or(0, |((ms, _), _)| *ms));
        }
        assert!(max_latency_ms <= 7025, "latency {max_latency_ms} ms");
        classified.extend(filter.finish());
        let order: Vec<(i64, usize)> = classified.iter().map(|(payload, _)| *payload).collect();
        assert!(order.is_sorted() && order.len() == 80_000);
        let dropped: Vec<_> = classified.iter().filter(|(_, class)| *class != ReturnClass::Static).collect();
        assert_eq!(dropped, [&((7500, 50), ReturnClass::Isolated)]);
    }

    #[test]
    fn return_between_two_surfaces_is_mixed_and_an_empty_scan_is_ignored() {
        let mut filter = CloudFilter::new(NOISE);
        assert!(filter.push(Vec::new()).is_empty());
        let edge: Vec<(ProjectedReturn, usize)> = scan(0, None).into_iter().map(|(hit, (_, k))| (hit, k)).collect();
        let nearer = |(mut hit, k): (ProjectedReturn, usize)| {
            hit.point_in_map *= match k {
                0..50 => 1.0,
                50 => 0.8,
                _ => 0.5,
            };
            (hit, k)
        };
        let _ = filter.push(edge.into_iter().map(nearer).collect());
        let classified = filter.finish();
        assert_eq!(
            classified
                .iter()
                .filter(|(_, class)| *class == ReturnClass::MixedPixel)
                .map(|(k, _)| *k)
                .collect::<Vec<_>>(),
            [50]
        );
    }
}
