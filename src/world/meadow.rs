//! Groups of plants that sway and share their surfaces.

use super::caster::{BoxTree, Caster, Crossing};
use super::sway::Sway;
use super::triangle::Triangle;
use super::{MaterialId, SwaySpec};
use zsim_base::geometry::{Pose, Vector};

/// Plants of one template.
pub(super) struct Meadow {
    surfaces: Caster,
    plants: Vec<Sway>,
    /// Bounds of each plant at all times.
    bounds: Vec<(Vector, Vector)>,
    tree: BoxTree,
}

impl Meadow {
    /// Plants with these surfaces at these poses at rest.
    pub fn new(spec: &SwaySpec, surfaces: Caster, poses: Vec<Pose>) -> Self {
        let plants: Vec<Sway> = poses.into_iter().map(|pose| Sway::new(spec, pose)).collect();
        let bounds: Vec<(Vector, Vector)> = plants.iter().map(|plant| plant.bounds(surfaces.bounds())).collect();
        let tree = BoxTree::new(&bounds);
        Self { surfaces, plants, bounds, tree }
    }

    /// The triangles at `time_s`: corners in the world, and material.
    pub fn triangles(&self, time_s: f64) -> impl Iterator<Item = (Triangle, MaterialId)> + '_ {
        self.plants.iter().flat_map(move |plant| {
            let world_from_body = plant.at(time_s);
            let place = move |corner: Vector| world_from_body.transform_point(&corner.into()).coords;
            self.surfaces.triangles().map(move |(triangle, material)| (triangle.map(place), material))
        })
    }

    /// The first intersection with a ray at `time_s`, within `reach`.
    pub fn cast(&self, origin: &Vector, direction: &Vector, reach: f64, time_s: f64) -> Option<Crossing> {
        let crossing = |plant: usize| {
            let world_from_body = self.plants[plant].at(time_s);
            let origin = world_from_body.inverse_transform_point(&(*origin).into()).coords;
            let crossing = self.surfaces.cast(&origin, &world_from_body.inverse_transform_vector(direction), reach)?;
            Some(Crossing { normal: world_from_body * crossing.normal, ..crossing })
        };
        crossing(self.tree.first(origin, direction, reach, |plant| Some(crossing(plant)?.distance))?)
    }

    /// Distance of a point from the surfaces at `time_s`; `None` above `reach`.
    pub fn distance(&self, point: &Vector, reach: f64, time_s: f64) -> Option<f64> {
        let is_near = |(lower, upper): &(Vector, Vector)| (point - point.sup(lower).inf(upper)).norm() <= reach;
        let near = self.plants.iter().zip(&self.bounds).filter(|(_, bounds)| is_near(bounds));
        let distance = |(plant, _): (&Sway, _)| {
            let in_body = plant.at(time_s).inverse_transform_point(&(*point).into()).coords;
            Some((self.surfaces.nearest(&in_body, reach)?.0.point_in_world - in_body).norm())
        };
        near.filter_map(distance).min_by(f64::total_cmp)
    }
}
