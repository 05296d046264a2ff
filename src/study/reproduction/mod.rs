//! Reproduction of the paper's experiments, and comparison with its results.
//!
//! An experiment is a spec ([`ExperimentSpec`], the files of `specs/experiments/`). Its runs are a [sweep](super::sweep), so
//! that an interrupted experiment can be resumed; [`Experiment::run`] also draws the figures. [`paper_table`] and
//! [`paper_page`] combine all finished experiments in a table and on a page.

mod clock_plot;
mod comparison;
mod damping;
mod experiment;
mod extent;
mod gain_curves;
mod gain_plots;
mod head_response;
mod page;
mod paper_table;
mod result;
mod runs;
mod spec;
mod timing;

pub use comparison::{Comparison, Verdict};
pub use damping::{DampingFit, FittedPeak, fit_damping};
pub use experiment::{Experiment, Finding};
pub use extent::Extent;
pub use page::paper_page;
pub use paper_table::{TABLE_HEADING, paper_table};
pub use result::{ComparedNumber, ExperimentResult};
pub use spec::{
    ClaimSpec, DesignedSpec, ExperimentSpec, GainCurvesSpec, PeaksSpec, QuickSpec, ResultSpec, RunsSpec,
    TimingMapsSpec, WarningSpec,
};
