//! Which planes are unknowns of the whole run.

use super::division::Segment;
use super::sightings::Sightings;
use std::collections::BTreeMap;

/// The planes that are unknowns of the whole run. Every other plane is an unknown of its segment: because no other
/// segment sees it, or because there are too many planes and this one has few beams; then it counts as a new one in each
/// segment.
pub(super) struct JointPlanes {
    /// Numbers, increasing.
    numbers: Vec<u32>,
    /// Number of planes.
    pub planes: usize,
    /// Fraction of the beams on planes that are one plane in all segments.
    pub beam_fraction: f64,
}

/// The beams on a plane.
struct Seen {
    beams: u64,
    first_segment: usize,
    again: bool,
}

impl JointPlanes {
    /// Selects the `limit` planes with the most beams of those that several segments see.
    pub(super) fn of(sightings: &Sightings, segments: &[Segment], limit: usize) -> Self {
        let mut seen: BTreeMap<u32, Seen> = BTreeMap::new();
        for (number, segment) in segments.iter().enumerate() {
            for sighting in segment.measured.clone().flat_map(|epoch| sightings.of(epoch)) {
                let new = Seen { beams: 0, first_segment: number, again: false };
                let plane = seen.entry(sighting.plane).or_insert(new);
                plane.beams += u64::from(sighting.beams);
                plane.again |= plane.first_segment != number;
            }
        }
        let mut again: Vec<(u64, u32)> =
            seen.iter().filter(|(_, plane)| plane.again).map(|(number, plane)| (plane.beams, *number)).collect();
        again.sort_unstable_by_key(|(beams, number)| (std::cmp::Reverse(*beams), *number));
        let divided: u64 = again.iter().skip(limit).map(|(beams, _)| beams).sum();
        let all: u64 = seen.values().map(|plane| plane.beams).sum();
        let mut numbers: Vec<u32> = again.iter().take(limit).map(|(_, number)| *number).collect();
        numbers.sort_unstable();
        Self { numbers, planes: seen.len(), beam_fraction: 1.0 - divided as f64 / all.max(1) as f64 }
    }

    /// Number of planes that are unknowns of the whole run.
    pub(super) fn count(&self) -> usize {
        self.numbers.len()
    }

    /// Position of a plane among those; `None` if it is not one.
    pub(super) fn rank(&self, plane: u32) -> Option<usize> {
        self.numbers.binary_search(&plane).ok()
    }
}
