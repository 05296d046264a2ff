//! The model as SDF, with springs in the joints, as Gazebo reads it.

use super::joints::ElasticJoint;
use super::{HeadExport, LINK_INERTIA_KG_M2, LINK_MASS_KG, list, position_and_angles};
use std::fmt::Write as _;
use zsim_base::geometry::{Matrix, Pose, Vector};

impl HeadExport {
    /// SDF 1.9: a model with the frame `base` as its origin.
    pub fn sdf(&self) -> String {
        let mut text = String::from("<?xml version=\"1.0\"?>\n<sdf version=\"1.9\">\n  <model name=\"zsim_head\">\n");
        text += "    <link name=\"base\">\n";
        for (k, part) in self.carrier.iter().enumerate() {
            let middle = Vector::from(part.foot_in_base_m) + Vector::z() * (0.5 * part.height_m);
            let shape = format!(
                "<cylinder><radius>{:?}</radius><length>{:?}</length></cylinder>",
                part.radius_m, part.height_m
            );
            text += &visual(k, &middle, &shape);
        }
        text += "    </link>\n";
        let mut parent = String::from("base");
        for joint in &self.joints {
            let link = format!("{}_link", joint.name);
            let _ =
                writeln!(text, "    <link name=\"{link}\">\n      <pose>{} 0 0 0</pose>", list(joint.point.as_slice()));
            text += &inertial(&Vector::zeros(), LINK_MASS_KG, &(Matrix::identity() * LINK_INERTIA_KG_M2));
            text += "    </link>\n";
            text += &elastic_joint(joint, &parent, &link);
            parent = link;
        }
        let _ = writeln!(text, "    <link name=\"head\">\n      <pose>{}</pose>", pose(&self.base_from_head));
        text += &inertial(&self.body.centre_of_mass_in_head, self.body.mass_kg, &self.body.inertia_in_head);
        for (k, (size, centre)) in self.blocks.iter().enumerate() {
            text += &visual(k, &Vector::from(*centre), &format!("<box><size>{}</size></box>", list(size)));
        }
        let _ = writeln!(
            text,
            "    </link>\n    <joint name=\"head_mount\" type=\"fixed\"><parent>{parent}</parent><child>head</child></joint>"
        );
        for (name, frame) in [("laser", &self.head_from_laser), ("imu_link", &self.head_from_imu)] {
            let _ =
                writeln!(text, "    <frame name=\"{name}\" attached_to=\"head\"><pose>{}</pose></frame>", pose(frame));
        }
        text + "  </model>\n</sdf>\n"
    }
}

fn pose(pose: &Pose) -> String {
    let (position, angles) = position_and_angles(pose);
    format!("{} {}", list(position.as_slice()), list(&angles))
}

fn visual(number: usize, centre: &Vector, shape: &str) -> String {
    format!(
        "      <visual name=\"part_{number}\"><pose>{} 0 0 0</pose><geometry>{shape}</geometry></visual>\n",
        list(centre.as_slice())
    )
}

fn inertial(centre: &Vector, mass_kg: f64, inertia: &Matrix) -> String {
    let entry = |name: &str, r: usize, c: usize| format!("<{name}>{:?}</{name}>", inertia[(r, c)]);
    format!(
        "      <inertial><pose>{} 0 0 0</pose><mass>{mass_kg:?}</mass><inertia>{}{}{}{}{}{}</inertia></inertial>\n",
        list(centre.as_slice()),
        entry("ixx", 0, 0),
        entry("iyy", 1, 1),
        entry("izz", 2, 2),
        entry("ixy", 0, 1),
        entry("ixz", 0, 2),
        entry("iyz", 1, 2)
    )
}

fn elastic_joint(joint: &ElasticJoint, parent: &str, child: &str) -> String {
    let ElasticJoint { name, turns, axis, stiffness, damping, reference, .. } = joint;
    let kind = if *turns { "revolute" } else { "prismatic" };
    format!(
        "    <joint name=\"{name}\" type=\"{kind}\">\n      <parent>{parent}</parent>\n      <child>{child}</child>\n      \
         <axis>\n        <xyz>{}</xyz>\n        <dynamics><spring_reference>{reference:?}</spring_reference>\
         <spring_stiffness>{stiffness:?}</spring_stiffness><damping>{damping:?}</damping></dynamics>\n      </axis>\n    \
         </joint>\n",
        list(axis.as_slice())
    )
}
