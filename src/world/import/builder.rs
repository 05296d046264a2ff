//! Collects the faces of a mesh as triangles within the limits.

use super::error::MeshError;
use super::polygon::{FaceFault, triangulate};
use crate::triangle::{MAX_TRIANGLES, Triangle};
use std::collections::BTreeMap;
use zsim_base::geometry::Vector;

/// Maximum sum of the squared numbers of corners of all faces: the time for those that are not convex, some 10 s.
const MAX_EFFORT: usize = 10_000_000_000;

/// The triangles of a file, in its units and axes.
#[derive(Debug, Default)]
pub(super) struct Faces {
    pub triangles: Vec<Triangle>,
    /// Material of each triangle: 0 for none, otherwise the number in `names`, from 1.
    pub materials: Vec<u16>,
    /// Names of materials in the file.
    pub names: Vec<String>,
}

/// Builds the triangles of a mesh face by face.
#[derive(Default)]
pub(super) struct MeshBuilder {
    faces: Faces,
    numbers_of_names: BTreeMap<String, u16>,
    material: u16,
    face_count: usize,
    effort: usize,
}

impl MeshBuilder {
    /// Sets the material of the faces that follow.
    ///
    /// # Errors
    /// When there are too many materials.
    pub fn set_material(&mut self, name: Option<&str>) -> Result<(), MeshError> {
        let Some(name) = name else {
            self.material = 0;
            return Ok(());
        };
        self.material = match self.numbers_of_names.get(name) {
            Some(number) => *number,
            None => {
                let number = u16::try_from(self.faces.names.len() + 1).map_err(|_| MeshError::TooManyMaterials)?;
                self.faces.names.push(name.to_owned());
                self.numbers_of_names.insert(name.to_owned(), number);
                number
            }
        };
        Ok(())
    }

    /// Adds a face with its corners in order.
    ///
    /// # Errors
    /// When it is not a surface, or there are too many corners or triangles.
    pub fn polygon(&mut self, corners: &[Vector]) -> Result<(), MeshError> {
        self.face_count += 1;
        self.effort = self.effort.saturating_add(corners.len().saturating_mul(corners.len()));
        if self.effort > MAX_EFFORT {
            return Err(MeshError::TooManyCorners);
        }
        let wrong = |fault: FaceFault| MeshError::Face { face: self.face_count, fault };
        let triangles = triangulate(corners).map_err(wrong)?;
        self.reserve(triangles.len())?;
        triangles.iter().for_each(|triangle| self.push(triangle.map(|k| corners[k])));
        Ok(())
    }

    /// Adds a triangle.
    ///
    /// # Errors
    /// When there are too many.
    pub fn triangle(&mut self, triangle: Triangle) -> Result<(), MeshError> {
        self.face_count += 1;
        self.reserve(1)?;
        self.push(triangle);
        Ok(())
    }

    /// Checks that `more` triangles are within the limit.
    ///
    /// # Errors
    /// When they are not.
    pub fn reserve(&self, more: usize) -> Result<(), MeshError> {
        if more > MAX_TRIANGLES - self.faces.triangles.len() { Err(MeshError::TooManyTriangles) } else { Ok(()) }
    }

    /// Number of the next face, from 1.
    pub fn next_face(&self) -> usize {
        self.face_count + 1
    }

    pub fn finish(self) -> Faces {
        self.faces
    }

    fn push(&mut self, triangle: Triangle) {
        self.faces.triangles.push(triangle);
        self.faces.materials.push(self.material);
    }
}

/// Returns the vertices of a face, given their indices from 0.
pub(super) fn corners(vertices: &[Vector], indices: &[i64], face: usize) -> Result<Vec<Vector>, MeshError> {
    let corner = |index: &i64| {
        let found = usize::try_from(*index).ok().and_then(|index| vertices.get(index)).copied();
        found.ok_or(MeshError::NoSuchVertex { face, index: *index, vertices: vertices.len() })
    };
    indices.iter().map(corner).collect()
}
