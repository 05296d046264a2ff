//! Groups of rays.

use super::face::{OVERLAP, SingleFace};
use super::lanes::{Lanes, cross, dot, load3, splat3};
use super::single_precision::single_reach;
use crate::TimedRay;
use pulp::Simd;
use zsim_base::geometry::Vector;

/// Rays of a group.
pub(super) const PACKET: usize = 16;
/// No face, as the number of a face.
const NO_FACE: u32 = u32::MAX;

/// A face as the leaf test reads it.
#[derive(Clone, Copy)]
pub(super) struct LeafFace {
    corner: [f32; 3],
    u: [f32; 3],
    v: [f32; 3],
    /// See [`SingleFace`].
    max_sum: f32,
    number: u32,
}

impl LeafFace {
    /// The face with this number.
    pub fn new(face: &SingleFace, number: u32) -> Self {
        let ([corner, u, v], max_sum) = face.corner_and_edges();
        Self { corner, u, v, max_sum, number }
    }
}

/// A group of rays, by coordinate, and their nearest faces.
#[repr(align(32))]
pub(super) struct Packet {
    pub origin: [[f32; PACKET]; 3],
    pub direction: [[f32; PACKET]; 3],
    /// Distance within which a face is searched; later that of the nearest face.
    pub reach: [f32; PACKET],
    face: [u32; PACKET],
}

impl Packet {
    /// Up to 16 rays, relative to `middle`; the last one fills the group.
    #[inline(always)]
    pub fn new(rays: &[TimedRay], middle: &Vector) -> Self {
        let zeros = [[0.0; PACKET]; 3];
        let mut packet = Self { origin: zeros, direction: zeros, reach: [0.0; PACKET], face: [NO_FACE; PACKET] };
        for k in 0..PACKET {
            let TimedRay { ray, reach_m, .. } = &rays[k.min(rays.len() - 1)];
            packet.reach[k] = single_reach(*reach_m);
            for axis in 0..3 {
                packet.origin[axis][k] = (ray.origin_in_world[axis] - middle[axis]) as f32;
                packet.direction[axis][k] = ray.direction_in_world[axis] as f32;
            }
        }
        packet
    }

    /// Number of the face that a ray hits, and its distance.
    #[inline(always)]
    pub fn nearest(&self, ray: usize) -> Option<(usize, f32)> {
        let face = self.face[ray];
        (face != NO_FACE).then(|| (face as usize, self.reach[ray]))
    }

    /// Tests the rays against a face: the same operations as [`SingleFace::cross`]. Returns whether any distance changed.
    #[inline(always)]
    pub fn cross<S: Simd>(&mut self, simd: S, face: &LeafFace) -> bool {
        let (zero, outside) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, -OVERLAP));
        let (inside, max_sum) = (Lanes::splat(simd, 1.0 + OVERLAP), Lanes::splat(simd, face.max_sum));
        let (u, v, corner) = (splat3(simd, &face.u), splat3(simd, &face.v), splat3(simd, &face.corner));
        let mut is_nearer = false;
        for k in 0..PACKET / S::F32_LANES {
            let (origin, direction) = (load3(simd, &self.origin, k), load3(simd, &self.direction, k));
            let p = cross(&direction, &v);
            let inverse = dot(&u, &p).inverse();
            let from_corner = [origin[0] - corner[0], origin[1] - corner[1], origin[2] - corner[2]];
            let along_u = dot(&from_corner, &p) * inverse;
            let q = cross(&from_corner, &u);
            let along_v = dot(&direction, &q) * inverse;
            let distance = dot(&v, &q) * inverse;
            let reach = Lanes::load(simd, &self.reach, k);
            // A ray in the plane of the face divides by zero: the distance is infinite or NaN, and never below the reach.
            let is_hit = outside
                .at_most(along_u.min(along_v))
                .and(along_u.max(along_v).at_most(inside))
                .and((along_u + along_v).at_most(max_sum))
                .and(zero.at_most(distance))
                .and(distance.below(reach));
            if is_hit.any() {
                is_nearer = true;
                is_hit.select(distance, reach).store(&mut self.reach, k);
                is_hit.write(face.number, &mut self.face, k);
            }
        }
        is_nearer
    }
}
