//! The model as MJCF, with springs in the joints, as MuJoCo reads it.

use super::joints::ElasticJoint;
use super::{HeadExport, list};
use std::fmt::Write as _;
use zsim_base::geometry::{Pose, STANDARD_GRAVITY_M_PER_S2, Vector};

impl HeadExport {
    /// MJCF: a static body `base` with the body `head`, and sites for the sensors.
    pub fn mjcf(&self) -> String {
        let mut text = format!(
            "<mujoco model=\"zsim_head\">\n  <compiler angle=\"radian\"/>\n  <option gravity=\"0 0 -{STANDARD_GRAVITY_M_PER_S2:?}\" \
             timestep=\"0.001\"/>\n  <default><geom contype=\"0\" conaffinity=\"0\" mass=\"0\"/></default>\n  <worldbody>\n    \
             <body name=\"base\">\n"
        );
        for part in &self.carrier {
            let middle = Vector::from(part.foot_in_base_m) + Vector::z() * (0.5 * part.height_m);
            let (size, place) = (list(&[part.radius_m, 0.5 * part.height_m]), list(middle.as_slice()));
            let _ = writeln!(text, "      <geom type=\"cylinder\" size=\"{size}\" pos=\"{place}\"/>");
        }
        let _ = writeln!(text, "      <body name=\"head\" {}>", placed(&self.base_from_head));
        for joint in &self.joints {
            text += &self.joint(joint);
        }
        let i = &self.body.inertia_in_head;
        let inertia = list(&[i[(0, 0)], i[(1, 1)], i[(2, 2)], i[(0, 1)], i[(0, 2)], i[(1, 2)]]);
        let centre = list(self.body.centre_of_mass_in_head.as_slice());
        let mass = self.body.mass_kg;
        let _ = writeln!(text, "        <inertial pos=\"{centre}\" mass=\"{mass:?}\" fullinertia=\"{inertia}\"/>");
        for (size, centre) in &self.blocks {
            let (half, place) = (list(&size.map(|edge| 0.5 * edge)), list(centre));
            let _ = writeln!(text, "        <geom type=\"box\" size=\"{half}\" pos=\"{place}\"/>");
        }
        for (name, pose) in [("laser", &self.head_from_laser), ("imu_link", &self.head_from_imu)] {
            let _ = writeln!(text, "        <site name=\"{name}\" {}/>", placed(pose));
        }
        text + "      </body>\n    </body>\n  </worldbody>\n</mujoco>\n"
    }

    /// A joint of the head, in its frame at rest.
    fn joint(&self, joint: &ElasticJoint) -> String {
        let ElasticJoint { name, turns, axis, point, stiffness, damping, reference } = joint;
        let kind = if *turns { "hinge" } else { "slide" };
        let axis = self.base_from_head.rotation.inverse() * axis;
        let point = self.base_from_head.inverse() * nalgebra::Point3::from(*point);
        format!(
            "        <joint name=\"{name}\" type=\"{kind}\" axis=\"{}\" pos=\"{}\" stiffness=\"{stiffness:?}\" \
             damping=\"{damping:?}\" springref=\"{reference:?}\"/>\n",
            list(axis.as_slice()),
            list(point.coords.as_slice())
        )
    }
}

/// Position and attitude as attributes.
fn placed(pose: &Pose) -> String {
    let q = pose.rotation;
    format!("pos=\"{}\" quat=\"{}\"", list(pose.translation.vector.as_slice()), list(&[q.w, q.i, q.j, q.k]))
}
