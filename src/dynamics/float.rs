//! A floating cylinder: buoyancy, drag and added mass.

use super::elements::FloatSpec;
use super::forces::{Forces, MotionState, at_lever};
use nalgebra::Point3;
use std::f64::consts::{PI, TAU};
use zsim_base::geometry::{Matrix, Pose, Vector};
use zsim_elasticity::{Vector6, split, stack};

/// Number of columns in each ring of the float's cross-section.
const DIRECTIONS: usize = 12;

/// Squared radii of the two rings of columns over the squared radius of the cylinder.
///
/// Gauss-Legendre points; with columns of equal area they integrate area and second moment of area exactly.
const SQUARED_RADII: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

/// A float on the head in a fluid on the base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Float {
    spec: FloatSpec,
}

/// A column of the cylinder, parallel to the head's z.
struct Column {
    bottom_in_head: Vector,
    area_m2: f64,
}

impl Float {
    /// Creates the float that a spec describes.
    pub fn of(spec: &FloatSpec) -> Self {
        Self { spec: *spec }
    }

    /// Centre of the cylinder in the head frame.
    pub fn middle_in_head(&self) -> Vector {
        Vector::from(self.spec.head_bottom_m) + Vector::z() * (0.5 * self.spec.height_m)
    }

    fn columns(&self) -> impl Iterator<Item = Column> {
        let FloatSpec { head_bottom_m, radius_m, .. } = self.spec;
        let area_m2 = PI * radius_m * radius_m / (SQUARED_RADII.len() * DIRECTIONS) as f64;
        SQUARED_RADII.into_iter().enumerate().flat_map(move |(ring, squared)| {
            (0..DIRECTIONS).map(move |k| {
                // The second ring is rotated by half a division.
                let angle = TAU * (k as f64 + 0.5 * ring as f64) / DIRECTIONS as f64;
                let out = Vector::new(angle.cos(), angle.sin(), 0.0) * (radius_m * squared.sqrt());
                Column { bottom_in_head: Vector::from(head_bottom_m) + out, area_m2 }
            })
        })
    }

    /// Submerged volume (m^3), first moment in the head frame (m^4), and integral of depth (m^4).
    ///
    /// `up` and a point of the `surface` are given in the head frame.
    fn submerged(&self, up: &Vector, surface: &Vector) -> (f64, Vector, f64) {
        let height_m = self.spec.height_m;
        let (mut volume, mut moment, mut depth) = (0.0, Vector::zeros(), 0.0);
        for Column { bottom_in_head, area_m2 } in self.columns() {
            let (deep, shallow) = {
                let at_bottom = up.dot(&(surface - bottom_in_head));
                (at_bottom, at_bottom - height_m * up.z)
            };
            // The submerged interval of the column, measured from the bottom.
            let (from, to) = match (deep > 0.0, shallow > 0.0) {
                (true, true) => (0.0, height_m),
                (true, false) => (0.0, deep / up.z),
                (false, true) => (deep / up.z, height_m),
                (false, false) => continue,
            };
            let (length, middle) = (to - from, 0.5 * (from + to));
            volume += area_m2 * length;
            moment += (bottom_in_head + Vector::z() * middle) * (area_m2 * length);
            depth += area_m2 * length * (deep - up.z * middle);
        }
        (volume, moment, depth)
    }

    /// Adds buoyancy, drag and added mass.
    pub fn add_forces(&self, now: &MotionState<'_>, forces: &mut Forces) {
        let spec = &self.spec;
        let surface = now.base.world_from_body * Point3::from(spec.base_surface_m);
        let apparent = now.gravity_in_world - now.carried_acceleration(&surface.coords);
        let into_head = now.world_from_head.rotation.inverse();
        let up = into_head * -apparent.normalize();
        let surface_in_head = now.world_from_head.inverse_transform_point(&surface).coords;
        let (volume, moment, _) = self.submerged(&up, &surface_in_head);
        if volume > 0.0 {
            forces.add_force(&now.lever(&(moment / volume)), &(apparent * (-spec.density_kg_per_m3 * volume)));
        }
        self.drag(now, forces);
        let lever = now.lever(&self.middle_in_head());
        let carried = now.carried_acceleration(&(now.centre() + lever));
        forces.add_force(&lever, &(carried * spec.added_mass_kg));
        forces.inertia += at_lever(&lever, &(Matrix::identity() * spec.added_mass_kg));
    }

    fn drag(&self, now: &MotionState<'_>, forces: &mut Forces) {
        let spec = &self.spec;
        let lever = now.lever(&self.middle_in_head());
        let (velocity, turning) = split(&now.relative_twist());
        let through = velocity + turning.cross(&lever);
        let speed = through.norm();
        let drag = spec.drag_n_s_per_m + spec.drag_n_s2_per_m2 * speed;
        forces.add_force(&lever, &(through * -drag));
        let mut slope = Matrix::identity() * drag;
        if speed > 0.0 {
            slope += through * through.transpose() * (spec.drag_n_s2_per_m2 / speed);
        }
        forces.add_damper(&lever, &slope);
        forces.add_torque(&(turning * -spec.drag_nm_s_per_rad));
        let mut block = forces.damping.fixed_view_mut::<3, 3>(3, 3);
        block += Matrix::identity() * spec.drag_nm_s_per_rad;
    }

