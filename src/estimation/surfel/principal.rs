//! Principal axes of the points of a surfel.

use std::f64::consts::FRAC_PI_3;
use zsim_base::geometry::{Matrix, Vector};

/// The eigenvalues of a symmetric matrix, smallest first.
///
/// In closed form by the angle of the characteristic polynomial (Smith, Communications of the ACM 4(4), 1961), since each
/// cell needs them and an iteration takes several times as long. Two eigenvalues that are almost equal have errors of about
/// 1e-8 of the largest, others of less than 1e-13.
pub(super) fn eigenvalues(m: &Matrix) -> [f64; 3] {
    let mean = m.trace() / 3.0;
    let off_diagonal = m.m21 * m.m21 + m.m31 * m.m31 + m.m32 * m.m32;
    let [x, y, z] = [m.m11 - mean, m.m22 - mean, m.m33 - mean];
    let scale = ((x * x + y * y + z * z + 2.0 * off_diagonal) / 6.0).sqrt();
    if scale == 0.0 {
        return [mean; 3];
    }
    let determinant =
        x * (y * z - m.m32 * m.m32) - m.m21 * (m.m21 * z - m.m32 * m.m31) + m.m31 * (m.m21 * m.m32 - y * m.m31);
    let cosine = (0.5 * determinant / (scale * scale * scale)).clamp(-1.0, 1.0);
    // From `libm`, whose rounding does not depend on the machine.
    let angle = libm::acos(cosine) / 3.0;
    let largest = mean + 2.0 * scale * libm::cos(angle);
    let smallest = mean + 2.0 * scale * libm::cos(angle + 2.0 * FRAC_PI_3);
    [smallest, 3.0 * mean - smallest - largest, largest]
}

/// The unit eigenvector of a simple eigenvalue; `None` for a multiple one.
pub(super) fn eigenvector(m: &Matrix, eigenvalue: f64) -> Option<Vector> {
    let shifted = m - Matrix::from_diagonal_element(eigenvalue);
    let (a, b, c) = (shifted.column(0), shifted.column(1), shifted.column(2));
    // All columns are perpendicular to it; the longest product is that of the two that differ most in direction.
    let products = [a.cross(&b), b.cross(&c), c.cross(&a)];
    let longest = products.into_iter().max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()))?;
    longest.try_normalize(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::geometry::from_roll_pitch_yaw;

    /// Covariances of thin patches, and of patches that are round or long, in several directions.
    #[test]
    fn principal_axes_are_those_of_the_construction() {
        let shapes =
            [[1e-5, 3e-3, 9e-3], [0.0, 4e-3, 4e-3], [2e-4, 2e-3, 8e-2], [1e-6, 1e-4, 1e-2], [1e-12, 1e-4, 2e-4]];
        for (k, shape) in shapes.iter().enumerate() {
            for turn in 0..50 {
                let wave = |rate: f64| 3.0 * (f64::from(turn) * rate + k as f64).sin();
                let axes = from_roll_pitch_yaw(wave(0.7), wave(1.1), wave(1.9)).to_rotation_matrix().into_inner();
                let matrix = axes * Matrix::from_diagonal(&Vector::from(*shape)) * axes.transpose();
                let found = eigenvalues(&matrix);
                let differs = |k: usize, l: usize| (shape[k] - shape[l]).abs() > 1e-2 * shape[2];
                for (k, is_simple) in
                    [differs(0, 1), differs(0, 1) && differs(1, 2), differs(1, 2)].into_iter().enumerate()
                {
                    let tolerance = if is_simple { 1e-13 } else { 3e-8 };
                    assert_relative_eq!(found[k], shape[k], epsilon = tolerance * shape[2]);
                }
                let normal = eigenvector(&matrix, found[0]).unwrap();
                // An error of the eigenvalue turns the vector by the error over the distance to the next one.
                let aligned = normal.dot(&axes.column(0)).abs();
                assert!(1.0 - aligned < 1e-14, "{shape:?}: {aligned}");
            }
        }
    }

    #[test]
    fn equal_eigenvalues_have_no_eigenvector() {
        assert_eq!(eigenvalues(&(Matrix::identity() * 2.0)), [2.0; 3]);
        assert!(eigenvector(&(Matrix::identity() * 2.0), 2.0).is_none());
        let line = Matrix::from_diagonal(&Vector::new(1e-4, 1e-4, 1e-2));
        let found = eigenvalues(&line);
        assert_relative_eq!(found[0], 1e-4, epsilon = 1e-9);
        assert_relative_eq!(found[2], 1e-2, epsilon = 1e-15);
    }
}
