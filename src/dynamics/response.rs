//! Frequency response of the linearised head to base motion: the closed form of the gain curves.

use super::head::{HeadModel, Linkage};
use super::modes::{LinearModel, Mode};
use nalgebra::{Complex, Matrix6x1};
use std::f64::consts::TAU;
use zsim_base::geometry::{Matrix, STANDARD_GRAVITY_M_PER_S2, Vector, skew};
use zsim_elasticity::{Matrix6, Vector6, blocks};
use zsim_motion::Axis;

/// The acceleration whose gain is taken along x, y and z; about the axes it is always the angular rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AccelerationKind {
    /// Kinematic acceleration, without gravity.
    #[default]
    Kinematic,
    /// Specific force, as an accelerometer measures it: a head tilted by phi measures `phi x g` in addition.
    SpecificForce,
}

/// The two points of a gain curve: excitation on the base, response on the head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GainPoints {
    /// Point of the base whose motion is the input, m; rotations are about it.
    pub base_in_base: Vector,
    /// Point of the head whose motion is the output, m.
    pub head_in_head: Vector,
}

/// A local maximum of a gain curve.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Peak {
    /// Frequency, Hz.
    pub freq_hz: f64,
    /// Gain at that frequency.
    pub gain: f64,
}

impl HeadModel {
    /// The points of the paper's gain curves: the base at the foot of the spring, the head at the IMU.
    ///
    /// For a linkage other than a single spring or a joint, the base point is the base's origin.
    pub fn default_points(&self) -> GainPoints {
        let base_in_base = match &self.linkage {
            Linkage::Compliant(compliant) => compliant.foot_in_base(),
            Linkage::Rigid { .. } | Linkage::Actuated(_) => Vector::zeros(),
        };
        GainPoints { base_in_base, head_in_head: self.head_from_imu().translation.vector }
    }

    /// The response of the linearised head to small motions of the base.
    pub fn frequency_response(&self, points: &GainPoints) -> FrequencyResponse {
        let rest = self.base_from_head_at_rest();
        let at_base = lever_matrix(&-points.base_in_base);
        let Some(linear) = self.linear() else {
            let point = rest * nalgebra::Point3::from(points.head_in_head);
            return FrequencyResponse {
                rigid: lever_matrix(&point.coords) * at_base,
                terms: Vec::new(),
                coupling: None,
            };
        };
        let at_head = lever_matrix(&(rest.rotation * (points.head_in_head - self.body().centre_of_mass_in_head)));
        let terms = linear.modes.iter().map(|mode| ModalTerm::of(mode, linear, &at_head, &at_base)).collect();
        FrequencyResponse { rigid: at_head * linear.rigid_motion * at_base, terms, coupling: Coupling::of(linear) }
    }
}

/// The matrix from the displacement of one point of a rigid body to that of another, `to_point` away.
fn lever_matrix(to_point: &Vector) -> Matrix6 {
    blocks(&Matrix::identity(), &-skew(to_point), &Matrix::zeros(), &Matrix::identity())
}

/// The frequency response of a linearised head to its base, as a sum over modes.
///
/// From `M x'' + C x' + K x = Mb b'' + Cb b' + Kb b` (see [`LinearModel`]) with `x = T b + y`, where T b is the rigid
/// motion with the base and y is a combination of the mode shapes `phi_k` (unit modal mass). If damping does not couple
/// the modes, the displacement of the head over that of the base at the angular frequency w is
///
/// `H(w) = T + sum_k phi_k phi_k^T (Kb - K T + i w (Cb - C T) + w^2 (M T - Mb)) / (w_k^2 - w^2 + 2 i zeta_k w_k w)`.
///
/// If it does, the modal amplitudes solve a linear system of six equations (two with a joint). Points other than the
/// centre of mass and the base's origin enter by lever arms. All quantities are in the axes of the upright base; the
/// axes of a moving body differ from these in second order only.
#[derive(Debug, Clone, PartialEq)]
pub struct FrequencyResponse {
    /// The rigid part: `T` between the two points.
    rigid: Matrix6,
    terms: Vec<ModalTerm>,
    coupling: Option<Coupling>,
}

/// The contribution of one mode.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ModalTerm {
    omega: f64,
    damping_ratio: f64,
    shape: Vector6,
    by_displacement: Vector6,
    by_velocity: Vector6,
    by_acceleration: Vector6,
}

