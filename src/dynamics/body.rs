//! Mass properties of the head.

use super::spec::{HeadSpec, PartSpec};
use zsim_base::geometry::{Matrix, Pose, Rotation, Vector};
use zsim_base::spec::{Source, SpecError};
use zsim_elasticity::{Matrix6, Vector6, blocks, split};

/// Mass, centre of mass and inertia of the head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Centre of mass in the head frame, m.
    pub centre_of_mass_in_head: Vector,
    /// Inertia tensor about the centre of mass, in the axes of the head, kg m^2.
    pub inertia_in_head: Matrix,
}

impl Body {
    /// Combines the parts of a head into one rigid body.
    ///
    /// # Errors
    /// When there is no part, or the inertia of a part is physically impossible.
    pub(super) fn of(spec: &HeadSpec, source: &Source) -> Result<Self, SpecError> {
        let bodies = spec
            .parts
            .iter()
            .enumerate()
            .map(|(index, part)| body_of(index, part, source))
            .collect::<Result<Vec<_>, _>>()?;
        if bodies.is_empty() {
            return Err(SpecError::about(source, "parts", "the head has no parts: give at least one"));
        }
        let mass_kg = bodies.iter().map(|b| b.mass_kg).sum::<f64>();
        let centre = bodies.iter().map(|b| b.centre_of_mass_in_head * b.mass_kg).sum::<Vector>() / mass_kg;
        let inertia = bodies.iter().map(|b| {
            // Parallel-axis theorem (Steiner): I + m (r^2 1 - r r^T).
            let r = b.centre_of_mass_in_head - centre;
            b.inertia_in_head + (Matrix::identity() * r.norm_squared() - r * r.transpose()) * b.mass_kg
        });
        Ok(Self { mass_kg, centre_of_mass_in_head: centre, inertia_in_head: inertia.sum() })
    }

    /// The mass matrix for the twist (velocity of the centre of mass, angular velocity).
    ///
    /// `rotation` takes the axes of the head to those in which the twist is expressed.
    pub fn mass_matrix(&self, rotation: &Matrix) -> Matrix6 {
        let inertia = rotation * self.inertia_in_head * rotation.transpose();
        blocks(&(Matrix::identity() * self.mass_kg), &Matrix::zeros(), &Matrix::zeros(), &inertia)
    }

    /// The pose of the head after a displacement of the centre of mass and a rotation about it.
    pub(super) fn displaced(&self, pose: &Pose, displacement: &Vector6) -> Pose {
        let (shift, turn) = split(displacement);
        let turn = Rotation::from_scaled_axis(turn);
        let arm = pose.rotation * self.centre_of_mass_in_head;
        let origin = arm + pose.translation.vector + shift - turn * arm;
        Pose::from_parts(origin.into(), turn * pose.rotation)
    }
}

fn body_of(index: usize, part: &PartSpec, source: &Source) -> Result<Body, SpecError> {
    match part {
        PartSpec::Block { mass_kg, size_m, centre_m, .. } => {
            let [x2, y2, z2] = size_m.map(|edge| edge * edge);
            let diagonal = Vector::new(y2 + z2, x2 + z2, x2 + y2) * (mass_kg / 12.0);
            Ok(Body {
                mass_kg: *mass_kg,
                centre_of_mass_in_head: Vector::from(*centre_m),
                inertia_in_head: Matrix::from_diagonal(&diagonal),
            })
        }
        PartSpec::Body { name, mass_kg, centre_of_mass_m, inertia_kg_m2: i } => {
            let inertia = Matrix::new(i.xx, i.xy, i.xz, i.xy, i.yy, i.yz, i.xz, i.yz, i.zz);
            let principal = inertia.symmetric_eigenvalues();
            // Each principal moment of a rigid body is positive and at most the sum of the other two.
            if principal.min() <= 0.0 || 2.0 * principal.max() > principal.sum() * (1.0 + 1e-9) {
                let name = name.clone().unwrap_or_else(|| format!("part {}", index + 1));
                let [a, b, c] = [principal.x, principal.y, principal.z];
                let message = format!(
                    "the inertia of \"{name}\" is physically impossible: the principal moments are {a:.3e}, {b:.3e} and \
                     {c:.3e} kg m^2; each must be positive and at most the sum of the other two"
                );
                return Err(SpecError::about(source, "inertia_kg_m2", message));
            }
            let centre_of_mass_in_head = Vector::from(*centre_of_mass_m);
            Ok(Body { mass_kg: *mass_kg, centre_of_mass_in_head, inertia_in_head: inertia })
        }
    }
}
