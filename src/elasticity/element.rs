//! One element of a spring: a quadratic potential in the deformation coordinates.

use super::coil_stop::CoilStop;
use super::deformation::{blocks, split, stack};
use super::{Column, Deformation, ElasticityError, Matrix6, SectionLoad, Vector6, conditioning, loaded_stiffness};
use zsim_base::geometry::{Matrix, Pose, Vector, skew};

/// A segment of a spring between two nodes, straight under an axial load in the reference state.
///
/// The potential is `U = f . e + e . K e / 2` in `e`, the [`Deformation`] coordinates minus those of the straight
/// segment, with the axial load `f`. The geometric stiffness (load times curvature of the coordinates) is subtracted in
/// `K`, such that the stiffness of the top about the straight, loaded state is exactly the given one. The force law
/// therefore includes the softening by the load, but not gravity. Where coils touch, the potential of their contact is added.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Element {
    rest: Vector6,
    load: Vector6,
    stiffness: Matrix6,
    stop: Option<CoilStop>,
}

impl Element {
    /// Creates a segment of `length_m` under `load_n` (compression positive).
    ///
    /// `at_top` is the stiffness of the top about the top, with the base clamped: order x, y, z, rx, ry, rz.
    ///
    /// # Errors
    /// When `at_top` is not symmetric, or the segment is unstable with both ends clamped.
    pub fn new(length_m: f64, load_n: f64, at_top: &Matrix6) -> Result<Self, ElasticityError> {
        check_symmetric(at_top)?;
        // For a displacement (u, theta) of the top, a_z = L + u_z + (theta_y u_x - theta_x u_y)/2 - L (theta_x^2 +
        // theta_y^2)/12 to second order. The Hessian times the axial force -P is the geometric stiffness.
        let mut geometric = Matrix6::zeros();
        for (shift, turn, sign) in [(0, 4, 1.0), (1, 3, -1.0)] {
            geometric[(shift, turn)] = -0.5 * sign * load_n;
            geometric[(turn, shift)] = -0.5 * sign * load_n;
            geometric[(turn, turn)] = load_n * length_m / 6.0;
        }
        // To first order e = (u - theta x L z / 2, theta), so (u, theta) = spread e.
        let lever = skew(&Vector::z()) * (-0.5 * length_m);
        let spread = blocks(&Matrix::identity(), &lever, &Matrix::zeros(), &Matrix::identity());
        let stiffness = spread.tr_mul(&((at_top - geometric) * spread));
        check_positive_definite(&stiffness)?;
        Ok(Self {
            rest: Vector6::new(0.0, 0.0, length_m, 0.0, 0.0, 0.0),
            load: Vector6::new(0.0, 0.0, -load_n, 0.0, 0.0, 0.0),
            stiffness: (stiffness + stiffness.transpose()) * 0.5,
            stop: None,
        })
    }

    /// Creates a segment of a loaded column.
    ///
    /// # Errors
    /// When the load buckles the segment.
    pub fn of_column(column: &Column) -> Result<Self, ElasticityError> {
        Self::new(column.length_m, column.load_n, &loaded_stiffness(column)?)
    }

    /// The same segment with contact of its coils.
    pub(super) fn with_stop(self, stop: CoilStop) -> Self {
        Self { stop: Some(stop), ..self }
    }

    /// The overlap of the coils at the inner side of the bend, m: negative without contact, minus infinity for a stiffness.
    pub(super) fn overlap_m(&self, coordinates: &Vector6) -> f64 {
        self.stop.map_or(f64::NEG_INFINITY, |stop| stop.overlap_m(&(coordinates - self.rest)))
    }

    /// The stiffness of the contact when all coils touch, in the coordinates.
    pub(super) fn closed_stiffness(&self) -> Option<Matrix6> {
        self.stop.map(|stop| stop.closed_stiffness())
    }

    /// The coordinates of the straight, loaded segment.
    pub fn rest(&self) -> &Vector6 {
        &self.rest
    }

    /// The stiffness in the deformation coordinates.
    pub fn stiffness(&self) -> &Matrix6 {
        &self.stiffness
    }

    /// The gradient of the potential by the coordinates, N and N m.
    pub fn gradient(&self, coordinates: &Vector6) -> Vector6 {
        let in_contact = self.stop.map_or_else(Vector6::zeros, |stop| stop.gradient(&(coordinates - self.rest)));
        self.gradient_of_wire(coordinates) + in_contact
    }

    /// The gradient without that of the contact.
    fn gradient_of_wire(&self, coordinates: &Vector6) -> Vector6 {
        self.load + self.stiffness * (coordinates - self.rest)
    }

    /// The potential, zero for the straight, loaded segment, J.
    pub fn potential_j(&self, coordinates: &Vector6) -> f64 {
        let e = coordinates - self.rest;
        let in_contact = self.stop.map_or(0.0, |stop| stop.potential_j(&e));
        e.dot(&(self.load + self.stiffness * e * 0.5)) + in_contact
    }

