//! What of a cloud is kept: echoes that are no surface are found while they pass by.
//!
//! | fate | what it is | how it is told |
//! |---|---|---|
//! | [`Fate::Mixed`] | an echo of two surfaces at once, in the gap between them | within its scan, see `mixed` |
//! | [`Fate::Moving`] | of what moved through the scene | beams went where it was, see `carve` |
//! | [`Fate::Isolated`] | with next to nothing beside it | by the number of points around it, see `support` |
//!
//! Time is cut into blocks of a second, and a point is judged by the blocks up to five seconds before and after its
//! own: a head that swings about once a second has looked there several times by then. So memory is that of eleven
//! blocks, however long the recording.

mod carve;
mod cell;
mod cells;
mod mixed;
mod sigma;
mod support;

pub use sigma::point_sigma_m;

use crate::geometry::Vector;
use crate::measurement::LidarNoise;
use crate::time::{Span, Stamp};
use carve::{Carved, Moving};
use rayon::prelude::*;
use std::collections::VecDeque;
use support::{Crowd, Support};

/// Length of a block.
const BLOCK: Span = Span::from_nanos(1_000_000_000);
/// A point is judged by so many blocks before its own, and as many after.
const AROUND: usize = 5;

/// An echo where the estimate puts it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// When its beam was fired.
    pub stamp: Stamp,
    /// Where it is, m, in the map.
    pub point_in_map: Vector,
    /// Where the lidar was, m, in the map.
    pub origin_in_map: Vector,
}

impl Hit {
    /// Its distance from the lidar, m.
    fn range_m(&self) -> f64 {
        (self.point_in_map - self.origin_in_map).norm()
    }
}

/// What becomes of an echo.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fate {
    /// It is of the map.
    Kept,
    /// It is an echo of two surfaces, and on neither.
    Mixed,
    /// Nothing else was seen about there.
    Isolated,
    /// It is of something that moved.
    Moving,
}

/// Tells echoes that are no surface of the map from those that are, as they come; each carries a `T` along.
#[derive(Debug)]
pub struct CloudFilter<T> {
    noise: LidarNoise,
    /// The block that is filled.
    filling: Option<(Stamp, Vec<Seen<T>>)>,
    /// Blocks that are whole: first those that were judged, then those that wait.
    whole: VecDeque<Block<T>>,
    /// Blocks of `whole` that were judged.
    judged: usize,
}

/// An echo, whether it is mixed, and what it carries.
#[derive(Debug)]
struct Seen<T> {
    hit: Hit,
    mixed: bool,
    carried: T,
}

/// What was seen in a second.
#[derive(Debug)]
struct Block<T> {
    seen: Vec<Seen<T>>,
    crowd: Crowd,
    carved: Carved,
}

impl<T: Send + Sync> CloudFilter<T> {
    /// A filter of the echoes of a lidar of this noise.
    pub fn new(noise: LidarNoise) -> Self {
        Self { noise, filling: None, whole: VecDeque::new(), judged: 0 }
    }

    /// Takes the echoes of a scan, in the order in which their beams were fired. Those whose fate is known by now, in
    /// the order in which they came: of a second, six seconds later.
    pub fn push(&mut self, scan: Vec<(Hit, T)>) -> Vec<(T, Fate)> {
        let Some((first, _)) = scan.first() else { return Vec::new() };
        let stamp = first.stamp;
        let mut told = Vec::new();
        if self.filling.as_ref().is_some_and(|(begun, _)| stamp - *begun >= BLOCK) {
            self.close_block();
            if self.whole.len() > self.judged + AROUND {
                told = self.judge_next();
            }
        }
        let hits: Vec<Hit> = scan.iter().map(|(hit, _)| *hit).collect();
        let mixed = mixed::in_scan(&hits, &self.noise);
        let (_, seen) = self.filling.get_or_insert_with(|| (stamp, Vec::new()));
        seen.extend(scan.into_iter().zip(mixed).map(|((hit, carried), mixed)| Seen { hit, mixed, carried }));
        told
    }

    /// The echoes whose fate was not known yet.
    pub fn finish(mut self) -> Vec<(T, Fate)> {
        self.close_block();
        let mut told = Vec::new();
        while self.judged < self.whole.len() {
            told.extend(self.judge_next());
        }
        told
    }

