//! Loads on the ends of the springs of a head.

use super::head::HeadModel;
use super::mounted_spring::MountedSpring;
use zsim_base::geometry::{Pose, Vector};
use zsim_elasticity::{ElasticityError, SpringState, split};

/// Force and moment that the head exerts on an end of a spring, in the frame of that end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndLoad {
    /// Force, N.
    pub force: Vector,
    /// Moment about the end, N m.
    pub moment: Vector,
}

/// The loads on the ends of the active coils of a head's springs by their force laws, for one pose after the other.
///
/// Unlike weight and inertial force of the head, they are known for each of several springs.
pub struct SpringEndLoads<'a> {
    /// Each spring with the last solution for its inner nodes.
    springs: Vec<(&'a MountedSpring, SpringState)>,
}

impl<'a> SpringEndLoads<'a> {
    /// The loads on the springs of `model`.
    pub fn of(model: &'a HeadModel) -> Self {
        Self { springs: model.springs_with_states() }
    }

    /// The loads on foot and top of each spring with the head at a pose; `None` where a segmented spring has no equilibrium.
    pub fn at(&mut self, base_from_head: &Pose) -> Vec<Option<[EndLoad; 2]>> {
        self.springs.iter_mut().map(|(mounted, state)| mounted.end_loads(state, base_from_head).ok()).collect()
    }
}

impl MountedSpring {
    /// The loads on foot and top with the head at a pose.
    ///
    /// # Errors
    /// When a segmented spring has no equilibrium.
    fn end_loads(&self, state: &mut SpringState, base_from_head: &Pose) -> Result<[EndLoad; 2], ElasticityError> {
        let foot_from_top = self.ends.foot_from_top(base_from_head);
        let (force, torque) = split(&self.spring.wrench(state, &foot_from_top)?.total());
        // The spring exerts the wrench on the head, and the head its opposite on the spring.
        let (force, about_top) = (-force, -torque);
        let about_foot = about_top + foot_from_top.translation.vector.cross(&force);
        let in_top = foot_from_top.rotation.inverse();
        Ok([EndLoad { force, moment: about_foot }, EndLoad { force: in_top * force, moment: in_top * about_top }])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::head::Linkage;
    use crate::load;
    use zsim_base::geometry::gravity_in_world;

    #[test]
    fn the_springs_bear_the_weight_of_the_head_and_its_moment() {
        for name in ["handheld", "vehicle_three_springs", "hanging"] {
            let (spec, source) = load(name).unwrap();
            let head = HeadModel::new_without_advice(&spec, &source).unwrap();
            let rest = *head.base_from_head_at_rest();
            let Linkage::Compliant(linkage) = &head.linkage else { panic!("compliant") };
            let (mut force, mut moment) = (Vector::zeros(), Vector::zeros());
            let springs = SpringEndLoads::of(&head).at(&rest);
            for (ends, mounted) in springs.into_iter().zip(&linkage.law.springs) {
                let [foot, top] = ends.unwrap();
                let base_from_foot = mounted.ends.base_from_foot;
                force += base_from_foot.rotation * foot.force;
                moment += base_from_foot.rotation * foot.moment
                    + base_from_foot.translation.vector.cross(&(base_from_foot.rotation * foot.force));
                // Both ends have the same force, in different axes.
                assert!((foot.force.norm() - top.force.norm()).abs() < 1e-12 * foot.force.norm());
                // Half of the weight of the wire acts on the top.
                let at_top = (rest * mounted.ends.head_from_top).translation.vector;
                let of_wire = gravity_in_world() * (0.5 * mounted.wire_mass_kg());
                force -= of_wire;
                moment -= at_top.cross(&of_wire);
            }
            let weight = gravity_in_world() * head.body().mass_kg;
            let centre = rest * nalgebra::Point3::from(head.body().centre_of_mass_in_head);
            let scale = weight.norm();
            assert!((force - weight).norm() < 1e-6 * scale, "{name}: {force} {weight}");
            assert!((moment - centre.coords.cross(&weight)).norm() < 1e-6 * scale, "{name}: {moment}");
        }
    }
}
