//! Conjugate gradients for equations too linked to be factored.
//!
//! Where one place is seen again and again, each stretch of time hangs together with stretches all over the recording,
//! and a sparse factor fills up: its work grows with the cube of the length. For the same reason such equations are
//! well conditioned once what hangs together in time is solved for. Conjugate gradients, preconditioned by the factor
//! of that (Hestenes and Stiefel 1952; Golub and Van Loan 2013, 11.5.2), need some dozens of products with the matrix.

/// A symmetric positive definite matrix, and one near it that is easily solved.
pub(super) trait System {
    /// Adds the product with `x` to `sum`.
    fn add_product(&self, x: &[f64], sum: &mut [f64]);
    /// Makes of the right side in `z` the solution of the near one.
    fn solve_near(&self, z: &mut [f64]);
}

/// Solved, when the residual as the near matrix weighs it is such a part of what it was; and solved well enough, when
/// rounding permits no more.
const SOLVED: f64 = 1e-8;
const PASSABLE: f64 = 1e-4;
/// So many products with the matrix at most.
const MOST_PRODUCTS: usize = 1000;

/// The solution of `system` for the right side `b`, or nothing where it is not found.
pub(super) fn solve(system: &impl System, b: &[f64]) -> Option<Vec<f64>> {
    let (mut x, mut r, mut product) = (vec![0.0; b.len()], b.to_vec(), vec![0.0; b.len()]);
    let mut z = b.to_vec();
    system.solve_near(&mut z);
    let mut direction = z.clone();
    let first = dot(&r, &z);
    let mut left = first;
    for _ in 0..MOST_PRODUCTS {
        if left <= SOLVED * SOLVED * first {
            return Some(x);
        }
        product.fill(0.0);
        system.add_product(&direction, &mut product);
        let step = left / dot(&direction, &product);
        if !(step.is_finite() && step > 0.0) {
            break;
        }
        add_scaled(&mut x, &direction, step);
        add_scaled(&mut r, &product, -step);
        z.copy_from_slice(&r);
        system.solve_near(&mut z);
        let before = std::mem::replace(&mut left, dot(&r, &z));
        let kept = left / before;
        direction.iter_mut().zip(&z).for_each(|(along, z)| *along = z + kept * *along);
    }
    (left <= PASSABLE * PASSABLE * first).then_some(x)
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

    /// A dense matrix with its diagonal for the near one.
    struct Dense(DMatrix<f64>);

    impl System for Dense {
        fn add_product(&self, x: &[f64], sum: &mut [f64]) {
            add_scaled(sum, (&self.0 * DVector::from_column_slice(x)).as_slice(), 1.0);
        }

        fn solve_near(&self, z: &mut [f64]) {
            z.iter_mut().zip(self.0.diagonal().iter()).for_each(|(z, d)| *z /= d);
        }
    }

    fn dense(least: f64) -> Dense {
        let half = DMatrix::from_fn(40, 40, |r, c| ((r * r * 3 + c * 7 + r * c) as f64 * 0.61).sin());
        Dense(&half * half.transpose() + DMatrix::identity(40, 40) * least)
    }

    #[test]
    fn the_solution_is_that_of_a_direct_solver() {
        let (system, b) = (dense(0.01), DVector::from_fn(40, |k, _| (k as f64).cos()));
        let expected = system.0.clone().lu().solve(&b).unwrap();
        let x = DVector::from_vec(solve(&system, b.as_slice()).unwrap());
        assert!((&x - &expected).norm() < 1e-6 * expected.norm(), "{x} {expected}");
        assert_eq!(solve(&system, &[0.0; 40]).unwrap(), [0.0; 40]);
    }

    #[test]
    fn what_is_not_positive_definite_or_finite_has_no_solution() {
        let b: Vec<f64> = (0..40).map(|k| f64::from(k).cos()).collect();
        assert_eq!(solve(&dense(-5.0), &b), None);
        assert_eq!(solve(&dense(f64::NAN), &b), None);
    }
}
