//! A rope or an elastic cable: it transmits tension only.

use super::elements::{CableSpec, CordSpec, CordStiffnessSpec};
use super::forces::{EndFrames, Forces, MotionState};
use nalgebra::Point3;
use zsim_base::geometry::{Matrix, Pose, Vector};
use zsim_elasticity::split;

/// Stretch range over which a cord changes from slack to taut, as a fraction of the length.
///
/// It smooths the stiffness, as in a real rope whose fibres become taut one after the other.
const TAUT_TRANSITION: f64 = 1e-4;

/// A massless cord between a point of the base and a point of the head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cord {
    pub point_in_base: Vector,
    pub point_in_head: Vector,
    /// Length without tension.
    length_m: f64,
    pub stiffness_n_per_m: f64,
    damping_n_s_per_m: f64,
}

impl Cord {
    /// Creates the cord that a spec describes.
    pub fn of(spec: &CordSpec) -> Self {
        Self {
            point_in_base: spec.base_point_m.into(),
            point_in_head: spec.head_point_m.into(),
            length_m: spec.length_m,
            stiffness_n_per_m: match spec.stiffness {
                CordStiffnessSpec::NPerM(stiffness) => stiffness,
                CordStiffnessSpec::EaN(ea) => ea / spec.length_m,
            },
            damping_n_s_per_m: spec.damping_n_s_per_m,
        }
    }

    /// Creates the cable through a spring.
    ///
    /// `None` if the unstretched length would not be positive.
    pub fn through(cable: &CableSpec, spring: &EndFrames) -> Option<Self> {
        let length_m = cable.length_m - cable.tension_n / cable.stiffness_n_per_m;
        (length_m > 0.0).then_some(Self {
            point_in_base: spring.base_from_foot.translation.vector,
            point_in_head: spring.head_from_top.translation.vector,
            length_m,
            stiffness_n_per_m: cable.stiffness_n_per_m,
            damping_n_s_per_m: cable.damping_n_s_per_m,
        })
    }

    /// The stretch at a distance between the ends: value (m), derivative and integral (m^2).
    ///
    /// Zero where the cord is slack and equal to `distance - length` above the transition range. In the range it is a
    /// parabola that joins both with continuous slope.
    fn stretch(&self, distance_m: f64) -> (f64, f64, f64) {
        let (transition, stretch) = (TAUT_TRANSITION * self.length_m, distance_m - self.length_m);
        let into = stretch + 0.5 * transition;
        if into <= 0.0 {
            (0.0, 0.0, 0.0)
        } else if into < transition {
            (into * into / (2.0 * transition), into / transition, into.powi(3) / (6.0 * transition))
        } else {
            // The integral over the transition range is toe^2 / 6; the linear branch has toe^2 / 8 there, hence toe^2 /
            // 24.
            (stretch, 1.0, 0.5 * stretch * stretch + transition * transition / 24.0)
        }
    }

    /// Static tension with the head at a pose, N.
    pub fn tension_n(&self, base_from_head: &Pose) -> f64 {
        let between = base_from_head * Point3::from(self.point_in_head) - Point3::from(self.point_in_base);
        self.stiffness_n_per_m * self.stretch(between.norm()).0
    }

    /// Adds the tension and damping of the cord.
    pub fn add_forces(&self, now: &MotionState<'_>, forces: &mut Forces) {
        let lever = now.lever(&self.point_in_head);
        let tied = now.base.world_from_body * Point3::from(self.point_in_base);
        let between = now.centre() + lever - tied.coords;
        let distance_m = between.norm();
        let (stretch, tautness, _) = self.stretch(distance_m);
        if tautness == 0.0 {
            return;
        }
        let along = between / distance_m;
        let relative = now.relative_twist();
        let (velocity, turning) = split(&relative);
        let damping = self.damping_n_s_per_m * tautness;
        let tension_n = self.stiffness_n_per_m * stretch + damping * along.dot(&(velocity + turning.cross(&lever)));
        // The damping force must not turn the tension into compression.
        if tension_n > 0.0 {
            forces.add_force(&lever, &(along * -tension_n));
            let c: Matrix = along * along.transpose() * damping;
            forces.add_damper(&lever, &c);
        }
    }

    /// Elastic energy of the cord, J.
    pub fn potential_j(&self, base_from_head: &Pose) -> f64 {
        let between = base_from_head * Point3::from(self.point_in_head) - Point3::from(self.point_in_base);
        self.stiffness_n_per_m * self.stretch(between.norm()).2
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn cord_tension_is_the_derivative_of_the_energy_and_zero_when_slack() {
        let cord = Cord {
            point_in_base: Vector::zeros(),
            point_in_head: Vector::zeros(),
            length_m: 0.5,
            stiffness_n_per_m: 2_000.0,
            damping_n_s_per_m: 0.0,
        };
        let at = |distance_m: f64| Pose::translation(0.0, 0.0, -distance_m);
        assert_relative_eq!(cord.tension_n(&at(0.51)), 20.0, max_relative = 1e-12);
        assert_eq!(cord.tension_n(&at(0.49)), 0.0);
        // The tension is the derivative of the energy on all three branches.
        for distance_m in [0.499, 0.4999, 0.5001, 0.50025, 0.502] {
            let h = 1e-7;
            let slope = (cord.potential_j(&at(distance_m + h)) - cord.potential_j(&at(distance_m - h))) / (2.0 * h);
            assert_relative_eq!(cord.tension_n(&at(distance_m)), slope, epsilon = 1e-5);
        }
    }
}
