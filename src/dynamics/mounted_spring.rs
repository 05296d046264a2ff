//! A spring with mounting points and, optionally, wire mass.

use super::forces::{EndFrames, Forces, MotionState, RelativePose};
use zsim_base::geometry::{Matrix, Pose, Vector, skew};
use zsim_elasticity::{
    Coil, Deformation, ElasticityError, Matrix6, Spring, SpringState, Vector6, blocks, split, stack,
};

/// A spring and the frames of the mounting points.
#[derive(Debug, Clone)]
pub(super) struct MountedSpring {
    pub spring: Spring,
    pub ends: EndFrames,
    pub mass: Option<WireMass>,
    /// The coil; `None` for a spring given by a stiffness matrix.
    pub coil: Option<Coil>,
}

/// The mass of a spring's wire, reduced to the spring's top.
///
/// The wire moves in the shape that the displacement of the top bends, shears and stretches it to. The kinetic energy
/// is `e_dot . M e_dot / 2` in the spring's deformation coordinates e; if the base does not rotate, that is exact for
/// large deflections too. The part of the wire that moves with the base, reduced to half of the mass at the top, is
/// loaded by gravity minus the base's acceleration. Forces on the wire due to the base's angular velocity are
/// neglected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WireMass {
    mass_kg: f64,
    /// Moment of inertia about the spring's axis, kg m^2.
    polar_kg_m2: f64,
    length_m: f64,
    /// The mass matrix M in the deformation coordinates.
    in_coordinates: Matrix6,
}

impl WireMass {
    /// The mass of a wire of `mass_kg` on a coil of `radius_m`, `length_m` long under load.
    ///
    /// Consistent mass matrix at the end of a beam (Przemieniecki, Theory of Matrix Structural Analysis, 11.3): 13/35
    /// of the mass for sideways motion, 1/105 of mass times length squared for the slope, -11/210 of mass times length
    /// for the coupling; 1/3 along and about the axis. An end that is free to rotate has 33/140.
    pub fn new(mass_kg: f64, radius_m: f64, length_m: f64) -> Self {
        let polar_kg_m2 = mass_kg * radius_m * radius_m;
        let mut at_top = Matrix6::zeros();
        for (shift, turn, sign) in [(0, 4, 1.0), (1, 3, -1.0)] {
            at_top[(shift, shift)] = mass_kg * 13.0 / 35.0;
            at_top[(turn, turn)] = mass_kg * length_m * length_m / 105.0;
            at_top[(shift, turn)] = -sign * mass_kg * length_m * 11.0 / 210.0;
            at_top[(turn, shift)] = at_top[(shift, turn)];
        }
        at_top[(2, 2)] = mass_kg / 3.0;
        at_top[(5, 5)] = polar_kg_m2 / 3.0;
        // Jacobian of the top's displacement by the coordinates of a straight spring (see `Element::new`).
        let lever = skew(&Vector::z()) * (-0.5 * length_m);
        let spread = blocks(&Matrix::identity(), &lever, &Matrix::zeros(), &Matrix::identity());
        Self { mass_kg, polar_kg_m2, length_m, in_coordinates: spread.tr_mul(&(at_top * spread)) }
    }

    /// Adds gravity and base acceleration on the wire, and the mass of the wire at the head.
    fn add_forces(&self, ends: &EndFrames, between: &RelativePose, now: &MotionState<'_>, forces: &mut Forces) {
        let rate = between.rate_by_twist();
        let inertia = rate.tr_mul(&(self.in_coordinates * rate));
        // Zeroth and first moments of the wire's shape function: half of the mass, and 7/20, hence a lumped mass at 0.7
        // of the length.
        let along = ends.base_from_foot * nalgebra::Point3::new(0.0, 0.0, 0.7 * self.length_m);
        let point = now.base.world_from_body * along;
        let weight = (now.gravity_in_world - now.carried_acceleration(&point.coords)) * (0.5 * self.mass_kg);
        forces.add_force(&between.lever, &weight);
        let axis = between.axes.column(2).into_owned();
        let turning = now.base.angular_acceleration_in_world;
        forces.add_torque(&(axis * (-0.5 * self.polar_kg_m2 * axis.dot(&turning))));
        let carried = stack(&now.carried_acceleration(&now.centre()), &turning);
        forces.wrench += inertia * carried;
        forces.inertia += inertia;
    }
}

impl MountedSpring {
    /// Mass of the wire, kg; 0 if it is neglected.
    #[cfg(test)]
    pub fn wire_mass_kg(&self) -> f64 {
        self.mass.map_or(0.0, |mass| mass.mass_kg)
    }

