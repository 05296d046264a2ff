//! Test heads and base motions.

use zsim::dynamics::{DynamicsError, HeadModel, HeadSimulation, HeadSpec, HeadState};
use zsim::elasticity::{Vector6, stack};
use zsim::geometry::{Kinematics, Pose, Rotation, Vector, from_roll_pitch_yaw};
use zsim::motion::BaseMotion;
use zsim::spec::{Source, parse};

/// The reference head: 0.40 kg, centre of mass 70 mm above the spring, 9e-4 kg m^2. Its frame is the spring's top.
pub struct ReferenceHead {
    /// Mean coil diameter, wire diameter, active coils, free length, mm.
    pub coil: [f64; 4],
    pub segments: usize,
    /// Damping ratios of rocking, sway, bounce and yaw.
    pub damping: [f64; 4],
    pub hanging: bool,
    /// Further keys of the linkage, as text.
    pub more: &'static str,
}

impl Default for ReferenceHead {
    fn default() -> Self {
        Self { coil: [25.0, 3.0, 12.0, 120.0], segments: 1, damping: [0.0; 4], hanging: false, more: "" }
    }
}

impl ReferenceHead {
    pub fn text(&self) -> String {
        let ([coil, wire, coils, length], [rocking, sway, bounce, yaw]) = (self.coil, self.damping);
        let (segments, more) = (self.segments, self.more);
        let mass = if more.contains("spring_mass") { "" } else { "spring_mass: neglected," };
        let roll = if self.hanging { 180.0 } else { 0.0 };
        format!(
            "(
    parts: [body(
        name: \"head\",
        mass_kg: 0.40,
        centre_of_mass_m: (0.0, 0.0, 0.07),
        inertia_kg_m2: (xx: 9e-4, yy: 9e-4, zz: 4e-4),
    )],
    head_from_laser: (position_m: (0.0, 0.0, 0.1)),
    head_from_imu: (position_m: (0.01, 0.0, 0.03), roll_pitch_yaw_deg: (0.0, 0.0, 90.0)),
    linkage: spring(
        spring: coil(
            coil_diameter_mm: {coil}, wire_diameter_mm: {wire}, active_coils: {coils:?}, free_length_mm: {length},
            material: spring_steel,
        ),
        segments: {segments},
        base_from_spring: (position_m: (0.0, 0.0, 0.0), roll_pitch_yaw_deg: ({roll:?}, 0.0, 0.0)),
        head_from_spring: (position_m: (0.0, 0.0, 0.0)), {mass}
        damping_ratio: (rocking: {rocking:?}, sway: {sway:?}, bounce: {bounce:?}, yaw: {yaw:?}),
        {more}
    ),
)"
        )
    }

    pub fn model(&self) -> HeadModel {
        built(&self.text()).unwrap()
    }
}

/// A head in a suspension of `elements` close to `place` in the base, as text.
///
/// 0.40 kg, 9e-4 kg m^2 about x and y and 4e-4 about z, centre of mass at the origin; damped only by its elements.
pub fn suspended(place: [f64; 3], elements: &str) -> String {
    let [x, y, z] = place;
    format!(
        "(
    parts: [body(
        name: \"head\",
        mass_kg: 0.40,
        centre_of_mass_m: (0.0, 0.0, 0.0),
        inertia_kg_m2: (xx: 9e-4, yy: 9e-4, zz: 4e-4),
    )],
    head_from_laser: (position_m: (0.0, 0.0, 0.0)),
    head_from_imu: (position_m: (0.0, 0.0, 0.0)),
    linkage: suspension(
        base_from_head: (position_m: ({x:?}, {y:?}, {z:?})),
        elements: [{elements}],
        damping_ratio: (rocking: 0.0, sway: 0.0, bounce: 0.0, yaw: 0.0),
    ),
)"
    )
}

