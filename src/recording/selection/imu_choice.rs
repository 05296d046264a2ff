//! Selects the IMU topic and determines how messages form samples.

use super::candidates::Candidate;
use super::content::{Content, detect_unit};
use super::preview::ImuPreview;
use super::unused::UnusedTopic;
use crate::message::imu::ForceUnit;
use crate::quantile::quantile;
use crate::{Reader, RecordingError};
use std::collections::BTreeMap;
use zsim_base::measurement::ImuSample;
use zsim_base::time::Span;

/// Endings of IMU topic names, preferred first: raw data are not altered by a filter.
const NAME_ENDINGS: [&str; 3] = ["imu/data_raw", "imu/data", "imu"];

/// Maximum angle between the axes of a gyroscope and an accelerometer in two topics, rad.
const MAX_AXES_ANGLE_RAD: f64 = 0.01;

/// How messages form samples.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum ImuLayout {
    /// Each message is a sample.
    #[default]
    Combined,
    /// Angular velocities and accelerations are separate messages, paired by stamp.
    Separate {
        /// Topic of the accelerations, if it is another one.
        acceleration_topic: Option<String>,
        /// Maximum difference of stamps in a pair: half a period.
        max_separation: Span,
    },
}

/// The selected IMU.
pub struct ImuChoice {
    pub candidate: Candidate,
    pub layout: ImuLayout,
    pub unit: ForceUnit,
    pub preview: ImuPreview,
    /// The other topics.
    pub unused: Vec<UnusedTopic>,
}

fn has_force(sample: &ImuSample) -> bool {
    sample.specific_force_m_per_s2.iter().any(|x| *x != 0.0)
}

fn has_rate(sample: &ImuSample) -> bool {
    sample.angular_velocity_rad_per_s.iter().any(|x| *x != 0.0)
}

/// Reasons why a topic with incomplete messages is unusable.
const NO_RATE: &str = "has zeros for angular velocity, and no other topic has it; record the gyroscope's topic too, or let the \
                       driver merge them (`unite_imu_method` of realsense2_camera)";
const NO_FORCE: &str = "has zeros for acceleration, and no other topic has it; record the accelerometer's topic too, or let the \
                        driver merge them (`unite_imu_method` of realsense2_camera)";
const NO_DATA: &str = "has zeros for acceleration and angular velocity; select another IMU topic, or configure the \
                       driver to publish them";

impl Reader {
    /// Selects the IMU from `wanted`; separate accelerations or rates may come from any of `all`.
    ///
    /// `None` if there is no candidate.
    ///
    /// # Errors
    /// When the file cannot be read, or no candidate has the data that an estimate needs.
    pub fn choose_imu(&self, wanted: &[Candidate], all: &[Candidate]) -> Result<Option<ImuChoice>, RecordingError> {
        let previews = self.preview_imus(all.iter().chain(wanted).map(|candidate| candidate.topic.as_str()))?;
        let content = |candidate: &Candidate| {
            previews.get(&candidate.topic).map_or(Content::Both, |preview| Content::detect(&preview.samples))
        };
        let rank = |candidate: &Candidate| match content(candidate) {
            Content::Both => 0,
            Content::Alternating => 1,
            Content::RateOnly | Content::ForceOnly => 2,
            Content::Neither => 3,
        };
        let Some(first) = wanted.iter().min_by_key(|c| (rank(c), name_rank(&c.topic), &c.topic)) else {
            return Ok(None);
        };
        let find_other = |sought: Content| {
            let halves = all.iter().filter(|c| c.topic != first.topic && content(c) == sought);
            halves.min_by_key(|c| (std::cmp::Reverse(common_prefix(&c.topic, &first.topic)), &c.topic))
        };
        let (rates, forces) = match content(first) {
            Content::Both | Content::Alternating => (first, first),
            Content::RateOnly => {
                (first, find_other(Content::ForceOnly).ok_or_else(|| self.imu_error(first, NO_FORCE.to_owned()))?)
            }
            Content::ForceOnly => {
                (find_other(Content::RateOnly).ok_or_else(|| self.imu_error(first, NO_RATE.to_owned()))?, first)
            }
            Content::Neither => return Err(self.imu_error(first, NO_DATA.to_owned())),
        };
        let layout = match content(first) {
            Content::Both => ImuLayout::Combined,
            _ => self.pairing_layout(rates, forces, &previews)?,
        };
        let unit = self.acceleration_unit(forces, &previews)?;
        let preview = previews.get(&rates.topic).cloned().unwrap_or_default();
        let others = all.iter().filter(|c| c.topic != rates.topic && c.topic != forces.topic);
        let unused = others.map(|other| {
            let reason = reason_against(other, content(other), rates);
            UnusedTopic { topic: other.topic.clone(), reason, is_usable: true }
        });
        Ok(Some(ImuChoice { candidate: rates.clone(), layout, unit, preview, unused: unused.collect() }))
    }