impl ModalTerm {
    fn of(mode: &Mode, linear: &LinearModel, at_head: &Matrix6, at_base: &Matrix6) -> Self {
        let work =
            |own: &Matrix6, of_base: &Matrix6| ((of_base - own * linear.rigid_motion) * at_base).tr_mul(&mode.shape);
        Self {
            omega: TAU * mode.frequency_hz,
            damping_ratio: mode.damping_ratio,
            shape: at_head * mode.shape,
            by_displacement: work(&linear.stiffness, &linear.base_stiffness),
            by_velocity: work(&linear.damping, &linear.base_damping),
            by_acceleration: work(&linear.mass, &linear.base_mass),
        }
    }

    /// The modal force of a unit displacement of the base along `input`, at the angular frequency `omega`.
    fn force(&self, input: usize, omega: f64) -> Complex<f64> {
        let still = self.by_displacement[input] - omega * omega * self.by_acceleration[input];
        Complex::new(still, omega * self.by_velocity[input])
    }

    /// The dynamic stiffness of the mode: modal force over modal amplitude.
    fn dynamic_stiffness(&self, omega: f64) -> Complex<f64> {
        Complex::new(self.omega * self.omega - omega * omega, 2.0 * self.damping_ratio * self.omega * omega)
    }
}

/// The off-diagonal part of the modal damping matrix `Phi^T C Phi`.
#[derive(Debug, Clone, PartialEq)]
struct Coupling(Matrix6);

impl Coupling {
    /// The coupling in a linear model; `None` if damping does not couple the modes.
    fn of(linear: &LinearModel) -> Option<Self> {
        let modes = &linear.modes;
        let of_pair = |i: usize, k: usize| match (modes.get(i), modes.get(k)) {
            (Some(one), Some(other)) if i != k => one.shape.dot(&(linear.damping * other.shape)),
            _ => 0.0,
        };
        let between = Matrix6::from_fn(of_pair);
        let own = modes.iter().map(|mode| 2.0 * mode.damping_ratio * TAU * mode.frequency_hz).fold(0.0, f64::max);
        (between.amax() > 1e-9 * own).then_some(Self(between))
    }
}

/// Lowest frequency for gains of specific force, Hz: below it numerator and denominator both vanish.
const MIN_FREQUENCY_HZ: f64 = 1e-3;

impl FrequencyResponse {
    /// Displacement and rotation at the head's point over the base's displacement along or about `input`.
    ///
    /// At `freq_hz`; order x, y, z, about x, about y, about z.
    pub fn displacement(&self, input: Axis, freq_hz: f64) -> Matrix6x1<Complex<f64>> {
        let column = index(input);
        let start = self.rigid.column(column).map(|x| Complex::new(x, 0.0));
        let amplitudes = self.amplitudes(column, TAU * freq_hz);
        self.terms
            .iter()
            .zip(&amplitudes)
            .fold(start.into_owned(), |sum, (term, amplitude)| sum + term.shape.map(|x| amplitude * x))
    }

    /// Amplitude of each mode over the base's displacement along or about `input`, at `freq_hz`; zero for absent modes.
    ///
    /// The modes move the head relative to the rigid motion with the base; their shapes have unit modal mass.
    pub fn modal_amplitudes(&self, input: Axis, freq_hz: f64) -> Matrix6x1<Complex<f64>> {
        self.amplitudes(index(input), TAU * freq_hz)
    }

    /// Modal amplitudes for a unit displacement of the base along `input` at `omega`; zero for absent modes.
    fn amplitudes(&self, input: usize, omega: f64) -> Matrix6x1<Complex<f64>> {
        let zero = Complex::new(0.0, 0.0);
        let force = Matrix6x1::from_fn(|k, _| self.terms.get(k).map_or(zero, |term| term.force(input, omega)));
        let dynamic_stiffness =
            |k: usize| self.terms.get(k).map_or(Complex::new(1.0, 0.0), |term| term.dynamic_stiffness(omega));
        let uncoupled = || Matrix6x1::from_fn(|k, _| force[k] / dynamic_stiffness(k));
        match &self.coupling {
            None => uncoupled(),
            Some(Coupling(between)) => {
                let mut all = between.map(|c| Complex::new(0.0, omega * c));
                (0..6).for_each(|k| all[(k, k)] = dynamic_stiffness(k));
                all.lu().solve(&force).unwrap_or_else(uncoupled)
            }
        }
    }