    /// Adds the wrench of the spring and the forces of the wire.
    ///
    /// # Errors
    /// When a segmented spring has no equilibrium.
    pub fn add_forces(
        &self,
        state: &mut SpringState,
        now: &MotionState<'_>,
        forces: &mut Forces,
    ) -> Result<(), ElasticityError> {
        let between = self.ends.at(now);
        let on_top = self.spring.wrench(state, &between.foot_from_top)?;
        forces.wrench += between.to_centre(&on_top.open);
        forces.turn_rad = forces.turn_rad.max(between.turn_rad());
        forces.overlap_m = forces.overlap_m.max(on_top.overlap_m);
        if on_top.overlap_m > 0.0 {
            let contact = between.to_centre(&on_top.contact);
            forces.wrench += contact;
            forces.contact += contact;
        }
        if let Some(mass) = &self.mass {
            mass.add_forces(&self.ends, &between, now, forces);
        }
        Ok(())
    }

    /// The wrench of the coils that touch.
    ///
    /// # Errors
    /// When a segmented spring has no equilibrium.
    pub fn contact(&self, state: &mut SpringState, now: &MotionState<'_>) -> Result<Vector6, ElasticityError> {
        let between = self.ends.at(now);
        let on_top = self.spring.wrench(state, &between.foot_from_top)?;
        Ok(between.to_centre(&on_top.contact))
    }

    /// The inertial force `-B^T M B_dot v` of the wire due to the change of the Jacobian B with the pose.
    ///
    /// `twist` is the twist v of the head. For a constant twist relative to the base, `B_dot v` is the second derivative of
    /// the coordinates by time.
    pub fn quadratic_forces(&self, now: &MotionState<'_>, twist: &Vector6) -> Vector6 {
        let Some(mass) = &self.mass else { return Vector6::zeros() };
        let relative = MotionState { twist, ..*now }.relative_twist();
        let moved = |span_s: f64| {
            let pose = now.body.displaced(now.world_from_head, &(relative * span_s));
            Deformation::of(&self.ends.foot_from_top_in_world(&now.base.world_from_body, &pose)).coordinates
        };
        // Central difference: at 10 rad/s the truncation is below 1e-6 of the force, the rounding 1e-9.
        let span_s = 2e-4;
        let between = self.ends.at(now);
        let change = (moved(span_s) - between.deformation.coordinates * 2.0 + moved(-span_s)) / (span_s * span_s);
        -between.rate_by_twist().tr_mul(&(mass.in_coordinates * change))
    }

    /// The stiffness of the contact of all coils by the head's twist, with the head at a pose; `None` without contact.
    pub fn contact_stiffness(&self, now: &MotionState<'_>) -> Option<Matrix6> {
        let rate = self.ends.at(now).rate_by_twist();
        Some(rate.tr_mul(&(self.spring.contact_stiffness()? * rate)))
    }

    /// Speed along the spring for a unit impulse along it on the head with the inertia `mass`, 1/kg.
    pub fn axial_mobility_per_kg(&self, now: &MotionState<'_>, mass: &Matrix6) -> Option<f64> {
        let along = self.ends.at(now).rate_by_twist().row(2).transpose();
        Some(along.dot(&mass.cholesky()?.solve(&along)))
    }

    /// Elastic energy of the spring and gravitational energy of the wire, J.
    ///
    /// # Errors
    /// When a segmented spring has no equilibrium.
    pub fn potential_j(
        &self,
        world_from_base: &Pose,
        base_from_head: &Pose,
        gravity_in_world: &Vector,
    ) -> Result<f64, ElasticityError> {
        let in_spring = self.spring.potential_j(&mut self.spring.state(), &self.ends.foot_from_top(base_from_head))?;
        let top = world_from_base * base_from_head * self.ends.head_from_top;
        let hanging = self.mass.map_or(0.0, |mass| -0.5 * mass.mass_kg * gravity_in_world.dot(&top.translation.vector));
        Ok(in_spring + hanging)
    }

    /// The compressive load of the spring with the head at a pose, N.
    ///
    /// # Errors
    /// When a segmented spring has no equilibrium.
    pub fn load_n(&self, base_from_head: &Pose) -> Result<f64, ElasticityError> {
        let foot_from_top = self.ends.foot_from_top(base_from_head);
        let (force, _) = split(&self.spring.wrench(&mut self.spring.state(), &foot_from_top)?.total());
        Ok(force.dot(&foot_from_top.translation.vector.normalize()))
    }
}
