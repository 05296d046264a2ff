//! Covariances of the corrections, from normal equations with fewer unknowns.
//!
//! Some of the knots are nodes. Between two nodes a knot moves as part of both rigid bodies, weighted by its distance to each:
//!
//! ```text
//! dr_k = sum w_j dr_j        dt_k = sum w_j (dt_j + dr_j x (t_k - t_j))
//! ```
//!
//! (rigid body modes of the smoothed aggregation in multigrid methods: Vanek, Mandel and Brezina 1996). A correction that varies
//! faster than the nodes counts as impossible, so the covariance is too small by its variance.

use super::equations::{Equations, SHARED_DIMENSION};
use crate::spline::Basis;
use nalgebra::{DMatrix, Matrix6, SMatrix};
use zsim_base::geometry::{Vector, skew};

/// Covariances of a correction `[dr, dt]`, rad and m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CorrectionCovariance {
    pub(super) own: Matrix6<f64>,
    /// Rows of the correction, columns of the first one.
    pub(super) with_first: Matrix6<f64>,
}

/// The corrections of all knots as a function of those of the nodes.
#[derive(Debug, Clone)]
pub(super) struct Reduction {
    nodes: usize,
    /// The nodes before and after each knot, with the derivative of the knot's correction by the node's.
    shares: Vec<[(usize, Matrix6<f64>); 2]>,
}

impl Reduction {
    /// At most `max_nodes` (two or more) of the knots at `positions` (m, two or more), evenly distributed, with the first and the last.
    pub(super) fn new(positions: &[Vector], max_nodes: usize) -> Self {
        let (last, nodes) = (positions.len() - 1, positions.len().min(max_nodes));
        let knot_of = |node: usize| node * last / (nodes - 1);
        let shares = (0..nodes - 1).flat_map(|node| {
            let (before, after) = (knot_of(node), knot_of(node + 1));
            // The last knot belongs to the last pair of nodes.
            let until = if node + 2 == nodes { after + 1 } else { after };
            (before..until).map(move |knot| {
                let weight = (knot - before) as f64 / (after - before) as f64;
                let share =
                    |node: usize, at: usize, weight: f64| (node, carried(&(positions[knot] - positions[at])) * weight);
                [share(node, before, 1.0 - weight), share(node + 1, after, weight)]
            })
        });
        Self { nodes, shares: shares.collect() }
    }

    /// Covariance of the correction at the times of `bases`, and with the correction at the first of them.
    ///
    /// `None` if the equations are singular.
    pub(super) fn covariances(&self, equations: &Equations, bases: &[Basis]) -> Option<Vec<CorrectionCovariance>> {
        let factor = self.information(equations).cholesky()?;
        // With the factor `L` of the information and the derivatives `S` of all corrections: `S (L L^T)^-1 S^T = W^T W`.
        let mut white = DMatrix::zeros(factor.l_dirty().nrows(), 6 * bases.len());
        for (at, basis) in bases.iter().enumerate() {
            for (node, by) in self.at(equations, basis) {
                white.fixed_view_mut::<6, 6>(6 * node, 6 * at).copy_from(&by.transpose());
            }
        }
        factor.l_dirty().solve_lower_triangular_mut(&mut white).then_some(())?;
        let of_time = |at: usize| white.fixed_columns::<6>(6 * at);
        let between = |at: usize, other: usize| of_time(at).tr_mul(&of_time(other));
        let covariance = |at| CorrectionCovariance { own: between(at, at), with_first: between(at, 0) };
        Some((0..bases.len()).map(covariance).collect())
    }

    /// The correction at the time of `basis` as a function of those of the nodes.
    fn at(&self, equations: &Equations, basis: &Basis) -> Shares {
        let mut shares = Shares::new();
        for (knot, value) in equations.knots_of(basis) {
            for (node, by) in &self.shares[knot] {
                match shares.iter_mut().find(|(other, _)| other == node) {
                    Some((_, sum)) => *sum += by * value,
                    None => shares.push((*node, by * value)),
                }
            }
        }
        shares
    }

    /// The normal equations of the nodes, and of the shared unknowns after them.
    fn information(&self, equations: &Equations) -> DMatrix<f64> {
        let of_nodes = 6 * self.nodes;
        let mut information = DMatrix::zeros(of_nodes + SHARED_DIMENSION, of_nodes + SHARED_DIMENSION);
        for (row, column, block) in equations.blocks() {
            for (node, by) in &self.shares[row] {
                for (other, by_other) in &self.shares[column] {
                    let product = by.tr_mul(&(block * by_other));
                    add(&mut information, 6 * node, 6 * other, &product);
                    if row != column {
                        add(&mut information, 6 * other, 6 * node, &product.transpose());
                    }
                }
            }
        }
        let (of_knots, square) = equations.shared_blocks();
        for (block, shares) in of_knots.iter().zip(&self.shares) {
            for (node, by) in shares {
                add(&mut information, of_nodes, 6 * node, &by.tr_mul(block).transpose());
            }
        }
        add(&mut information, of_nodes, of_nodes, square);
        information
    }
}

/// Nodes, each with the derivative of a correction by the node's.
type Shares = Vec<(usize, Matrix6<f64>)>;

/// Derivative of the correction of a point of a rigid body, `lever` away from the body's origin, m.
pub(super) fn carried(lever: &Vector) -> Matrix6<f64> {
    let mut carried = Matrix6::identity();
    carried.fixed_view_mut::<3, 3>(3, 0).copy_from(&-skew(lever));
    carried
}

fn add<const R: usize, const C: usize>(into: &mut DMatrix<f64>, row: usize, column: usize, block: &SMatrix<f64, R, C>) {
    for (c, of_column) in block.column_iter().enumerate() {
        for (r, value) in of_column.iter().enumerate() {
            into[(row + r, column + c)] += value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::Vector6;

    #[test]
    fn knots_move_with_the_rigid_body_of_their_nodes() {
        let positions: Vec<Vector> = (0..11).map(|k| Vector::new(f64::from(k), f64::from(k * k) * 0.1, 0.3)).collect();
        let motion = Vector6::new(1e-3, -2e-3, 3e-3, 0.01, 0.02, -0.01);
        for nodes in [2, 3, 4, 11, 20] {
            let reduction = Reduction::new(&positions, nodes);
            assert_eq!((reduction.nodes, reduction.shares.len()), (nodes.min(11), 11));
            let of_node = |node: usize| carried(&positions[node * 10 / (reduction.nodes - 1)]) * motion;
            for (position, shares) in positions.iter().zip(&reduction.shares) {
                let found: Vector6<f64> = shares.iter().map(|(node, by)| by * of_node(*node)).sum();
                assert_relative_eq!(found, carried(position) * motion, epsilon = 1e-15);
            }
        }
    }
}
