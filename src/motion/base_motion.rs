//! The motion of the base.

use zsim_base::geometry::Kinematics;

/// The prescribed motion of the base.
pub trait BaseMotion: Send + Sync {
    /// The motion at `t_s` seconds after the start: `world_from_base` with exact derivatives. Accelerations are
    /// continuous. The base is at rest at the start, except in a cruise.
    fn at(&self, t_s: f64) -> Kinematics;

    /// Grip of the hand on the head: 0 is free, 1 is held still.
    fn hold(&self, _t_s: f64) -> f64 {
        0.0
    }
}
