//! How far a correction moves a trajectory.

use zsim_base::geometry::Vector;

/// The largest displacement of the trajectory by a correction.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Displacement {
    /// Translation, m.
    pub translation_m: f64,
    /// Rotation, rad.
    pub rotation_rad: f64,
}

impl Displacement {
    /// Returns the maximum over corrections, each rotation and translation.
    pub fn max_of(corrections: impl Iterator<Item = (Vector, Vector)>) -> Self {
        // A NaN must not count as small.
        let larger = |a: f64, b: f64| if b > a || b.is_nan() { b } else { a };
        corrections.fold(Self { translation_m: 0.0, rotation_rad: 0.0 }, |largest, (rotation, translation)| Self {
            translation_m: larger(largest.translation_m, translation.norm()),
            rotation_rad: larger(largest.rotation_rad, rotation.norm()),
        })
    }

    /// Returns the larger of rotation (rad) and translation (m).
    pub fn max(self) -> f64 {
        self.translation_m.max(self.rotation_rad)
    }
}
