//! A chain of elements in series with massless inner nodes in equilibrium.

use super::deformation::{blocks, split, stack};
use super::solutions::Solutions;
use super::{Deformation, ElasticityError, Element, Matrix6, SectionLoad, Vector6};
use zsim_base::geometry::{Matrix, Pose, Rotation, Vector, left_jacobian, skew};

/// Maximum Newton iterations.
const MAX_ITERATIONS: usize = 100;

/// Convergence threshold of the residual force, as a fraction of axial stiffness times spring length.
///
/// Close to buckling, the rest pose of a head is sensitive to residuals: with 1e-12, the largest mass was wrong by 2e-4.
const TOLERANCE: f64 = 1e-13;

/// The nodes of a chain, from the base (0) to the top (N), and the factorised Newton matrix.
///
/// The residual of a node is the wrench on it, about it, in the axes of the base: the wrench of the element below on
/// its top plus that of the element above on its base. The matrix is block tridiagonal. It is reused as long as a step
/// reduces the residual at least tenfold.
#[derive(Debug, Clone)]
pub(super) struct Chain {
    nodes: Vec<Pose>,
    /// The last solutions.
    solutions: Solutions,
    residual: Vec<Vector6>,
    on_top: Vector6,
    matrix: Option<Matrices>,
}

/// The factorised block tridiagonal matrix.
///
/// For each inner node: the inverse of the pivot block, and the blocks below and above the diagonal.
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
            solutions: Solutions::default(),
            residual: vec![Vector6::zeros(); inner],
            on_top: Vector6::zeros(),
            matrix: None,
        }
    }

    /// The wrench on the top, about the top, in the axes of the base.
    pub(super) fn wrench_on_top(&self) -> Vector6 {
        self.on_top
    }

    pub(super) fn potential_j(&self, elements: &[Element]) -> f64 {
        let energy = |(element, ends): (&Element, &[Pose])| {
            element.potential_j(&Deformation::of(&ends[0].inv_mul(&ends[1])).coordinates)
        };
        elements.iter().zip(self.nodes.windows(2)).map(energy).sum()
    }

    /// The largest overlap of the coils of an element, m; negative without contact.
    pub(super) fn overlap_m(&self, elements: &[Element]) -> f64 {
        let overlap = |(element, ends): (&Element, &[Pose])| {
            element.overlap_m(&Deformation::of(&ends[0].inv_mul(&ends[1])).coordinates)
        };
        elements.iter().zip(self.nodes.windows(2)).map(overlap).fold(f64::NEG_INFINITY, f64::max)
    }

    /// The loads on the sections at the two ends of each element.
    pub(super) fn section_loads(&self, elements: &[Element]) -> Vec<SectionLoad> {
        let loads = |(element, ends): (&Element, &[Pose])| element.section_loads(&ends[0].inv_mul(&ends[1]));
        elements.iter().zip(self.nodes.windows(2)).flat_map(loads).collect()
    }

    /// Moves the inner nodes into equilibrium for a top at `base_from_top`.
    ///
    /// Starts from the nodes that [`Solutions::predict`] gives, or, if that fails, from a circular arc.
    pub(super) fn find_equilibrium(
        &mut self,
        elements: &[Element],
        length_m: f64,
        base_from_top: &Pose,
    ) -> Result<(), ElasticityError> {
        let segments = self.nodes.len() - 1;
        self.nodes[segments] = *base_from_top;
        let mut result = Err(ElasticityError::InnerNodes { segments, residual_n: f64::NAN });
        if self.solutions.predict(&mut self.nodes) {
            result = self.iterate(elements, length_m);
        }
        if result.is_err() {
            self.solutions.forget();
            self.matrix = None;
            self.place_on_arc(&Deformation::of(base_from_top).coordinates);
            result = self.iterate(elements, length_m);
        }
        if result.is_ok() {
            self.solutions.add(&self.nodes);
        }
        result
    }

    /// Runs Newton's method for the inner nodes from the present positions.
    fn iterate(&mut self, elements: &[Element], length_m: f64) -> Result<(), ElasticityError> {
        let tolerance_n = TOLERANCE * elements[0].stiffness().m33 * length_m;
        let mut size_n = self.compute_residual(elements, length_m);
        for _ in 0..MAX_ITERATIONS {
            if size_n <= tolerance_n {
                return Ok(());
            }
            if self.matrix.is_none() {
                self.matrix = Some(self.linearise(elements)?);
            }
            self.advance(length_m);
            let before_n = std::mem::replace(&mut size_n, self.compute_residual(elements, length_m));
            if size_n.is_nan() || size_n > 0.1 * before_n {
                self.matrix = None;
            }
        }
        Err(ElasticityError::InnerNodes { segments: self.nodes.len() - 1, residual_n: size_n })
    }

    /// Places the inner nodes on the curve of constant curvature from base to top.
    ///
    /// That curve is close to equilibrium for all loads.
    fn place_on_arc(&mut self, coordinates: &Vector6) {
        let segments = self.nodes.len() - 1;
        let (a, theta) = split(coordinates);
        for (k, node) in self.nodes.iter_mut().enumerate().take(segments) {
            let fraction = k as f64 / segments as f64;
            let turned = theta * fraction;
            let position = left_jacobian(&turned) * a * fraction;
            *node = Pose::from_parts(position.into(), Rotation::from_scaled_axis(turned));
        }
    }

    /// Computes the residuals of the inner nodes and returns the largest one as a force, N.
    ///
    /// A torque counts as torque over spring length.
    fn compute_residual(&mut self, elements: &[Element], length_m: f64) -> f64 {
        self.residual.fill(Vector6::zeros());
        for (k, element) in elements.iter().enumerate() {
            let below_from_above = self.nodes[k].inv_mul(&self.nodes[k + 1]);
            let wrench = element.wrench(&below_from_above);
            let reaction = Element::reaction(&below_from_above, &wrench);
            let rotation = &self.nodes[k].rotation;
            if k > 0 {
                self.residual[k - 1] += rotate_wrench(rotation, &reaction);
            }
            match self.residual.get_mut(k) {
                Some(residual) => *residual += rotate_wrench(rotation, &wrench),
                None => self.on_top = rotate_wrench(rotation, &wrench),
            }
        }
        let size = |r: &Vector6| {
            let (force, torque) = split(r);
            force.amax().max(torque.amax() / length_m)
        };
        // `f64::max` would drop a NaN.
        self.residual.iter().map(size).fold(0.0, |largest, s| if s > largest || s.is_nan() { s } else { largest })
    }

    /// Computes and factorises the Newton matrix at the present nodes, from the base upwards.
    fn linearise(&self, elements: &[Element]) -> Result<Matrices, ElasticityError> {
        let segments = self.nodes.len() - 1;
        let tangents: Vec<Tangent> = elements
            .iter()
            .zip(self.nodes.windows(2))
            .map(|(element, ends)| Tangent::of(element, &ends[0], &ends[1]))
            .collect();
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

    /// Takes one Newton step, limited to 0.5 rad and to a quarter of the spring's length for each node.
    fn advance(&mut self, length_m: f64) {
        let Some(matrix) = &self.matrix else { return };
        let inner = self.residual.len();
        for k in 1..inner {
            let eliminated = matrix.below[k] * (matrix.pivot[k - 1] * self.residual[k - 1]);
            self.residual[k] -= eliminated;
        }
        for k in (0..inner).rev() {
            let from_above = if k + 1 < inner { matrix.above[k] * self.residual[k + 1] } else { Vector6::zeros() };
            self.residual[k] = matrix.pivot[k] * (self.residual[k] - from_above);
        }
        let largest = self.residual.iter().fold(0.0_f64, |largest, step| {
            let (shift, turned) = split(step);
            largest.max(shift.norm() / (0.25 * length_m)).max(turned.norm() / 0.5)
        });
        let factor = if largest > 1.0 { 1.0 / largest } else { 1.0 };
        for (node, step) in self.nodes[1..].iter_mut().zip(&self.residual) {
            let (shift, turned) = split(&(step * -factor));
            node.translation.vector += shift;
            node.rotation = Rotation::from_scaled_axis(turned) * node.rotation;
        }
    }
}

