//! The recording cut into places.

use super::PlacesSpec;
use crate::estimation::registration::chapters::chapters;
use crate::estimation::registration::course::Course;
use crate::estimation::surfel::Patch;
use crate::estimation::survey::Survey;
use crate::geometry::Vector;
use std::ops::Range;

/// So few of a place's surfels lie lower than its ground: floors are seen through stairwells, and beams err.
const BELOW_GROUND: f64 = 0.02;

/// A few seconds of what was seen.
#[derive(Debug, Clone)]
pub(super) struct Place {
    /// Their middle, s.
    pub(super) tau_s: f64,
    /// Where the head is then in the map, m.
    pub(super) head: Vector,
    /// Height of the ground over the head (it is negative), m.
    pub(super) ground_m: f64,
    /// Which of the album's surfels, in the order of time.
    members: Range<usize>,
}

/// All places, and what was seen of each.
#[derive(Debug)]
pub(super) struct Album<'a> {
    survey: &'a Survey,
    /// Indices of the survey's sightings in the order of time.
    order: Vec<u32>,
    pub(super) places: Vec<Place>,
}

impl<'a> Album<'a> {
    /// Of what was seen while `course` lasts.
    pub(super) fn new(survey: &'a Survey, course: &Course, spec: &PlacesSpec) -> Self {
        let (start_s, end_s) = course.span_s();
        let tau_s = |k: &u32| survey.sightings[*k as usize].tau_s;
        let mut order: Vec<u32> = (0..survey.len() as u32).filter(|k| (start_s..=end_s).contains(&tau_s(k))).collect();
        order.sort_by(|a, b| tau_s(a).total_cmp(&tau_s(b)));
        let times_s: Vec<f64> = order.iter().map(tau_s).collect();
        let place = |members: Range<usize>| {
            let tau_s = 0.5 * (times_s[members.start] + times_s[members.end - 1]);
            let head = course.pose_at(tau_s).translation.vector;
            let mut heights: Vec<f64> = order[members.clone()]
                .iter()
                .map(|k| &survey.sightings[*k as usize].patch)
                .filter(|patch| patch.level == 0)
                .map(|patch| patch.centre.z - head.z)
                .collect();
            heights.sort_by(f64::total_cmp);
            let ground_m = heights.get((heights.len() as f64 * BELOW_GROUND) as usize).copied().unwrap_or(0.0);
            Place { tau_s, head, ground_m, members }
        };
        let places = chapters(&times_s, spec.length_s).into_iter().map(place).collect();
        Self { survey, order, places }
    }

    /// The surfels of `level` seen in a place: about its head, along the map's axes.
    pub(super) fn patches(&self, place: usize, level: usize) -> impl Iterator<Item = Patch> + '_ {
        let Place { head, members, .. } = self.places[place].clone();
        let seen = self.order[members].iter().map(|k| self.survey.sightings[*k as usize].patch);
        seen.filter(move |patch| patch.level == level).map(move |patch| Patch { centre: patch.centre - head, ..patch })
    }
}