    fn close_block(&mut self) {
        let Some((_, seen)) = self.filling.take() else { return };
        let hits: Vec<Hit> = seen.iter().map(|seen| seen.hit).collect();
        let crowd = Crowd::of(&hits);
        let carved = Carved::by(&hits, &crowd);
        self.whole.push_back(Block { seen, crowd, carved });
    }

    /// Judges the oldest block that waits, and forgets the one that no further needs.
    fn judge_next(&mut self) -> Vec<(T, Fate)> {
        let until = (self.judged + AROUND + 1).min(self.whole.len());
        let around = || self.whole.range(..until);
        let support = Support::of(around().map(|block| &block.crowd));
        let carved: Vec<&Carved> = around().map(|block| &block.carved).collect();
        let block = &self.whole[self.judged];
        let moving = Moving::of(&block.crowd, &carved);
        let fate = |seen: &Seen<T>| match seen {
            Seen { mixed: true, .. } => Fate::Mixed,
            Seen { hit, .. } if !support.holds(hit) => Fate::Isolated,
            Seen { hit, .. } if moving.has(&hit.point_in_map) => Fate::Moving,
            _ => Fate::Kept,
        };
        let fates: Vec<Fate> = block.seen.par_iter().with_min_len(512).map(fate).collect();
        let seen = std::mem::take(&mut self.whole[self.judged].seen);
        self.judged += 1;
        if self.judged > AROUND {
            self.whole.pop_front();
            self.judged -= 1;
        }
        seen.into_iter().map(|seen| seen.carried).zip(fates).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE: LidarNoise = LidarNoise { near_sigma_m: 0.01, near_m: 10.0, far_sigma_m: 0.03, far_m: 30.0 };

    /// A scan at `ms` of a wall at x = 4, a hundred beams over 25 degrees, in a plane that nods; `other` is put where
    /// beam 50 ends.
    fn scan(ms: i64, other: Option<Vector>) -> Vec<(Hit, (i64, usize))> {
        let height = (ms as f64 * 0.01).sin();
        let hit = |k: usize| {
            let wall = Vector::new(4.0, (k as f64 - 50.0) * 0.02, height);
            let point_in_map = other.filter(|_| k == 50).unwrap_or(wall);
            let stamp = Stamp::from_nanos(ms * 1_000_000 + k as i64 * 20_000);
            (Hit { stamp, point_in_map, origin_in_map: Vector::zeros() }, (ms, k))
        };
        (0..100).map(hit).collect()
    }

    #[test]
    fn all_come_out_once_in_order_and_a_point_in_the_air_is_isolated() {
        let mut filter = CloudFilter::new(NOISE);
        let (mut told, mut latest_behind) = (Vec::new(), 0);
        for k in 0..800_i64 {
            // Once, twenty metres above everything.
            let other = (k == 300).then(|| Vector::new(4.0, 0.0, 20.0));
            told.extend(filter.push(scan(k * 25, other)));
            latest_behind = latest_behind.max(k * 25 - told.last().map_or(0, |((ms, _), _)| *ms));
        }
        assert!(latest_behind <= 7025, "{latest_behind} ms behind");
        told.extend(filter.finish());
        let order: Vec<(i64, usize)> = told.iter().map(|(carried, _)| *carried).collect();
        assert!(order.is_sorted() && order.len() == 80_000);
        let dropped: Vec<_> = told.iter().filter(|(_, fate)| *fate != Fate::Kept).collect();
        assert_eq!(dropped, [&((7500, 50), Fate::Isolated)]);
    }

    #[test]
    fn an_echo_between_two_surfaces_is_mixed_and_nothing_is_no_scan() {
        let mut filter = CloudFilter::new(NOISE);
        assert!(filter.push(Vec::new()).is_empty());
        let edge: Vec<(Hit, usize)> = scan(0, None).into_iter().map(|(hit, (_, k))| (hit, k)).collect();
        let nearer = |(mut hit, k): (Hit, usize)| {
            hit.point_in_map *= match k {
                0..50 => 1.0,
                50 => 0.8,
                _ => 0.5,
            };
            (hit, k)
        };
        let _ = filter.push(edge.into_iter().map(nearer).collect());
        let told = filter.finish();
        assert_eq!(told.iter().filter(|(_, fate)| *fate == Fate::Mixed).map(|(k, _)| *k).collect::<Vec<_>>(), [50]);
    }
}