    /// The centripetal force of the added mass, `-m w x (w x r)`, at the head's `twist`.
    pub fn quadratic_forces(&self, now: &MotionState<'_>, twist: &Vector6) -> Vector6 {
        let (_, turning) = split(twist);
        let lever = now.lever(&self.middle_in_head());
        let force = turning.cross(&turning.cross(&lever)) * -self.spec.added_mass_kg;
        stack(&force, &lever.cross(&force))
    }

    /// Potential energy of the displaced fluid, J.
    pub fn potential_j(&self, world_from_base: &Pose, base_from_head: &Pose, gravity_in_world: &Vector) -> f64 {
        let up = (world_from_base.rotation * base_from_head.rotation).inverse() * -gravity_in_world.normalize();
        let surface = base_from_head.inverse_transform_point(&Point3::from(self.spec.base_surface_m)).coords;
        let (_, _, depth) = self.submerged(&up, &surface);
        self.spec.density_kg_per_m3 * gravity_in_world.norm() * depth
    }

    /// Buoyancy with head and base at rest, N.
    pub fn buoyancy_n(&self, base_from_head: &Pose, gravity_in_base: &Vector) -> f64 {
        let up = base_from_head.rotation.inverse() * -gravity_in_base.normalize();
        let surface = base_from_head.inverse_transform_point(&Point3::from(self.spec.base_surface_m)).coords;
        self.spec.density_kg_per_m3 * gravity_in_base.norm() * self.submerged(&up, &surface).0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Body;
    use approx::assert_relative_eq;
    use zsim_base::geometry::{Kinematics, gravity_in_world};

    const SPEC: FloatSpec = FloatSpec {
        base_surface_m: [0.0, 0.0, 1.0],
        head_bottom_m: [0.0, 0.0, -0.02],
        radius_m: 0.05,
        height_m: 0.04,
        density_kg_per_m3: 1000.0,
        drag_n_s_per_m: 2.0,
        drag_n_s2_per_m2: 30.0,
        drag_nm_s_per_rad: 0.01,
        added_mass_kg: 0.0,
    };

    fn body() -> Body {
        Body { mass_kg: 0.1, centre_of_mass_in_head: Vector::zeros(), inertia_in_head: Matrix::identity() * 1e-4 }
    }

    fn forces(head: &Pose, twist: &Vector6) -> Forces {
        let now = MotionState {
            base: &Kinematics::at_rest(Pose::identity()),
            world_from_head: head,
            twist,
            body: &body(),
            hold: 0.0,
            gravity_in_world: gravity_in_world(),
        };
        let mut forces = Forces::none();
        Float::of(&SPEC).add_forces(&now, &mut forces);
        forces
    }

    #[test]
    fn a_submerged_float_rises_at_the_terminal_velocity() {
        // rho g V - m g = c v + q v^2 with V = pi r^2 h: 3.081 - 0.981 = 2.100 N, v = 0.2334 m/s.
        let lift = 9.80665 * (1000.0 * PI * 0.05 * 0.05 * 0.04 - 0.1);
        let v = (-2.0 + (4.0 + 120.0 * lift).sqrt()) / 60.0;
        let forces = forces(&Pose::identity(), &Vector6::new(0.0, 0.0, v, 0.0, 0.0, 0.0));
        assert_relative_eq!(forces.wrench[2], 0.1 * 9.80665, max_relative = 1e-12);
        assert_relative_eq!(forces.damping[(2, 2)], 2.0 + 60.0 * v, max_relative = 1e-12);
    }

    #[test]
    fn buoyancy_is_the_gradient_of_the_energy_at_any_tilt() {
        let float = Float::of(&SPEC);
        let turn = zsim_base::geometry::Rotation::from_scaled_axis(Vector::new(0.5, -0.3, 0.2));
        for depth_m in [0.99, 1.0, 1.02, 0.5, 1.2] {
            let pose = Pose::from_parts(Vector::new(0.1, -0.2, depth_m).into(), turn);
            let energy =
                |d: &Vector6| float.potential_j(&Pose::identity(), &body().displaced(&pose, d), &gravity_in_world());
            let wrench = forces(&pose, &Vector6::zeros()).wrench;
            for k in 0..6 {
                let d = Vector6::ith(k, 1e-6);
                assert_relative_eq!((energy(&-d) - energy(&d)) / 2e-6, wrench[k], epsilon = 1e-6, max_relative = 1e-4);
            }
        }
    }
}
