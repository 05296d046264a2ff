//! A reference cloud as surface elements, from which other clouds are measured.

use std::collections::BTreeMap;
use zsim_base::geometry::{Matrix, Surface, SurfacePoint, Vector};

/// Edge of the voxels, m: an office wall has 30 points of the paper's reference laser in one after a minute.
const EDGE_M: f64 = 0.2;
/// Minimum number of points in a voxel.
const MIN_POINTS: f64 = 8.0;
/// Minimum planarity `2 (l2 - l1) / (l1 + l2 + l3)` of the points in a voxel, eigenvalues `l1 <= l2 <= l3` of their second
/// moments: 1 for a plane (Bosse and Zlot, ICRA 2009).
const MIN_PLANARITY: f64 = 0.5;
/// Maximum distance from a point to the centre of its surface element, as a multiple of the edge.
const MAX_DISTANCE_EDGES: f64 = 1.0;

/// Surface elements of a reference cloud: centre and normal of the points in each voxel that are nearly planar.
///
/// As a [`Surface`], its nearest point is the foot of the perpendicular on the plane of the element with the nearest
/// centre: the paper measures the error of a cloud along the normals of the reference (Bosse, Zlot and Flick 2012,
/// section IV-A). Where the reference has no element within 0.2 m, there is no nearest point.
#[derive(Debug, Clone, Default)]
pub struct ReferenceCloud {
    elements: BTreeMap<Voxel, Element>,
}

type Voxel = [i64; 3];

#[derive(Debug, Clone, Copy)]
struct Element {
    centre_in_world: Vector,
    normal_in_world: Vector,
}

/// Sums over the points of a voxel, from its centre.
#[derive(Default)]
struct Moments {
    count: f64,
    sum: Vector,
    squares: Matrix,
}

impl ReferenceCloud {
    /// Builds the surface elements of points in the world, m.
    pub fn new(points_in_world: impl IntoIterator<Item = Vector>) -> Self {
        let mut voxels: BTreeMap<Voxel, Moments> = BTreeMap::new();
        for point in points_in_world {
            let voxel = voxel_of(&point);
            let from_centre = point - centre_of(voxel);
            let moments = voxels.entry(voxel).or_default();
            moments.count += 1.0;
            moments.sum += from_centre;
            moments.squares += from_centre * from_centre.transpose();
        }
        let element = |(voxel, moments): (Voxel, Moments)| Some((voxel, moments.element(centre_of(voxel))?));
        Self { elements: voxels.into_iter().filter_map(element).collect() }
    }

    /// Returns the number of surface elements.
    pub fn len(&self) -> usize {
        self.elements.len()
    }

    /// Whether the cloud has no surface element.
    pub fn is_empty(&self) -> bool {
        self.elements.is_empty()
    }
}

impl Moments {
    fn element(&self, origin: Vector) -> Option<Element> {
        if self.count < MIN_POINTS {
            return None;
        }
        let mean = self.sum / self.count;
        let eigen = (self.squares / self.count - mean * mean.transpose()).symmetric_eigen();
        let mut order = [0, 1, 2];
        order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
        let [l1, l2, l3] = order.map(|k| eigen.eigenvalues[k].max(0.0));
        let planarity = 2.0 * (l2 - l1) / (l1 + l2 + l3).max(f64::MIN_POSITIVE);
        let normal_in_world = eigen.eigenvectors.column(order[0]).into_owned();
        (planarity >= MIN_PLANARITY).then_some(Element { centre_in_world: origin + mean, normal_in_world })
    }
}

fn voxel_of(point: &Vector) -> Voxel {
    [point.x, point.y, point.z].map(|x| (x / EDGE_M).floor() as i64)
}

fn centre_of(voxel: Voxel) -> Vector {
    Vector::from(voxel.map(|index| (index as f64 + 0.5) * EDGE_M))
}

