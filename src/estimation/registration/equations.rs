//! Normal equations of the trajectory correction, with separate local and loop-closure blocks.
//!
//! Local terms couple neighbouring knots; their factor preconditions the conjugate gradients. Remote terms couple any knots.

use super::band_cholesky::BandCholesky;
use super::block_matrix::BlockMatrix;
use super::conjugate_gradients::{self, PreconditionedSystem};
use crate::spline::Basis;
use nalgebra::{Cholesky, Const, Matrix6, SMatrix, SVector, Vector6};

/// Number of unknowns shared by all times: the range bias, m.
pub(super) const SHARED_DIMENSION: usize = 2;
/// Vector over the shared unknowns: a derivative or a step.
pub(super) type Shared = SVector<f64, SHARED_DIMENSION>;
/// Cross block: rows of a correction, columns of the shared unknowns.
pub(super) type SharedBlock = SMatrix<f64, 6, SHARED_DIMENSION>;

/// Maximum distance of two spline segments for a local term: open-loop motion couples adjacent segments.
const LOCAL_DISTANCE: i64 = 1;
/// Number of knots per segment of the cubic spline.
const KNOTS: usize = 4;

/// Normal equations of residuals that depend on the corrections at two times: `J^T W J` and `-J^T W e`.
#[derive(Debug, Clone, Default)]
pub(super) struct PairTerm {
    pub(super) first: UnaryTerm,
    pub(super) second: UnaryTerm,
    /// Cross block: rows of the first, columns of the second correction.
    pub(super) cross: Matrix6<f64>,
}

/// Normal equations of the correction at one time.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct UnaryTerm {
    pub(super) square: Matrix6<f64>,
    pub(super) right: Vector6<f64>,
    shared: SharedBlock,
}

/// Normal equations of the shared unknowns.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct SharedTerm {
    square: SMatrix<f64, SHARED_DIMENSION, SHARED_DIMENSION>,
    right: Shared,
}

impl PairTerm {
    /// Adds a residual `e` with derivatives by both corrections.
    pub(super) fn add(&mut self, by_first: &Vector6<f64>, by_second: &Vector6<f64>, e: f64, weight: f64) {
        let scaled = by_first * weight;
        self.cross += scaled * by_second.transpose();
        self.first.add(by_first, e, weight);
        self.second.add(by_second, e, weight);
    }
}

impl UnaryTerm {
    /// Adds a residual `e` with a derivative by the correction.
    pub(super) fn add(&mut self, by: &Vector6<f64>, e: f64, weight: f64) {
        let scaled = by * weight;
        self.square += scaled * by.transpose();
        self.right -= scaled * e;
    }

    /// Adds the cross block of a residual between the correction and the shared unknowns.
    pub(super) fn add_shared(&mut self, by: &Vector6<f64>, by_shared: &Shared, weight: f64) {
        self.shared += by * (by_shared * weight).transpose();
    }

    /// Adds another term.
    pub(super) fn merge(&mut self, other: &Self) {
        self.square += other.square;
        self.right += other.right;
        self.shared += other.shared;
    }
}

impl SharedTerm {
    /// Adds a residual `e` with a derivative by the shared unknowns.
    pub(super) fn add(&mut self, by: &Shared, e: f64, weight: f64) {
        let scaled = by * weight;
        self.square += scaled * by.transpose();
        self.right -= scaled * e;
    }

    /// Adds another term.
    pub(super) fn merge(&mut self, other: &Self) {
        self.square += other.square;
        self.right += other.right;
    }
}

/// Normal equations `H x = b` of the corrections `[dr, dt]` of all knots and of the shared unknowns.
#[derive(Debug, Clone)]
pub(super) struct Equations {
    first_knot: i64,
    /// Blocks of knots of one segment or of two adjacent ones; positive semidefinite.
    local: BlockMatrix,
    /// Blocks between segments that are not adjacent.
    remote: BlockMatrix,
    right: Vec<f64>,
    /// Cross blocks of each knot with the shared unknowns.
    shared: Vec<SharedBlock>,
    pub(super) shared_term: SharedTerm,
}

