//! The load on a cross-section of a spring, and the gap between its coils there.

use super::{Coil, Vector6, split};
use zsim_base::geometry::Pose;

/// The part of the load on a cross-section that moves the coils towards each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SectionLoad {
    /// Axial force, compression positive, N.
    pub axial_n: f64,
    /// Bending moment, N m.
    pub bending_nm: f64,
}

impl SectionLoad {
    /// The load by a wrench about the centre of the section, in a frame whose z is the axis of the spring there.
    ///
    /// The wrench acts from the side of the foot on that of the top, so that a compressed spring pushes along +z.
    pub fn of_wrench(wrench: &Vector6) -> Self {
        let (force, torque) = split(wrench);
        Self { axial_n: force.z, bending_nm: torque.xy().norm() }
    }

    /// The load by a wrench about the centre of a section at `base_from_section`, in the axes of the base.
    pub(super) fn in_base(base_from_section: &Pose, wrench: &Vector6) -> Self {
        let (force, torque) = split(wrench);
        let to_section = base_from_section.rotation.inverse();
        Self { axial_n: (to_section * force).z, bending_nm: (to_section * torque).xy().norm() }
    }
}

impl Coil {
    /// Stiffness against bending of the whole spring by a constant moment, `E d^4 / (32 D n (2 + nu))`, N m/rad.
    ///
    /// It does not depend on the length: each coil bends by `1 / n` of the angle (Timoshenko & Gere, 2.19).
    pub fn bending_nm_per_rad(&self) -> f64 {
        self.moduli().youngs_pa * self.wire_diameter_m().powi(4)
            / (32.0 * self.coil_diameter_m() * self.active_coils() * (2.0 + self.moduli().poisson()))
    }

    /// Gap between neighbouring coils on the inner side of the bend at a section, m; negative where the coils clash.
    ///
    /// The distance of the wire's centres along the axis is `(L0 - P / k) / n`. A moment M bends each coil by
    /// `M / (n K)`, with the bending stiffness K of the whole spring, which brings the centres of the wire nearer by the
    /// mean radius times that angle. The gap is the rest after the diameter of the wire. Shear is neglected: it moves
    /// the coils across the gap.
    pub fn inner_gap_m(&self, load: &SectionLoad) -> f64 {
        self.straight_gap_m(load.axial_n) - self.closing_m(load.bending_nm)
    }

    /// Gap between neighbouring coils of the straight spring under an axial load, compression positive, m.
    pub fn straight_gap_m(&self, axial_n: f64) -> f64 {
        let open_m = self.free_length_m() - self.solid_length_m() - axial_n / self.axial_n_per_m();
        open_m / self.active_coils()
    }

    /// Distance by which a moment closes the gap between neighbouring coils on the inner side, m.
    pub fn closing_m(&self, bending_nm: f64) -> f64 {
        0.5 * self.coil_diameter_m() * bending_nm / (self.bending_nm_per_rad() * self.active_coils())
    }

    /// Smallest gap between neighbouring coils that EN 13906-1 permits in operation, m.
    ///
    /// `0.0015 D^2 / d + 0.1 d` a coil, for static loads and cold-coiled springs.
    pub fn standard_gap_m(&self) -> f64 {
        // The first coefficient has the unit of the formula: D and d in mm give mm.
        0.0015 * self.coil_diameter_m().powi(2) / self.wire_diameter_m() + 0.1 * self.wire_diameter_m()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Moduli, Spring};
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::geometry::{Rotation, Vector};

    fn coil() -> Coil {
        Coil::new(0.025, 0.003, 12.0, 0.12, Moduli { youngs_pa: 206e9, shear_pa: 79.3e9 }).unwrap()
    }

    #[test]
    fn an_arc_closes_the_gap_by_the_geometry_of_a_circle() {
        // Neighbouring wires on the inner side of an arc of length L and angle phi are `(L - R phi) / n` apart. n = 12, R = 12.5 mm,
        // and the wire fills 36 mm.
        let coil = coil();
        let spring = Spring::of_column(&coil.under_load(0.0).unwrap(), 4).unwrap();
        for phi in [0.3, 1.0, 2.0] {
            let radius_m = 0.12 / phi;
            let chord = Vector::new(radius_m * (1.0 - f64::cos(phi)), 0.0, radius_m * f64::sin(phi));
            let top = Pose::from_parts(chord.into(), Rotation::from_scaled_axis(Vector::y() * phi));
            let loads = spring.section_loads(&mut spring.state(), &top).unwrap();
            assert_eq!(loads.len(), 8);
            for load in &loads {
                assert_relative_eq!(coil.inner_gap_m(load), (0.12 - 0.036 - 0.0125 * phi) / 12.0, epsilon = 1e-8);
            }
        }
    }

    #[test]
    fn the_moment_at_the_foot_of_a_cantilever_is_force_times_length() {
        let coil = coil();
        let spring = Spring::of_column(&coil.under_load(0.0).unwrap(), 2).unwrap();
        let stiffness = super::super::loaded_stiffness(&coil.under_load(0.0).unwrap()).unwrap();
        // The displacement of the top under a lateral force of 0.01 N.
        let moved = stiffness.try_inverse().unwrap() * Vector6::new(0.01, 0.0, 0.0, 0.0, 0.0, 0.0);
        let (shift, turn) = split(&moved);
        let top = Pose::from_parts((Vector::z() * 0.12 + shift).into(), Rotation::from_scaled_axis(turn));
        let loads = spring.section_loads(&mut spring.state(), &top).unwrap();
        assert_relative_eq!(loads[0].bending_nm, 0.01 * 0.12, max_relative = 1e-3);
        assert_relative_eq!(loads[1].bending_nm, 0.01 * 0.06, max_relative = 1e-3);
        assert!(loads[3].bending_nm < 1e-6, "{loads:?}");
    }

    #[test]
    fn the_standard_gap_is_that_of_the_formula_in_millimetres() {
        // 0.0015 * 25^2 / 3 + 0.1 * 3 = 0.6125 mm.
        assert_relative_eq!(coil().standard_gap_m(), 0.6125e-3, max_relative = 1e-12);
    }
}
