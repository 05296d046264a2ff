//! An experiment as it is written: `specs/experiments/NAME.ron`.

use crate::dynamics::{self, HeadSpec};
use crate::motion::Axis;
use crate::spec::{Source, SpecError, checked};
use crate::study::gains::AXES;
use crate::study::latency::LatencySpec;
use serde::{Deserialize, Serialize};

/// An experiment of the paper.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum ExperimentSpec {
    /// Gain curves of several heads, their damping fitted to the paper's peaks.
    GainCurves(GainCurvesSpec),
    /// Maps of one recording under errors of timing.
    Latency(Box<LatencySpec>),
}

/// Gain curves of several heads.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GainCurvesSpec {
    /// The paper's figure.
    pub figure: String,
    /// Highest frequency that the figure shows, Hz.
    #[serde(with = "checked::Positive")]
    pub shown_to_hz: f64,
    /// Highest frequency at which gains are measured and peaks are looked for, Hz.
    #[serde(with = "checked::Positive")]
    pub up_to_hz: f64,
    /// Least and greatest damping ratio that the fit may choose.
    pub ratios: (f64, f64),
    /// The heads.
    pub designs: Vec<DesignedSpec>,
}

/// A head of a figure.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DesignedSpec {
    /// Its letter in the paper's figure.
    pub letter: String,
    /// What it is.
    pub title: String,
    /// The head, a name under `specs/heads/` or a file.
    pub head: String,
    /// The paper's peaks.
    pub peaks: PeaksSpec,
}

/// The highest gain along or about each axis; left out where the paper shows none.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PeaksSpec {
    /// Rate about x.
    pub x_rot: Option<f64>,
    /// Rate about y.
    pub y_rot: Option<f64>,
    /// Rate about z.
    pub z_rot: Option<f64>,
    /// Acceleration along x.
    pub x: Option<f64>,
    /// Acceleration along y.
    pub y: Option<f64>,
    /// Acceleration along z.
    pub z: Option<f64>,
}

impl PeaksSpec {
    /// The peak of an axis.
    pub fn of(&self, axis: Axis) -> Option<f64> {
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

impl ExperimentSpec {
    /// Whether what it says can be done.
    ///
    /// # Errors
    /// When numbers contradict each other, or a head is missing, wrong, or has no spring.
    pub fn check(&self, source: &Source) -> Result<(), SpecError> {
        match self {
            ExperimentSpec::GainCurves(spec) => spec.heads(source).map(drop),
            ExperimentSpec::Latency(spec) => spec.check(source),
        }
    }
}

impl GainCurvesSpec {
    /// The heads, in the order of the designs.
    ///
    /// # Errors
    /// As [`ExperimentSpec::check`].
    pub(super) fn heads(&self, source: &Source) -> Result<Vec<HeadSpec>, SpecError> {
        let wrong = |key: &str, message: String| Err(SpecError::about(source, key, message));
        let (least, most) = self.ratios;
        if !(least > 0.0 && least < most && most < 1.0) {
            return wrong("ratios", format!("damping ratios from {least} to {most}: expected 0 < least < most < 1"));
        }
        if self.up_to_hz < self.shown_to_hz {
            return wrong("up_to_hz", format!("{} Hz are less than the {} Hz shown", self.up_to_hz, self.shown_to_hz));
        }
        if self.designs.is_empty() {
            return wrong("designs", "a figure shows at least one head".to_owned());
        }
        for (index, design) in self.designs.iter().enumerate() {
            if self.designs[..index].iter().any(|other| other.letter == design.letter) {
                return wrong("designs", format!("two designs have the letter \"{}\"", design.letter));
            }
        }
        self.designs.iter().map(|design| design.head(source)).collect()
    }
}

impl DesignedSpec {
    /// The head, which has something to damp.
    fn head(&self, source: &Source) -> Result<HeadSpec, SpecError> {
        let wrong = |key: &str, message: String| Err(SpecError::about(source, key, message));
        if self.letter.is_empty() || !self.letter.chars().all(|c| c.is_ascii_alphanumeric()) {
            return wrong("letter", format!("\"{}\" names a folder: expected letters a to z", self.letter));
        }
        let peaks = AXES.map(|axis| self.peaks.of(axis));
        if let Some(peak) = peaks.into_iter().flatten().find(|peak| !(peak.is_finite() && *peak > 1.0)) {
            return wrong("peaks", format!("a peak is a gain above 1, not {peak}"));
        }
        let (mut head, _) = dynamics::load(&self.head)?;
        if head.linkage.damping_ratio_mut().is_none() {
            return wrong("head", format!("the head \"{}\" is rigid: there is nothing to damp", self.head));
        }
        Ok(head)
    }
}