impl Equations {
    /// Empty equations of `knots` knots from `first_knot` on.
    ///
    /// Their pattern couples adjacent segments and the pairs of segments in `linked` (indices of their first knots).
    pub(super) fn new(first_knot: i64, knots: usize, linked: impl Iterator<Item = (i64, i64)>) -> Self {
        let coupled_knots = KNOTS - 1 + LOCAL_DISTANCE as usize;
        let local = (0..knots).map(|k| (k.saturating_sub(coupled_knots) as u32..=k as u32).collect()).collect();
        let mut remote = vec![Vec::new(); knots];
        let mut segments: Vec<(i64, i64)> =
            linked.filter(|(a, b)| !is_local(*a, *b)).map(|(a, b)| (a.min(b), a.max(b))).collect();
        segments.sort_unstable();
        segments.dedup();
        for (early, late) in segments {
            let (early, late) = ((early - first_knot) as usize, (late - first_knot) as usize);
            for (row, column) in
                (late..late + KNOTS).flat_map(|row| (early..early + KNOTS).map(move |column| (row, column)))
            {
                remote[row.max(column)].push(row.min(column) as u32);
            }
        }
        let shared = vec![SMatrix::zeros(); knots];
        let (local, remote) = (BlockMatrix::new(local), BlockMatrix::new(remote));
        Self { first_knot, local, remote, right: vec![0.0; 6 * knots], shared, shared_term: SharedTerm::default() }
    }

    /// Sets all numbers to zero.
    pub(super) fn clear(&mut self) {
        self.local.clear();
        self.remote.clear();
        self.right.fill(0.0);
        self.shared.fill(SMatrix::zeros());
        self.shared_term = SharedTerm::default();
    }

    /// Indices and values of the knots at the time of `basis`.
    pub(super) fn knots_of(&self, basis: &Basis) -> [(usize, f64); KNOTS] {
        let first = (basis.first - self.first_knot) as usize;
        std::array::from_fn(|a| (first + a, basis.value[a]))
    }

    /// Adds a term of the correction at the time of `basis`.
    pub(super) fn add_unary(&mut self, basis: &Basis, unary: &UnaryTerm) {
        let knots = self.knots_of(basis);
        for (k, (row, value)) in knots.iter().enumerate() {
            for (sum, term) in self.right[6 * row..6 * row + 6].iter_mut().zip(unary.right.iter()) {
                *sum += value * term;
            }
            for (column, other) in &knots[..=k] {
                // `BlockMatrix::add` adds a diagonal block twice.
                let by = value * other * if row == column { 0.5 } else { 1.0 };
                self.local.add(*row, *column, &(unary.square * by));
            }
            self.shared[*row] += unary.shared * *value;
        }
    }

    /// Adds a cross block between the corrections at two times.
    pub(super) fn add_cross(&mut self, first: &Basis, second: &Basis, cross: &Matrix6<f64>) {
        let (firsts, seconds) = (self.knots_of(first), self.knots_of(second));
        let into = if is_local(first.first, second.first) { &mut self.local } else { &mut self.remote };
        for (row, value) in firsts {
            for (column, other) in seconds {
                into.add(row, column, &(cross * (value * other)));
            }
        }
    }

    /// Adds `value` to every diagonal entry.
    pub(super) fn add_diagonal(&mut self, value: f64) {
        self.local.add_diagonal(value);
        self.shared_term.square += SMatrix::identity() * value;
    }

    /// Solves for the knots and the shared unknowns; `None` if the equations are singular.
    pub(super) fn solve(&self) -> Option<(Vec<f64>, Shared)> {
        let system = LocallyPreconditioned {
            equations: self,
            local: self.local.factor()?,
            shared_term: self.shared_term.square.cholesky()?,
        };
        let mut right = self.right.clone();
        right.extend(self.shared_term.right.iter());
        let mut x = conjugate_gradients::solve(&system, &right)?;
        let shared = Shared::from_iterator(x.drain(self.right.len()..));
        Some((x, shared))
    }

