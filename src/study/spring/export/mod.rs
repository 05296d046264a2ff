//! A head on its spring as a robot model of other simulators: URDF, SDF and MJCF.
//!
//! The spring becomes three sliding and three turning joints between base and head, each with a stiffness and a damping, through
//! the point where a sideways force does not turn the head. It has the linear modes of the head at rest.

mod mjcf;
mod sdf;
mod urdf;

use crate::dynamics::{Body, CarrierSpec, HeadModel, HeadSpec, LinearModel, PartSpec};
use crate::elasticity::Matrix6;
use crate::geometry::{Pose, STANDARD_GRAVITY_M_PER_S2, Vector};

/// Greatest coupling between joints that may be neglected: the entry of the stiffness over the geometric mean of its diagonals.
const MAX_COUPLING: f64 = 0.05;
/// Mass of wire or fluid that may be neglected, of that of the head.
const MAX_ADDED: f64 = 0.001;
/// Mass of the links between the joints, kg: simulators want one.
const LINK_MASS_KG: f64 = 1e-6;
/// Moment of inertia of these links, kg m^2.
const LINK_INERTIA_KG_M2: f64 = 1e-9;

/// Why a head has no such model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ExportError {
    /// The linkage is not elastic in six directions.
    #[error("only a head on springs has a model with six elastic joints: {0}")]
    NotElastic(&'static str),
    /// Wire or fluid moves with the head.
    #[error(
        "the mass of the wire or of a fluid moves with this head, which the links of a robot model cannot show: give the springs \
         `spring_mass: neglected`"
    )]
    AddedMass,
    /// The joints of the model would not move independently.
    #[error(
        "the stiffness couples {first} with {second} by {coupling:.2} of their own, which independent joints cannot show; up to {} \
         is neglected",
        MAX_COUPLING
    )]
    Coupled {
        /// One coordinate.
        first: &'static str,
        /// The other coordinate.
        second: &'static str,
        /// Entry of the stiffness over the geometric mean of its diagonals.
        coupling: f64,
    },
}

/// A head on six elastic joints.
#[derive(Debug, Clone, PartialEq)]
pub struct HeadExport {
    body: Body,
    /// Pose of the head in the base at rest.
    base_from_head: Pose,
    head_from_laser: Pose,
    head_from_imu: Pose,
    /// From base to head.
    joints: [ElasticJoint; 6],
    /// Size and centre in the head frame of its blocks, m.
    blocks: Vec<([f64; 3], [f64; 3])>,
    carrier: Vec<CarrierSpec>,
}

/// An elastic joint; forces and stiffness in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ElasticJoint {
    name: &'static str,
    /// Whether it turns about its axis; otherwise it slides along it.
    turns: bool,
    /// Unit vector in the base.
    axis: Vector,
    /// A point on the axis in the base, m.
    point: Vector,
    stiffness: f64,
    damping: f64,
    /// Coordinate without force; 0 is the rest.
    reference: f64,
}

impl HeadExport {
    /// The model of `head`, which `spec` describes.
    ///
    /// # Errors
    /// If the head is on no spring, or its stiffness is not that of independent joints.
    pub fn new(spec: &HeadSpec, head: &HeadModel) -> Result<Self, ExportError> {
        let linear = match (head.rigid_mount_reason(), head.linear()) {
            (Some(reason), _) => return Err(ExportError::NotElastic(reason)),
            (None, Some(linear)) if linear.modes.len() == 6 => linear,
            _ => return Err(ExportError::NotElastic("a joint leaves this one two rotations")),
        };
        let (body, base_from_head) = (*head.body(), *head.base_from_head_at_rest());
        let centre = base_from_head * nalgebra::Point3::from(body.centre_of_mass_in_head);
        let about_centre = body.mass_matrix(base_from_head.rotation.to_rotation_matrix().matrix());
        if (linear.mass - about_centre).amax() > MAX_ADDED * body.mass_kg {
            return Err(ExportError::AddedMass);
        }
        let joints = joints(&centre.coords, linear, body.mass_kg);
        check_coupling(&joints, &centre.coords, &linear.stiffness, body.mass_kg)?;
        let block = |part: &PartSpec| match part {
            PartSpec::Block { size_m, centre_m, .. } => Some((*size_m, *centre_m)),
            PartSpec::Body { .. } => None,
        };
        Ok(Self {
            body,
            base_from_head,
            head_from_laser: *head.head_from_laser(),
            head_from_imu: *head.head_from_imu(),
            joints,
            blocks: spec.parts.iter().filter_map(block).collect(),
            carrier: spec.carrier.clone(),
        })
    }
}

