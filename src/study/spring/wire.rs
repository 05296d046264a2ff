//! Stress in the wire of a helical spring, and what it bears.

use crate::dynamics::{Body, HeadSpec, HeadState, LinkageSpec};
use crate::elasticity::{Material, SpringSpec};
use crate::geometry::{Pose, Vector, gravity_in_world};
use std::f64::consts::{PI, TAU};

/// The wire of a coil.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wire {
    /// Mean radius of the coil, m.
    pub coil_radius_m: f64,
    /// Diameter of the wire, m.
    pub diameter_m: f64,
    /// What it is made of.
    pub material: Material,
}

/// What one side of a cut across the spring does to the other, about the spring's axis there; z along the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WireLoad {
    /// N.
    pub force: Vector,
    /// N m.
    pub moment: Vector,
}

/// Around the coil, in so many steps, the most stressed place is looked for: 0.1 % in the stress at most.
const PLACES: usize = 72;

impl Wire {
    /// The wire of a spring that is given as a coil; `None` for one that is given by its stiffness.
    ///
    /// # Errors
    /// When a named spring is not there.
    pub fn of(spec: &SpringSpec) -> Result<Option<Self>, crate::spec::SpecError> {
        Ok(match spec.resolved()? {
            SpringSpec::Coil { coil_diameter_mm, wire_diameter_mm, material, .. } => {
                Some(Self { coil_radius_m: 0.5e-3 * coil_diameter_mm, diameter_m: 1e-3 * wire_diameter_mm, material })
            }
            SpringSpec::Named(_) | SpringSpec::Stiffness { .. } => None,
        })
    }

    /// The spring index.
    pub fn index(&self) -> f64 {
        2.0 * self.coil_radius_m / self.diameter_m
    }

    /// Greatest equivalent stress (von Mises) in the wire at a cut, Pa.
    ///
    /// At the angle where the radius is n, the force and the moment less `R n x F` act on the wire. Its torsion about
    /// the tangent has the curvature factor `(4C - 1) / (4C - 4)`, to which 1.23 times the mean shear comes: for an
    /// axial force together Wahl's factor (Wahl, Mechanical Springs, chapter 2). Bending about the coil's axis has that
    /// of a curved bar, `(4C^2 - C - 1) / (4C (C - 1))`; bending about n has none. The pitch angle counts as small, and
    /// the greatest torsion and bending as if they met in one point.
    pub fn equivalent_stress_pa(&self, section: &WireLoad) -> f64 {
        let c = self.index();
        let (curved_torsion, curved_bending) =
            ((4.0 * c - 1.0) / (4.0 * c - 4.0), (4.0 * c * c - c - 1.0) / (4.0 * c * (c - 1.0)));
        let modulus = PI * self.diameter_m.powi(3) / 32.0;
        let area = 0.25 * PI * self.diameter_m.powi(2);
        let at = |place: usize| {
            let (sin, cos) = (TAU * place as f64 / PLACES as f64).sin_cos();
            let (outward, along) = (Vector::new(cos, sin, 0.0), Vector::new(-sin, cos, 0.0));
            let moment = section.moment - (outward * self.coil_radius_m).cross(&section.force);
            let across = section.force - along * section.force.dot(&along);
            let shear = 0.5 * moment.dot(&along).abs() / modulus * curved_torsion + 1.23 * across.norm() / area;
            let bending = (moment.dot(&outward)).hypot(moment.z * curved_bending) / modulus;
            (bending + section.force.dot(&along).abs() / area).hypot(3_f64.sqrt() * shear)
        };
        (0..PLACES).map(at).fold(0.0, f64::max)
    }

    /// The stress at which the wire stays bent, Pa; `None` for a material known by its moduli alone.
    ///
    /// Tensile strength `A / d^m` and the allowable torsion of it, 45 % for music wire and 35 % for stainless 302,
    /// taken over the square root of 3 to bending (Shigley's Mechanical Engineering Design, 9th edition, tables 10-4
    /// and 10-6).
    pub fn yield_pa(&self) -> Option<f64> {
        let wire_mm = self.diameter_m * 1e3;
        let (strength_mpa, exponent, share) = match self.material {
            Material::SpringSteel => (2211.0, 0.145, 0.45),
            Material::Stainless if wire_mm <= 2.5 => (1867.0, 0.146, 0.35),
            Material::Stainless if wire_mm <= 5.0 => (2065.0, 0.263, 0.35),
            Material::Stainless => (2911.0, 0.478, 0.35),
            Material::Moduli { .. } => return None,
        };
        Some(3_f64.sqrt() * share * 1e6 * strength_mpa / f64::powf(wire_mm, exponent))
    }
}

/// Where a spring is fastened, and to what.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpringMounting {
    base_from_foot: Pose,
    head_from_top: Pose,
    body: Body,
}