    /// Blocks of the lower triangle between knots: row, column, block. Blocks of the same knots may repeat, and add.
    pub(super) fn blocks(&self) -> impl Iterator<Item = (usize, usize, &Matrix6<f64>)> {
        self.local.iter().chain(self.remote.iter())
    }

    /// Blocks between each knot and the shared unknowns, and that of the shared unknowns.
    pub(super) fn shared_blocks(&self) -> (&[SharedBlock], &SMatrix<f64, SHARED_DIMENSION, SHARED_DIMENSION>) {
        (&self.shared, &self.shared_term.square)
    }
}

fn is_local(first: i64, second: i64) -> bool {
    (first - second).abs() <= LOCAL_DISTANCE
}

/// Equations with a preconditioner: the local blocks and, separately, the block of the shared unknowns.
struct LocallyPreconditioned<'a> {
    equations: &'a Equations,
    local: BandCholesky,
    shared_term: Cholesky<f64, Const<SHARED_DIMENSION>>,
}

impl PreconditionedSystem for LocallyPreconditioned<'_> {
    fn add_product(&self, x: &[f64], sum: &mut [f64]) {
        let Equations { local, remote, right, shared, shared_term, .. } = self.equations;
        let (knots, x_shared) = x.split_at(right.len());
        let (into, into_shared) = sum.split_at_mut(right.len());
        local.add_product(knots, into);
        remote.add_product(knots, into);
        let x_shared = Shared::from_column_slice(x_shared);
        let mut by_shared = shared_term.square * x_shared;
        for (of_knot, (unary, into)) in shared.iter().zip(knots.chunks_exact(6).zip(into.chunks_exact_mut(6))) {
            by_shared += of_knot.tr_mul(&Vector6::from_column_slice(unary));
            into.iter_mut().zip(&(of_knot * x_shared)).for_each(|(sum, term)| *sum += term);
        }
        into_shared.iter_mut().zip(&by_shared).for_each(|(sum, term)| *sum += term);
    }

    fn precondition(&self, z: &mut [f64]) {
        let (knots, shared) = z.split_at_mut(self.equations.right.len());
        self.local.solve_in_place(knots);
        let solved = self.shared_term.solve(&Shared::from_column_slice(shared));
        shared.copy_from_slice(solved.as_slice());
    }
}

#[cfg(test)]
mod tests {
    use super::super::reduction::Reduction;
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::{DMatrix, DVector};
    use zsim_base::geometry::Vector;

    fn wave(k: usize) -> Vector6<f64> {
        Vector6::from_fn(|r, _| ((k * 7 + r * r * 3 + r * k) as f64 * 0.41).sin())
    }

    /// Equations and the same with a dense Jacobian of every residual: `J^T W J + I` and `-J^T W e`.
    struct Example {
        equations: Equations,
        dense: DMatrix<f64>,
        right: DVector<f64>,
        bases: [(Basis, Basis); 5],
    }

    const FIRST_KNOT: i64 = -1;
    const OF_KNOTS: usize = 6 * 13;
    const SIZE: usize = OF_KNOTS + SHARED_DIMENSION;

