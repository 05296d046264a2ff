//! Stress in the wire of a helical spring, and the load on it.

use std::f64::consts::{PI, TAU};
use zsim_base::geometry::{Kinematics, Pose, Vector, gravity_in_world};
use zsim_dynamics::{Body, HeadSpec, HeadState, LinkageSpec};
use zsim_elasticity::{Material, SpringSpec};

/// The wire of a coil.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wire {
    /// Mean radius of the coil, m.
    pub coil_radius_m: f64,
    /// Diameter of the wire, m.
    pub diameter_m: f64,
    /// Material of the wire.
    pub material: Material,
}

/// Force and moment across a section of the spring, in the frame of the section; z along the spring axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WireLoad {
    /// Force, N.
    pub force: Vector,
    /// Moment about the spring axis at the section, N m.
    pub moment: Vector,
}

/// Number of angles around the coil at which the stress is evaluated: the error of the maximum is at most 0.1 %.
pub(super) const ANGLES: usize = 72;

/// Stress in a wire at one section, Pa: each entry is the largest over the section, with its sign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WireStress {
    pub shear_pa: f64,
    /// By the moment about the radial direction.
    pub radial_bending_pa: f64,
    /// By the moment about the axis of the coil.
    pub axial_bending_pa: f64,
    pub tension_pa: f64,
}

impl WireStress {
    /// The von Mises stress, if all maxima occur at the same point of the section, which is conservative.
    pub fn von_mises_pa(&self) -> f64 {
        // `hypot`, which cannot overflow, takes ten times as long, and this is computed at each angle of each section.
        let bending = (self.radial_bending_pa.powi(2) + self.axial_bending_pa.powi(2)).sqrt();
        ((bending + self.tension_pa.abs()).powi(2) + 3.0 * self.shear_pa.powi(2)).sqrt()
    }

    /// The stress with each entry combined with that of another one.
    pub fn zip(&self, other: &Self, combine: fn(f64, f64) -> f64) -> Self {
        Self {
            shear_pa: combine(self.shear_pa, other.shear_pa),
            radial_bending_pa: combine(self.radial_bending_pa, other.radial_bending_pa),
            axial_bending_pa: combine(self.axial_bending_pa, other.axial_bending_pa),
            tension_pa: combine(self.tension_pa, other.tension_pa),
        }
    }
}

impl Wire {
    /// The wire of a spring specified as a coil; `None` for a spring specified by stiffness.
    ///
    /// # Errors
    /// When a named spring does not exist.
    pub fn of(spec: &SpringSpec) -> Result<Option<Self>, zsim_base::spec::SpecError> {
        Ok(match spec.resolved()? {
            SpringSpec::Coil { coil_diameter_mm, wire_diameter_mm, material, .. } => {
                Some(Self { coil_radius_m: 0.5e-3 * coil_diameter_mm, diameter_m: 1e-3 * wire_diameter_mm, material })
            }
            SpringSpec::Named(_) | SpringSpec::Stiffness { .. } => None,
        })
    }

    /// Spring index: mean coil diameter divided by wire diameter.
    pub fn index(&self) -> f64 {
        2.0 * self.coil_radius_m / self.diameter_m
    }

    /// Stress in the wire at a section, at angle `k` of [`ANGLES`] around the coil.
    ///
    /// At the angle with radial direction n, the force F and the moment `M - R n x F` act on the wire. Torsion about the
    /// tangent has the curvature factor `(4C - 1) / (4C - 4)`, plus 1.23 times the mean shear; for an axial force the sum
    /// is Wahl's factor (Wahl, Mechanical Springs, chapter 2). Bending about the coil axis has the factor of a curved
    /// bar, `(4C^2 - C - 1) / (4C (C - 1))`; bending about n has none. The pitch angle is assumed to be small.
    pub(super) fn stress_at(&self, section: &WireLoad, k: usize) -> WireStress {
        let c = self.index();
        let (curved_torsion, curved_bending) =
            ((4.0 * c - 1.0) / (4.0 * c - 4.0), (4.0 * c * c - c - 1.0) / (4.0 * c * (c - 1.0)));
        let modulus = PI * self.diameter_m.powi(3) / 32.0;
        let area = 0.25 * PI * self.diameter_m.powi(2);
        let (sin, cos) = (TAU * k as f64 / ANGLES as f64).sin_cos();
        let (outward, along) = (Vector::new(cos, sin, 0.0), Vector::new(-sin, cos, 0.0));
        let moment = section.moment - (outward * self.coil_radius_m).cross(&section.force);
        let tension = section.force.dot(&along);
        let across = section.force - along * tension;
        let torsion = 0.5 * moment.dot(&along) / modulus * curved_torsion;
        WireStress {
            shear_pa: torsion + torsion.signum() * 1.23 * across.norm() / area,
            radial_bending_pa: moment.dot(&outward) / modulus,
            axial_bending_pa: moment.z * curved_bending / modulus,
            tension_pa: tension / area,
        }
    }

