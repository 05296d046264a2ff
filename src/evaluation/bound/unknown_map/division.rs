//! Division of the run into segments.

use std::ops::Range;

/// Number of epochs of a segment: 2 s.
const SEGMENT: usize = 100;
/// Number of epochs between kept epochs: 1 s.
const SPACING: usize = 50;
/// Number of epochs between kept epochs near the start and the end of the run, where the errors change quickly: 0.2 s.
const SHORT_SPACING: usize = 10;
/// Number of epochs with this spacing at the start, when a head is often at rest, 4 s, and at the end, 1 s.
const SHORTLY_SPACED: (usize, usize) = (200, 50);

/// A part of the run, of which only some epochs are kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Segment {
    /// Epochs whose beams belong to the segment.
    pub measured: Range<usize>,
    /// Epochs that are kept, in order. The last one is the first one of the next segment.
    pub kept: Vec<usize>,
}

/// The segments of a run of `epochs`, at least two.
pub(super) fn segments(epochs: usize) -> Vec<Segment> {
    let last = epochs - 1;
    let tail = last.saturating_sub(SHORTLY_SPACED.1).max(SHORTLY_SPACED.0);
    let (mut segments, mut start) = (Vec::new(), 0);
    while start < last {
        let end = if start < tail { tail.min(start + SEGMENT) } else { start + SEGMENT }.min(last);
        let is_inner = (SHORTLY_SPACED.0..tail).contains(&start);
        let spacing = if is_inner { SPACING } else { SHORT_SPACING };
        let kept = (start..end).step_by(spacing).chain([end]).collect();
        segments.push(Segment { measured: start..if end == last { epochs } else { end }, kept });
        start = end;
    }
    segments
}

/// The kept epochs of all segments, in order.
pub(super) fn kept_epochs(segments: &[Segment]) -> Vec<usize> {
    let before_ends = |segment: &Segment| segment.kept[..segment.kept.len() - 1].to_vec();
    let last = segments.iter().filter_map(|segment| segment.kept.last()).next_back();
    segments.iter().flat_map(before_ends).chain(last.copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_are_adjacent_and_cover_the_run() {
        for epochs in [2, 3, 11, 250, 251, 262, 300, 302, 1000, 7501] {
            let segments = segments(epochs);
            let (first, last) = (&segments[0], &segments[segments.len() - 1]);
            assert!(first.measured.start == 0 && last.measured.end == epochs, "{epochs}");
            assert_eq!(last.kept.last(), Some(&(epochs - 1)));
            for pair in segments.windows(2) {
                assert_eq!(pair[0].measured.end, pair[1].measured.start, "{epochs}");
                assert_eq!(pair[0].kept.last(), pair[1].kept.first(), "{epochs}");
            }
            let kept = kept_epochs(&segments);
            assert!(kept.windows(2).all(|pair| (1..=SPACING).contains(&(pair[1] - pair[0]))), "{epochs}: {kept:?}");
        }
        // 149 s in 75 segments, and 1 s; 4 s every 0.2 s, 145 s every 1 s, 1 s every 0.2 s.
        let segments = segments(7501);
        assert_eq!(segments.len(), 75 + 1);
        assert_eq!(kept_epochs(&segments).len(), 20 + 145 + 5 + 1);
    }
}
