//! Placement of a part on the head.

use serde::Deserialize;
use serde::Serialize;
use zsim_base::geometry::Pose;
use zsim_base::geometry::Vector;
use zsim_base::geometry::from_roll_pitch_yaw;
use zsim_base::spec::checked;

/// The pose of a frame in another frame; without keys the frames coincide.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PlacementSpec {
    /// Origin of the frame, m.
    #[serde(default, with = "checked::FiniteArray::<3>")]
    pub position_m: [f64; 3],
    /// Roll, pitch and yaw (about fixed x, then y, then z), degrees.
    #[serde(default, with = "checked::FiniteArray::<3>")]
    pub roll_pitch_yaw_deg: [f64; 3],
}

impl PlacementSpec {
    /// The pose as a rigid transform.
    pub fn pose(&self) -> Pose {
        let [roll, pitch, yaw] = self.roll_pitch_yaw_deg.map(f64::to_radians);
        Pose::from_parts(Vector::from(self.position_m).into(), from_roll_pitch_yaw(roll, pitch, yaw))
    }
}
