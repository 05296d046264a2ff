//! Preconditioned conjugate gradients for normal equations with many loop closures.
//!
//! If an area is revisited often, matches link times all over the recording, and the sparse Cholesky factor fills in: its cost
//! grows with the cube of the length. The same matches make the equations well conditioned after preconditioning with the
//! terms between neighbouring times. Conjugate gradients (Hestenes and Stiefel 1952; Golub and Van Loan 2013, 11.5.2) with the
//! factor of these terms need some dozens of matrix products.

/// A symmetric positive definite matrix and a preconditioner.
pub(super) trait PreconditionedSystem {
    /// Adds the product with `x` to `sum`.
    fn add_product(&self, x: &[f64], sum: &mut [f64]);
    /// Applies the inverse of the preconditioner to `z`.
    fn precondition(&self, z: &mut [f64]);
}

/// Convergence: the preconditioned norm of the residual has decreased by this factor.
const TOLERANCE: f64 = 1e-8;
/// A larger residual, up to this factor, is accepted if rounding errors prevent convergence.
const ACCEPTED_TOLERANCE: f64 = 1e-4;
/// Maximum number of iterations, one matrix product each; some dozens are usual.
const MAX_ITERATIONS: usize = 1000;

/// Solves `system` for the right-hand side `b`; `None` if the iteration does not converge.
pub(super) fn solve(system: &impl PreconditionedSystem, b: &[f64]) -> Option<Vec<f64>> {
    let (mut x, mut r, mut product) = (vec![0.0; b.len()], b.to_vec(), vec![0.0; b.len()]);
    let mut z = b.to_vec();
    system.precondition(&mut z);
    let mut direction = z.clone();
    let first = dot(&r, &z);
    let mut residual = first;
    for _ in 0..MAX_ITERATIONS {
        if residual <= TOLERANCE * TOLERANCE * first {
            return Some(x);
        }
        product.fill(0.0);
        system.add_product(&direction, &mut product);
        let step = residual / dot(&direction, &product);
        if !(step.is_finite() && step > 0.0) {
            break;
        }
        add_scaled(&mut x, &direction, step);
        add_scaled(&mut r, &product, -step);
        z.copy_from_slice(&r);
        system.precondition(&mut z);
        let before = std::mem::replace(&mut residual, dot(&r, &z));
        let ratio = residual / before;
        direction.iter_mut().zip(&z).for_each(|(along, z)| *along = z + ratio * *along);
    }
    (residual <= ACCEPTED_TOLERANCE * ACCEPTED_TOLERANCE * first).then_some(x)
}

fn add_scaled(into: &mut [f64], from: &[f64], scale: f64) {
    into.iter_mut().zip(from).for_each(|(sum, term)| *sum += scale * term);
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// A dense matrix, preconditioned with the diagonal.
    struct Dense(DMatrix<f64>);

    impl PreconditionedSystem for Dense {
        fn add_product(&self, x: &[f64], sum: &mut [f64]) {
            add_scaled(sum, (&self.0 * DVector::from_column_slice(x)).as_slice(), 1.0);
        }

        fn precondition(&self, z: &mut [f64]) {
            z.iter_mut().zip(self.0.diagonal().iter()).for_each(|(z, d)| *z /= d);
        }
    }

    fn dense(least: f64) -> Dense {
        let half = DMatrix::from_fn(40, 40, |r, c| ((r * r * 3 + c * 7 + r * c) as f64 * 0.61).sin());
        Dense(&half * half.transpose() + DMatrix::identity(40, 40) * least)
    }

    #[test]
    fn solution_matches_a_direct_solver() {
        let (system, b) = (dense(0.01), DVector::from_fn(40, |k, _| (k as f64).cos()));
        let expected = system.0.clone().lu().solve(&b).unwrap();
        let x = DVector::from_vec(solve(&system, b.as_slice()).unwrap());
        assert!((&x - &expected).norm() < 1e-6 * expected.norm(), "{x} {expected}");
        assert_eq!(solve(&system, &[0.0; 40]).unwrap(), [0.0; 40]);
    }

    #[test]
    fn indefinite_and_non_finite_systems_have_no_solution() {
        let b: Vec<f64> = (0..40).map(|k| f64::from(k).cos()).collect();
        assert_eq!(solve(&dense(-5.0), &b), None);
        assert_eq!(solve(&dense(f64::NAN), &b), None);
    }
}
