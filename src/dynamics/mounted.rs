//! A spring between its mounting points, with its own mass if that counts.

use super::push::{Between, Ends, Forces, Instant};
use crate::elasticity::{Deformation, ElasticityError, Matrix6, Spring, SpringState, Vector6, blocks, split, stack};
use crate::geometry::{Matrix, Pose, Vector, skew};

/// A spring, and where it is fastened.
#[derive(Debug, Clone)]
pub(super) struct MountedSpring {
    pub spring: Spring,
    pub ends: Ends,
    pub mass: Option<WireMass>,
}

/// The mass of a spring's wire, as its top feels it.
///
/// Of a motion of the wire as the top's displacement bends, shears and stretches it, the kinetic energy is `e_dot . M
/// e_dot / 2` in the spring's deformation coordinates e; for a base that does not turn that is exact for large swings,
/// too. What the base carries along, half of the mass at the top, pulls by gravity less the base's acceleration. Forces
/// by the base's rate of turn on the wire are left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WireMass {
    mass_kg: f64,
    /// About the spring's axis, kg m^2.
    polar_kg_m2: f64,
    length_m: f64,
    /// M.
    in_coordinates: Matrix6,
}

impl WireMass {
    /// That of wire of `mass_kg` on a coil of `radius_m`, `length_m` long under its load.
    ///
    /// The consistent mass matrix of a beam's end (Przemieniecki, Theory of Matrix Structural Analysis, 11.3): 13/35 of
    /// the mass sideways, 1/105 of it times the length squared for the slope, -11/210 times the length between them;
    /// 1/3 along and about the axis. Left free to turn, its end feels 33/140.
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
        // The top's displacement by the coordinates of a straight spring (see `Element::new`).
        let lever = skew(&Vector::z()) * (-0.5 * length_m);
        let spread = blocks(&Matrix::identity(), &lever, &Matrix::zeros(), &Matrix::identity());
        Self { mass_kg, polar_kg_m2, length_m, in_coordinates: spread.tr_mul(&(at_top * spread)) }
    }

    /// What gravity and the carrying base do to the top, and the mass that the head feels.
    fn push(&self, ends: &Ends, between: &Between, now: &Instant<'_>, forces: &mut Forces) {
        let rate = between.rate_by_twist();
        let inertia = rate.tr_mul(&(self.in_coordinates * rate));
        // Of the shape that the top makes of the wire, half the mass; of its first moment 7/20, as if all were at 0.7.
        let along = ends.base_from_foot * nalgebra::Point3::new(0.0, 0.0, 0.7 * self.length_m);
        let place = now.base.world_from_body * along;
        let hangs = (now.gravity_in_world - now.carried_acceleration(&place.coords)) * (0.5 * self.mass_kg);
        forces.add_force(&between.lever, &hangs);
        let axis = between.axes.column(2).into_owned();
        let turning = now.base.angular_acceleration_in_world;
        forces.add_torque(&(axis * (-0.5 * self.polar_kg_m2 * axis.dot(&turning))));
        let carried = stack(&now.carried_acceleration(&now.centre()), &turning);
        forces.wrench += inertia * carried;
        forces.inertia += inertia;
    }
}

impl MountedSpring {
    /// Adds the spring's push at an instant.
    ///
    /// # Errors
    /// When a segmented spring finds no equilibrium.
    pub fn push(&self, state: &mut SpringState, now: &Instant<'_>, forces: &mut Forces) -> Result<(), ElasticityError> {
        let between = self.ends.at(now);
        let on_top = self.spring.wrench(state, &between.foot_from_top, &between.deformation)?;
        forces.wrench += between.to_centre(&on_top);
        forces.turn_rad = forces.turn_rad.max(between.turn_rad());
        if let Some(mass) = &self.mass {
            mass.push(&self.ends, &between, now, forces);
        }
        Ok(())
    }

    /// The force that its mass feels because the coordinates' rate changes with the pose, `-B^T M B_dot v`, at the
    /// twist `twist` of the head.
    pub fn bend(&self, now: &Instant<'_>, twist: &Vector6) -> Vector6 {
        let Some(mass) = &self.mass else { return Vector6::zeros() };
        let relative = Instant { twist, ..*now }.relative_twist();
        let rate = |pose: &Pose| self.ends.at(&Instant { world_from_head: pose, ..*now }).rate_by_twist();
        let moved = |span_s: f64| now.body.displaced(now.world_from_head, &(relative * span_s));
        // The pose of a ten-thousandth of a second on either side: a difference to 1e-8 of the swing's own.
        let span_s = 1e-4;
        let change = (rate(&moved(span_s)) - rate(&moved(-span_s))) / (2.0 * span_s);
        -rate(now.world_from_head).tr_mul(&(mass.in_coordinates * (change * relative)))
    }

    /// Energy in the spring and of its weight, J.
    ///
    /// # Errors
    /// When a segmented spring finds no equilibrium.
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

    /// The load that presses the spring together with the head at a pose, N.
    ///
    /// # Errors
    /// When a segmented spring finds no equilibrium.
    pub fn load_n(&self, base_from_head: &Pose) -> Result<f64, ElasticityError> {
        let foot_from_top = self.ends.foot_from_top(base_from_head);
        let deformation = Deformation::of(&foot_from_top);
        let (force, _) = split(&self.spring.wrench(&mut self.spring.state(), &foot_from_top, &deformation)?);
        Ok(force.dot(&foot_from_top.translation.vector.normalize()))
    }
}