    /// The head's rate or acceleration over the base's, both along or about `axis`, at `freq_hz`.
    pub fn transfer(&self, axis: Axis, freq_hz: f64, acceleration: AccelerationKind) -> Complex<f64> {
        let row = index(axis);
        let gravity_term = match (acceleration, axis) {
            // (phi x g) is -g phi_y along x and g phi_x along y; dividing by -w^2 converts it to displacement.
            (AccelerationKind::SpecificForce, Axis::X) => Some((4, STANDARD_GRAVITY_M_PER_S2)),
            (AccelerationKind::SpecificForce, Axis::Y) => Some((3, -STANDARD_GRAVITY_M_PER_S2)),
            _ => None,
        };
        let freq_hz = if gravity_term.is_some() { freq_hz.max(MIN_FREQUENCY_HZ) } else { freq_hz };
        let omega = TAU * freq_hz;
        let measured = |of: &dyn Fn(usize) -> f64| match gravity_term {
            Some((turn, g)) => of(row) + of(turn) * g / (omega * omega),
            None => of(row),
        };
        let start = Complex::new(measured(&|k| self.rigid[(k, row)]), 0.0);
        let amplitudes = self.amplitudes(row, omega);
        self.terms
            .iter()
            .zip(&amplitudes)
            .fold(start, |sum, (term, amplitude)| sum + amplitude * measured(&|k| term.shape[k]))
    }

    /// The gain: the modulus of [`FrequencyResponse::transfer`].
    pub fn gain(&self, axis: Axis, freq_hz: f64, acceleration: AccelerationKind) -> f64 {
        self.transfer(axis, freq_hz, acceleration).norm()
    }

    /// The local maxima of a gain curve between 0 and `up_to_hz`, lowest frequency first.
    pub fn peaks(&self, axis: Axis, up_to_hz: f64, acceleration: AccelerationKind) -> Vec<Peak> {
        let grid = self.grid(axis, up_to_hz);
        let gain = |freq_hz: f64| self.gain(axis, freq_hz, acceleration);
        let gains: Vec<f64> = grid.iter().map(|f| gain(*f)).collect();
        let is_top = |k: &usize| gains[*k] > gains[k - 1] && gains[*k] >= gains[k + 1];
        (1..grid.len().saturating_sub(1))
            .filter(is_top)
            .map(|k| {
                let freq_hz = maximum(gain, grid[k - 1], grid[k + 1]);
                Peak { freq_hz, gain: gain(freq_hz) }
            })
            .collect()
    }

    /// The largest of the [`FrequencyResponse::peaks`].
    pub fn peak(&self, axis: Axis, up_to_hz: f64, acceleration: AccelerationKind) -> Option<Peak> {
        self.peaks(axis, up_to_hz, acceleration).into_iter().max_by(|a, b| a.gain.total_cmp(&b.gain))
    }

    /// Frequencies from 0 to `up_to_hz`, refined around the modes that `axis` excites.
    ///
    /// The refinement step is half a bandwidth.
    fn grid(&self, axis: Axis, up_to_hz: f64) -> Vec<f64> {
        let column = index(axis);
        let part = |term: &ModalTerm| {
            term.force(column, term.omega).norm() * term.shape[column].abs() / (term.omega * term.omega)
        };
        let largest = self.terms.iter().map(part).fold(0.0, f64::max);
        let mut grid: Vec<f64> = (0..=64).map(|k| up_to_hz * f64::from(k) / 64.0).collect();
        for term in self.terms.iter().filter(|term| part(term) > 1e-9 * largest) {
            let width = term.damping_ratio.clamp(1e-5, 0.2);
            grid.extend((-16..=16).map(|k| term.omega / TAU * (0.5 * width * f64::from(k)).exp()));
        }
        grid.retain(|f| (0.0..=up_to_hz).contains(f));
        grid.sort_by(f64::total_cmp);
        grid.dedup_by(|a, b| *a - *b < 1e-12 * *b);
        grid
    }
}

fn index(axis: Axis) -> usize {
    axis as usize
}