/// A cord between a point of the base and one of the head.
pub fn cord(base: [f64; 3], head: [f64; 3], length_m: f64, ea_n: f64) -> String {
    format!(
        "cord((base_point_m: ({:?}, {:?}, {:?}), head_point_m: ({:?}, {:?}, {:?}), length_m: {length_m:?},
            stiffness: ea_n({ea_n:?}), damping_n_s_per_m: 0.0)),",
        base[0], base[1], base[2], head[0], head[1], head[2]
    )
}

/// A vertical spring of 20/2.5/8/80 mm without mass from a point of the base up to a point of the head.
pub fn upright_spring(base: [f64; 3], head: [f64; 3]) -> String {
    format!(
        "spring((spring: coil(coil_diameter_mm: 20.0, wire_diameter_mm: 2.5, active_coils: 8.0, free_length_mm: 80.0,
            material: spring_steel), segments: 1, spring_mass: neglected,
            base_from_spring: (position_m: ({:?}, {:?}, {:?})), head_from_spring: (position_m: ({:?}, {:?}, {:?})))),",
        base[0], base[1], base[2], head[0], head[1], head[2]
    )
}

/// A float of 80 mm radius and 60 mm height whose bottom is 70 mm below the head's origin, in water, without drag.
pub fn floating(more: [f64; 4]) -> String {
    let [linear, squared, turning, added] = more;
    format!(
        "float((base_surface_m: (0.0, 0.0, 0.0), head_bottom_m: (0.0, 0.0, -0.07), radius_m: 0.08, height_m: 0.06,
            density_kg_per_m3: 1000.0, drag_n_s_per_m: {linear:?}, drag_n_s2_per_m2: {squared:?},
            drag_nm_s_per_rad: {turning:?}, added_mass_kg: {added:?})),"
    )
}

/// A universal joint 70 mm below the head's origin.
pub fn jointed(stiffness_nm_per_rad: f64) -> String {
    format!(
        "universal_joint((base_from_joint: (position_m: (0.0, 0.0, 0.0)), head_from_joint: (position_m: (0.0, 0.0, -0.07)),
            stiffness_nm_per_rad: ({stiffness_nm_per_rad:?}, {stiffness_nm_per_rad:?}))),"
    )
}

/// Three soft cords that centre a float.
pub fn moored() -> String {
    [0.0_f64, 120.0, 240.0]
        .map(|degrees| {
            let (s, c) = degrees.to_radians().sin_cos();
            cord([0.3 * c, 0.3 * s, 0.02], [0.08 * c, 0.08 * s, -0.03], 0.15, 0.06)
        })
        .concat()
}

pub fn built(text: &str) -> Result<HeadModel, DynamicsError> {
    let source = Source::in_memory("head.ron", text);
    let spec: HeadSpec = parse(&source)?;
    HeadModel::new(&spec, &source)
}

pub fn shipped(name: &str) -> HeadModel {
    let (spec, source) = zsim::dynamics::load(name).unwrap();
    HeadModel::new(&spec, &source).unwrap()
}

/// A base that does not move.
pub struct FixedBase(pub Pose);

impl BaseMotion for FixedBase {
    fn at(&self, _t_s: f64) -> Kinematics {
        Kinematics::at_rest(self.0)
    }
}

/// A base that makes one pulse `amount (1 - cos(2 pi t / T)) / 2` along x, y, z or in roll, pitch, yaw.
pub struct BasePulse {
    pub axis: usize,
    pub amount: f64,
    pub period_s: f64,
}

