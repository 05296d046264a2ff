use super::jet::Jet;
use zsim::geometry::{Kinematics, Pose, Rotation, Vector, from_roll_pitch_yaw};

/// A walk round an ellipse with a nodding head; at rest until `start_s`.
#[derive(Debug, Clone, Copy)]
pub struct Walk {
    pub semi_axes_m: (f64, f64),
    pub lap_s: f64,
    pub height_m: f64,
    /// Amplitude of pitch, rad.
    pub nod_rad: f64,
    /// End of the initial rest, s; negative to start in motion.
    pub start_s: f64,
    /// Interval in which the nodding stops, s.
    pub stop: Option<(f64, f64)>,
    /// Pose of walk and room in the world.
    pub world_from_room: Pose,
}

impl Walk {
    pub fn new(semi_axes_m: (f64, f64), lap_s: f64) -> Self {
        let world_from_room = Pose::identity();
        Self { semi_axes_m, lap_s, height_m: 1.2, nod_rad: 0.75, start_s: 3.0, stop: None, world_from_room }
    }

    /// Position and roll, pitch, yaw.
    fn jets(&self, t_s: f64) -> ([Jet; 3], [Jet; 3]) {
        let tau = std::f64::consts::TAU;
        let since = Jet::time(t_s) - Jet::constant(self.start_s);
        let walked = since.ramped_time(3.0);
        let mut nodding = since.scale(1.0 / 2.0).smoothstep();
        if let Some((from, to)) = self.stop {
            let t = Jet::time(t_s);
            let held = (t - Jet::constant(from)).smoothstep() - (t - Jet::constant(to)).smoothstep();
            nodding = nodding * (Jet::constant(1.0) - held);
        }
        let lap = walked.scale(tau / self.lap_s);
        // The frequency of a hand is irregular.
        let phase = since.scale(tau * 1.3) + since.scale(0.9).sin().scale(0.5);
        let strength = nodding * (Jet::constant(0.8) + since.scale(0.37).sin().scale(0.2));
        let pitch = phase.sin() * strength.scale(self.nod_rad);
        let roll = since.scale(tau * 0.9).sin() * nodding.scale(0.12);
        let yaw = lap + since.scale(tau * 0.31).sin() * nodding.scale(0.25) + Jet::constant(tau / 4.0);
        let x = lap.cos().scale(self.semi_axes_m.0) + phase.sin() * strength.scale(0.06);
        let y = lap.sin().scale(self.semi_axes_m.1);
        let bob = walked.scale(tau * 1.9).sin() * nodding.scale(0.02);
        let slow = walked.scale(tau / 17.0).sin().scale(0.2);
        ([x, y, Jet::constant(self.height_m) + bob + slow], [roll, pitch, yaw])
    }

    fn rates(&self, t_s: f64) -> (Rotation, Vector) {
        let (_, [roll, pitch, yaw]) = self.jets(t_s);
        let rotation = from_roll_pitch_yaw(roll.value, pitch.value, yaw.value);
        let ((sr, cr), (sp, cp)) = (roll.value.sin_cos(), pitch.value.sin_cos());
        // Body rates of Rz(yaw) Ry(pitch) Rx(roll).
        let body = Vector::new(
            roll.rate - yaw.rate * sp,
            pitch.rate * cr + yaw.rate * sr * cp,
            -pitch.rate * sr + yaw.rate * cr * cp,
        );
        (rotation, rotation * body)
    }

    /// Pose, velocities and accelerations of the head in the world at true time `t_s`.
    pub fn at(&self, t_s: f64) -> Kinematics {
        let (position, _) = self.jets(t_s);
        let (rotation, rate) = self.rates(t_s);
        let h = 1e-4;
        let alpha = (self.rates(t_s + h).1 - self.rates(t_s - h).1) / (2.0 * h);
        let turn = self.world_from_room.rotation;
        let room_from_head = Pose::from_parts(Vector::from(position.map(|j| j.value)).into(), rotation);
        Kinematics {
            world_from_body: self.world_from_room * room_from_head,
            velocity_in_world: turn * Vector::from(position.map(|j| j.rate)),
            angular_velocity_in_world: turn * rate,
            acceleration_in_world: turn * Vector::from(position.map(|j| j.acceleration)),
            angular_acceleration_in_world: turn * alpha,
        }
    }

    /// Pose of the head in the world.
    pub fn pose(&self, t_s: f64) -> Pose {
        let (position, [roll, pitch, yaw]) = self.jets(t_s);
        let rotation = from_roll_pitch_yaw(roll.value, pitch.value, yaw.value);
        self.world_from_room * Pose::from_parts(Vector::from(position.map(|j| j.value)).into(), rotation)
    }
}
