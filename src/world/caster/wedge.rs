//! Bounds of a group of rays.

use super::lanes::{Lanes, dot, load3, range, splat3};
use super::packet::{PACKET, Packet};
use super::wide_tree::{WIDTH, WideNode};
use pulp::Simd;

/// Least cosine between a ray and the axis of its group; rays farther apart have no useful bounds.
const MIN_COS: f32 = 0.5;
/// Least component of all directions along a coordinate axis, with which its slabs are tested.
const MIN_SLOPE: f32 = 1e-6;
/// Rounding of a quotient of the slab test, as a fraction: more than three roundings.
const ROUNDING: f32 = 1e-6;

/// A region that contains all rays of a group: a wedge of four planes, and intervals along the coordinate axes.
///
/// A box that is outside of one plane, or that no ray crosses in all three slabs at once by interval arithmetic, cannot
/// be hit. All tests have margins for rounding, so that no box is missed.
pub(super) struct Wedge {
    /// The rays are in `normal . x <= offset`.
    normals: [[f32; 3]; 4],
    offsets: [f32; 4],
    /// Middle direction of the rays.
    axis: [f32; 3],
    /// Largest coordinate along `axis` of an origin.
    depth: f32,
    /// Rounding of coordinates, m.
    slack: f32,
    slabs: [Slab; 3],
}

/// Interval of the distances at which rays enter and leave slabs of one axis.
#[derive(Clone, Copy)]
struct Slab {
    /// Index in [`WideNode::sides`] of the side through which rays enter and leave.
    sides: [usize; 2],
    /// Coordinates of the origin for the least distance of entry and the largest of exit.
    origins: [f32; 2],
    /// Reciprocals of the direction for the same.
    inverses: [f32; 2],
}

impl Wedge {
    /// The bounds of a group in a scene whose coordinates are at most `extent`, m; `None` if the rays diverge too much.
    #[inline(always)]
    pub fn new<S: Simd>(simd: S, rays: &Packet, extent: f32) -> Option<Self> {
        let (directions, origins) = (&rays.direction, &rays.origin);
        let [axis, across, up] = frame(directions);
        let (cos, depths) = (along(simd, directions, &axis), along(simd, origins, &axis));
        let least_cos = range(simd, &cos).0;
        if least_cos.is_nan() || least_cos <= MIN_COS {
            return None;
        }
        let slabs = [Slab::new(simd, rays, 0), Slab::new(simd, rays, 1), Slab::new(simd, rays, 2)];
        // Four products and sums, each of which rounds by half a unit in the last place.
        let [x, y, z] = origins;
        let slack = 16.0 * f32::EPSILON * (extent + x[0].abs() + y[0].abs() + z[0].abs());
        let mut wedge =
            Self { normals: [[0.0; 3]; 4], offsets: [0.0; 4], axis, depth: range(simd, &depths).1, slack, slabs };
        for (side, towards) in [across, up].into_iter().enumerate() {
            let (slopes, starts) = (along(simd, directions, &towards), along(simd, origins, &towards));
            let mut ratios = [0.0; PACKET];
            for k in 0..PACKET / S::F32_LANES {
                (Lanes::load(simd, &slopes, k) * Lanes::load(simd, &cos, k).inverse()).store(&mut ratios, k);
            }
            let (lower, upper) = range(simd, &ratios);
            let (mut above, mut below) = ([0.0; PACKET], [0.0; PACKET]);
            for k in 0..PACKET / S::F32_LANES {
                let (start, depth) = (Lanes::load(simd, &starts, k), Lanes::load(simd, &depths, k));
                (start - Lanes::splat(simd, upper) * depth).store(&mut above, k);
                (Lanes::splat(simd, lower) * depth - start).store(&mut below, k);
            }
            for k in 0..3 {
                wedge.normals[2 * side][k] = towards[k] - upper * axis[k];
                wedge.normals[2 * side + 1][k] = lower * axis[k] - towards[k];
            }
            wedge.offsets[2 * side] = range(simd, &above).1 + slack;
            wedge.offsets[2 * side + 1] = range(simd, &below).1 + slack;
        }
        Some(wedge)
    }

    /// Coordinate along the axis up to which boxes can contain a hit within `reach` of the origins.
    #[inline(always)]
    pub fn farthest(&self, reach: f32) -> f32 {
        self.depth + reach * (1.0 + ROUNDING) + self.slack
    }

