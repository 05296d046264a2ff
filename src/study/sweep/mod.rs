//! Sweeps and studies: a run, what is varied about it, and what is told of each.
//!
//! A [`SweepSpec`] names a base run, axes and measures. A [`Plan`] is the spec with all that it names found and
//! checked; left in a folder it is a [`Sweep`], whose runs any number of processes on any number of machines may do,
//! stop, and go on with: each run is named by what it is (a hash of its specs, seed and the version of zsim), and what
//! came of it is there whole or not at all. Merged, they are one table, the same bytes however they came about.
//!
//! Work is not repeated: runs that differ in the estimator alone share one recording, and recordings that differ in the
//! IMU or the lidar's errors alone share physics and rays. A run that fails, takes too long or needs too much memory is
//! a row with its error; journeys run in processes of their own, so that one that breaks breaks no other.

mod axis;
mod check;
mod closed_form;
mod component;
mod design;
mod folder;
mod identity;
mod integrity;
mod journey;
mod measure;
mod merge;
mod output;
mod paired;
mod part;
mod pictures;
mod plan;
mod run;
mod runs;
mod settings;
mod spec;
mod summary;
mod table;
mod task;
mod tell;
mod trend;
mod worker;

pub use folder::Sweep;
pub use measure::Measure;
pub use merge::Status;
pub use plan::Plan;
pub use run::{Runner, Share};
pub use spec::{Aim, AxisSpec, BaseSpec, GoalSpec, LevelSpec, LimitSpec, Sampling, Setting, SweepSpec};
pub use summary::{Against, Line, SIGNIFICANT, Summary, Trend};
pub use task::{Word, confine};
pub use tell::Merged;