/// Derivatives of the wrenches at the two ends of an element by the displacements of the two ends.
///
/// All are in the axes of the chain's base.
struct Tangent {
    top_by_top: Matrix6,
    top_by_base: Matrix6,
    base_by_top: Matrix6,
    base_by_base: Matrix6,
}

impl Tangent {
    /// Computes the derivatives by differences in the top's displacement, with an error of about 1e-6, as a Newton step needs.
    ///
    /// Those by the base's displacement follow, since a rigid motion rotates the wrenches.
    fn of(element: &Element, base: &Pose, top: &Pose) -> Self {
        let base_from_top = base.inv_mul(top);
        let p = base_from_top.translation.vector;
        let wrench = element.wrench(&base_from_top);
        let (force, torque) = split(&wrench);
        let mut by_top = Matrix6::zeros();
        for k in 0..6 {
            let h = 1e-7;
            let (dp, dphi) = split(&Vector6::ith(k, h));
            let rotation = Rotation::from_scaled_axis(dphi) * base_from_top.rotation;
            let moved = element.wrench(&Pose::from_parts((p + dp).into(), rotation));
            by_top.set_column(k, &((moved - wrench) / h));
        }
        // A displacement (d, phi) of the base equals (-d - phi x p, -phi) of the top relative to the base, and rotates
        // the wrench by phi.
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

fn rotate_wrench(rotation: &Rotation, wrench: &Vector6) -> Vector6 {
    let (force, torque): (Vector, Vector) = split(wrench);
    stack(&(rotation * force), &(rotation * torque))
}
