//! A helical spring as an elastic rod along its wire, under an axial load.
//!
//! The wire is a geometrically exact rod (Reissner 1981; Simo 1985) of circular section, which bends, twists, shears and stretches.
//! In the axes that turn with the wire, a helix under an axial force has constant strain and constant load. The motion of
//! a section and the change of its load are therefore linear differential equations with constant coefficients:
//!
//! ```text
//! eta' = -ad(xi) eta + C w        w' = ad(xi)^T w + (C w) * W        (eta, w)(s) = exp(A s) (eta, w)(0)
//! ```
//!
//! `xi` is the strain (motion along the wire by length of wire), `W` the load, `eta` the displacement and `w` the change of the load;
//! `C` is the compliance of a unit of length of wire. All refer to a frame on the axis of the loaded helix, rigidly attached to
//! the section: x towards the section, z along the axis.

use super::deformation::blocks;
use super::{Coil, ElasticityError, Matrix6};
use nalgebra::{Matrix2, SMatrix, UnitQuaternion, Vector2};
use zsim_base::geometry::{Matrix, Pose, Rotation, Vector, skew};

/// Maximum Newton iterations for the loaded helix.
const MAX_ITERATIONS: usize = 50;
/// Largest turn of the axis relative to the clamped wire, rad, and change of the radius by its value. Springs of steel yield at a
/// third of it.
const MAX_CHANGE: f64 = 0.35;

/// The helix under an axial load: a state of constant strain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Helix {
    /// Length of the active wire, m.
    wire_m: f64,
    /// Axial length by length of wire.
    rise: f64,
    /// Turning about the axis by length of wire, rad/m; negative for a left-handed coil. Without load, and with it.
    free_turning: f64,
    turning: f64,
    /// Angle at which the wire begins, rad.
    start_rad: f64,
    load_n: f64,
    /// Compliance of a unit of length of wire, in the frame on the axis.
    compliance: Matrix6,
    /// The frame on the axis of the loaded helix, relative to that of the unloaded one: both belong to the same section.
    free_from_loaded: Pose,
}

/// A portion of the helix between two sections.
pub(super) struct Portion {
    /// Length along the axis, m.
    pub(super) length_m: f64,
    /// Stiffness of the end, load included, with the beginning clamped; axes of the beginning, about the end.
    pub(super) at_top: Matrix6,
    /// Angle by which the wire turns about the axis, rad.
    pub(super) turn_rad: f64,
}

/// Section properties of the unloaded coil in the axes of a section: x away from the axis, z parallel to it.
struct Wire {
    radius_m: f64,
    tangent: Vector,
    /// Curvature and torsion without load, 1/m: the turning about the axis.
    turning: f64,
    /// Strain by force, 1/N, and curvature by moment, 1/(N m^2).
    by_force: Matrix,
    by_moment: Matrix,
}

impl Wire {
    fn new(coil: &Coil) -> Self {
        let radius_m = 0.5 * coil.coil_diameter_m();
        let per_turn_m = coil.wire_per_turn_m();
        let around_m = std::f64::consts::TAU * radius_m;
        let hand = if coil.winding().left_handed { -1.0 } else { 1.0 };
        let tangent =
            Vector::new(0.0, hand * around_m / per_turn_m, coil.free_length_m() / coil.active_coils() / per_turn_m);
        let moduli = coil.moduli();
        let area = std::f64::consts::PI * coil.wire_diameter_m().powi(2) / 4.0;
        let second_moment = area * coil.wire_diameter_m().powi(2) / 16.0;
        let along = tangent * tangent.transpose();
        let across = Matrix::identity() - along;
        // Shear coefficient of a circular section (Cowper 1966).
        let poisson = moduli.poisson();
        let shear_area = area * 6.0 * (1.0 + poisson) / (7.0 + 6.0 * poisson);
        Self {
            radius_m,
            tangent,
            turning: hand * std::f64::consts::TAU / per_turn_m,
            by_force: across / (moduli.shear_pa * shear_area) + along / (moduli.youngs_pa * area),
            by_moment: across / (moduli.youngs_pa * second_moment) + along / (2.0 * moduli.shear_pa * second_moment),
        }
    }

    /// The loaded helix with `radius_m` and with its axis turned by `tilt_rad` about the section's x.
    ///
    /// Its axis, the derivative of a point on the axis by the length of wire, and the turning, in the axes of the section.
    fn loaded(&self, load_n: f64, tilt_rad: f64, radius_m: f64) -> (Vector, Vector, Vector) {
        let axis = Vector::new(0.0, -tilt_rad.sin(), tilt_rad.cos());
        let force = -load_n * axis;
        let moment = Vector::x().cross(&axis) * (load_n * radius_m);
        let turning = Vector::z() * self.turning + self.by_moment * moment;
        let along = self.tangent + self.by_force * force - turning.cross(&Vector::x()) * radius_m;
        (axis, along, turning)
    }
}

impl Helix {
    /// The coil under `load_n`, compression positive, whose ends are free to turn about the axis.
    ///
    /// # Errors
    /// When the load is beyond the range in which the wire stays a helix.
    pub(super) fn new(coil: &Coil, load_n: f64) -> Result<Self, ElasticityError> {
        let wire = Wire::new(coil);
        let out_of_range = || ElasticityError::NotAHelix { load_n };
        // Both the turning and the motion of the axis are parallel to the axis.
        let residual = |x: &Vector2<f64>| {
            let (axis, along, turning) = wire.loaded(load_n, x[0], wire.radius_m * (1.0 + x[1]));
            let across = axis.cross(&Vector::x());
            Vector2::new(turning.dot(&across) * wire.radius_m, along.dot(&across))
        };
        let mut x = Vector2::zeros();
        for iteration in 0.. {
            let step = 1e-6;
            let by = |d: Vector2<f64>| (residual(&(x + d)) - residual(&(x - d))) / (2.0 * step);
            let slope = Matrix2::from_columns(&[by(Vector2::new(step, 0.0)), by(Vector2::new(0.0, step))]);
            let change = slope.lu().solve(&residual(&x)).ok_or_else(out_of_range)?;
            x -= change;
            if change.amax() < 1e-13 {
                break;
            }
            if iteration > MAX_ITERATIONS || x.amax() > MAX_CHANGE || x.amax().is_nan() {
                return Err(out_of_range());
            }
        }
        Self::of_wire(coil, &wire, load_n, x[0], wire.radius_m * (1.0 + x[1])).ok_or_else(out_of_range)
    }

