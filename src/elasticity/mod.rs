//! Stiffness and force law of springs from geometry and load; pure mechanics.
//!
//! A spring connects two frames: the clamped *base* and the *top*. In both, z points along the straight spring from
//! base to top. A *wrench* is a force and a torque about the top; a *twist* is the velocity and angular velocity of the
//! top. Both are columns of six in the axes of the base, translation first.
//!
//! - [`Coil`]: a helical spring as a column with axial, torsional, bending and shear rigidity.
//! - [`loaded_stiffness`]: the effect of an axial load on the stiffness of such a column (Haringx).
//! - [`Deformation`]: the displacement of the top in corotational coordinates.
//! - [`Spring`]: the force law for large rotations: one or several elements, each with a potential in those
//!   coordinates, so that energy is conserved exactly; the nodes between elements are massless and in equilibrium.

mod chain;
mod coil;
mod deformation;
mod element;
mod error;
mod haringx;
mod spec;
mod spring;

pub use coil::{Coil, Moduli};
pub use deformation::{Deformation, blocks, split, stack};
pub use element::Element;
pub use error::ElasticityError;
pub use haringx::{Column, buckling_load_n, loaded_stiffness};
pub use spec::{Density, Material, SpringDesign, SpringSpec, StiffnessRow};
pub use spring::{MAX_SEGMENTS, Spring, SpringState};

/// A wrench, a twist, or a small displacement: translation, then rotation.
pub type Vector6 = nalgebra::Vector6<f64>;
/// A stiffness, damping or mass matrix: maps one [`Vector6`] to another.
pub type Matrix6 = nalgebra::Matrix6<f64>;

/// The smallest eigenvalue of a symmetric matrix after scaling to unit diagonal.
///
/// The scaling makes metres and radians comparable: 1 for a diagonal matrix, 0 for a singular one, negative for an
/// indefinite one. Returns -1 if a diagonal entry is zero or negative.
pub fn conditioning(matrix: &Matrix6) -> f64 {
    if matrix.diagonal().iter().any(|d| d.is_nan() || *d <= 0.0) {
        return -1.0;
    }
    let scale = matrix.diagonal().map(|d| 1.0 / d.sqrt());
    let scaled = Matrix6::from_fn(|i, j| 0.5 * (matrix[(i, j)] + matrix[(j, i)]) * scale[i] * scale[j]);
    scaled.symmetric_eigenvalues().min()
}