    /// Maximum von Mises stress in the wire at a section, Pa.
    pub fn equivalent_stress_pa(&self, section: &WireLoad) -> f64 {
        (0..ANGLES).map(|k| self.stress_at(section, k).von_mises_pa()).fold(0.0, f64::max)
    }

    /// Yield stress of the wire, Pa; `None` if unknown.
    pub fn yield_pa(&self) -> Option<f64> {
        self.material.yield_pa(self.diameter_m)
    }
}

/// Ends of the active coils of a spring in their attachments, and the body that it carries.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpringMounting {
    base_from_foot: Pose,
    head_from_top: Pose,
    body: Body,
    /// Mass of the wire, if the head models it; else 0.
    wire_mass_kg: f64,
}

impl SpringMounting {
    /// The mounting of a head on a single spring; `None` for other linkages.
    pub fn of(spec: &HeadSpec, body: &Body) -> Option<Self> {
        let LinkageSpec::Spring { spring, base_from_spring, head_from_spring, spring_mass, .. } = &spec.linkage else {
            return None;
        };
        let end = Pose::translation(0.0, 0.0, spring.end_length_m().ok()?);
        Some(Self {
            base_from_foot: base_from_spring.pose() * end,
            head_from_top: head_from_spring.pose() * end.inverse(),
            body: *body,
            wire_mass_kg: spring_mass.of_wire(spring).ok()?.unwrap_or(0.0),
        })
    }

    /// Distance from foot to top with the head at a pose, m.
    pub fn length_m(&self, base_from_head: &Pose) -> f64 {
        let top = (base_from_head * self.head_from_top).translation.vector;
        (top - self.base_from_foot.translation.vector).norm()
    }

    /// Loads on the foot and the top of the spring: weight and inertial force of the head and of half of the wire, at the top
    /// (d'Alembert).
    pub fn ends(&self, state: &HeadState) -> [WireLoad; 2] {
        let centre =
            state.head.of_frame(&Pose::from_parts(self.body.centre_of_mass_in_head.into(), Default::default()));
        let force = (gravity_in_world() - centre.acceleration_in_world) * self.body.mass_kg;
        let rotation = centre.world_from_body.rotation;
        let in_head = |v: Vector| rotation.inverse() * v;
        let omega = in_head(state.head.angular_velocity_in_world);
        let inertia = self.body.inertia_in_head;
        let spin = inertia * in_head(state.head.angular_acceleration_in_world) + omega.cross(&(inertia * omega));
        let top = state.head.of_frame(&self.head_from_top);
        let of_wire = (gravity_in_world() - top.acceleration_in_world) * (0.5 * self.wire_mass_kg);
        let ends = [state.base.world_from_body * self.base_from_foot, top.world_from_body];
        ends.map(|world_from_end| {
            let arm = |point: &Kinematics| point.world_from_body.translation.vector - world_from_end.translation.vector;
            let moment = arm(&centre).cross(&force) + arm(&top).cross(&of_wire) - rotation * spin;
            let in_end = world_from_end.rotation.inverse();
            WireLoad { force: in_end * (force + of_wire), moment: in_end * moment }
        })
    }

    /// Maximum von Mises stress in the wire at the two ends, Pa.
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
    fn bending_of_the_spring_alternates_between_bending_and_torsion_of_the_wire() {
        // A radial moment bends the wire, 32 M / (pi d^3); a tangential moment twists it.
        let section = WireLoad { force: Vector::zeros(), moment: Vector::x() * 0.5 };
        let bent = 32.0 * 0.5 / (PI * 0.003_f64.powi(3));
        let stress = WIRE.equivalent_stress_pa(&section);
        assert!(stress >= bent * (1.0 - 1e-12) && stress < 1.1 * bent, "{stress} {bent}");
    }

    #[test]
    fn a_thicker_wire_has_less_strength() {
        // Music wire of 1 mm: 2211 MPa, 45 % of it in torsion, sqrt(3) times that in bending.
        let thin = Wire { diameter_m: 1e-3, ..WIRE };
        assert_relative_eq!(thin.yield_pa().unwrap(), 3_f64.sqrt() * 0.45 * 2211e6, max_relative = 1e-12);
        assert!(WIRE.yield_pa() < thin.yield_pa());
    }
}
