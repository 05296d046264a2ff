//! A head on its spring as a robot model of other simulators: URDF, SDF and MJCF.
//!
//! The springs become three sliding and three turning joints between base and head, each with a stiffness and a damping. The model
//! has the linear modes of the head at rest. The wire of the springs is a mesh of its own.

mod joints;
mod mesh;
mod mjcf;
mod sdf;
mod urdf;

use joints::{ElasticJoint, RestModel};
use zsim_base::geometry::{Pose, Vector};
use zsim_dynamics::{Body, CarrierSpec, HeadModel, HeadSpec, LinearModel, PartSpec, natural_frequencies_hz};
use zsim_report::page::{Link, links};
use zsim_world::stl;

/// Greatest relative error of the model's natural frequencies.
const MAX_FREQUENCY_ERROR: f64 = 0.01;
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
    /// The model would have other modes.
    #[error(
        "six independent joints cannot show this head: a natural frequency would differ by {:.1} % (at most {:.0} %), because its \
         springs couple motions, or the wire or a fluid that moves with it is too heavy",
        error * 100.0, MAX_FREQUENCY_ERROR * 100.0
    )]
    OtherModes {
        /// Largest relative error of a natural frequency.
        error: f64,
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
    links: Vec<Link>,
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
        let base_from_head = *head.base_from_head_at_rest();
        let rotation = *base_from_head.rotation.to_rotation_matrix().matrix();
        let centre = base_from_head * nalgebra::Point3::from(head.body().centre_of_mass_in_head);
        let model = RestModel::new(head.body(), linear, &centre.coords, &rotation);
        let joints = model.joints().ok_or(ExportError::NotElastic("it is free to shift"))?;
        let (mass, stiffness) = model.in_joints(&joints, &rotation);
        let error =
            natural_frequencies_hz(&mass, &stiffness).map_or(f64::INFINITY, |found| frequency_error(&found, linear));
        if error.is_nan() || error > MAX_FREQUENCY_ERROR {
            return Err(ExportError::OtherModes { error });
        }
        let block = |part: &PartSpec| match part {
            PartSpec::Block { size_m, centre_m, .. } => Some((*size_m, *centre_m)),
            PartSpec::Body { .. } => None,
        };
        Ok(Self {
            body: model.body,
            base_from_head,
            head_from_laser: *head.head_from_laser(),
            head_from_imu: *head.head_from_imu(),
            joints,
            blocks: spec.parts.iter().filter_map(block).collect(),
            carrier: spec.carrier.clone(),
            links: links::of(&spec.linkage),
        })
    }

    /// The wire of all springs with the head at rest, in the base frame, m, as binary STL; `None` if none has a coil.
    ///
    /// # Errors
    /// When the mesh is too large for the format.
    pub fn spring_mesh(&self) -> std::io::Result<Option<Vec<u8>>> {
        let surfaces = self.links.iter().filter_map(|link| match link {
            Link::Spring(spring) => mesh::wire_surface(spring, &self.base_from_head),
            Link::Straight { .. } => None,
        });
        let surface: mesh::Surface = surfaces.flatten().collect();
        if surface.is_empty() { Ok(None) } else { stl(surface.iter()).map(Some) }
    }
}

/// Largest relative difference between `found` and the natural frequencies of a head; both have the lowest first.
fn frequency_error(found: &[f64], linear: &LinearModel) -> f64 {
    let ratios = linear.modes.iter().zip(found).map(|(mode, found)| (found / mode.frequency_hz - 1.0).abs());
    ratios.fold(0.0, |worst, ratio| if ratio <= worst { worst } else { ratio })
}

/// Numbers separated by spaces, as XML attributes have them.
fn list(numbers: &[f64]) -> String {
    numbers.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(" ")
}

/// Position, then roll, pitch and yaw, m and rad.
fn position_and_angles(pose: &Pose) -> (Vector, [f64; 3]) {
    let (roll, pitch, yaw) = zsim_base::geometry::roll_pitch_yaw(&pose.rotation);
    (pose.translation.vector, [roll, pitch, yaw])
}
