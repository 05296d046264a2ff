//! Elements end to end; the nodes between them have no mass and are in equilibrium.

use super::deformation::{blocks, split, stack};
use super::{Deformation, ElasticityError, Element, Matrix6, Vector6};
use crate::geometry::{Matrix, Pose, Rotation, Vector, left_jacobian, skew};

/// Iterations after which a chain has no equilibrium.
const MOST_ITERATIONS: usize = 100;

/// Residual of the inner nodes that counts as none, in parts of the segment's stiffness times the spring's length.
const TOLERANCE: f64 = 1e-12;

/// The nodes of a chain, from the base (0) to the top (N), and Newton's matrix about where they last were.
///
/// The residual of a node is the wrench on it, about it, written in the base: that of the element below on its top, and
/// that of the element above on its base. The matrix is block tridiagonal, and is kept from step to step for as long as
/// it still brings the residual down tenfold.
#[derive(Debug, Clone)]
pub(super) struct Chain {
    nodes: Vec<Pose>,
    residual: Vec<Vector6>,
    on_top: Vector6,
    /// Whether the nodes are where a search ended well.
    settled: bool,
    matrix: Option<Matrices>,
}

/// The elimination of the block tridiagonal matrix: per inner node the inverse of its pivot, and its two neighbours'
/// blocks.
#[derive(Debug, Clone)]
struct Matrices {
    pivot: Vec<Matrix6>,
    below: Vec<Matrix6>,
    above: Vec<Matrix6>,
}

impl Chain {
    pub(super) fn new(segments: usize) -> Self {
        let inner = segments - 1;
        Self {
            nodes: vec![Pose::identity(); segments + 1],
            residual: vec![Vector6::zeros(); inner],
            on_top: Vector6::zeros(),
            settled: false,
            matrix: None,
        }
    }

    /// The wrench on the top, about it, in the base.
    pub(super) fn wrench_on_top(&self) -> Vector6 {
        self.on_top
    }

    pub(super) fn potential_j(&self, element: &Element) -> f64 {
        let segments = self.nodes.windows(2).map(|ends| ends[0].inv_mul(&ends[1]));
        segments.map(|one_from_next| element.potential_j(&Deformation::of(&one_from_next).coordinates)).sum()
    }

    /// Moves the inner nodes to where they are in equilibrium with the top at `base_from_top`: from where they last
    /// were, or, should that fail, from an arc.
    pub(super) fn settle(
        &mut self,
        element: &Element,
        length_m: f64,
        base_from_top: &Pose,
        deformation: &Deformation,
    ) -> Result<(), ElasticityError> {
        let segments = self.nodes.len() - 1;
        self.nodes[segments] = *base_from_top;
        if self.settled && self.iterate(element, length_m).is_ok() {
            return Ok(());
        }
        self.matrix = None;
        self.lay_along_an_arc(&deformation.coordinates);
        let found = self.iterate(element, length_m);
        self.settled = found.is_ok();
        found
    }

    /// Newton's method for the inner nodes from where they are.
    fn iterate(&mut self, element: &Element, length_m: f64) -> Result<(), ElasticityError> {
        let tolerance_n = TOLERANCE * element.stiffness().m33 * length_m;
        let mut size_n = self.find_residual(element, length_m);
        for _ in 0..MOST_ITERATIONS {
            if size_n <= tolerance_n {
                return Ok(());
            }
            if self.matrix.is_none() {
                self.matrix = Some(self.linearise(element)?);
            }
            self.advance(length_m);
            let before_n = std::mem::replace(&mut size_n, self.find_residual(element, length_m));
            if size_n.is_nan() || size_n > 0.1 * before_n {
                self.matrix = None;
            }
        }
        Err(ElasticityError::InnerNodes { segments: self.nodes.len() - 1, residual_n: size_n })
    }

    /// Puts the inner nodes on the helix of constant curvature from base to top: close to equilibrium wherever loads
    /// are.
    fn lay_along_an_arc(&mut self, coordinates: &Vector6) {
        let segments = self.nodes.len() - 1;
        let (a, theta) = split(coordinates);
        for (k, node) in self.nodes.iter_mut().enumerate().take(segments) {
            let share = k as f64 / segments as f64;
            let turned = theta * share;
            let place = left_jacobian(&turned) * a * share;
            *node = Pose::from_parts(place.into(), Rotation::from_scaled_axis(turned));
        }
    }

    /// Residuals of the inner nodes; returns the greatest force, a torque counted over the spring's length.
    fn find_residual(&mut self, element: &Element, length_m: f64) -> f64 {
        let segments = self.nodes.len() - 1;
        self.residual.fill(Vector6::zeros());
        for k in 0..segments {
            let below_from_above = self.nodes[k].inv_mul(&self.nodes[k + 1]);
            let wrench = element.wrench(&below_from_above);
            let reaction = Element::reaction(&below_from_above, &wrench);
            let rotation = &self.nodes[k].rotation;
            if k > 0 {
                self.residual[k - 1] += turn(rotation, &reaction);
            }
            match self.residual.get_mut(k) {
                Some(residual) => *residual += turn(rotation, &wrench),
                None => self.on_top = turn(rotation, &wrench),
            }
        }
        let size = |r: &Vector6| {
            let (force, torque) = split(r);
            force.amax().max(torque.amax() / length_m)
        };
        // `max` of f64 would hide a NaN.
        self.residual.iter().map(size).fold(0.0, |most, s| if s > most || s.is_nan() { s } else { most })
    }