/// The position of the maximum between two limits, by golden-section search to a relative accuracy of 1e-8.
fn maximum(f: impl Fn(f64) -> f64, low: f64, high: f64) -> f64 {
    let golden = 0.5 * (5_f64.sqrt() - 1.0);
    let (mut low, mut high) = (low, high);
    let (mut left, mut right) = (high - golden * (high - low), low + golden * (high - low));
    let (mut at_left, mut at_right) = (f(left), f(right));
    while high - low > 1e-8 * high {
        if at_left > at_right {
            (high, right, at_right) = (right, left, at_left);
            left = high - golden * (high - low);
            at_left = f(left);
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = low + golden * (high - low);
            at_right = f(right);
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DampingSpec, HeadSpec, LinkageSpec, load};
    use approx::assert_relative_eq;
    use zsim_base::spec::{Source, parse};
    use zsim_elasticity::{SpringDesign, SpringSpec, StiffnessRow, loaded_stiffness};

    fn head(change: impl FnOnce(&mut HeadSpec)) -> HeadModel {
        let (mut spec, source) = load("handheld").unwrap();
        change(&mut spec);
        HeadModel::new(&spec, &source).unwrap()
    }

    /// The handheld head on a spring whose stiffness does not couple bounce, yaw and bending.
    fn on_column(ratio: f64) -> HeadModel {
        head(|spec| {
            let LinkageSpec::Spring { spring, segments, damping_ratio, .. } = &mut spec.linkage else { return };
            let SpringDesign::Coil(coil) = spring.design().unwrap() else { return };
            let column = coil.under_load(0.35 * 9.80665).unwrap();
            let at_top = loaded_stiffness(&column).unwrap();
            let row = |i| StiffnessRow(std::array::from_fn(|j| at_top[(i, j)]));
            *spring = SpringSpec::Stiffness { length_mm: 1e3 * column.length_m, rows: std::array::from_fn(row) };
            *segments = 1;
            *damping_ratio = DampingSpec { rocking: ratio, sway: ratio, bounce: ratio, yaw: ratio };
        })
    }

    fn damped(ratio: f64) -> HeadModel {
        head(|spec| {
            if let LinkageSpec::Spring { damping_ratio, .. } = &mut spec.linkage {
                *damping_ratio = DampingSpec { rocking: ratio, sway: ratio, bounce: ratio, yaw: ratio };
            }
        })
    }

    /// A head of 0.40 kg, centre of mass 70 mm above an undamped spring of 25/3.0/`coils`/`length_mm` mm.
    fn reference_head(coils: f64, length_mm: f64) -> HeadModel {
        let text = format!(
            "(parts: [body(name: \"h\", mass_kg: 0.4, centre_of_mass_m: (0.0, 0.0, 0.07),
                inertia_kg_m2: (xx: 9e-4, yy: 9e-4, zz: 9e-4))],
              head_from_laser: (position_m: (0.0, 0.0, 0.0)), head_from_imu: (position_m: (0.0, 0.0, 0.0)),
              linkage: spring(spring: coil(coil_diameter_mm: 25.0, wire_diameter_mm: 3.0, active_coils: {coils:?},
                free_length_mm: {length_mm:?}, material: spring_steel), segments: 1,
                base_from_spring: (position_m: (0.0, 0.0, 0.0)), head_from_spring: (position_m: (0.0, 0.0, 0.0)),
                spring_mass: neglected, damping_ratio: (rocking: 0.0, sway: 0.0, bounce: 0.0, yaw: 0.0)))"
        );
        let source = Source::in_memory("table", text);
        HeadModel::new(&parse(&source).unwrap(), &source).unwrap()
    }

    #[test]
    fn gravity_raises_the_static_rotation_gain_of_an_upright_head() {
        // Expected static gains: 1.58 for 25/3.0/8/80, 2.64 for 25/3.0/12/120.
        for (coils, length_mm, expected) in [(8.0, 80.0, 1.58), (12.0, 120.0, 2.64)] {
            let head = reference_head(coils, length_mm);
            let response = head.frequency_response(&head.default_points());
            for axis in [Axis::Roll, Axis::Pitch] {
                assert_relative_eq!(
                    response.gain(axis, 0.0, AccelerationKind::Kinematic),
                    expected,
                    max_relative = 0.02
                );
            }
            for axis in [Axis::X, Axis::Y, Axis::Z, Axis::Yaw] {
                assert_relative_eq!(response.gain(axis, 0.0, AccelerationKind::Kinematic), 1.0, epsilon = 1e-4);
            }
        }
    }

    #[test]
    fn bounce_and_yaw_are_oscillators_of_one_degree_of_freedom() {
        // |H|^2 = (1 + (2 zeta r)^2) / ((1 - r^2)^2 + (2 zeta r)^2), r = f / f0: transmissibility.
        let zeta = 0.02;
        let head = on_column(zeta);
        let response = head.frequency_response(&head.default_points());
        for (axis, kind) in [(Axis::Z, super::super::ModeKind::Bounce), (Axis::Yaw, super::super::ModeKind::Yaw)] {
            let mode = head.linear_modes().iter().find(|mode| mode.kind == kind).unwrap();
            for r in [0.1, 0.9, 1.0, 1.1, 3.0_f64] {
                let c = (2.0 * zeta * r).powi(2);
                let exact = ((1.0 + c) / ((1.0 - r * r).powi(2) + c)).sqrt();
                let gain = response.gain(axis, r * mode.frequency_hz, AccelerationKind::Kinematic);
                assert_relative_eq!(gain, exact, max_relative = 1e-4);
            }
            let peak = response.peak(axis, 60.0, AccelerationKind::Kinematic).unwrap();
            assert_relative_eq!(peak.freq_hz, mode.frequency_hz, max_relative = 1e-3);
            assert_relative_eq!(peak.gain, 1.0 / (2.0 * zeta), max_relative = 2e-3);
        }
    }

    #[test]
    fn the_sum_over_modes_solves_the_equation_of_motion() {
        let shipped = |name: &str| {
            let (spec, source) = load(name).unwrap();
            HeadModel::new(&spec, &source).unwrap()
        };
        // A cable and fluid drag couple the modes; wire and fluid have mass.
        for head in [damped(0.05), shipped("backpack"), shipped("float"), shipped("vehicle_three_springs")] {
            let linear = head.linear().unwrap();
            let response = head.frequency_response(&GainPoints {
                base_in_base: Vector::zeros(),
                head_in_head: head.body().centre_of_mass_in_head,
            });
            for freq_hz in [0.3, 1.3, 7.0] {
                let omega = TAU * freq_hz;
                let complex = |re: &Matrix6, im: &Matrix6| re.zip_map(im, Complex::new);
                let at = |mass: &Matrix6, damping: &Matrix6, stiffness: &Matrix6| {
                    complex(&(stiffness - mass * (omega * omega)), &(damping * omega))
                };
                let left = at(&linear.mass, &linear.damping, &linear.stiffness);
                let right = at(&linear.base_mass, &linear.base_damping, &linear.base_stiffness);
                let exact = left.lu().solve(&right).unwrap();
                for axis in Axis::ALL {
                    let column = response.displacement(axis, freq_hz);
                    let away = (column - exact.column(index(axis))).norm();
                    assert!(away < 1e-9 * column.norm(), "{axis:?} {freq_hz}: {away}");
                }
            }
        }
    }

    #[test]
    fn a_rigid_head_has_unit_gain() {
        let (spec, source) = load("rigid").unwrap();
        let head = HeadModel::new(&spec, &source).unwrap();
        let response = head.frequency_response(&head.default_points());
        assert!(Axis::ALL.iter().all(|axis| response.gain(*axis, 5.0, AccelerationKind::Kinematic) == 1.0));
        assert!(response.peaks(Axis::X, 10.0, AccelerationKind::Kinematic).is_empty());
    }

    #[test]
    fn the_specific_force_of_a_tilted_head_includes_gravity() {
        // Along x: (a_x - g phi_y) / b_x with a = -w^2 d gives the displacement response plus g phi_y / w^2.
        let head = damped(0.05);
        let response = head.frequency_response(&head.default_points());
        let (freq_hz, g) = (2.0, STANDARD_GRAVITY_M_PER_S2);
        let column = response.displacement(Axis::X, freq_hz);
        let exact = column[0] + column[4] * (g / (TAU * freq_hz).powi(2));
        assert_relative_eq!(
            (response.transfer(Axis::X, freq_hz, AccelerationKind::SpecificForce) - exact).norm(),
            0.0,
            epsilon = 1e-12
        );
        assert!(response.gain(Axis::Y, 0.0, AccelerationKind::SpecificForce).is_finite());
    }
}