    fn example() -> Example {
        let times_s = [(0.1, 5.9), (0.2, 0.4), (3.0, 3.6), (5.5, 1.2), (2.2, 4.1)];
        let bases = times_s.map(|(a, b)| (Basis::at(a, 0.7), Basis::at(b, 0.7)));
        let mut equations = Equations::new(FIRST_KNOT, OF_KNOTS / 6, bases.iter().map(|(a, b)| (a.first, b.first)));
        let (mut dense, mut right) = (DMatrix::<f64>::identity(SIZE, SIZE), DVector::<f64>::zeros(SIZE));
        for (k, (a, b)) in bases.iter().enumerate() {
            let mut pair_term = PairTerm::default();
            for m in 0..5 {
                let (by_a, by_b, e, weight) = (wave(k + 9 * m), wave(k + 50 + m), 0.3 * m as f64 - 0.5, 2.0 + k as f64);
                let by_shared = Shared::from_fn(|r, _| ((k * 5 + r * 3 + m) as f64 * 0.7).cos());
                pair_term.add(&by_a, &by_b, e, weight);
                pair_term.first.add_shared(&by_a, &by_shared, weight);
                pair_term.second.add_shared(&by_b, &by_shared, weight);
                equations.shared_term.add(&by_shared, e, weight);
                let mut row = at_time(a).tr_mul(&by_a) + at_time(b).tr_mul(&by_b);
                row.rows_mut(OF_KNOTS, SHARED_DIMENSION).copy_from(&by_shared);
                dense += &row * row.transpose() * weight;
                right -= row * (e * weight);
            }
            equations.add_unary(a, &pair_term.first);
            equations.add_unary(b, &pair_term.second);
            equations.add_cross(a, b, &pair_term.cross);
        }
        equations.add_diagonal(1.0);
        Example { equations, dense, right, bases }
    }

    /// The correction at a time, by the unknowns.
    fn at_time(basis: &Basis) -> DMatrix<f64> {
        let mut rows = DMatrix::<f64>::zeros(6, SIZE);
        for (c, value) in basis.value.iter().enumerate() {
            let at = 6 * ((basis.first - FIRST_KNOT) as usize + c);
            rows.view_mut((0, at), (6, 6)).fill_diagonal(*value);
        }
        rows
    }

    #[test]
    fn solution_matches_the_dense_equations() {
        let Example { equations, dense, right, .. } = example();
        let expected = dense.lu().solve(&right).unwrap();
        let (x, shared) = equations.solve().unwrap();
        let solved = DVector::from_iterator(SIZE, x.iter().chain(shared.iter()).copied());
        assert!((&solved - &expected).norm() < 1e-6 * expected.norm(), "{solved} {expected}");
        // The shared unknowns depend on all knots and are the harder part.
        for (x, y) in shared.iter().zip(expected.iter().skip(OF_KNOTS)) {
            assert_relative_eq!(x, y, max_relative = 1e-5);
        }
    }

    #[test]
    fn covariances_are_those_of_the_dense_equations_and_smaller_with_fewer_nodes() {
        let Example { equations, dense, bases, .. } = example();
        let (inverse, times) = (dense.try_inverse().unwrap(), bases.map(|(a, _)| a));
        let positions: Vec<Vector> = (0..OF_KNOTS / 6).map(|k| Vector::new(k as f64, (k as f64).sin(), 0.0)).collect();
        let of_all = Reduction::new(&positions, OF_KNOTS / 6).covariances(&equations, &times).unwrap();
        let of_few = Reduction::new(&positions, 5).covariances(&equations, &times).unwrap();
        let first = at_time(&times[0]);
        for ((basis, found), few) in times.iter().zip(of_all).zip(of_few) {
            let between = |other: &DMatrix<f64>| {
                let between = at_time(basis) * &inverse * other.transpose();
                Matrix6::from_column_slice(between.as_slice())
            };
            assert_relative_eq!(found.own, between(&at_time(basis)), epsilon = 1e-12);
            assert_relative_eq!(found.with_first, between(&first), epsilon = 1e-12);
            let excess = (found.own - few.own).symmetric_eigenvalues();
            assert!(excess.min() > -1e-12 && excess.max() > 1e-3, "{excess}");
        }
    }

    #[test]
    fn singular_equations_have_no_solution() {
        let singular = Equations::new(0, 5, std::iter::empty());
        assert_eq!(singular.solve(), None);
        let reduction = Reduction::new(&[Vector::zeros(); 5], 3);
        assert_eq!(reduction.covariances(&singular, &[Basis::at(0.3, 1.0)]), None);
    }
}
