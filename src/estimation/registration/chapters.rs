//! Which stretches of the recording are compared with which.
//!
//! The whole is cut into chapters of a few seconds. Some are *references*: enough of them that each place was seen by
//! so many, chosen from all over the recording. Every chapter's surfels are matched with those of the references that
//! saw the same. Where the same place is seen for an hour, references do not become more: unknowns of other chapters
//! hang together with those of the references and of their neighbours in time alone, and their equations stay sparse.

use super::RegistrationSpec;
use crate::estimation::surfel::Patch;
use crate::estimation::views::cells_of;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;

/// A chapter becomes a reference when this fraction of what it saw lacks references.
const LACKING: f64 = 0.3;
/// Chapters are compared when they have this fraction of a chapter's cells in common.
const COMMON: f64 = 0.1;

/// Cuts surfels at `times_s`, which increase, into chapters: ranges of their indices.
pub(super) fn chapters(times_s: &[f64], length_s: f64) -> Vec<Range<usize>> {
    let Some(start_s) = times_s.first() else { return Vec::new() };
    let chapter = |t: &f64| ((t - start_s) / length_s) as usize;
    let mut chapters: Vec<Range<usize>> = Vec::new();
    let mut from = 0;
    for k in 1..=times_s.len() {
        if k == times_s.len() || chapter(&times_s[k]) != chapter(&times_s[from]) {
            chapters.push(from..k);
            from = k;
        }
    }
    chapters
}

/// Pairs of chapters whose surfels are to be matched, in order.
pub(super) fn pairs(patches: &[Patch], chapters: &[Range<usize>], spec: &RegistrationSpec) -> Vec<(usize, usize)> {
    let cells: Vec<Vec<u64>> = chapters.par_iter().map(|chapter| cells_of(patches[chapter.clone()].iter())).collect();
    let by_cell = references(&cells, spec.references);
    let mut pairs: Vec<(usize, usize)> = cells
        .par_iter()
        .enumerate()
        .flat_map_iter(|(a, own)| {
            let mut common: BTreeMap<usize, usize> = BTreeMap::new();
            for b in own.iter().filter_map(|cell| by_cell.get(cell)).flatten().filter(|b| **b != a) {
                *common.entry(*b).or_default() += 1;
            }
            let enough = |b: usize, count: usize| count as f64 >= COMMON * own.len().min(cells[b].len()) as f64;
            let mut partners: Vec<(usize, usize)> =
                common.into_iter().filter(|(b, count)| enough(*b, *count)).collect();
            partners.sort_by_key(|(b, count)| (std::cmp::Reverse(*count), *b));
            partners.truncate(spec.partners);
            partners.into_iter().map(move |(b, _)| (a.min(b), a.max(b)))
        })
        .collect();
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

/// The references that saw each cell.
fn references(cells: &[Vec<u64>], wanted: usize) -> BTreeMap<u64, Vec<usize>> {
    let mut by_cell: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
    for k in from_all_over(cells.len()) {
        let lacks = |cell: &&u64| by_cell.get(*cell).is_none_or(|seen| seen.len() < wanted);
        let lacking = cells[k].iter().filter(lacks).count();
        if lacking as f64 > LACKING * cells[k].len() as f64 {
            cells[k].iter().for_each(|cell| by_cell.entry(*cell).or_default().push(k));
        }
    }
    by_cell
}

/// `0..count` in an order whose every beginning is spread over the whole: that of the reversed bits (van der Corput).
fn from_all_over(count: usize) -> impl Iterator<Item = usize> {
    let bits = count.next_power_of_two().trailing_zeros();
    let reversed = move |k: usize| if bits == 0 { 0 } else { k.reverse_bits() >> (usize::BITS - bits) };
    (0..1_usize << bits).map(reversed).filter(move |k| *k < count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_chapter_comes_once_and_the_first_ones_are_far_apart() {
        let order: Vec<usize> = from_all_over(11).collect();
        assert_eq!(order[..4], [0, 8, 4, 2]);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..11).collect::<Vec<_>>());
        assert_eq!(from_all_over(1).collect::<Vec<_>>(), [0]);
        assert_eq!(from_all_over(0).count(), 0);
    }

    #[test]
    fn chapters_cut_time_and_skip_where_nothing_was_seen() {
        assert_eq!(chapters(&[0.0, 1.0, 4.9, 5.1, 5.2, 31.0], 5.0), [0..3, 3..5, 5..6]);
        assert_eq!(chapters(&[], 5.0), Vec::<Range<usize>>::new());
    }

    #[test]
    fn a_place_seen_for_long_gets_no_more_references_than_wanted() {
        let cells: Vec<Vec<u64>> = (0..500).map(|_| (0..40).collect()).collect();
        let by_cell = references(&cells, 6);
        assert!(by_cell.values().all(|seen| seen.len() == 6));
        // From all over the 500.
        assert_eq!(by_cell[&7], [0, 256, 128, 384, 64, 320]);
    }
}