    /// The wrench on the top, about the top, in the axes of the base.
    pub fn wrench(&self, base_from_top: &Pose) -> Vector6 {
        let deformation = Deformation::of(base_from_top);
        -deformation.wrench(&self.gradient(&deformation.coordinates))
    }

    /// The loads on the wire at the sections at the base and at the top, without the forces between coils that touch.
    pub fn section_loads(&self, base_from_top: &Pose) -> [SectionLoad; 2] {
        let deformation = Deformation::of(base_from_top);
        let on_top = -deformation.wrench(&self.gradient_of_wire(&deformation.coordinates));
        let through_base = -Self::reaction(base_from_top, &on_top);
        [SectionLoad::of_wrench(&through_base), SectionLoad::in_base(base_from_top, &on_top)]
    }

    /// The wrench on the base, about the base, that balances `wrench` on the top.
    pub fn reaction(base_from_top: &Pose, wrench: &Vector6) -> Vector6 {
        let (force, torque) = split(wrench);
        -stack(&force, &(torque + base_from_top.translation.vector.cross(&force)))
    }
}

/// Returns an error unless a stiffness is positive definite.
pub(super) fn check_positive_definite(k: &Matrix6) -> Result<(), ElasticityError> {
    let smallest = conditioning(k);
    if smallest.is_nan() || smallest <= 1e-12 { Err(ElasticityError::NotPositiveDefinite { smallest }) } else { Ok(()) }
}

fn check_symmetric(k: &Matrix6) -> Result<(), ElasticityError> {
    for row in 0..6 {
        for column in row + 1..6 {
            let (upper, lower) = (k[(row, column)], k[(column, row)]);
            let scale = (k[(row, row)] * k[(column, column)]).abs().sqrt();
            if (upper - lower).abs() > 1e-9 * scale {
                return Err(ElasticityError::NotSymmetric { row: row + 1, column: column + 1, upper, lower });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::geometry::Rotation;

    /// A stiffness of a spring of 120 mm with couplings between all coordinates, N, m, rad.
    fn coupled() -> Matrix6 {
        let skewed = Matrix6::from_fn(|i, j| ((3 * i + 5 * j * j) as f64).sin());
        let scale = Matrix6::from_diagonal(&Vector6::new(20.0, 20.0, 60.0, 1.0, 1.0, 0.8));
        scale * (Matrix6::identity() * 8.0 + skewed.tr_mul(&skewed)) * scale * 0.1
    }

    fn moved(top: &Pose, d: &Vector6) -> Pose {
        let (dp, dphi) = split(d);
        Pose::from_parts((top.translation.vector + dp).into(), Rotation::from_scaled_axis(dphi) * top.rotation)
    }

    #[test]
    fn the_tangent_in_the_reference_state_is_the_given_stiffness_for_any_load() {
        for load in [0.0, 3.9, -3.9] {
            let element = Element::new(0.12, load, &coupled()).unwrap();
            let rest = Pose::translation(0.0, 0.0, 0.12);
            assert_relative_eq!(element.wrench(&rest), Vector6::new(0.0, 0.0, load, 0.0, 0.0, 0.0), epsilon = 1e-12);
            for k in 0..6 {
                let d = Vector6::ith(k, 1e-5);
                let slope = (element.wrench(&moved(&rest, &d)) - element.wrench(&moved(&rest, &-d))) / -2e-5;
                assert_relative_eq!(slope, coupled().column(k).into_owned(), epsilon = 1e-5);
            }
        }
    }

    #[test]
    fn the_wrench_is_minus_the_gradient_of_the_potential_at_large_rotations() {
        let element = Element::new(0.12, 3.9, &coupled()).unwrap();
        let turn = Rotation::from_scaled_axis(Vector::new(0.9, -1.2, 0.5));
        let top = Pose::from_parts(Vector::new(0.05, 0.03, 0.08).into(), turn);
        let potential = |top: &Pose| element.potential_j(&Deformation::of(top).coordinates);
        let wrench = element.wrench(&top);
        for k in 0..6 {
            let d = Vector6::ith(k, 1e-6);
            let slope = (potential(&moved(&top, &d)) - potential(&moved(&top, &-d))) / 2e-6;
            assert_relative_eq!(-slope, wrench[k], max_relative = 1e-6, epsilon = 1e-7);
        }
    }

    #[test]
    fn an_indefinite_or_asymmetric_stiffness_is_rejected() {
        let mut soft = coupled();
        soft.set_row(3, &(soft.row(0) * 0.01));
        soft.set_column(3, &(soft.column(0) * 0.01));
        assert!(matches!(Element::new(0.12, 0.0, &soft), Err(ElasticityError::NotPositiveDefinite { .. })));
        let mut lopsided = coupled();
        lopsided[(0, 4)] += 1.0;
        let error = Element::new(0.12, 0.0, &lopsided).unwrap_err();
        assert!(error.to_string().contains("row 1, column 5"), "{error}");
    }
}