impl BaseMotion for BasePulse {
    fn at(&self, t_s: f64) -> Kinematics {
        let rate = std::f64::consts::TAU / self.period_s;
        let phase = rate * t_s.clamp(0.0, self.period_s);
        let (sin, cos) = phase.sin_cos();
        let (place, speed, gain) =
            (0.5 * self.amount * (1.0 - cos), 0.5 * self.amount * rate * sin, 0.5 * self.amount * rate * rate * cos);
        let gain = if (0.0..self.period_s).contains(&t_s) { gain } else { 0.0 };
        let unit = Vector::ith(self.axis % 3, 1.0);
        let (shift, turn) = if self.axis < 3 { (unit, Vector::zeros()) } else { (Vector::zeros(), unit) };
        Kinematics {
            world_from_body: Pose::from_parts((shift * place).into(), Rotation::from_scaled_axis(turn * place)),
            velocity_in_world: shift * speed,
            angular_velocity_in_world: turn * speed,
            acceleration_in_world: shift * gain,
            angular_acceleration_in_world: turn * gain,
        }
    }
}

/// A base that walks and nods: smooth, at rest at the start, aperiodic.
pub struct Nodding {
    pub amount_rad: f64,
}

impl Nodding {
    /// Axis, amount and angular frequency of each part.
    fn parts(&self) -> [(usize, f64, f64); 6] {
        let a = self.amount_rad;
        [(0, 0.20, 0.9), (1, 0.12, 1.7), (2, 0.01, 12.0), (3, 0.4 * a, 5.1), (4, a, 7.3), (5, 2.0 * a, 0.7)]
    }
}

impl BaseMotion for Nodding {
    fn at(&self, t_s: f64) -> Kinematics {
        // sin^3(w t) has zero velocity and acceleration at 0.
        let (mut place, mut speed, mut gain) = (Vector6::zeros(), Vector6::zeros(), Vector6::zeros());
        for (axis, amount, omega) in self.parts() {
            let (s, c) = (omega * t_s).sin_cos();
            place[axis] = amount * s * s * s;
            speed[axis] = 3.0 * amount * omega * s * s * c;
            gain[axis] = 3.0 * amount * omega * omega * (2.0 * s * c * c - s * s * s);
        }
        // Roll, pitch, yaw angles to angular velocity and acceleration: w = Rz Ry ex r' + Rz ey p' + ez y'.
        let (roll, pitch, yaw) = (place[3], place[4], place[5]);
        let rotation = from_roll_pitch_yaw(roll, pitch, yaw);
        let rz = from_roll_pitch_yaw(0.0, 0.0, yaw);
        let (x, y, z) = (from_roll_pitch_yaw(0.0, pitch, yaw) * Vector::x(), rz * Vector::y(), Vector::z());
        let about_y = z * speed[5];
        let about_x = about_y + y * speed[4];
        let omega = x * speed[3] + y * speed[4] + z * speed[5];
        let alpha =
            x * gain[3] + y * gain[4] + z * gain[5] + about_x.cross(&x) * speed[3] + about_y.cross(&y) * speed[4];
        Kinematics {
            world_from_body: Pose::from_parts(Vector::new(place[0], place[1], place[2]).into(), rotation),
            velocity_in_world: Vector::new(speed[0], speed[1], speed[2]),
            angular_velocity_in_world: omega,
            acceleration_in_world: Vector::new(gain[0], gain[1], gain[2]),
            angular_acceleration_in_world: alpha,
        }
    }
}

pub fn states(model: &HeadModel, motion: &dyn BaseMotion, step_s: f64, seconds: f64) -> Vec<HeadState> {
    let count = (seconds / step_s).round() as usize + 1;
    HeadSimulation::new(model, motion, step_s).unwrap().take(count).map(Result::unwrap).collect()
}

/// Displacement of the head's centre of mass and its rotation from rest, in the base's axes.
pub fn displacement(model: &HeadModel, state: &HeadState) -> Vector6 {
    let base_from_head = state.base.world_from_body.inv_mul(&state.head.world_from_body);
    let rest = model.base_from_head_at_rest();
    let centre = nalgebra::Point3::from(model.body().centre_of_mass_in_head);
    let turn = (base_from_head.rotation * rest.rotation.inverse()).scaled_axis();
    stack(&(base_from_head * centre - rest * centre), &turn)
}
