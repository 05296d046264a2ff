//! Triangles of a polygon, in its plane.

use earcut::Earcut;
use zsim_base::geometry::Vector;

/// Maximum number of corners of a face: bounds the time of its triangulation.
pub(super) const MAX_CORNERS: usize = 10_000;
/// Maximum distance of a corner from the plane of its face, as a fraction of the face's size.
const MAX_OUT_OF_PLANE: f64 = 0.02;
/// A face whose area is below this fraction of its squared size has none. Also the relative error of a sum of areas.
const NO_AREA: f64 = 1e-9;
/// Sine of the smallest angle at which a corner is convex.
const MIN_CONVEX_SINE: f64 = 1e-6;

type Point = [f64; 2];

/// Indices of the corners of a triangle.
pub(super) type Indices = [usize; 3];

/// Why a face is not a surface.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub(crate) enum FaceFault {
    #[error("has too few corners ({0}); a face has at least three corners")]
    TooFewCorners(usize),
    #[error("has {0} corners; the maximum is {MAX_CORNERS}")]
    TooManyCorners(usize),
    #[error("has a corner that is not finite")]
    NotFinite,
    #[error(
        "is not flat: a corner is {:.1} % of its size out of its plane; the maximum is {} %: export the mesh with triangles",
        100.0 * .0,
        100.0 * MAX_OUT_OF_PLANE
    )]
    NotFlat(f64),
    #[error("crosses itself: its corners do not follow its outline")]
    CrossesItself,
}

/// Splits a polygon into triangles that cover exactly the polygon, convex or not. Corners on one line give one triangle.
///
/// A convex polygon is split into a fan about its first corner, any other by ear clipping (Eberly 1998).
pub(super) fn triangulate(corners: &[Vector]) -> Result<Vec<Indices>, FaceFault> {
    if corners.len() == 3 {
        return Ok(vec![[0, 1, 2]]);
    }
    if corners.len() < 3 {
        return Err(FaceFault::TooFewCorners(corners.len()));
    }
    if corners.len() > MAX_CORNERS {
        return Err(FaceFault::TooManyCorners(corners.len()));
    }
    let Some(points) = flatten(corners)? else { return Ok(vec![[0, 1, 2]]) };
    if is_convex(&points) {
        return Ok((2..points.len()).map(|k| [0, k - 1, k]).collect());
    }
    if crosses_itself(&points) {
        return Err(FaceFault::CrossesItself);
    }
    let mut indices: Vec<usize> = Vec::new();
    Earcut::new().earcut_slice(&points, &[], &mut indices);
    // Ears are often slivers along a side with many corners; a Delaunay triangulation has as few as there can be.
    earcut::refine(&mut indices, &points);
    let triangles: Vec<Indices> = indices.chunks_exact(3).map(|three| [three[0], three[1], three[2]]).collect();
    let area: f64 = triangles.iter().map(|triangle| twice_area(triangle.map(|k| points[k])).abs()).sum();
    // Of an outline that touches itself, the triangles can cover more than the outline encloses.
    if (area - outline(&points)).abs() > NO_AREA { Err(FaceFault::CrossesItself) } else { Ok(triangles) }
}

/// Returns the corners in the plane of the face, scaled to a size of 1; `None` if they are on one line.
fn flatten(corners: &[Vector]) -> Result<Option<Vec<Point>>, FaceFault> {
    let first = corners[0];
    let (lower, upper) = corners.iter().fold((first, first), |(low, high), c| (low.inf(c), high.sup(c)));
    let size = (upper - lower).norm();
    if !size.is_finite() || !corners.iter().flatten().all(|x| x.is_finite()) {
        return Err(FaceFault::NotFinite);
    }
    if size == 0.0 {
        return Ok(None);
    }
    let local: Vec<Vector> = corners.iter().map(|corner| (corner - first) / size).collect();
    let Some(normal) = normal(&local) else { return Ok(None) };
    let middle = local.iter().sum::<Vector>() / local.len() as f64;
    let out = local.iter().map(|corner| (corner - middle).dot(&normal).abs()).fold(0.0, f64::max);
    if out > MAX_OUT_OF_PLANE {
        return Err(FaceFault::NotFlat(out));
    }
    let axis = Vector::ith(normal.iamin(), 1.0);
    let u = axis.cross(&normal).normalize();
    let v = normal.cross(&u);
    Ok(Some(local.iter().map(|corner| [corner.dot(&u), corner.dot(&v)]).collect()))
}

