//! Submaps, and the selection of the pairs of submaps that are matched.
//!
//! The recording is divided into submaps of a few seconds. Some of them, spread over the recording, are *references*, such
//! that each cell is observed by a given number of references. The surfels of every submap are matched with each other and
//! with the references that observe the same cells. The number of references does not grow with the time spent in one area:
//! the other submaps are linked to references and to their neighbours in time only, and the equations stay sparse.

use crate::RegistrationSpec;
use crate::surfel::Patch;
use crate::views::cells_of;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;

/// A submap becomes a reference if this fraction of the observed cells has too few references.
const MIN_UNCOVERED: f64 = 0.3;
/// Minimum overlap of a pair: common cells as a fraction of the cells of the smaller submap.
const MIN_OVERLAP: f64 = 0.1;

/// Divides surfels at increasing `times_s` into submaps of `length_s`: ranges of indices.
pub(super) fn divide(times_s: &[f64], length_s: f64) -> Vec<Range<usize>> {
    let Some(start_s) = times_s.first() else { return Vec::new() };
    let submap = |t: &f64| ((t - start_s) / length_s) as usize;
    let mut submaps: Vec<Range<usize>> = Vec::new();
    let mut from = 0;
    for k in 1..=times_s.len() {
        if k == times_s.len() || submap(&times_s[k]) != submap(&times_s[from]) {
            submaps.push(from..k);
            from = k;
        }
    }
    submaps
}

/// Pairs of submaps to be matched, sorted. Each submap is also matched with itself.
pub(super) fn select_pairs(
    patches: &[Patch],
    submaps: &[Range<usize>],
    spec: &RegistrationSpec,
) -> Vec<(usize, usize)> {
    let cells: Vec<Vec<u64>> = submaps.par_iter().map(|submap| cells_of(patches[submap.clone()].iter())).collect();
    let by_cell = select_references(&cells, spec.references);
    let mut pairs: Vec<(usize, usize)> = cells
        .par_iter()
        .enumerate()
        .flat_map_iter(|(a, own)| {
            let mut common: BTreeMap<usize, usize> = BTreeMap::new();
            for b in own.iter().filter_map(|cell| by_cell.get(cell)).flatten().filter(|b| **b != a) {
                *common.entry(*b).or_default() += 1;
            }
            let enough = |b: usize, count: usize| count as f64 >= MIN_OVERLAP * own.len().min(cells[b].len()) as f64;
            let mut partners: Vec<(usize, usize)> =
                common.into_iter().filter(|(b, count)| enough(*b, *count)).collect();
            partners.sort_by_key(|(b, count)| (std::cmp::Reverse(*count), *b));
            partners.truncate(spec.references);
            let others = partners.into_iter().map(move |(b, _)| (a.min(b), a.max(b)));
            others.chain([(a, a)])
        })
        .collect();
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

/// Selects the references; returns the references of each cell.
fn select_references(cells: &[Vec<u64>], required: usize) -> BTreeMap<u64, Vec<usize>> {
    let mut by_cell: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
    for k in bit_reversed_order(cells.len()) {
        let needs_reference = |cell: &&u64| by_cell.get(*cell).is_none_or(|references| references.len() < required);
        let uncovered = cells[k].iter().filter(needs_reference).count();
        if uncovered as f64 > MIN_UNCOVERED * cells[k].len() as f64 {
            cells[k].iter().for_each(|cell| by_cell.entry(*cell).or_default().push(k));
        }
    }
    by_cell
}

/// `0..count` in bit-reversed order (van der Corput): every prefix is spread evenly over the range.
fn bit_reversed_order(count: usize) -> impl Iterator<Item = usize> {
    let bits = count.next_power_of_two().trailing_zeros();
    let reversed = move |k: usize| if bits == 0 { 0 } else { k.reverse_bits() >> (usize::BITS - bits) };
    (0..1_usize << bits).map(reversed).filter(move |k| *k < count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::geometry::{Matrix, Vector};

    #[test]
    fn bit_reversed_order_is_a_permutation_with_spread_prefixes() {
        let order: Vec<usize> = bit_reversed_order(11).collect();
        assert_eq!(order[..4], [0, 8, 4, 2]);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..11).collect::<Vec<_>>());
        assert_eq!(bit_reversed_order(1).collect::<Vec<_>>(), [0]);
        assert_eq!(bit_reversed_order(0).count(), 0);
    }

    #[test]
    fn submaps_divide_time_and_skip_empty_intervals() {
        assert_eq!(divide(&[0.0, 1.0, 4.9, 5.1, 5.2, 31.0], 5.0), [0..3, 3..5, 5..6]);
        assert_eq!(divide(&[], 5.0), Vec::<Range<usize>>::new());
    }

    #[test]
    fn every_submap_is_matched_with_itself_and_with_those_that_observe_the_same() {
        let spec = crate::load("default").unwrap().registration;
        let patch = |x_m: f64| Patch {
            centre: Vector::new(x_m, 0.0, 0.0),
            normal: Vector::z(),
            points: 10.0,
            covariance: Matrix::identity(),
            roughness_variance: 0.0,
            level: 0,
        };
        let patches: Vec<Patch> = [0.0, 0.1, 500.0, 0.2].map(patch).into();
        let pairs = select_pairs(&patches, &[0..2, 2..3, 3..4], &spec);
        assert_eq!(pairs, [(0, 0), (0, 2), (1, 1), (2, 2)]);
    }

    #[test]
    fn repeatedly_observed_cells_get_no_more_references_than_required() {
        let cells: Vec<Vec<u64>> = (0..500).map(|_| (0..40).collect()).collect();
        let by_cell = select_references(&cells, 6);
        assert!(by_cell.values().all(|references| references.len() == 6));
        // Spread over the 500 submaps.
        assert_eq!(by_cell[&7], [0, 256, 128, 384, 64, 320]);
    }
}
