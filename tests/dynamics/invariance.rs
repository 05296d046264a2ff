use crate::dynamics::heads::{Nodding, shipped, states};
use zsim::dynamics::HeadModel;
use zsim::geometry::{Kinematics, Pose, Vector, from_roll_pitch_yaw};
use zsim::motion::BaseMotion;

/// A base with a shift, a yaw rotation and a constant velocity added to its motion.
struct Elsewhere {
    base: Nodding,
    there: Pose,
    drift_m_per_s: Vector,
}

impl BaseMotion for Elsewhere {
    fn at(&self, t_s: f64) -> Kinematics {
        let here = self.base.at(t_s);
        let turn = |v: Vector| self.there.rotation * v;
        let mut world_from_body = self.there * here.world_from_body;
        world_from_body.translation.vector += self.drift_m_per_s * t_s;
        Kinematics {
            world_from_body,
            velocity_in_world: turn(here.velocity_in_world) + self.drift_m_per_s,
            angular_velocity_in_world: turn(here.angular_velocity_in_world),
            acceleration_in_world: turn(here.acceleration_in_world),
            angular_acceleration_in_world: turn(here.angular_acceleration_in_world),
        }
    }
}

#[test]
fn the_swing_is_invariant_to_shift_yaw_and_constant_velocity() {
    let model = shipped("handheld");
    let here = states(&model, &Nodding { amount_rad: 0.05 }, 1e-3, 5.0);
    let there = Pose::from_parts(Vector::new(120.0, -70.0, 8.0).into(), from_roll_pitch_yaw(0.0, 0.0, 2.1));
    let elsewhere = Elsewhere { base: Nodding { amount_rad: 0.05 }, there, drift_m_per_s: Vector::new(9.0, -4.0, 0.5) };
    let mut lean: f64 = 0.0;
    for (a, b) in here.iter().zip(states(&model, &elsewhere, 1e-3, 5.0)) {
        let seen = a.base.world_from_body.inv_mul(&a.head.world_from_body);
        let moved = b.base.world_from_body.inv_mul(&b.head.world_from_body).inv_mul(&seen);
        assert!(moved.translation.vector.norm() < 1e-8 && moved.rotation.angle() < 1e-7, "{} s: {moved}", a.t_s);
        lean = lean.max(seen.rotation.angle());
    }
    assert!(lean > 0.3, "swings by only {lean} rad");
}

#[test]
fn two_runs_are_identical_to_the_bit() {
    let bits = |model: &HeadModel| -> Vec<u64> {
        let path = states(model, &Nodding { amount_rad: 0.05 }, 1e-3, 2.0);
        let numbers = path.iter().flat_map(|state| {
            let pose = state.head.world_from_body;
            let acceleration = state.head.acceleration_in_world;
            pose.translation
                .vector
                .iter()
                .chain(pose.rotation.coords.iter())
                .chain(acceleration.iter())
                .copied()
                .collect::<Vec<_>>()
        });
        numbers.map(f64::to_bits).collect()
    };
    assert_eq!(bits(&shipped("handheld")), bits(&shipped("handheld")));
}
