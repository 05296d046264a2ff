//! Reproduction of the paper's experiments, and comparison with its results.
//!
//! An experiment is a spec ([`ExperimentSpec`], the files of `specs/experiments/`). Its runs are a [sweep](super::sweep), so
//! that an interrupted experiment can be resumed; [`Experiment::run`] also draws the figures.
//! [`paper_document`] combines all finished experiments.

mod clock_plot;
mod damping;
mod document;
mod experiment;
mod extent;
mod gain_curves;
mod gain_plots;
mod head_response;
mod result;
mod spec;
mod timing;

pub use damping::{DampingFit, FittedPeak, fit_damping};
pub use document::{PAPER_TITLE, paper_document};
pub use experiment::{Experiment, Finding};
pub use extent::Extent;
pub use result::ExperimentResult;
pub use spec::{DesignedSpec, ExperimentSpec, GainCurvesSpec, PeaksSpec, QuickSpec, RunsSpec, TimingMapsSpec};
