//! Contact of the coils of a spring during a simulation.

use super::coil_gap::CoilGaps;
use super::head::HeadModel;
use serde::{Deserialize, Serialize};
use zsim_base::geometry::{Kinematics, Pose};

/// The coils of a spring touched and stopped each other.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CoilContact {
    /// Time of the first contact, s after the start.
    pub first_t_s: f64,
    /// Angle between the two ends of the spring at that time, degrees.
    pub first_bend_deg: f64,
    /// Total time in contact, s.
    pub contact_s: f64,
    /// Smallest gap between neighbouring coils, mm: negative, the depth to which they would overlap.
    pub least_gap_mm: f64,
}

/// Watches the springs of a head for contact of their coils.
pub struct ContactWatch<'a> {
    gaps: CoilGaps<'a>,
    checked_t_s: Option<f64>,
    contact: Option<CoilContact>,
}

/// Minimum time between two checks, s: modes up to 40 Hz have five checks in a period.
const INTERVAL_S: f64 = 5e-3;

impl<'a> ContactWatch<'a> {
    /// A watch of a simulation of `model`.
    pub fn new(model: &'a HeadModel) -> Self {
        Self { gaps: CoilGaps::of(model), checked_t_s: None, contact: None }
    }

    /// Checks a state at `t_s` after the start; states within 5 ms of the last check are passed over.
    pub fn check(&mut self, t_s: f64, base: &Kinematics, head: &Kinematics) {
        let since_s = self.checked_t_s.map(|before_s| t_s - before_s);
        // Half a step of 1 ms less, so that rounding does not skip a check.
        if since_s.is_some_and(|since_s| since_s < INTERVAL_S - 5e-4) {
            return;
        }
        self.checked_t_s = Some(t_s);
        let base_from_head: Pose = base.world_from_body.inv_mul(&head.world_from_body);
        let Some(gap) = self.gaps.smallest(&base_from_head).filter(|gap| gap.gap_m < 0.0) else { return };
        let contact = self.contact.get_or_insert(CoilContact {
            first_t_s: t_s,
            first_bend_deg: gap.bend_rad.to_degrees(),
            contact_s: 0.0,
            least_gap_mm: 0.0,
        });
        contact.contact_s += since_s.unwrap_or(0.0);
        contact.least_gap_mm = contact.least_gap_mm.min(1e3 * gap.gap_m);
    }

    /// The contact so far; `None` if no coils touched.
    pub fn contact(&self) -> Option<CoilContact> {
        self.contact
    }
}

impl CoilContact {
    /// The warning for the user.
    pub fn warning(&self) -> String {
        format!(
            "t = {:.2} s: the coils of the spring touch while its ends are {:.0} degrees apart (in contact for {:.2} s, overlap \
             up to {:.2} mm); they stop each other by a contact softer than that of steel, so the motion from there on is \
             approximate: use a spring with larger gaps, an end stop, or less motion",
            self.first_t_s, self.first_bend_deg, self.contact_s, -self.least_gap_mm
        )
    }
}