    /// Least coordinate along the axis of each child of a node; infinite for a box that no ray meets before `farthest`.
    #[inline(always)]
    pub fn depths<S: Simd>(&self, simd: S, node: &WideNode, farthest: f32, depths: &mut [f32; WIDTH]) {
        for k in 0..WIDTH / S::F32_LANES {
            let mut outside = least(simd, node, k, &self.normals[0]) - Lanes::splat(simd, self.offsets[0]);
            for plane in 1..4 {
                let beyond = least(simd, node, k, &self.normals[plane]) - Lanes::splat(simd, self.offsets[plane]);
                outside = outside.max(beyond);
            }
            let zero = Lanes::splat(simd, 0.0);
            let infinite = Lanes::splat(simd, f32::INFINITY);
            let (mut enter, mut leave) = (zero, infinite);
            for slab in &self.slabs {
                enter = enter.max(slab.distance(simd, node, k, 0));
                leave = leave.min(slab.distance(simd, node, k, 1));
            }
            let depth = least(simd, node, k, &self.axis);
            let is_before = depth.at_most(Lanes::splat(simd, farthest));
            let is_met = outside.at_most(zero).and(enter.at_most(leave)).and(is_before);
            is_met.select(depth, infinite).store(depths, k);
        }
    }
}

/// Least component along `normal` of the boxes in register `register`.
#[inline(always)]
fn least<S: Simd>(simd: S, node: &WideNode, register: usize, normal: &[f32; 3]) -> Lanes<S> {
    // The corner that is farthest against the normal.
    let [x, y, z] = normal;
    let x_side = &node.sides[if *x > 0.0 { 0 } else { 3 }];
    let y_side = &node.sides[if *y > 0.0 { 1 } else { 4 }];
    let z_side = &node.sides[if *z > 0.0 { 2 } else { 5 }];
    let load =
        [Lanes::load(simd, x_side, register), Lanes::load(simd, y_side, register), Lanes::load(simd, z_side, register)];
    dot(&load, &splat3(simd, normal))
}

impl Slab {
    /// The slab test of a coordinate axis for the intervals of directions and origins of a group.
    #[inline(always)]
    fn new<S: Simd>(simd: S, rays: &Packet, axis: usize) -> Self {
        let (slowest, fastest) = range(simd, &rays.direction[axis]);
        let (lower, upper) = range(simd, &rays.origin[axis]);
        if slowest > MIN_SLOPE {
            return Self::between([axis, axis + 3], [upper, lower], [fastest, slowest]);
        }
        if fastest < -MIN_SLOPE {
            return Self::between([axis + 3, axis], [lower, upper], [slowest, fastest]);
        }
        // Rays in both directions: enter at 0, leave far away.
        Self { sides: [axis, axis], origins: [0.0, -1e20], inverses: [0.0, 1.0] }
    }

    /// Least distance of entry (`end` 0) or largest of exit (1) of the boxes in register `register`.
    #[inline(always)]
    fn distance<S: Simd>(&self, simd: S, node: &WideNode, register: usize, end: usize) -> Lanes<S> {
        let side = Lanes::load(simd, &node.sides[self.sides[end]], register);
        (side - Lanes::splat(simd, self.origins[end])) * Lanes::splat(simd, self.inverses[end])
    }

    #[inline(always)]
    fn between(sides: [usize; 2], origins: [f32; 2], [enter, leave]: [f32; 2]) -> Self {
        Self { sides, origins, inverses: [(1.0 - ROUNDING) / enter, (1.0 + ROUNDING) / leave] }
    }
}

/// Three perpendicular unit vectors: the middle of directions, the direction in which they fan out, and that across.
#[inline(always)]
fn frame(directions: &[[f32; PACKET]; 3]) -> [[f32; 3]; 3] {
    let [x, y, z] = directions;
    let sum = |d: &[f32; PACKET]| d[0] + d[PACKET / 2] + d[PACKET - 1];
    let fan = |d: &[f32; PACKET]| d[PACKET - 1] - d[0];
    let axis = unit([sum(x), sum(y), sum(z)]);
    let (fan, axis_x) = ([fan(x), fan(y), fan(z)], axis[0]);
    let forward = product(&fan, &axis);
    let fan = [fan[0] - axis[0] * forward, fan[1] - axis[1] * forward, fan[2] - axis[2] * forward];
    let any = if axis_x.abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let across = unit(if product(&fan, &fan) > 1e-12 { fan } else { perpendicular(&axis, &any) });
    [axis, across, perpendicular(&axis, &across)]
}

/// The component of vectors along `axis`.
#[inline(always)]
fn along<S: Simd>(simd: S, vectors: &[[f32; PACKET]; 3], axis: &[f32; 3]) -> [f32; PACKET] {
    let (mut components, axis) = ([0.0; PACKET], splat3(simd, axis));
    for k in 0..PACKET / S::F32_LANES {
        dot(&load3(simd, vectors, k), &axis).store(&mut components, k);
    }
    components
}

#[inline(always)]
fn product(a: &[f32; 3], b: &[f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn perpendicular(a: &[f32; 3], b: &[f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
fn unit(a: [f32; 3]) -> [f32; 3] {
    let inverse = 1.0 / product(&a, &a).sqrt();
    [a[0] * inverse, a[1] * inverse, a[2] * inverse]
}
