//! Results of a run that the page shows.

use crate::cloud::Origin;
use crate::integrity::Integrity;
use crate::loops::{BestEstimate, Loops};
use zsim_evaluation::{InformationBound, Pairs};
use zsim_recording::CloudPoint;

/// Results of a run, from which the page is made.
pub(crate) struct RunResults<'a> {
    pub origin: &'a Origin<'a>,
    pub loops: &'a Loops,
    pub best: &'a BestEstimate<'a>,
    pub bound: Option<&'a InformationBound>,
    pub integrity: &'a Integrity,
    /// Estimated and true poses; `None` without truth.
    pub pairs: Option<&'a Pairs>,
    /// Points of the cloud in the map frame.
    pub points: &'a [CloudPoint],
}
