//! The last linearisation of a window.

use super::correspondence::Matches;
use super::equations::Robust;
use crate::layout::Layout;
use crate::surfel::PlacedSurfel;

/// The last linearisation of a solved window; the workspace still has the equations and the factor of it.
#[derive(Debug)]
pub(crate) struct Linearised {
    pub(super) layout: Layout,
    pub(super) scene: Vec<PlacedSurfel>,
    pub(super) matches: Matches,
    pub(super) robust: Robust,
    /// Sum of the corrections of the window before this linearisation.
    pub(super) total_before: Vec<f64>,
    /// The solution; empty until it is applied.
    pub(super) step: Vec<f64>,
}