    /// Newton's matrix here, eliminated from the base up.
    fn linearise(&self, element: &Element) -> Result<Matrices, ElasticityError> {
        let segments = self.nodes.len() - 1;
        let tangents: Vec<Tangent> =
            self.nodes.windows(2).map(|ends| Tangent::of(element, &ends[0], &ends[1])).collect();
        let mut matrix = Matrices { pivot: Vec::new(), below: Vec::new(), above: Vec::new() };
        for k in 1..segments {
            let (under, over) = (&tangents[k - 1], &tangents[k]);
            let mut diagonal = under.top_by_top + over.base_by_base;
            if let (Some(pivot), Some(above)) = (matrix.pivot.last(), matrix.above.last()) {
                diagonal -= under.top_by_base * pivot * above;
            }
            let pivot = diagonal.try_inverse().ok_or(ElasticityError::InnerNodes { segments, residual_n: f64::NAN })?;
            matrix.pivot.push(pivot);
            matrix.below.push(under.top_by_base);
            matrix.above.push(over.base_by_top);
        }
        Ok(matrix)
    }

    /// One step of Newton's method, at most half a radian and a quarter of the length a node.
    fn advance(&mut self, length_m: f64) {
        let Some(matrix) = &self.matrix else { return };
        let inner = self.residual.len();
        for k in 1..inner {
            let carried = matrix.below[k] * (matrix.pivot[k - 1] * self.residual[k - 1]);
            self.residual[k] -= carried;
        }
        for k in (0..inner).rev() {
            let from_above = if k + 1 < inner { matrix.above[k] * self.residual[k + 1] } else { Vector6::zeros() };
            self.residual[k] = matrix.pivot[k] * (self.residual[k] - from_above);
        }
        let most = self.residual.iter().fold(0.0_f64, |most, step| {
            let (shift, turned) = split(step);
            most.max(shift.norm() / (0.25 * length_m)).max(turned.norm() / 0.5)
        });
        let share = if most > 1.0 { 1.0 / most } else { 1.0 };
        for (node, step) in self.nodes[1..].iter_mut().zip(&self.residual) {
            let (shift, turned) = split(&(step * -share));
            node.translation.vector += shift;
            node.rotation = Rotation::from_scaled_axis(turned) * node.rotation;
        }
    }
}

/// How the wrenches at an element's two ends change with its two ends' displacements, all written in the chain's base.
struct Tangent {
    top_by_top: Matrix6,
    top_by_base: Matrix6,
    base_by_top: Matrix6,
    base_by_base: Matrix6,
}

impl Tangent {
    /// By central differences in the top's displacement; the rest follows, as a rigid motion turns the wrenches along.
    fn of(element: &Element, base: &Pose, top: &Pose) -> Self {
        let base_from_top = base.inv_mul(top);
        let p = base_from_top.translation.vector;
        let wrench = element.wrench(&base_from_top);
        let (force, torque) = split(&wrench);
        let mut by_top = Matrix6::zeros();
        for k in 0..6 {
            let moved = |h: f64| {
                let (dp, dphi) = split(&Vector6::ith(k, h));
                let rotation = Rotation::from_scaled_axis(dphi) * base_from_top.rotation;
                element.wrench(&Pose::from_parts((p + dp).into(), rotation))
            };
            let h = 1e-6;
            by_top.set_column(k, &((moved(h) - moved(-h)) / (2.0 * h)));
        }
        // A displacement (d, phi) of the base is (-d - phi x p, -phi) of the top seen from it, and turns the wrench by
        // phi.
        let zero = Matrix::zeros();
        let carry = blocks(&-Matrix::identity(), &skew(&p), &zero, &-Matrix::identity());
        let turning = blocks(&zero, &-skew(&force), &zero, &-skew(&torque));
        let by_base = by_top * carry + turning;
        // The reaction is -(F, T + p x F), and p = (top - base) in the base's axes.
        let react = blocks(&-Matrix::identity(), &zero, &-skew(&p), &-Matrix::identity());
        let lever = blocks(&zero, &zero, &skew(&force), &zero);
        let axes = base.rotation.to_rotation_matrix().into_inner();
        let turned = blocks(&axes, &zero, &zero, &axes);
        let in_chain = |m: Matrix6| turned * m * turned.transpose();
        Self {
            top_by_top: in_chain(by_top),
            top_by_base: in_chain(by_base),
            base_by_top: in_chain(react * by_top + lever),
            base_by_base: in_chain(react * by_base - lever),
        }
    }
}

fn turn(rotation: &Rotation, wrench: &Vector6) -> Vector6 {
    let (force, torque): (Vector, Vector) = split(wrench);
    stack(&(rotation * force), &(rotation * torque))
}