/// The joints: along x, y and z of the base, then about y, x and z.
///
/// About the centre of mass, with the displacement `d` and the rotation `phi`, a joint about y at `h` below it has the energy
/// `kx (dx - h phi)^2 / 2 + (k - m g h) phi^2 / 2`: the joint bears the weight `m g`. So `h = -K_x,phi / K_xx`.
fn joints(centre: &Vector, linear: &LinearModel, mass_kg: f64) -> [ElasticJoint; 6] {
    let LinearModel { stiffness, damping, .. } = linear;
    let weight_n = mass_kg * STANDARD_GRAVITY_M_PER_S2;
    let slide = |name, axis: usize, reference: f64| ElasticJoint {
        name,
        turns: false,
        axis: Vector::ith(axis, 1.0),
        point: *centre,
        stiffness: stiffness[(axis, axis)],
        damping: damping[(axis, axis)],
        reference,
    };
    // A rotation about y moves the centre of mass along +x, one about x along -y.
    let turn = |name, axis: usize, along: usize, sign: f64| {
        let (row, shift) = (3 + axis, stiffness[(along, along)]);
        let below = -sign * stiffness[(along, row)] / shift;
        let elastic = stiffness[(row, row)] - shift * below * below + weight_n * below;
        let lever = sign * below;
        let lossy = damping[(row, row)] + 2.0 * lever * damping[(along, row)] + lever * lever * damping[(along, along)];
        ElasticJoint {
            name,
            turns: true,
            axis: Vector::ith(axis, 1.0),
            point: centre - Vector::z() * below,
            stiffness: elastic,
            damping: lossy.max(0.0),
            reference: 0.0,
        }
    };
    let yaw = ElasticJoint {
        name: "spring_yaw",
        turns: true,
        stiffness: stiffness[(5, 5)],
        damping: damping[(5, 5)],
        ..slide("", 2, 0.0)
    };
    [
        slide("spring_x", 0, 0.0),
        slide("spring_y", 1, 0.0),
        slide("spring_z", 2, weight_n / stiffness[(2, 2)]),
        turn("spring_pitch", 1, 0, 1.0),
        turn("spring_roll", 0, 1, -1.0),
        yaw,
    ]
}

/// The stiffness of the head on `joints` about its centre of mass, in the axes of the base.
fn stiffness_of(joints: &[ElasticJoint; 6], centre: &Vector, mass_kg: f64) -> Matrix6 {
    let mut all = Matrix6::zeros();
    for (axis, joint) in joints.iter().take(3).enumerate() {
        all[(axis, axis)] = joint.stiffness;
    }
    for (joint, axis, along, sign) in [(&joints[3], 1, 0, 1.0), (&joints[4], 0, 1, -1.0)] {
        let below = (centre - joint.point).z;
        let shift = joints[along].stiffness;
        let row = 3 + axis;
        (all[(along, row)], all[(row, along)]) = (-sign * shift * below, -sign * shift * below);
        all[(row, row)] = joint.stiffness - mass_kg * STANDARD_GRAVITY_M_PER_S2 * below + shift * below * below;
    }
    all[(5, 5)] = joints[5].stiffness;
    all
}

/// Checks that the joints have the stiffness of the head.
fn check_coupling(
    joints: &[ElasticJoint; 6],
    centre: &Vector,
    stiffness: &Matrix6,
    mass_kg: f64,
) -> Result<(), ExportError> {
    const NAMES: [&str; 6] = ["x", "y", "z", "roll", "pitch", "yaw"];
    let neglected = stiffness - stiffness_of(joints, centre, mass_kg);
    let coupling = |r: usize, c: usize| neglected[(r, c)].abs() / (stiffness[(r, r)] * stiffness[(c, c)]).abs().sqrt();
    let pairs = (0..6).flat_map(|r| (0..6).map(move |c| (r, c)));
    let worst = pairs.map(|(r, c)| (coupling(r, c), r, c)).max_by(|a, b| a.0.total_cmp(&b.0));
    match worst {
        Some((coupling, r, c)) if coupling.is_nan() || coupling > MAX_COUPLING => {
            Err(ExportError::Coupled { first: NAMES[r], second: NAMES[c], coupling })
        }
        _ => Ok(()),
    }
}

/// Numbers separated by spaces, as XML attributes have them.
fn list(numbers: &[f64]) -> String {
    numbers.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(" ")
}

/// Position, then roll, pitch and yaw, m and rad.
fn position_and_angles(pose: &Pose) -> (Vector, [f64; 3]) {
    let (roll, pitch, yaw) = crate::geometry::roll_pitch_yaw(&pose.rotation);
    (pose.translation.vector, [roll, pitch, yaw])
}
