//! Planes of a scene: the faces of one solid that touch and lie in one plane are one surface.

use zsim_base::geometry::Vector;

/// Corners within this distance are one corner, m: above single precision at 100 m.
const SAME_CORNER_M: f64 = 1e-4;
/// Faces that share a corner are coplanar if the sine of the angle between their normals is smaller.
const MAX_COPLANAR_SINE: f64 = 1e-4;

/// A static face of a world.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct FaceId(pub(super) u32);

/// A plane of a world: a number below [`PlaneMap::count`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct PlaneId(pub u32);

/// A face as a part of a plane.
pub(super) struct FlatFace {
    /// Corners, some of which may be equal, m.
    pub corners: [Vector; 4],
    /// Unit normal, of either sign.
    pub normal: Vector,
    /// Number of the solid.
    pub solid: u32,
}

/// The plane of each static face of a world.
///
/// Faces are parts of one plane if they belong to one solid (a placed shape or mesh), are coplanar, and touch at a corner
/// directly or through other such faces. The two sides of a wall are two planes; so are two boxes side by side.
#[derive(Debug, Clone)]
pub struct PlaneMap {
    planes: Vec<PlaneId>,
    count: usize,
}

impl PlaneMap {
    /// The planes of `faces`, in the order of their [`FaceId`]. Their numbers depend on the scene only.
    pub(super) fn of(faces: &[FlatFace]) -> Self {
        let mut corners: Vec<(u32, [i64; 3], u32)> = Vec::new();
        for (index, face) in (0..).zip(faces) {
            let cells = face.corners.iter().flat_map(cells_around);
            corners.extend(cells.map(|cell| (face.solid, cell, index)));
        }
        corners.sort_unstable();
        corners.dedup();
        let mut parents: Vec<u32> = (0..).zip(faces).map(|(index, _)| index).collect();
        for at_corner in corners.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            for (later, (_, _, face)) in at_corner.iter().enumerate() {
                let normal = faces[*face as usize].normal;
                let is_coplanar = |other: &u32| normal.cross(&faces[*other as usize].normal).norm() < MAX_COPLANAR_SINE;
                if let Some(other) = at_corner[..later].iter().map(|(_, _, other)| *other).find(is_coplanar) {
                    join(&mut parents, *face, other);
                }
            }
        }
        Self::number(parents)
    }

    /// Numbers the roots in the order of the faces.
    fn number(mut parents: Vec<u32>) -> Self {
        let (mut count, mut planes) = (0, Vec::with_capacity(parents.len()));
        for index in 0..parents.len() {
            // The root is the face with the lowest index of a plane, so its plane has a number already.
            let root = root(&mut parents, index as u32) as usize;
            planes.push(if root == index { PlaneId(count) } else { planes[root] });
            count += u32::from(root == index);
        }
        Self { planes, count: count as usize }
    }

    /// Number of planes.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The plane of a face of the same world.
    pub fn plane(&self, face: FaceId) -> PlaneId {
        self.planes[face.0 as usize]
    }
}

/// Cells of a grid that contain a point within the tolerance: two points that are one corner share a cell.
fn cells_around(point: &Vector) -> impl Iterator<Item = [i64; 3]> + use<> {
    let cell = |x: f64| (x / (4.0 * SAME_CORNER_M)).floor() as i64;
    let ranges = [0, 1, 2].map(|axis| {
        let x = point[axis];
        [cell(x - SAME_CORNER_M / 2.0), cell(x + SAME_CORNER_M / 2.0)]
    });
    (0..8).map(move |k| [ranges[0][k & 1], ranges[1][k >> 1 & 1], ranges[2][k >> 2]])
}

/// Root of a face in a forest of parents, with path halving.
fn root(parents: &mut [u32], mut face: u32) -> u32 {
    while parents[face as usize] != face {
        parents[face as usize] = parents[parents[face as usize] as usize];
        face = parents[face as usize];
    }
    face
}

/// Joins the trees of two faces; the lower index becomes the root.
fn join(parents: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(parents, a), root(parents, b));
    parents[a.max(b) as usize] = a.min(b);
}