/// Unit normal of corners relative to the first one; `None` if they are on one line.
///
/// Newell's sum is the mean plane of an outline. It vanishes for a figure of eight, whose plane is that of its widest triangle.
fn normal(local: &[Vector]) -> Option<Vector> {
    let next = local.iter().cycle().skip(1);
    let newell: Vector = local.iter().zip(next).map(|(a, b)| a.cross(b)).sum();
    if let Some(normal) = newell.try_normalize(NO_AREA) {
        return Some(normal);
    }
    let farthest = local.iter().max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()))?;
    let across = local.iter().map(|corner| farthest.cross(corner));
    across.max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()))?.try_normalize(NO_AREA)
}

fn twice_area([a, b, c]: [Point; 3]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Twice the area that an outline encloses.
fn outline(points: &[Point]) -> f64 {
    (2..points.len()).map(|k| twice_area([points[0], points[k - 1], points[k]])).sum::<f64>().abs()
}

/// Whether every corner turns to the same side, and the outline goes around once.
fn is_convex(points: &[Point]) -> bool {
    let count = points.len();
    let edge = |k: usize| {
        let (from, to) = (points[k % count], points[(k + 1) % count]);
        [to[0] - from[0], to[1] - from[1]]
    };
    let mut turned = 0.0;
    for k in 0..count {
        let ([ax, ay], [bx, by]) = (edge(k), edge(k + 1));
        let (sine, cosine) = (ax * by - ay * bx, ax * bx + ay * by);
        if sine <= MIN_CONVEX_SINE * ax.hypot(ay) * bx.hypot(by) {
            return false;
        }
        turned += sine.atan2(cosine);
    }
    // Once around is 2 pi; a star goes around several times.
    turned < 3.0 * std::f64::consts::PI
}

/// Whether two edges cross between their ends. Edges that touch, or lie on each other, bound a hole and do not cross.
fn crosses_itself(points: &[Point]) -> bool {
    let count = points.len();
    let mut edges: Vec<[Point; 2]> = (0..count).map(|k| [points[k], points[(k + 1) % count]]).collect();
    let start = |[a, b]: &[Point; 2]| a[0].min(b[0]);
    edges.sort_by(|a, b| start(a).total_cmp(&start(b)));
    // Only edges whose ranges of x overlap can cross.
    edges.iter().enumerate().any(|(at, edge)| {
        let end = edge[0][0].max(edge[1][0]);
        edges[at + 1..].iter().take_while(|other| start(other) <= end).any(|other| cross(edge, other))
    })
}

fn cross([a, b]: &[Point; 2], [c, d]: &[Point; 2]) -> bool {
    let side = |from: Point, to: Point, point: Point| {
        let area = twice_area([from, to, point]);
        if area.abs() <= NO_AREA { 0.0 } else { area.signum() }
    };
    side(*a, *b, *c) * side(*a, *b, *d) < 0.0 && side(*c, *d, *a) * side(*c, *d, *b) < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Corners in a tilted plane through (3, -2, 5).
    fn tilted(points: &[Point]) -> Vec<Vector> {
        let (u, v) = (Vector::new(0.6, 0.8, 0.0), Vector::new(-0.48, 0.36, 0.8));
        points.iter().map(|[x, y]| Vector::new(3.0, -2.0, 5.0) + u * *x + v * *y).collect()
    }

    fn area(corners: &[Vector], triangles: &[Indices]) -> f64 {
        let of = |[a, b, c]: &Indices| (corners[*b] - corners[*a]).cross(&(corners[*c] - corners[*a])).norm() / 2.0;
        triangles.iter().map(of).sum()
    }

    /// A wall of 4 m x 3 m around a doorway of 1 m x 2 m.
    const DOOR: [Point; 8] = [[0., 3.], [0., 0.], [1.5, 0.], [1.5, 2.], [2.5, 2.], [2.5, 0.], [4., 0.], [4., 3.]];

    #[test]
    fn the_triangles_of_a_concave_face_have_its_area_from_any_corner_in_any_plane() {
        for start in 0..DOOR.len() {
            let mut corners = tilted(&DOOR);
            corners.rotate_left(start);
            for _ in 0..2 {
                let triangles = triangulate(&corners).unwrap();
                assert_eq!(triangles.len(), 6);
                assert!((area(&corners, &triangles) - (12.0 - 2.0)).abs() < 1e-12);
                corners.reverse();
            }
        }
    }

    #[test]
    fn a_window_that_is_joined_to_the_outline_by_a_bridge_stays_open() {
        // The bridge from (0, 0) to the window's corner (1, 1) is passed twice.
        let wall = [[0., 0.], [4., 0.], [4., 3.], [0., 3.], [0., 0.], [1., 1.], [1., 2.], [3., 2.], [3., 1.], [1., 1.]];
        let corners = tilted(&wall);
        assert!((area(&corners, &triangulate(&corners).unwrap()) - (12.0 - 2.0)).abs() < 1e-12);
    }

    #[test]
    fn a_convex_face_is_a_fan_and_corners_on_an_edge_add_no_area() {
        let square = tilted(&[[0., 0.], [1., 0.], [1., 1.], [0., 1.]]);
        assert_eq!(triangulate(&square).unwrap(), [[0, 1, 2], [0, 2, 3]]);
        let edge = tilted(&[[0., 0.], [0.3, 0.], [0.6, 0.], [1., 0.], [1., 1.], [0., 1.]]);
        assert!((area(&edge, &triangulate(&edge).unwrap()) - 1.0).abs() < 1e-12);
        let line = tilted(&[[0., 0.], [1., 0.], [2., 0.], [1.5, 0.]]);
        assert_eq!(triangulate(&line).unwrap(), [[0, 1, 2]]);
    }

    #[test]
    fn a_face_that_crosses_itself_is_refused() {
        let bow_tie = [[0., 0.], [2., 2.], [2., 0.], [0., 2.]];
        let uneven = [[0., 0.], [4., 2.], [4., 0.], [0., 1.]];
        let star: Vec<Point> = (0..5).map(|k| (f64::from(k) * 144.0).to_radians().sin_cos().into()).collect();
        // The crossing is a corner of both loops.
        let eight = [[0., 0.], [2., 2.], [4., 4.], [4., 0.], [2., 2.], [0., 4.]];
        for points in [&bow_tie[..], &uneven, &star, &eight] {
            assert_eq!(triangulate(&tilted(points)), Err(FaceFault::CrossesItself), "{points:?}");
        }
    }

    #[test]
    fn a_warped_face_is_refused_and_rounding_is_not() {
        let mut corners = tilted(&DOOR);
        corners[3] += Vector::new(0.48, -0.64, 0.6) * 0.01;
        assert!(triangulate(&corners).is_ok());
        corners[3] += Vector::new(0.48, -0.64, 0.6) * 0.5;
        assert!(matches!(triangulate(&corners), Err(FaceFault::NotFlat(out)) if (0.05..0.1).contains(&out)));
        corners[0].x = f64::NAN;
        assert_eq!(triangulate(&corners), Err(FaceFault::NotFinite));
        corners[0].x = 1e308;
        assert!(triangulate(&corners).is_err());
    }

    #[test]
    fn the_largest_face_is_triangulated() {
        // A comb with teeth of different lengths: half of its corners are reflex.
        let teeth = MAX_CORNERS as u32 / 2 - 1;
        let tooth = |k: u32| [[f64::from(k), 1.0], [f64::from(k) + 0.5, 2.0 + f64::from(k * 7919 % 1000)]];
        let comb: Vec<Point> = (0..teeth).flat_map(tooth).chain([[f64::from(teeth), 0.0], [0.0, 0.0]]).collect();
        let corners = tilted(&comb);
        let inside = triangulate(&corners).unwrap();
        assert!(inside.len() > MAX_CORNERS - 10);
        assert_eq!(triangulate(&[&corners[..], &corners[..]].concat()), Err(FaceFault::TooManyCorners(2 * comb.len())));
    }
}
