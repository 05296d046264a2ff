//! The surfels of the whole recording in the map.

use super::course::Course;
use super::lidar::{Mount, Shared, Sight, turn_patch};
use super::{RegistrationSpec, chapters};
use crate::estimation::nominal::Correction;
use crate::estimation::spline::Basis;
use crate::estimation::surfel::Patch;
use crate::estimation::survey::Survey;
use crate::geometry::{Rotation, Vector};
use rayon::prelude::*;
use std::ops::Range;

/// All surfels in the order of time, and the chapters that are compared.
#[derive(Debug)]
pub(super) struct Scene {
    spacing_s: f64,
    times_s: Vec<f64>,
    pub(super) patches: Vec<Patch>,
    /// From the head to each surfel's centre, m.
    pub(super) arms: Vec<Vector>,
    /// From where each was seen.
    pub(super) sights: Vec<Sight>,
    /// In which slot each was seen.
    pub(super) slots: Vec<u32>,
    /// Slots are halves of knot intervals: the spline's basis in the middle of each.
    pub(super) middles: Vec<Basis>,
    pub(super) chapters: Vec<Range<usize>>,
    /// Chapters whose surfels are to be matched.
    pub(super) pairs: Vec<(usize, usize)>,
}

impl Scene {
    /// What was seen while `course` lasts, by the lidar of `mount`.
    pub(super) fn new(survey: &Survey, course: &Course, mount: &Mount, spec: &RegistrationSpec) -> Self {
        let (start_s, end_s) = course.span_s();
        let within = |k: &usize| (start_s..=end_s).contains(&survey.sightings[*k].tau_s);
        let mut order: Vec<usize> = (0..survey.len()).filter(within).collect();
        order.sort_by(|a, b| survey.sightings[*a].tau_s.total_cmp(&survey.sightings[*b].tau_s));
        let sightings = || order.iter().map(|k| &survey.sightings[*k]);
        let times_s: Vec<f64> = sightings().map(|sighting| sighting.tau_s).collect();
        let mut patches: Vec<Patch> = sightings().map(|sighting| sighting.patch).collect();
        let mut sights = Vec::with_capacity(patches.len());
        let mut arms = Vec::with_capacity(patches.len());
        for (sighting, patch) in sightings().zip(&mut patches) {
            let map_from_head = course.pose_at(sighting.tau_s);
            sights.push(mount.sight(&map_from_head, patch, &survey.lidars[sighting.lidar as usize].lidar));
            arms.push(patch.centre - map_from_head.translation.vector);
        }
        let length_s = 0.5 * spec.knot_spacing_s;
        let slots = times_s.iter().map(|tau_s| ((tau_s - start_s) / length_s) as u32).collect();
        let middle = |slot: u32| {
            let middle_s = start_s + length_s * (f64::from(slot) + 0.5);
            Basis::at(middle_s.min(end_s), spec.knot_spacing_s)
        };
        let middles = (0..=((end_s - start_s) / length_s) as u32).map(middle).collect();
        let chapters = chapters::chapters(&times_s, spec.chapter_s);
        let pairs = chapters::pairs(&patches, &chapters, spec);
        Self { spacing_s: spec.knot_spacing_s, times_s, patches, arms, sights, slots, middles, chapters, pairs }
    }

    /// How much later than surfel `i` surfel `j` was seen, s.
    pub(super) fn apart_s(&self, (i, j): (usize, usize)) -> f64 {
        self.times_s[j] - self.times_s[i]
    }

    /// Moves every surfel with the trajectory at its time, then by a step of the lidar.
    pub(super) fn correct(&mut self, first_knot: i64, x: &[f64], step: &Shared) {
        let spacing_s = self.spacing_s;
        let places = self.arms.par_iter_mut().zip(&mut self.sights);
        let surfels = self.times_s.par_iter().zip(&mut self.patches).zip(places).with_min_len(512);
        surfels.for_each(|((tau_s, patch), (arm, sight))| {
            let by = Correction::of_spline(&Basis::at(*tau_s, spacing_s), first_knot, x);
            let turn = Rotation::from_scaled_axis(by.rotation);
            let turned = turn * *arm;
            patch.centre += turned - *arm + by.translation;
            turn_patch(patch, &turn);
            sight.turn(&turn);
            *arm = turned + sight.correct(step, patch);
        });
    }

    /// The farthest that a surfel is from the head, m.
    pub(super) fn farthest_m(&self) -> f64 {
        self.arms.iter().map(Vector::norm).fold(0.0, f64::max)
    }
}
