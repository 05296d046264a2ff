//! Recorded rotation of the lidar and rates of the gyroscope.

use super::{CoveragePlan, GyroUsage};
use crate::HeadError;
use zsim_base::geometry::{Rotation, Vector, roll_pitch_yaw};
use zsim_dynamics::{HeadModel, HeadSimulation, HeadState};
use zsim_motion::BaseMotion;

/// A recorded swing, one entry per simulation step.
#[derive(Debug, Clone)]
pub(super) struct SwingTrack {
    step_s: f64,
    /// `heading_from_laser`.
    rotations: Vec<Rotation>,
    /// Elevation of the forward beam above the horizon, rad.
    elevations: Vec<f64>,
    /// Largest absolute rate among the IMU's axes, rad/s.
    rates: Vec<f64>,
    /// Maximum tilt of the lidar's scan plane from horizontal, rad.
    pub most_tilt_rad: f64,
}

impl SwingTrack {
    /// Simulates the head and records the observed part.
    pub fn record(
        head: &HeadModel,
        motion: &dyn BaseMotion,
        plan: &CoveragePlan,
        mut watch: impl FnMut(&HeadState),
    ) -> Result<Self, HeadError> {
        let (skipped, steps) = ((plan.from_s / plan.step_s).round(), (plan.duration_s / plan.step_s).ceil());
        let mut track = Self {
            step_s: plan.step_s,
            rotations: Vec::with_capacity(steps as usize),
            elevations: Vec::with_capacity(steps as usize),
            rates: Vec::with_capacity(steps as usize),
            most_tilt_rad: 0.0,
        };
        let simulation = HeadSimulation::new(head, motion, plan.step_s)?;
        for (step, state) in simulation.enumerate().take((skipped + steps) as usize) {
            let state = state?;
            if step >= skipped as usize {
                track.add(head, &state);
                watch(&state);
            }
        }
        Ok(track)
    }

    fn add(&mut self, head: &HeadModel, state: &HeadState) {
        let (_, _, yaw) = roll_pitch_yaw(&state.base.world_from_body.rotation);
        let upright = Rotation::from_axis_angle(&Vector::z_axis(), -yaw);
        let rotation = upright * state.head.world_from_body.rotation * head.head_from_laser().rotation;
        let forward = rotation * Vector::x();
        self.elevations.push(forward.z.clamp(-1.0, 1.0).asin());
        let up = rotation * Vector::z();
        self.most_tilt_rad = self.most_tilt_rad.max(up.xy().norm().atan2(up.z));
        let rate = head.head_from_imu().rotation.inverse() * state.head.angular_velocity_in_body();
        self.rates.push(rate.amax());
        self.rotations.push(rotation);
    }

    /// Rotation of the lidar at `t_s` after the start of the observation.
    pub fn heading_from_laser(&self, t_s: f64) -> Rotation {
        let step = (t_s / self.step_s).round() as usize;
        self.rotations[step.min(self.rotations.len() - 1)]
    }

    /// Angle between the 2.5 % and the 97.5 % quantile of the forward beam's elevation, rad.
    pub fn field_of_view_rad(&self) -> f64 {
        quantile(&self.elevations, 0.975) - quantile(&self.elevations, 0.025)
    }

    /// Turning points of the forward beam's elevation, s after the start of the observation.
    ///
    /// Reversals by less than a quarter of the field of view, or less than 1 degree, are ignored.
    pub fn turning_points(&self) -> Vec<f64> {
        let threshold = (0.25 * self.field_of_view_rad()).max(1_f64.to_radians());
        let mut turning = Vec::new();
        let (mut rises, mut extreme, mut at) = (true, f64::NEG_INFINITY, 0);
        for (step, elevation) in self.elevations.iter().enumerate() {
            let height = if rises { *elevation } else { -elevation };
            if height > extreme {
                (extreme, at) = (height, step);
            } else if height < extreme - threshold {
                turning.push(at as f64 * self.step_s);
                (rises, extreme, at) = (!rises, -height, step);
            }
        }
        turning
    }

    /// Angular rates in comparison with the gyroscope's range.
    pub fn gyro_usage(&self, limit_deg_per_s: f64) -> GyroUsage {
        let limit = limit_deg_per_s.to_radians();
        let saturated = self.rates.iter().filter(|rate| **rate > limit).count();
        GyroUsage {
            limit_deg_per_s,
            most_deg_per_s: self.rates.iter().copied().fold(0.0, f64::max).to_degrees(),
            p99_deg_per_s: quantile(&self.rates, 0.99).to_degrees(),
            saturated: saturated as f64 / self.rates.len().max(1) as f64,
        }
    }
}

/// Quantile of unsorted values at `fraction`; 0 if there are none.
fn quantile(values: &[f64], fraction: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let index = (fraction * sorted.len() as f64) as usize;
    sorted.get(index.min(sorted.len().saturating_sub(1))).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_swing_has_two_turning_points_per_period_and_ripple_is_ignored() {
        // 1 Hz, 0.5 rad, with a ripple of 0.01 rad at 20 Hz: turning points half a second apart.
        let elevation = |k: usize| {
            let t = k as f64 * 1e-3;
            0.5 * (std::f64::consts::TAU * t).sin() + 0.01 * (std::f64::consts::TAU * 20.0 * t).sin()
        };
        let track = SwingTrack {
            step_s: 1e-3,
            rotations: Vec::new(),
            elevations: (0..5000).map(elevation).collect(),
            rates: vec![10.0, 11.0],
            most_tilt_rad: 0.0,
        };
        let turning = track.turning_points();
        assert_eq!(turning.len(), 10, "{turning:?}");
        assert!(turning.windows(2).all(|w| (w[1] - w[0] - 0.5).abs() < 0.05), "{turning:?}");
        // A sine exceeds 0.997 of its amplitude in 2.5 % of the time.
        assert!((track.field_of_view_rad() - 1.0).abs() < 0.03);
        assert_eq!(track.gyro_usage(600.0).saturated, 0.5);
    }
}
