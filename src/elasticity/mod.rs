//! A spring's stiffness from its geometry and load: pure mechanics, no engine.
//!
//! A spring stands between two frames: its base, clamped, and its *top*, at its other end; in both z points along the
//! unbent spring, from base to top. A *wrench* is a force and a torque about the top, a *twist* the top's velocity and
//! angular velocity, both written in the base's frame as columns of six: translation first.
//!
//! - [`Coil`]: a helical spring as a column with axial, torsional, bending and shear rigidity.
//! - [`loaded_stiffness`]: what an axial load does to such a column (Haringx).
//! - [`Deformation`]: how far the top is from where it would rest, in coordinates that turn with the spring.
//! - [`Spring`]: the force law for large turns: one or several elements, each with a potential in those coordinates, so
//!   that energy is conserved exactly; the nodes between them have no mass and are always in equilibrium.

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
pub use spring::{MOST_SEGMENTS, Spring, SpringState};

/// A wrench, a twist, or a small displacement: translation, then rotation.
pub type Vector6 = nalgebra::Vector6<f64>;
/// A stiffness, a damping, a mass: what takes one [`Vector6`] to another.
pub type Matrix6 = nalgebra::Matrix6<f64>;

/// The least eigenvalue of a symmetric matrix after its rows and columns are scaled to a unit diagonal, so that metres
/// and radians compare: from 1 (diagonal) down to 0 (singular) and below.
///
/// Meaningful for a positive diagonal alone; an entry of the diagonal at or below zero is returned as minus one.
pub fn conditioning(matrix: &Matrix6) -> f64 {
    if matrix.diagonal().iter().any(|d| d.is_nan() || *d <= 0.0) {
        return -1.0;
    }
    let scale = matrix.diagonal().map(|d| 1.0 / d.sqrt());
    let scaled = Matrix6::from_fn(|i, j| 0.5 * (matrix[(i, j)] + matrix[(j, i)]) * scale[i] * scale[j]);
    scaled.symmetric_eigenvalues().min()
}
