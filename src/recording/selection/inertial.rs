//! Which topic is the IMU, and how its messages are put together.

use super::candidates::Candidate;
use super::content::{Content, quantile, unit_of_force};
use super::listen::Heard;
use crate::measurement::ImuSample;
use crate::recording::message::imu::ForceUnit;
use crate::recording::{Reader, RecordingError};
use crate::time::Span;
use std::collections::BTreeMap;

/// Endings of IMU topics, preferred first: the raw one is without a filter's opinion.
const ENDINGS: [&str; 3] = ["imu/data_raw", "imu/data", "imu"];

/// Greatest angle between the frames of a gyroscope and an accelerometer in two topics, rad.
const SAME_AXES_RAD: f64 = 0.01;

/// How samples come in messages.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Layout {
    /// Each message is a sample.
    #[default]
    Whole,
    /// Angular velocities and accelerations are separate messages, paired by their stamps.
    Separate {
        /// The topic of the accelerations, where it is another one.
        acceleration_topic: Option<String>,
        /// How far apart the stamps of a pair may be: half a period.
        apart: Span,
    },
}

/// The IMU.
pub struct Choice {
    pub candidate: Candidate,
    pub layout: Layout,
    pub unit: ForceUnit,
    pub heard: Heard,
}

fn has_force(sample: &ImuSample) -> bool {
    sample.specific_force_m_per_s2.iter().any(|x| *x != 0.0)
}

fn has_rate(sample: &ImuSample) -> bool {
    sample.angular_velocity_rad_per_s.iter().any(|x| *x != 0.0)
}

/// Why one that carries a part only cannot be used.
const NO_RATE: &str = "has zeros for angular velocity, and no other topic carries it; record the gyroscope's topic too, or let the \
                       driver unite them (`unite_imu_method` of realsense2_camera)";
const NO_FORCE: &str = "has zeros for acceleration, and no other topic carries it; record the accelerometer's topic too, or let the \
                        driver unite them (`unite_imu_method` of realsense2_camera)";
const NOTHING: &str = "has zeros for acceleration and angular velocity; name another with --imu-topic, or set the driver to \
                       publish them";

impl Reader {
    /// The IMU among `wanted`, whose other half may be any of `all`; `None` where there is none.
    ///
    /// # Errors
    /// When the file cannot be read, or none of them carries what an estimate needs.
    pub fn choose_imu(&self, wanted: &[Candidate], all: &[Candidate]) -> Result<Option<Choice>, RecordingError> {
        let heard = self.hear(all.iter().chain(wanted).map(|candidate| candidate.topic.as_str()))?;
        let content = |candidate: &Candidate| {
            heard.get(&candidate.topic).map_or(Content::Both, |heard| Content::of(&heard.samples))
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
        let other_half = |sought: Content| {
            let halves = all.iter().filter(|c| c.topic != first.topic && content(c) == sought);
            halves.min_by_key(|c| (std::cmp::Reverse(shared(&c.topic, &first.topic)), &c.topic))
        };
        let (rates, forces) = match content(first) {
            Content::Both | Content::Alternating => (first, first),
            Content::RateOnly => {
                (first, other_half(Content::ForceOnly).ok_or_else(|| self.imu_error(first, NO_FORCE.to_owned()))?)
            }
            Content::ForceOnly => {
                (other_half(Content::RateOnly).ok_or_else(|| self.imu_error(first, NO_RATE.to_owned()))?, first)
            }
            Content::Neither => return Err(self.imu_error(first, NOTHING.to_owned())),
        };
        let layout = match content(first) {
            Content::Both => Layout::Whole,
            _ => self.pairing(rates, forces, &heard)?,
        };
        let unit = self.unit_of(forces, &heard)?;
        let heard = heard.get(&rates.topic).cloned().unwrap_or_default();
        Ok(Some(Choice { candidate: rates.clone(), layout, unit, heard }))
    }

    /// How separate messages are paired.
    fn pairing(
        &self,
        rates: &Candidate,
        forces: &Candidate,
        heard: &BTreeMap<String, Heard>,
    ) -> Result<Layout, RecordingError> {
        let turned_rad = self
            .frames()
            .ok()
            .and_then(|tree| tree.target_from_source(&rates.frame, &forces.frame))
            .map_or(0.0, |pose| pose.rotation.angle());
        if turned_rad > SAME_AXES_RAD {
            let problem = format!(
                "has no accelerations, and those of {} are in the frame {}, whose axes are turned by {:.1} degrees; let the driver \
                 publish both in one frame",
                forces.topic,
                forces.frame,
                turned_rad.to_degrees()
            );
            return Err(self.imu_error(rates, problem));
        }
        let period = |topic: &str, has: fn(&ImuSample) -> bool| heard.get(topic).map_or(0.0, |h| h.period_s(has));
        let slower_s = period(&rates.topic, has_rate).max(period(&forces.topic, has_force));
        let acceleration_topic = (forces.topic != rates.topic).then(|| forces.topic.clone());
        Ok(Layout::Separate { acceleration_topic, apart: Span::from_seconds(0.5 * slower_s) })
    }

    /// The unit of a topic's accelerations.
    fn unit_of(&self, forces: &Candidate, heard: &BTreeMap<String, Heard>) -> Result<ForceUnit, RecordingError> {
        let samples = heard.get(&forces.topic).map(|heard| heard.samples.as_slice()).unwrap_or_default();
        let felt: Vec<ImuSample> = samples.iter().copied().filter(has_force).collect();
        unit_of_force(&felt).ok_or_else(|| {
            let median = quantile(felt.iter().map(|sample| sample.specific_force_m_per_s2.norm()).collect(), 0.5);
            let problem = format!(
                "has accelerations without gravity (median {median:.2} m/s^2); the estimate needs what the accelerometer \
                 measures, gravity included (REP-145): record the driver's raw accelerations, not its linear ones \
                 (BNO08x: accelerometer, not linear acceleration; Android: TYPE_ACCELEROMETER), or name another topic \
                 with --imu-topic"
            );
            self.imu_error(forces, problem)
        })
    }

    /// The unit of the accelerations of one topic that has whole samples.
    ///
    /// # Errors
    /// When the file cannot be read, or the topic carries a part only, or no gravity.
    pub fn force_unit(&self, candidate: &Candidate) -> Result<ForceUnit, RecordingError> {
        let only = std::slice::from_ref(candidate);
        let choice = self.choose_imu(only, only)?;
        Ok(choice.map(|choice| choice.unit).unwrap_or_default())
    }

    fn imu_error(&self, candidate: &Candidate, problem: String) -> RecordingError {
        RecordingError::Imu { name: self.name().to_owned(), topic: candidate.topic.clone(), problem }
    }
}

fn name_rank(topic: &str) -> usize {
    ENDINGS.iter().position(|ending| topic.ends_with(ending)).unwrap_or(ENDINGS.len())
}

/// How many characters two names share at their beginning.
fn shared(a: &str, b: &str) -> usize {
    a.chars().zip(b.chars()).take_while(|(a, b)| a == b).count()
}
