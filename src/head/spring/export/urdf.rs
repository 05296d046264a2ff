//! The model as URDF: shape, mass and joints; the stiffness is a comment, because URDF has no springs.

use super::joints::ElasticJoint;
use super::{HeadExport, LINK_INERTIA_KG_M2, LINK_MASS_KG, list, position_and_angles};
use std::fmt::Write as _;
use zsim_base::geometry::{Pose, Vector};

impl HeadExport {
    /// URDF with the frames of recordings: `base`, `head`, `laser`, `imu_link`.
    pub fn urdf(&self) -> String {
        let mut text = String::from("<?xml version=\"1.0\"?>\n<robot name=\"zsim_head\">\n  <link name=\"base\">\n");
        for part in &self.carrier {
            let middle = Vector::from(part.foot_in_base_m) + Vector::z() * (0.5 * part.height_m);
            let shape = format!("<cylinder radius=\"{:?}\" length=\"{:?}\"/>", part.radius_m, part.height_m);
            text += &visual(&middle, &shape);
        }
        text += "  </link>\n";
        let mut from = (String::from("base"), Vector::zeros());
        for joint in &self.joints {
            let link = format!("{}_link", joint.name);
            text += &elastic_joint(joint, &from.0, &link, &(joint.point - from.1));
            text += &inertial_link(&link);
            from = (link, joint.point);
        }
        let to_head =
            Pose::from_parts((self.base_from_head.translation.vector - from.1).into(), self.base_from_head.rotation);
        text += &fixed_joint(&from.0, "head", &to_head);
        text += &self.head_link();
        for (name, pose) in [("laser", &self.head_from_laser), ("imu_link", &self.head_from_imu)] {
            text += &fixed_joint("head", name, pose);
            let _ = writeln!(text, "  <link name=\"{name}\"/>");
        }
        text + "</robot>\n"
    }

    fn head_link(&self) -> String {
        let (centre, i) = (list(self.body.centre_of_mass_in_head.as_slice()), &self.body.inertia_in_head);
        let mut text = format!(
            "  <link name=\"head\">\n    <inertial>\n      <origin xyz=\"{centre}\"/>\n      <mass value=\"{:?}\"/>\n      \
             <inertia ixx=\"{:?}\" iyy=\"{:?}\" izz=\"{:?}\" ixy=\"{:?}\" ixz=\"{:?}\" iyz=\"{:?}\"/>\n    </inertial>\n",
            self.body.mass_kg,
            i[(0, 0)],
            i[(1, 1)],
            i[(2, 2)],
            i[(0, 1)],
            i[(0, 2)],
            i[(1, 2)]
        );
        for (size, centre) in &self.blocks {
            text += &visual(&Vector::from(*centre), &format!("<box size=\"{}\"/>", list(size)));
        }
        text + "  </link>\n"
    }
}

fn visual(centre: &Vector, shape: &str) -> String {
    let centre = list(centre.as_slice());
    format!("    <visual>\n      <origin xyz=\"{centre}\"/>\n      <geometry>{shape}</geometry>\n    </visual>\n")
}

fn elastic_joint(joint: &ElasticJoint, parent: &str, child: &str, origin: &Vector) -> String {
    let ElasticJoint { name, turns, axis, stiffness, damping, reference, .. } = joint;
    let (kind, limit) = if *turns { ("revolute", 3.0) } else { ("prismatic", 0.5) };
    format!(
        "  <!-- {name}: stiffness {stiffness:?}, no force at {reference:?} (SI units) -->\n  <joint name=\"{name}\" \
         type=\"{kind}\">\n    <parent link=\"{parent}\"/>\n    <child link=\"{child}\"/>\n    <origin xyz=\"{}\"/>\n    <axis \
         xyz=\"{}\"/>\n    <limit lower=\"-{limit:?}\" upper=\"{limit:?}\" effort=\"1000\" velocity=\"100\"/>\n    <dynamics \
         damping=\"{damping:?}\"/>\n  </joint>\n",
        list(origin.as_slice()),
        list(axis.as_slice())
    )
}

fn inertial_link(name: &str) -> String {
    format!(
        "  <link name=\"{name}\">\n    <inertial>\n      <mass value=\"{LINK_MASS_KG:?}\"/>\n      <inertia \
         ixx=\"{LINK_INERTIA_KG_M2:?}\" iyy=\"{LINK_INERTIA_KG_M2:?}\" izz=\"{LINK_INERTIA_KG_M2:?}\" ixy=\"0\" ixz=\"0\" \
         iyz=\"0\"/>\n    </inertial>\n  </link>\n"
    )
}

fn fixed_joint(parent: &str, child: &str, pose: &Pose) -> String {
    let (position, angles) = position_and_angles(pose);
    format!(
        "  <joint name=\"{child}_mount\" type=\"fixed\">\n    <parent link=\"{parent}\"/>\n    <child link=\"{child}\"/>\n    \
         <origin xyz=\"{}\" rpy=\"{}\"/>\n  </joint>\n",
        list(position.as_slice()),
        list(&angles)
    )
}
