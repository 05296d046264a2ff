//! Time steps and impulses of the contact force of coils that touch.

use super::body::Body;
use super::compliant::CompliantLinkage;
use zsim_elasticity::{Matrix6, Vector6};

/// Divides the steps of a simulation while coils touch, and has the impulses of their contact force.
///
/// The contact of a spring is a Kelvin-Voigt element: the damping force is the rate of the elastic contact force times a
/// relaxation time. The backward difference of the elastic force is that damping force times the length of the part, so
/// that the impulses of the damping force are zero in sum over a clash.
pub(super) struct ContactSteps {
    step_s: f64,
    /// Longest part of a step while coils touch, s; infinite for springs without contact.
    longest_part_s: f64,
    relaxation_s: f64,
    /// Length of the last part of the last step, s.
    last_part_s: f64,
    /// Elastic contact force at the start of the last part.
    last_contact: Vector6,
    /// Largest overlap of coils at the last step, m.
    last_overlap_m: Option<f64>,
    /// Number of steps since one with several parts.
    undivided: u32,
}

/// Length of a part of a step times the angular frequency of the fastest bounce on closed coils.
const PART_OVER_BOUNCE: f64 = 0.15;

impl ContactSteps {
    /// The steps of a simulation with steps of `step_s`.
    pub fn new(body: &Body, compliant: &CompliantLinkage, step_s: f64) -> Self {
        Self {
            step_s,
            longest_part_s: longest_part_s(body, compliant).unwrap_or(f64::INFINITY),
            relaxation_s: compliant.law.contact_relaxation_s(&compliant.rest, body, &compliant.linear.mass),
            last_part_s: step_s,
            last_contact: Vector6::zeros(),
            last_overlap_m: None,
            undivided: u32::MAX,
        }
    }

    /// The number of parts of the next step: several if coils touch, or will in this step at twice their present speed.
    pub fn count_parts(&mut self, overlap_m: f64) -> u32 {
        let before_m = self.last_overlap_m.replace(overlap_m).unwrap_or(overlap_m);
        let next_m = overlap_m + 2.0 * (overlap_m - before_m);
        let touch = overlap_m > 0.0 || next_m > 0.0;
        let parts = if touch { (self.step_s / self.longest_part_s).ceil().max(1.0) as u32 } else { 1 };
        self.undivided = if parts > 1 { 0 } else { self.undivided.saturating_add(1) };
        parts
    }

    /// Whether the next step or one of the two before is divided.
    pub fn are_short(&self) -> bool {
        self.undivided <= 2
    }

    /// The impulse of the contact at the start of a part of `part_s` with the elastic contact force `contact`.
    ///
    /// It acts between the middles of the last part and of this one.
    pub fn impulse(&mut self, contact: &Vector6, part_s: f64) -> Vector6 {
        let change = contact - std::mem::replace(&mut self.last_contact, *contact);
        let span_s = 0.5 * (std::mem::replace(&mut self.last_part_s, part_s) + part_s);
        contact * span_s + change * self.relaxation_s
    }
}

/// The longest part of a step that resolves the bounce on coils that all touch, s; `None` without contact.
fn longest_part_s(body: &Body, compliant: &CompliantLinkage) -> Option<f64> {
    let stiffness: Matrix6 = compliant.law.contact_stiffness(&compliant.rest, body)?;
    let inverse = compliant.linear.mass.cholesky()?.l().try_inverse()?;
    let fastest = (inverse * stiffness * inverse.transpose()).symmetric_eigenvalues().max().sqrt();
    Some(PART_OVER_BOUNCE / fastest)
}