    fn of_wire(coil: &Coil, wire: &Wire, load_n: f64, tilt_rad: f64, radius_m: f64) -> Option<Self> {
        let (axis, along, turning) = wire.loaded(load_n, tilt_rad, radius_m);
        let axes = Matrix::from_columns(&[Vector::x(), axis.cross(&Vector::x()), axis]);
        // A wrench about the axis gives a moment about the section, and the strain there gives one at the axis.
        let (zero, lever) = (Matrix::zeros(), skew(&(Vector::x() * radius_m)));
        let carry = blocks(&Matrix::identity(), &lever, &zero, &Matrix::identity());
        let turned = |m: &Matrix| axes.tr_mul(&(m * axes));
        let of_section = blocks(&turned(&wire.by_force), &zero, &zero, &turned(&wire.by_moment));
        let rotation = Rotation::from_scaled_axis(Vector::x() * tilt_rad);
        let rise = along.dot(&axis);
        (rise > 0.0).then(|| Self {
            wire_m: coil.wire_per_turn_m() * coil.active_coils(),
            rise,
            free_turning: wire.turning,
            turning: turning.dot(&axis),
            start_rad: coil.winding().start_rad,
            load_n,
            compliance: carry * of_section * carry.transpose(),
            free_from_loaded: Pose::from_parts((Vector::x() * (wire.radius_m - radius_m)).into(), rotation),
        })
    }

    /// Length of the loaded helix along its axis, m.
    pub(super) fn length_m(&self) -> f64 {
        self.rise * self.wire_m
    }

    /// One of `count` equal portions. The wire of the first begins on x.
    ///
    /// `None` if the stiffness is singular.
    pub(super) fn portion(&self, count: usize) -> Option<Portion> {
        let wire_m = self.wire_m / count as f64;
        let transfer = (self.coefficients() * wire_m).exp();
        let displaced = transfer.fixed_view::<6, 6>(0, 6).into_owned();
        let loaded = transfer.fixed_view::<6, 6>(6, 6).into_owned();
        // The load turns with the section: in fixed axes, its change has the turning in addition.
        let force = skew(&(Vector::z() * self.load_n));
        let turned = blocks(&Matrix::zeros(), &force, &Matrix::zeros(), &Matrix::zeros());
        let at_top = (loaded + turned * displaced) * displaced.try_inverse()?;
        let turn_rad = self.turning * wire_m;
        Some(Portion { length_m: self.rise * wire_m, at_top: about_axis(&at_top, turn_rad), turn_rad })
    }

    /// The coefficients A of `(eta, w)' = A (eta, w)`.
    fn coefficients(&self) -> SMatrix<f64, 12, 12> {
        let (along, turning) = (skew(&(Vector::z() * self.rise)), skew(&(Vector::z() * self.turning)));
        let zero = Matrix::zeros();
        let adjoint = blocks(&turning, &along, &zero, &turning);
        let force = skew(&(Vector::z() * -self.load_n));
        let by_strain = blocks(&zero, &force, &force, &zero) * self.compliance;
        let mut coefficients = SMatrix::<f64, 12, 12>::zeros();
        coefficients.fixed_view_mut::<6, 6>(0, 0).copy_from(&-adjoint);
        coefficients.fixed_view_mut::<6, 6>(0, 6).copy_from(&self.compliance);
        coefficients.fixed_view_mut::<6, 6>(6, 6).copy_from(&(by_strain - blocks(&turning, &zero, &along, &turning)));
        coefficients
    }

    /// The frame at the foot of the loaded helix, z along its axis, relative to the clamped foot.
    ///
    /// The load changes the pitch of the wire, whose ends are clamped: the axis leans.
    pub(super) fn foot_from_axis(&self) -> Pose {
        turned(self.start_rad) * self.free_from_loaded * turned(-self.start_rad)
    }

    /// The clamped top relative to the frame at the top of the loaded helix.
    pub(super) fn axis_from_top(&self) -> Pose {
        let (loaded_rad, free_rad) = (self.turning * self.wire_m, self.free_turning * self.wire_m);
        turned(self.start_rad + loaded_rad) * self.free_from_loaded.inverse() * turned(-self.start_rad - free_rad)
    }

    /// Angle at which the wire begins, rad.
    pub(super) fn start_rad(&self) -> f64 {
        self.start_rad
    }
}

/// A rotation about z.
fn turned(angle_rad: f64) -> Pose {
    Pose::from_parts(Vector::zeros().into(), UnitQuaternion::from_axis_angle(&Vector::z_axis(), angle_rad))
}

/// A stiffness turned about z.
pub(super) fn about_axis(stiffness: &Matrix6, angle_rad: f64) -> Matrix6 {
    let axes = *Rotation::from_axis_angle(&Vector::z_axis(), angle_rad).to_rotation_matrix().matrix();
    let zero = Matrix::zeros();
    let both = blocks(&axes, &zero, &zero, &axes);
    both * stiffness * both.transpose()
}