impl SpringMounting {
    /// That of a head on one spring; `None` for any other.
    pub fn of(spec: &HeadSpec, body: &Body) -> Option<Self> {
        let LinkageSpec::Spring { base_from_spring, head_from_spring, .. } = &spec.linkage else { return None };
        Some(Self { base_from_foot: base_from_spring.pose(), head_from_top: head_from_spring.pose(), body: *body })
    }

    /// Distance from foot to top with the head at a pose, m.
    pub fn length_m(&self, base_from_head: &Pose) -> f64 {
        let top = (base_from_head * self.head_from_top).translation.vector;
        (top - self.base_from_foot.translation.vector).norm()
    }

    /// What the spring carries at its foot and at its top: the head's weight less its inertia (d'Alembert), about each
    /// end.
    pub fn ends(&self, state: &HeadState) -> [WireLoad; 2] {
        let centre =
            state.head.of_frame(&Pose::from_parts(self.body.centre_of_mass_in_head.into(), Default::default()));
        let force = (gravity_in_world() - centre.acceleration_in_world) * self.body.mass_kg;
        let rotation = centre.world_from_body.rotation;
        let in_head = |v: Vector| rotation.inverse() * v;
        let omega = in_head(state.head.angular_velocity_in_world);
        let inertia = self.body.inertia_in_head;
        let spin = inertia * in_head(state.head.angular_acceleration_in_world) + omega.cross(&(inertia * omega));
        let feet = [state.base.world_from_body * self.base_from_foot, state.head.world_from_body * self.head_from_top];
        feet.map(|world_from_end| {
            let arm = centre.world_from_body.translation.vector - world_from_end.translation.vector;
            let moment = arm.cross(&force) - rotation * spin;
            let in_end = world_from_end.rotation.inverse();
            WireLoad { force: in_end * force, moment: in_end * moment }
        })
    }

    /// Greatest equivalent stress in the wire at either end, Pa.
    pub fn stress_pa(&self, wire: &Wire, state: &HeadState) -> f64 {
        self.ends(state).iter().map(|section| wire.equivalent_stress_pa(section)).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    const WIRE: Wire = Wire { coil_radius_m: 0.0125, diameter_m: 0.003, material: Material::SpringSteel };

    #[test]
    fn an_axial_force_gives_wahls_stress() {
        // tau = (8 F D / pi d^3) ((4C - 1)/(4C - 4) + 0.615/C), C = 25/3; von Mises of pure shear is sqrt(3) tau.
        let c = 25.0 / 3.0;
        let wahl = (4.0 * c - 1.0) / (4.0 * c - 4.0) + 0.615 / c;
        let tau = 8.0 * 20.0 * 0.025 / (PI * 0.003_f64.powi(3)) * wahl;
        let section = WireLoad { force: -Vector::z() * 20.0, moment: Vector::zeros() };
        assert_relative_eq!(WIRE.equivalent_stress_pa(&section), 3_f64.sqrt() * tau, max_relative = 1e-3);
    }

    #[test]
    fn a_torque_about_the_axis_bends_the_wire_as_in_a_torsion_spring() {
        // sigma = K_i 32 T / (pi d^3), K_i = (4C^2 - C - 1) / (4C (C - 1)).
        let c: f64 = 25.0 / 3.0;
        let factor = (4.0 * c * c - c - 1.0) / (4.0 * c * (c - 1.0));
        let section = WireLoad { force: Vector::zeros(), moment: Vector::z() * 0.5 };
        let sigma = factor * 32.0 * 0.5 / (PI * 0.003_f64.powi(3));
        assert_relative_eq!(WIRE.equivalent_stress_pa(&section), sigma, max_relative = 1e-12);
    }

    #[test]
    fn bending_the_spring_bends_and_twists_its_wire_in_turn() {
        // Where the moment is along the radius, the wire is bent: 32 M / (pi d^3); where along the tangent, twisted.
        let section = WireLoad { force: Vector::zeros(), moment: Vector::x() * 0.5 };
        let bent = 32.0 * 0.5 / (PI * 0.003_f64.powi(3));
        let stress = WIRE.equivalent_stress_pa(&section);
        assert!(stress >= bent * (1.0 - 1e-12) && stress < 1.1 * bent, "{stress} {bent}");
    }

    #[test]
    fn strength_falls_with_the_wire() {
        // Music wire of 1 mm: 2211 MPa, 45 % of it in torsion, sqrt(3) times that in bending.
        let thin = Wire { diameter_m: 1e-3, ..WIRE };
        assert_relative_eq!(thin.yield_pa().unwrap(), 3_f64.sqrt() * 0.45 * 2211e6, max_relative = 1e-12);
        assert!(WIRE.yield_pa() < thin.yield_pa());
    }
}
