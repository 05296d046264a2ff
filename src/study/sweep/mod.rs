//! Parameter sweeps: a base run, the parameters to vary, and the measures of each run.
//!
//! A [`SweepSpec`] defines a base run, axes and measures. A [`Plan`] is the spec with all referenced specs loaded and
//! checked; written to a folder it is a [`Sweep`]. Any number of processes on any number of machines can run a sweep, and
//! stop and resume it: a run is identified by a hash of its specs, its seed and the version of zsim, and its result is
//! written atomically. The merged table has the same bytes for any division of the work. A *run* is a combination of values
//! and a seed; a *batch*, the runs that are stored together in one *file*; a *job*, the batches that one worker process does.
//!
//! Work is shared: runs that differ only in the estimator use one recording, and recordings that differ only in the IMU
//! or in the lidar's errors use the same physics and rays. A run that fails or exceeds its time or memory limit is a row
//! with its error. Journeys run in worker processes, so that a crash does not affect other runs.

mod axis;
mod base_spec;
mod check;
mod claim;
mod comparison;
mod design;
mod document;
mod effects;
mod folder;
mod goal;
mod identity;
mod in_process;
mod integrity;
mod job;
mod judge;
mod levels;
mod maps;
mod measure;
mod merge;
mod outcome;
mod paired;
mod pareto;
mod plan;
mod plots;
mod repeat;
mod report;
mod run;
mod runs;
mod setting;
mod settings;
mod spec;
mod suite;
mod summary;
mod table;
mod timing;
mod tree;
mod trend;
mod worker;

pub(crate) use base_spec::usual;
pub use base_spec::{BaseSpec, JourneySpec, LimitSpec, ReferenceSpec};
pub use claim::{ClaimSpec, Place};
pub use comparison::{Comparison, Goal, Verdict};
pub use folder::Sweep;
pub use goal::{Aim, GoalSpec, MeasureLimitSpec};
pub(super) use identity::ContentHash;
pub use job::{WorkerMessage, limit_process};
pub use judge::ComparedNumber;
pub use measure::Measure;
pub(super) use measure::{figures, needs};
pub use merge::SweepStatus;
pub(crate) use outcome::Figures;
pub use pareto::{pareto_set, spread};
pub use plan::Plan;
pub(crate) use plan::check_folder_name;
pub use repeat::RepeatedRun;
pub use report::MergedReport;
pub use run::Shard;
pub use setting::Setting;
pub use spec::{AxisSpec, LevelSpec, Sampling, SweepSpec};
pub use suite::SuiteRecording;
pub use summary::{LevelSummary, RatioToFirst, SIGNIFICANCE_LEVEL, Summary, Trend};
pub use worker::Runner;
