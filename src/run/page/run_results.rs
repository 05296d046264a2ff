//! Results of a run that the page shows.

use super::super::cloud::Origin;
use super::super::integrity::Integrity;
use super::super::loops::BestEstimate;
use super::super::open_loop::OpenLoopRun;
use super::super::sampled_truth::SampledTruth;
use zsim_evaluation::Errors;
use zsim_evaluation::InformationBound;
use zsim_evaluation::Pairs;
use zsim_recording::CloudPoint;

/// Results of a run, from which the page is made.
pub(crate) struct RunResults<'a> {
    pub origin: &'a Origin<'a>,
    pub open: &'a OpenLoopRun,
    /// The truth at the stamps of the estimate, if it is known.
    pub truth: Option<&'a SampledTruth>,
    pub best: &'a BestEstimate<'a>,
    /// Errors of the open loop if a closed loop was computed.
    pub open_errors: Option<&'a Errors>,
    pub bound: Option<&'a InformationBound>,
    pub integrity: &'a Integrity,
    /// Estimated and true poses; `None` without truth.
    pub pairs: Option<&'a Pairs>,
    /// Points of the cloud in the map frame.
    pub points: &'a [CloudPoint],
}
