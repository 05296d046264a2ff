//! Plants that sway about their feet.

use super::SwaySpec;
use nalgebra::Unit;
use std::f64::consts::{FRAC_PI_2, TAU};
use zsim_base::geometry::{Pose, Rotation, Vector};

/// Maximum frequency, Hz, and minimum speed of gusts, m/s: beyond, phases are no longer exact.
const MAX_FREQUENCY_HZ: f64 = 1000.0;
const MIN_GUST_SPEED_M_PER_S: f64 = 1e-3;

/// Checks the numbers of swaying plants; an error is a key and a message.
pub(super) fn check_sway(spec: &SwaySpec) -> Result<(), (&'static str, String)> {
    let SwaySpec { lean_deg, amplitude_deg, frequency_hz, gust_speed_m_per_s, .. } = spec;
    if lean_deg + amplitude_deg > 90.0 {
        return Err(("lean_deg", format!("plants lean by {lean_deg} + {amplitude_deg} degrees; the maximum is 90")));
    }
    if *frequency_hz > MAX_FREQUENCY_HZ {
        return Err(("frequency_hz", format!("`frequency_hz` is {frequency_hz}; the maximum is {MAX_FREQUENCY_HZ}")));
    }
    if *gust_speed_m_per_s < MIN_GUST_SPEED_M_PER_S {
        let message = format!("`gust_speed_m_per_s` is {gust_speed_m_per_s}; the minimum is {MIN_GUST_SPEED_M_PER_S}");
        return Err(("gust_speed_m_per_s", message));
    }
    Ok(())
}

/// The motion of one plant.
pub(super) struct Sway {
    world_from_body: Pose,
    /// Horizontal axis of the tilt in the world: a positive tilt is towards the wind's direction.
    axis: Unit<Vector>,
    lean_rad: f64,
    amplitude_rad: f64,
    frequency_hz: f64,
    /// Time at which gusts arrive, s.
    delay_s: f64,
}

impl Sway {
    /// The motion of a plant that is at `world_from_body` at rest.
    pub fn new(spec: &SwaySpec, world_from_body: Pose) -> Self {
        let (sin, cos) = spec.wind_deg.to_radians().sin_cos();
        let along_m = world_from_body.translation.vector.dot(&Vector::new(cos, sin, 0.0));
        Self {
            world_from_body,
            axis: Unit::new_unchecked(Vector::new(-sin, cos, 0.0)),
            lean_rad: spec.lean_deg.to_radians(),
            amplitude_rad: spec.amplitude_deg.to_radians(),
            frequency_hz: spec.frequency_hz,
            delay_s: along_m / spec.gust_speed_m_per_s,
        }
    }

    /// A box that contains a box of the plant's frame (lower and upper corner) at all times.
    pub fn bounds(&self, (lower, upper): (Vector, Vector)) -> (Vector, Vector) {
        let sin = (self.lean_rad + self.amplitude_rad).min(FRAC_PI_2).sin();
        let corner = |k: usize| {
            let corner = Vector::from_fn(|axis, _| if k >> axis & 1 == 0 { lower[axis] } else { upper[axis] });
            self.world_from_body.rotation * corner
        };
        let reach = |k: usize| {
            let (level, height) = (corner(k).xy().norm(), corner(k).z);
            // A tilt moves a point sideways by at most |height| sin, and vertically by at most level sin or towards zero.
            let (side, rise) = (level + height.abs() * sin, level * sin);
            (Vector::new(-side, -side, height.min(0.0) - rise), Vector::new(side, side, height.max(0.0) + rise))
        };
        let foot = self.world_from_body.translation.vector;
        let join = |a: (Vector, Vector), b: (Vector, Vector)| (a.0.inf(&b.0), a.1.sup(&b.1));
        let (lower, upper) = (1..8).map(reach).fold(reach(0), join);
        (foot + lower, foot + upper)
    }

    /// The pose at a time.
    pub fn at(&self, time_s: f64) -> Pose {
        let phase = TAU * self.frequency_hz * (time_s - self.delay_s);
        let tilt = Rotation::from_axis_angle(&self.axis, self.lean_rad + self.amplitude_rad * phase.sin());
        Pose::from_parts(self.world_from_body.translation, tilt * self.world_from_body.rotation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::spec::{Source, parse};

    fn plant_at(x_m: f64) -> Sway {
        let text = "(wind_deg: 0, lean_deg: 5, amplitude_deg: 10, frequency_hz: 0.5, gust_speed_m_per_s: 2, scatter: \
                    (template: \"tuft\", seed: 1, count: 1, region_m: ((0, 0, 0), (1, 1, 0)), min_spacing_m: 0, turn: Fixed))";
        Sway::new(&parse(&Source::in_memory("sway.ron", text)).unwrap(), Pose::translation(x_m, 0.0, 0.0))
    }

    #[test]
    fn a_plant_tilts_towards_the_wind_about_its_foot() {
        // The period is 2 s: 15 degrees at a quarter of it, -5 at three quarters, and the lean of 5 degrees between.
        let plant = plant_at(0.0);
        for (time_s, tilt_deg) in [(0.0, 5.0_f64), (0.5, 15.0), (1.0, 5.0), (1.5, -5.0), (2.5, 15.0)] {
            let tip = plant.at(time_s) * nalgebra::Point3::new(0.0, 0.0, 1.0);
            assert_relative_eq!(tip.x, tilt_deg.to_radians().sin(), epsilon = 1e-12);
            assert_relative_eq!(tip.z, tilt_deg.to_radians().cos(), epsilon = 1e-12);
            assert_eq!(plant.at(time_s).translation, plant.at(0.0).translation);
        }
    }

    #[test]
    fn gusts_arrive_later_downwind() {
        // 2 m at 2 m/s: one second later.
        let (here, downwind) = (plant_at(0.0), plant_at(2.0));
        for time_s in [0.3, 0.9, 1.4] {
            assert_relative_eq!(
                here.at(time_s).rotation.angle_to(&downwind.at(time_s + 1.0).rotation),
                0.0,
                epsilon = 1e-9
            );
        }
    }

    #[test]
    fn the_bounds_contain_the_plant_at_all_times() {
        let plant = plant_at(3.0);
        let body = (Vector::new(-0.1, -0.2, -0.3), Vector::new(0.2, 0.1, 1.1));
        let (lower, upper) = plant.bounds(body);
        for (step, corner) in (0..40).flat_map(|step| (0..8_usize).map(move |corner| (step, corner))) {
            let corner = Vector::from_fn(|axis, _| if corner >> axis & 1 == 0 { body.0[axis] } else { body.1[axis] });
            let at = (plant.at(0.05 * f64::from(step)) * nalgebra::Point3::from(corner)).coords;
            assert!((at - lower).min() > -1e-9 && (upper - at).min() > -1e-9, "{at:?} in {lower:?} {upper:?}");
        }
    }
}
