//! Spec of an experiment: `specs/experiments/NAME.ron`.

use super::Extent;
use crate::sweep::{AxisSpec, BaseSpec, JourneySpec, Measure, Setting, SweepSpec};
use serde::{Deserialize, Serialize};
use std::num::NonZeroUsize;
use zsim_base::spec::{Kind, NamedSpec, Source, SpecError, checked, find_from, parse_named};
use zsim_dynamics::HeadSpec;
use zsim_head::gains::AXES;
use zsim_motion::Axis;

/// An experiment of the paper.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum ExperimentSpec {
    /// Gain curves of several heads with damping fitted to the paper's peaks.
    GainCurves(GainCurvesSpec),
    /// Maps of one recording with timing errors.
    Latency(TimingMapsSpec),
    /// A study with claims.
    Runs(RunsSpec),
}

/// A study whose claims compare its result with the paper and with goals.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RunsSpec {
    /// Number of the figure or the section in the paper, `-` for an experiment that the paper does not have.
    pub figure: String,
    /// What the experiment shows, for its heading.
    #[serde(default)]
    pub title: String,
    /// The study: a name under `specs/studies/`, or a file. It has claims.
    pub study: String,
    /// The smoke test.
    #[serde(default)]
    pub quick: QuickSpec,
    /// Whether to plot the clock offset of each run over time. The study measures `clock_error_30s_s` and has one axis.
    #[serde(default)]
    pub plots_clock: bool,
    /// Assumptions and discrepancies.
    #[serde(default)]
    pub notes: Vec<String>,
}

/// The smoke test of an experiment: the first seeds of its study, with shorter runs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QuickSpec {
    /// Duration of a run, s.
    #[serde(default = "usual_duration_s", with = "checked::Positive")]
    pub duration_s: f64,
    /// Number of seeds.
    #[serde(default = "one")]
    pub seeds: NonZeroUsize,
}

fn usual_duration_s() -> f64 {
    20.0
}

impl Default for QuickSpec {
    fn default() -> Self {
        Self { duration_s: usual_duration_s(), seeds: one() }
    }
}

fn one() -> NonZeroUsize {
    NonZeroUsize::MIN
}

/// Gain curves of several heads.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GainCurvesSpec {
    /// Number of the figure in the paper.
    pub figure: String,
    /// Upper limit of the figure's frequency axis, Hz.
    #[serde(with = "checked::Positive")]
    pub shown_to_hz: f64,
    /// Upper frequency limit of the measurement and of the search for peaks, Hz; at least `shown_to_hz`.
    #[serde(with = "checked::Positive")]
    pub up_to_hz: f64,
    /// Bounds of the fitted damping ratios, lower and upper, between 0 and 1.
    pub ratios: (f64, f64),
    /// Heads of the figure.
    pub designs: Vec<DesignedSpec>,
}

/// Maps of a study of timing errors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TimingMapsSpec {
    /// Number of the figure in the paper.
    pub figure: String,
    /// The study: a name under `specs/studies/`, or a file.
    pub study: String,
    /// A short study for smoke tests.
    pub quick_study: String,
}

/// A head in a figure.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DesignedSpec {
    /// Letter in the paper's figure; also the name of the folder of its results.
    pub letter: String,
    /// Title of its plots.
    pub title: String,
    /// Head: a name under `specs/heads/`, or a file.
    pub head: String,
    /// Peak gains in the paper.
    pub peaks: PeaksSpec,
}

/// Peak gain per axis, above 1; omit those that the paper does not show.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PeaksSpec {
    /// Angular rate about x.
    pub x_rot: Option<f64>,
    /// Angular rate about y.
    pub y_rot: Option<f64>,
    /// Angular rate about z.
    pub z_rot: Option<f64>,
    /// Acceleration along x.
    pub x: Option<f64>,
    /// Acceleration along y.
    pub y: Option<f64>,
    /// Acceleration along z.
    pub z: Option<f64>,
}

impl PeaksSpec {
    /// Peak gain of an axis.
    pub fn peak(&self, axis: Axis) -> Option<f64> {
        match axis {
            Axis::X => self.x,
            Axis::Y => self.y,
            Axis::Z => self.z,
            Axis::Roll => self.x_rot,
            Axis::Pitch => self.y_rot,
            Axis::Yaw => self.z_rot,
        }
    }
}

impl TimingMapsSpec {
    /// The study of an extent, and its source.
    ///
    /// # Errors
    /// If the study is missing or invalid, or does not fit the experiment.
    pub(super) fn study(&self, extent: Extent, source: &Source) -> Result<(SweepSpec, Source), SpecError> {
        let (key, name) = match extent {
            Extent::Whole => ("study", &self.study),
            Extent::Quick => ("quick_study", &self.quick_study),
        };
        let of_study = find_from(Kind::Study, source, name)?;
        let spec: SweepSpec = SweepSpec::parse(&of_study)?;
        match spec.base {
            BaseSpec::Journey(JourneySpec { timing: Some(_), .. }) => Ok((spec, of_study)),
            _ => Err(SpecError::about(source, key, format!("the study \"{name}\" has no `timing`"))),
        }
    }
}

