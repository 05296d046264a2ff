use crate::triangle::{Triangle, parallelogram};
use serde::{Deserialize, Serialize};
use zsim_base::geometry::Vector;
use zsim_base::spec::checked;

/// A doorway or a window: a rectangular opening in a wall.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OpeningSpec {
    /// Start along the wall, m.
    #[serde(with = "checked::NonNegative")]
    pub from_m: f64,
    /// End along the wall, m.
    #[serde(with = "checked::Positive")]
    pub to_m: f64,
    /// Height of the sill, m. Default: 0, a doorway.
    #[serde(default, with = "checked::NonNegative")]
    pub sill_m: f64,
    /// Height of the head, m.
    #[serde(with = "checked::Positive")]
    pub head_m: f64,
}

/// The outer faces of a wall of `size` (length, thickness, height), and the reveals of the openings.
pub(super) fn triangles(size: Vector, openings: &[OpeningSpec]) -> Result<Vec<Triangle>, String> {
    check(size, openings)?;
    let mut faces = Faces { thickness: size.y, triangles: Vec::new() };
    let mut done = 0.0;
    for opening in openings {
        let OpeningSpec { from_m, to_m, sill_m, head_m } = *opening;
        faces.panel([done, from_m], [0.0, size.z]);
        faces.panel([from_m, to_m], [0.0, sill_m]);
        faces.panel([from_m, to_m], [head_m, size.z]);
        faces.end(from_m, [sill_m, head_m], true);
        faces.end(to_m, [sill_m, head_m], false);
        if sill_m > 0.0 {
            faces.floor([from_m, to_m], sill_m);
            faces.ceiling([from_m, to_m], 0.0);
        }
        if head_m < size.z {
            faces.ceiling([from_m, to_m], head_m);
            faces.floor([from_m, to_m], size.z);
        }
        faces.ceiling([done, from_m], 0.0);
        faces.floor([done, from_m], size.z);
        done = to_m;
    }
    faces.panel([done, size.x], [0.0, size.z]);
    faces.ceiling([done, size.x], 0.0);
    faces.floor([done, size.x], size.z);
    faces.end(0.0, [0.0, size.z], false);
    faces.end(size.x, [0.0, size.z], true);
    Ok(faces.triangles)
}

/// Checks that the openings are within the wall, in order, and do not overlap.
fn check(size: Vector, openings: &[OpeningSpec]) -> Result<(), String> {
    let mut done = 0.0;
    for OpeningSpec { from_m, to_m, sill_m, head_m } in openings {
        if *from_m < done {
            return Err(format!("the opening from {from_m} m begins before the previous one ends, at {done} m"));
        }
        if to_m <= from_m || head_m <= sill_m {
            return Err(format!("the opening from {from_m} to {to_m} m, {sill_m} to {head_m} m high, has no area"));
        }
        if *to_m > size.x || *head_m > size.z {
            let (length, height) = (size.x, size.z);
            return Err(format!(
                "the opening ends at {to_m} m, {head_m} m high, beyond the wall of {length} m, {height} m high"
            ));
        }
        done = *to_m;
    }
    Ok(())
}

struct Faces {
    thickness: f64,
    triangles: Vec<Triangle>,
}

impl Faces {
    fn push(&mut self, corner: Vector, u: Vector, v: Vector) {
        if u.norm_squared() > 0.0 && v.norm_squared() > 0.0 {
            self.triangles.extend(parallelogram(corner, u, v));
        }
    }

    /// The two sides of a part of the wall.
    fn panel(&mut self, [x0, x1]: [f64; 2], [z0, z1]: [f64; 2]) {
        let (along, up) = (Vector::x() * (x1 - x0), Vector::z() * (z1 - z0));
        self.push(Vector::new(x0, -self.thickness / 2.0, z0), along, up);
        self.push(Vector::new(x0, self.thickness / 2.0, z0), up, along);
    }

    /// A face that points up.
    fn floor(&mut self, [x0, x1]: [f64; 2], z: f64) {
        self.push(Vector::new(x0, -self.thickness / 2.0, z), Vector::x() * (x1 - x0), Vector::y() * self.thickness);
    }

    /// A face that points down.
    fn ceiling(&mut self, [x0, x1]: [f64; 2], z: f64) {
        self.push(Vector::new(x0, -self.thickness / 2.0, z), Vector::y() * self.thickness, Vector::x() * (x1 - x0));
    }

    /// A face across the wall that points along x, or against it.
    fn end(&mut self, x: f64, [z0, z1]: [f64; 2], along_x: bool) {
        let (across, up) = (Vector::y() * self.thickness, Vector::z() * (z1 - z0));
        let (u, v) = if along_x { (across, up) } else { (up, across) };
        self.push(Vector::new(x, -self.thickness / 2.0, z0), u, v);
    }
}