    /// Determines how separate messages are paired.
    fn pairing_layout(
        &self,
        rates: &Candidate,
        forces: &Candidate,
        previews: &BTreeMap<String, ImuPreview>,
    ) -> Result<ImuLayout, RecordingError> {
        let angle_rad = self
            .frames()
            .ok()
            .and_then(|frames| frames.target_from_source(&rates.frame, &forces.frame).ok().flatten())
            .map_or(0.0, |pose| pose.rotation.angle());
        if angle_rad > MAX_AXES_ANGLE_RAD {
            let problem = format!(
                "has no accelerations, and those of {} are in the frame {}, whose axes are rotated by {:.1} degrees; configure the \
                 driver to publish both in one frame",
                forces.topic,
                forces.frame,
                angle_rad.to_degrees()
            );
            return Err(self.imu_error(rates, problem));
        }
        let period = |topic: &str, has: fn(&ImuSample) -> bool| previews.get(topic).map_or(0.0, |h| h.period_s(has));
        let slower_s = period(&rates.topic, has_rate).max(period(&forces.topic, has_force));
        let acceleration_topic = (forces.topic != rates.topic).then(|| forces.topic.clone());
        Ok(ImuLayout::Separate { acceleration_topic, max_separation: Span::from_seconds(0.5 * slower_s) })
    }

    /// Unit of a topic's accelerations.
    fn acceleration_unit(
        &self,
        forces: &Candidate,
        previews: &BTreeMap<String, ImuPreview>,
    ) -> Result<ForceUnit, RecordingError> {
        let samples = previews.get(&forces.topic).map(|preview| preview.samples.as_slice()).unwrap_or_default();
        let nonzero: Vec<ImuSample> = samples.iter().copied().filter(has_force).collect();
        detect_unit(&nonzero).ok_or_else(|| {
            let median = quantile(nonzero.iter().map(|sample| sample.specific_force_m_per_s2.norm()).collect(), 0.5);
            let problem = format!(
                "has accelerations without gravity (median {median:.2} m/s^2); the estimate needs specific force as the \
                 accelerometer measures it, gravity included (REP-145): record the driver's raw accelerations, not its linear ones \
                 (BNO08x: accelerometer, not linear acceleration; Android: TYPE_ACCELEROMETER), or select another \
                 IMU topic"
            );
            self.imu_error(forces, problem)
        })
    }

    /// Unit of the accelerations of one topic whose messages are complete samples.
    ///
    /// # Errors
    /// When the file cannot be read, or the topic lacks a quantity or gravity.
    pub fn force_unit(&self, candidate: &Candidate) -> Result<ForceUnit, RecordingError> {
        let only = std::slice::from_ref(candidate);
        let choice = self.choose_imu(only, only)?;
        Ok(choice.map(|choice| choice.unit).unwrap_or_default())
    }

    fn imu_error(&self, candidate: &Candidate, problem: String) -> RecordingError {
        RecordingError::Imu { name: self.name().to_owned(), topic: candidate.topic.clone(), problem }
    }
}

/// Why `other` is not used, but `chosen`.
fn reason_against(other: &Candidate, content: Content, chosen: &Candidate) -> String {
    let frame = &other.frame;
    match content {
        Content::Neither => "it has zeros for acceleration and angular velocity".to_owned(),
        Content::RateOnly => "it has zeros for acceleration".to_owned(),
        Content::ForceOnly => "it has zeros for angular velocity".to_owned(),
        Content::Alternating => "it has zeros for acceleration or angular velocity in each message".to_owned(),
        Content::Both if other.frame == chosen.frame && name_rank(&other.topic) > name_rank(&chosen.topic) => {
            format!("the same IMU (frame {frame}); raw data are preferred")
        }
        Content::Both if other.frame == chosen.frame => format!("the same IMU (frame {frame}), as suitable"),
        Content::Both => format!("another IMU (frame {frame}), as suitable; select it with --imu-topic"),
    }
}

fn name_rank(topic: &str) -> usize {
    NAME_ENDINGS.iter().position(|ending| topic.ends_with(ending)).unwrap_or(NAME_ENDINGS.len())
}

/// Length of the common prefix of two names, in characters.
fn common_prefix(a: &str, b: &str) -> usize {
    a.chars().zip(b.chars()).take_while(|(a, b)| a == b).count()
}
