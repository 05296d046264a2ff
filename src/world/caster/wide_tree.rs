//! Tree of boxes in which each node has eight children, whose boxes are tested at once.

use parry3d::bounding_volume::Aabb;
use std::ops::Range;

/// Children of a node.
pub(super) const WIDTH: usize = 8;
/// Maximum number of faces of a leaf.
const LEAF_FACES: usize = 4;
/// Bins of a coordinate axis in which a split is searched.
const BINS: usize = 16;
/// Coordinate of the empty box, m: outside of every scene.
const OUTSIDE: f32 = 1e30;

/// The boxes of the children of a node.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub(super) struct WideNode {
    /// Lower x, y, z, then upper x, y, z of each child.
    pub sides: [[f32; WIDTH]; 6],
    pub children: [Child; WIDTH],
}

/// A child of a node: another node or a leaf, in one integer.
///
/// Bit 31 marks a leaf. Its lowest two bits are the number of faces minus one, the others the place of its first face.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct Child(u32);

impl Child {
    const LEAF: u32 = 1 << 31;

    /// The node with this index.
    pub fn node(index: usize) -> Self {
        Self(index as u32)
    }

    fn leaf(faces: &Range<usize>) -> Self {
        Self(Self::LEAF | (faces.start * LEAF_FACES + faces.len() - 1) as u32)
    }

    /// The index of a node, or the faces of a leaf in the order of the tree.
    #[inline(always)]
    pub fn content(self) -> Result<usize, Range<usize>> {
        let bits = (self.0 & !Self::LEAF) as usize;
        if self.0 & Self::LEAF == 0 {
            return Ok(bits);
        }
        let first = bits / LEAF_FACES;
        Err(first..first + bits % LEAF_FACES + 1)
    }
}

/// Builds the nodes, the first of which is the root, and returns them with the order of the boxes in the leaves.
pub(super) fn build(boxes: &[Aabb]) -> (Vec<WideNode>, Vec<u32>) {
    let mut builder = Builder { boxes, order: (0..boxes.len() as u32).collect(), nodes: Vec::new() };
    if !boxes.is_empty() {
        builder.add_node(0..boxes.len());
    }
    (builder.nodes, builder.order)
}

struct Builder<'a> {
    boxes: &'a [Aabb],
    order: Vec<u32>,
    nodes: Vec<WideNode>,
}

/// A place at which boxes are divided in two: bin `at` of `axis` is the first on the right.
struct Split {
    axis: usize,
    at: usize,
    cost: f32,
}

impl Builder<'_> {
    /// Adds the node of a range of `order`, and the nodes below it; returns its index.
    ///
    /// The part with the largest surface is divided until there are eight: a ray meets it most often.
    fn add_node(&mut self, range: Range<usize>) -> usize {
        let mut parts = vec![(self.bounds(&range), range)];
        while parts.len() < WIDTH {
            let divisible = (0..parts.len()).filter(|k| parts[*k].1.len() > LEAF_FACES);
            let largest = divisible.max_by(|a, b| area(&parts[*a].0).total_cmp(&area(&parts[*b].0)));
            let Some(largest) = largest else { break };
            let (_, whole) = parts.swap_remove(largest);
            let middle = self.divide(&whole);
            parts.extend([whole.start..middle, middle..whole.end].map(|part| (self.bounds(&part), part)));
        }
        let index = self.nodes.len();
        let [lower, upper] = [[OUTSIDE; WIDTH], [-OUTSIDE; WIDTH]];
        let sides = [lower, lower, lower, upper, upper, upper];
        self.nodes.push(WideNode { sides, children: [Child::node(0); WIDTH] });
        for (k, (bounds, range)) in parts.into_iter().enumerate() {
            let is_leaf = range.len() <= LEAF_FACES;
            let child = if is_leaf { Child::leaf(&range) } else { Child::node(self.add_node(range)) };
            let node = &mut self.nodes[index];
            node.children[k] = child;
            for axis in 0..3 {
                node.sides[axis][k] = bounds.mins[axis];
                node.sides[axis + 3][k] = bounds.maxs[axis];
            }
        }
        index
    }

    fn bounds(&self, range: &Range<usize>) -> Aabb {
        self.order[range.clone()]
            .iter()
            .fold(Aabb::new_invalid(), |bounds, at| join(&bounds, &self.boxes[*at as usize]))
    }

    /// Sorts a range of `order` into two parts, and returns the start of the second one.
    fn divide(&mut self, range: &Range<usize>) -> usize {
        let middles = self.order[range.clone()].iter().fold(Aabb::new_invalid(), |bounds, at| {
            let middle = self.boxes[*at as usize].center();
            join(&bounds, &Aabb::new(middle, middle))
        });
        let bin = |at: u32, axis: usize| {
            let scale = BINS as f32 / (middles.maxs[axis] - middles.mins[axis]);
            let from_lower = self.boxes[at as usize].center()[axis] - middles.mins[axis];
            ((from_lower * scale) as usize).min(BINS - 1)
        };
        let extended = (0..3).filter(|axis| middles.maxs[*axis] > middles.mins[*axis]);
        let splits = extended.filter_map(|axis| self.best_split(range, axis, |at| bin(at, axis)));
        let Some(Split { axis, at, .. }) = splits.min_by(|a, b| a.cost.total_cmp(&b.cost)) else {
            return range.start + range.len() / 2; // all centres are at one point
        };
        let (left, right): (Vec<u32>, Vec<u32>) = self.order[range.clone()].iter().partition(|k| bin(**k, axis) < at);
        let middle = range.start + left.len();
        self.order[range.start..middle].copy_from_slice(&left);
        self.order[middle..range.end].copy_from_slice(&right);
        middle
    }

    /// The split along an axis with the least cost by the surface area heuristic (Wald 2007, "On fast construction of
    /// SAH-based bounding volume hierarchies"); `None` if all boxes are in one bin.
    fn best_split(&self, range: &Range<usize>, axis: usize, bin: impl Fn(u32) -> usize) -> Option<Split> {
        let empty = (Aabb::new_invalid(), 0_usize);
        let mut bins = [empty; BINS];
        for at in &self.order[range.clone()] {
            let (bounds, count) = &mut bins[bin(*at)];
            (*bounds, *count) = (join(bounds, &self.boxes[*at as usize]), *count + 1);
        }
        let mut right = [empty; BINS + 1];
        for k in (1..BINS).rev() {
            right[k] = (join(&right[k + 1].0, &bins[k].0), right[k + 1].1 + bins[k].1);
        }
        let (mut left, mut best) = (empty, None);
        for at in 1..BINS {
            left = (join(&left.0, &bins[at - 1].0), left.1 + bins[at - 1].1);
            let right = &right[at];
            if left.1 > 0 && right.1 > 0 {
                let cost = area(&left.0) * left.1 as f32 + area(&right.0) * right.1 as f32;
                let is_better = best.as_ref().is_none_or(|best: &Split| cost < best.cost);
                best = if is_better { Some(Split { axis, at, cost }) } else { best };
            }
        }
        best
    }
}

fn join(a: &Aabb, b: &Aabb) -> Aabb {
    Aabb::new(a.mins.min(b.mins), a.maxs.max(b.maxs))
}

/// Half of the surface of a box.
fn area(bounds: &Aabb) -> f32 {
    let size = bounds.maxs - bounds.mins;
    size.x * size.y + size.y * size.z + size.z * size.x
}