impl Surface for ReferenceCloud {
    fn nearest(&self, point_in_world: &Vector, reach_m: f64) -> Option<SurfacePoint> {
        let [x, y, z] = voxel_of(point_in_world);
        let mut nearest: Option<(f64, &Element)> = None;
        for dx in -1..=1 {
            for dy in -1..=1 {
                let row = self.elements.range([x + dx, y + dy, z - 1]..=[x + dx, y + dy, z + 1]);
                for (_, element) in row {
                    let distance2 = (element.centre_in_world - point_in_world).norm_squared();
                    if nearest.is_none_or(|(least, _)| distance2 < least) {
                        nearest = Some((distance2, element));
                    }
                }
            }
        }
        let (distance2, element) = nearest?;
        if distance2.sqrt() > MAX_DISTANCE_EDGES * EDGE_M {
            return None;
        }
        let height_m = (point_in_world - element.centre_in_world).dot(&element.normal_in_world);
        let point = point_in_world - element.normal_in_world * height_m;
        let found = SurfacePoint { point_in_world: point, normal_in_world: element.normal_in_world };
        (height_m.abs() <= reach_m).then_some(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CloudErrors;
    use approx::assert_relative_eq;
    use zsim_base::geometry::Rotation;

    /// A wall of 4 m by 2 m, tilted, with a deviation along its normal as a function of the index of the point.
    fn wall(deviation_m: impl Fn(usize) -> f64) -> Vec<Vector> {
        let tilt = Rotation::from_euler_angles(0.2, -0.4, 0.7);
        let point = |k: usize| {
            let (u, v) = ((k as f64 * 0.754_877_666).fract() * 4.0, (k as f64 * 0.569_840_291).fract() * 2.0);
            tilt * Vector::new(u, v, deviation_m(k)) + Vector::new(3.0, -1.0, 0.5)
        };
        (0..40_000).map(point).collect()
    }

    #[test]
    fn bias_and_spread_of_a_cloud_along_the_normal_of_the_reference_are_recovered() {
        // The reference deviates by 10 mm to either side; the cloud is 20 mm nearer to the sensor, and deviates by 30 mm.
        let alternate = |k: usize| if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        let reference = ReferenceCloud::new(wall(|k| 0.010 * alternate(k)));
        let sensor = Some(Rotation::from_euler_angles(0.2, -0.4, 0.7) * Vector::new(2.0, 1.0, 5.0));
        let cloud: Vec<_> =
            wall(|k| 0.020 + 0.030 * alternate(k / 2)).into_iter().map(|point| (point, sensor)).collect();
        let found = CloudErrors::to_surface(&reference, &cloud, 0.5).summary().unwrap();
        assert_relative_eq!(found.bias_m, 0.020, max_relative = 0.02);
        assert_relative_eq!(found.sigma_m, 0.030, max_relative = 0.02);
        assert!(found.beyond_reach < 0.02, "{found:?}");
    }

    #[test]
    fn points_without_a_plane_give_no_surface() {
        let random = |k: usize, of: f64| (k as f64 * of).fract();
        // Even in a cube of 1 m: the sequence R3 of Roberts, the powers of the inverse of the root of x^4 = x + 1.
        let foliage = (0..30_000).map(|k| {
            Vector::new(
                random(k, 0.819_172_513_396_164_5),
                random(k, 0.671_043_606_703_789_3),
                random(k, 0.549_700_477_901_970_3),
            )
        });
        let reference = ReferenceCloud::new(foliage);
        assert!(reference.is_empty(), "{} of 125 voxels", reference.len());
        let sparse = ReferenceCloud::new((0..7).map(|k| Vector::new(0.01 * k as f64, 0.01 * (k * k % 5) as f64, 0.1)));
        assert!(sparse.is_empty());
        assert_eq!(sparse.nearest(&Vector::new(0.05, 0.05, 0.1), 1.0), None);
    }

    #[test]
    fn a_surface_that_the_reference_has_not_seen_is_out_of_reach() {
        let reference = ReferenceCloud::new(wall(|_| 0.0));
        assert!(!reference.is_empty());
        assert_eq!(reference.nearest(&Vector::new(-3.0, -4.0, 0.5), 1.0), None);
    }
}
