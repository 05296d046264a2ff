//! All surfels of the recording, placed in the map.

use super::corrected_trajectory::CorrectedTrajectory;
use super::equations::Shared;
use super::lidar_model::{LidarModel, LidarRay, rotate_patch};
use super::submaps;
use crate::RegistrationSpec;
use crate::nominal::Correction;
use crate::observed::ObservedSurfels;
use crate::spline::Basis;
use crate::surfel::Patch;
use rayon::prelude::*;
use std::ops::Range;
use zsim_base::geometry::{Rotation, Vector};

/// All surfels in time order, and the submaps to be matched.
#[derive(Debug)]
pub(super) struct Scene {
    spacing_s: f64,
    times_s: Vec<f64>,
    pub(super) patches: Vec<Patch>,
    /// Vector from the head to the centre of each surfel, in map axes, m.
    pub(super) arms: Vec<Vector>,
    /// Vector from the lidar to each surfel.
    pub(super) rays: Vec<LidarRay>,
    /// Time bin of each surfel.
    pub(super) bins: Vec<u32>,
    /// Spline basis at the middle of each time bin; a bin is half a knot interval.
    pub(super) bin_bases: Vec<Basis>,
    pub(super) submaps: Vec<Range<usize>>,
    /// Submap of each surfel.
    submap_of: Vec<u32>,
    /// Pairs of submaps to be matched.
    pub(super) pairs: Vec<(usize, usize)>,
}

impl Scene {
    /// Builds the scene from the surfels `observed` within the time of `corrected` by the lidar of `lidar_model`.
    pub(super) fn new(
        observed: &ObservedSurfels,
        corrected: &CorrectedTrajectory,
        lidar_model: &LidarModel,
        spec: &RegistrationSpec,
    ) -> Self {
        let (start_s, end_s) = corrected.span_s();
        let within = |k: &usize| (start_s..=end_s).contains(&observed.surfels[*k].tau_s);
        let mut order: Vec<usize> = (0..observed.len()).filter(within).collect();
        order.sort_by(|a, b| observed.surfels[*a].tau_s.total_cmp(&observed.surfels[*b].tau_s));
        let surfels = || order.iter().map(|k| &observed.surfels[*k]);
        let times_s: Vec<f64> = surfels().map(|surfel| surfel.tau_s).collect();
        let mut patches: Vec<Patch> = surfels().map(|surfel| surfel.patch).collect();
        let mut rays = Vec::with_capacity(patches.len());
        let mut arms = Vec::with_capacity(patches.len());
        for (surfel, patch) in surfels().zip(&mut patches) {
            let map_from_head = corrected.pose_at(surfel.tau_s);
            let made_by = &observed.lidars[surfel.lidar as usize].lidar;
            rays.push(lidar_model.ray_to(&map_from_head, patch, made_by, surfel.weakness));
            arms.push(patch.centre - map_from_head.translation.vector);
        }
        let length_s = 0.5 * spec.knot_spacing_s;
        let bins = times_s.iter().map(|tau_s| ((tau_s - start_s) / length_s) as u32).collect();
        let bin_basis = |bin: u32| {
            let middle_s = start_s + length_s * (f64::from(bin) + 0.5);
            Basis::at(middle_s.min(end_s), spec.knot_spacing_s)
        };
        let bin_bases = (0..=((end_s - start_s) / length_s) as u32).map(bin_basis).collect();
        let submaps = submaps::divide(&times_s, spec.chapter_s);
        let submap_of = (0..).zip(&submaps).flat_map(|(k, submap)| submap.clone().map(move |_| k)).collect();
        let pairs = submaps::select_pairs(&patches, &submaps, spec);
        Self {
            spacing_s: spec.knot_spacing_s,
            times_s,
            patches,
            arms,
            rays,
            bins,
            bin_bases,
            submaps,
            submap_of,
            pairs,
        }
    }

    /// Time of surfel `j` minus time of surfel `i`, s.
    pub(super) fn time_difference_s(&self, i: usize, j: usize) -> f64 {
        self.times_s[j] - self.times_s[i]
    }

    /// Whether two surfels are of the same submap.
    pub(super) fn are_of_one_submap(&self, i: usize, j: usize) -> bool {
        self.submap_of[i] == self.submap_of[j]
    }

    /// Moves every surfel by the correction of the trajectory at that time, then by the step of the lidar.
    pub(super) fn correct(&mut self, first_knot: i64, x: &[f64], step: &Shared) {
        let spacing_s = self.spacing_s;
        let placements = self.arms.par_iter_mut().zip(&mut self.rays);
        let surfels = self.times_s.par_iter().zip(&mut self.patches).zip(placements).with_min_len(512);
        surfels.for_each(|((tau_s, patch), (arm, ray))| {
            let by = Correction::of_spline(&Basis::at(*tau_s, spacing_s), first_knot, x);
            let turn = Rotation::from_scaled_axis(by.rotation);
            let rotated = turn * *arm;
            patch.centre += rotated - *arm + by.translation;
            rotate_patch(patch, &turn);
            ray.rotate(&turn);
            *arm = rotated + ray.correct(step, patch);
        });
    }

    /// Maximum distance of a surfel from the head, m.
    pub(super) fn max_distance_m(&self) -> f64 {
        self.arms.iter().map(Vector::norm).fold(0.0, f64::max)
    }
}