impl RunsSpec {
    /// Heading: the figure or the section of the paper, and what the experiment shows.
    pub(super) fn heading(&self) -> String {
        let Self { figure, title, .. } = self;
        let place = match figure.chars().next() {
            Some(first) if first.is_ascii_digit() => format!("Figure {figure}"),
            Some(first) if first.is_alphabetic() => format!("Section {figure}"),
            _ => String::new(),
        };
        [place.as_str(), title].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(": ")
    }

    /// The study of an extent, and its source.
    ///
    /// # Errors
    /// If the study is missing or invalid, or does not fit the experiment.
    pub(super) fn study(&self, extent: Extent, source: &Source) -> Result<(SweepSpec, Source), SpecError> {
        let of_study = find_from(Kind::Study, source, &self.study)?;
        let mut spec: SweepSpec = SweepSpec::parse(&of_study)?;
        let wrong = |key: &str, message: String| Err(SpecError::about(source, key, message));
        if spec.claims.is_empty() {
            return wrong("study", format!("the study \"{}\" has no claims", self.study));
        }
        if self.plots_clock && !spec.measures.contains(&Measure::CLOCK_ERROR_30S_S) {
            let key = Measure::CLOCK_ERROR_30S_S.key();
            return wrong("plots_clock", format!("the study \"{}\" does not measure {key}", self.study));
        }
        if extent == Extent::Quick {
            self.quick.shorten(&mut spec);
        }
        Ok((spec, of_study))
    }
}

impl QuickSpec {
    /// Keeps the first seeds of a study, and shortens its runs.
    fn shorten(&self, spec: &mut SweepSpec) {
        spec.seeds.truncate(self.seeds.get());
        if let BaseSpec::Journey(JourneySpec { duration_s, .. }) = &mut spec.base {
            *duration_s = self.duration_s;
        }
        for axis in &mut spec.axes {
            let AxisSpec::Levels { levels, .. } = axis else { continue };
            for duration in levels.iter_mut().filter_map(|level| level.set.get_mut("duration_s")) {
                if let Setting::Number(duration_s) = duration {
                    *duration_s = duration_s.min(self.duration_s);
                }
            }
        }
    }
}

impl GainCurvesSpec {
    /// Loads the heads, in the order of the designs.
    ///
    /// # Errors
    /// If the study is missing or invalid, or does not fit the experiment.
    pub(super) fn heads(&self, source: &Source) -> Result<Vec<HeadSpec>, SpecError> {
        let invalid = |key: &str, message: String| Err(SpecError::about(source, key, message));
        let (least, most) = self.ratios;
        if !(least > 0.0 && least < most && most < 1.0) {
            return invalid("ratios", format!("damping ratios from {least} to {most}: expected 0 < least < most < 1"));
        }
        if self.up_to_hz < self.shown_to_hz {
            return invalid(
                "up_to_hz",
                format!("{} Hz are less than the {} Hz shown", self.up_to_hz, self.shown_to_hz),
            );
        }
        if self.designs.is_empty() {
            return invalid("designs", "expected at least one head".to_owned());
        }
        for (index, design) in self.designs.iter().enumerate() {
            if self.designs[..index].iter().any(|other| other.letter == design.letter) {
                return invalid("designs", format!("the letter \"{}\" occurs twice", design.letter));
            }
        }
        self.designs.iter().map(|design| design.head(source)).collect()
    }
}

impl DesignedSpec {
    /// Loads the head and checks that it has damping.
    fn head(&self, source: &Source) -> Result<HeadSpec, SpecError> {
        let invalid = |key: &str, message: String| Err(SpecError::about(source, key, message));
        if self.letter.is_empty() || !self.letter.chars().all(|c| c.is_ascii_alphanumeric()) {
            return invalid("letter", format!("\"{}\" names a folder: expected letters a to z", self.letter));
        }
        let peaks = AXES.map(|axis| self.peaks.peak(axis));
        if let Some(peak) = peaks.into_iter().flatten().find(|peak| !(peak.is_finite() && *peak > 1.0)) {
            return invalid("peaks", format!("{peak}: expected a gain above 1"));
        }
        let mut head = HeadSpec::read(&find_from(Kind::Head, source, &self.head)?)?;
        if head.linkage.damping_ratio_mut().is_none() {
            return invalid("head", format!("the head \"{}\" is rigid: it has no damping to fit", self.head));
        }
        Ok(head)
    }
}

impl NamedSpec for ExperimentSpec {
    const KIND: Kind = Kind::Experiment;
    type Error = SpecError;

    fn parse(source: &Source) -> Result<Self, SpecError> {
        parse_named(source)
    }

    fn check_model(&self, source: &Source) -> Result<Vec<String>, SpecError> {
        let checked = match self {
            ExperimentSpec::GainCurves(spec) => spec.heads(source).map(drop),
            ExperimentSpec::Runs(spec) => spec.study(Extent::Whole, source).map(drop),
            ExperimentSpec::Latency(spec) => {
                [Extent::Whole, Extent::Quick].into_iter().try_for_each(|extent| spec.study(extent, source).map(drop))
            }
        };
        checked.map(|()| Vec::new())
    }
}
