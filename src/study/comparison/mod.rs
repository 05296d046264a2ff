//! Which of the estimator's ingredients matter: variants of its settings against the settings as they are.
//!
//! A run is a scene, a motion and a seed. Each is simulated once, and its recording estimated by every variant, so that
//! variants are compared on the same measurements: what counts is the ratio of a variant's figure to that of `base`, run by
//! run. Whether a variant differs is told by Wilcoxon's signed-rank test on the logarithms of these ratios, with the levels
//! of all variants together corrected by Holm's method.

mod ledger;
mod measure;
mod output;
mod overrides;
mod paired;
mod run;
mod spec;
mod summary;

pub use measure::{Measure, Row};
pub use output::{csv, markdown, ratio_figure, words};
pub use overrides::with_setting;
pub use paired::{holm, signed_rank_p};
pub use run::Comparison;
pub use spec::{BASE, BaseSpec, ComparisonSpec, PlaceSpec, Setting, VariantSpec};
pub use summary::{Line, Place, SIGNIFICANT, Summary};
