//! Vectors and matrices of translation and rotation together.

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
