//! Notes on the choice of sensors and on unusual encodings, one sentence each.

use super::candidates::{BeamTimes, Candidate, LidarKind};
use super::cloud_preview::CloudPreview;
use super::imu_choice::{ImuChoice, ImuLayout};
use super::preview::HeaderPreview;
use crate::message::imu::ForceUnit;
use crate::message::no_returns::NoReturnDetector;
use crate::message::point_times::{PointTimes, TimeUnit};
use crate::message::points::TIME_NAMES;
use zsim_base::time::Span;

/// The chosen sensors, and what is known of them.
pub struct Choice<'a> {
    pub lidar: &'a Candidate,
    pub lidars: &'a [Candidate],
    pub headers: &'a HeaderPreview,
    pub clouds: &'a CloudPreview,
    pub no_returns: &'a NoReturnDetector,
    pub imu: &'a ImuChoice,
    pub imus: &'a [Candidate],
    pub shift: Option<Span>,
}

impl Choice<'_> {
    /// The notes, in the order in which measurements are processed.
    pub fn notes(&self) -> Vec<String> {
        let (lidar, imu) = (self.lidar, &self.imu.candidate);
        let is_combined = self.imu.layout == ImuLayout::Combined;
        let notes = [
            choice("lidar", lidar, self.lidars),
            choice("IMU", imu, self.imus),
            self.headers.frames.note(&lidar.topic),
            is_combined.then(|| self.imu.preview.frames.note(&imu.topic)).flatten(),
            times(lidar, self.clouds),
            self.clouds.wrong_row_step.map(|bytes| row_step(lidar, bytes)),
            self.clouds.unusual_unit.map(|found| unit(lidar, found)),
            (self.imu.unit != ForceUnit::default()).then(|| force(&imu.topic)),
            layout(imu, &self.imu.layout),
            self.no_returns.note(&lidar.topic),
            (lidar.kind == Some(LidarKind::MultiEcho)).then(|| echoes(lidar)),
            self.shift.map(|offset| shift(imu, lidar, offset)),
        ];
        notes.into_iter().flatten().collect()
    }
}

/// Reports which of several sensors is used. Another topic in the same frame is the same sensor.
fn choice(sensor: &str, chosen: &Candidate, all: &[Candidate]) -> Option<String> {
    let mut others: Vec<_> =
        all.iter().filter(|c| c.topic != chosen.topic && c.frame != chosen.frame).map(|c| c.topic.as_str()).collect();
    others.sort_unstable();
    (!others.is_empty())
        .then(|| format!("Of several {sensor} topics, {} is used, not {}.", chosen.topic, others.join(", ")))
}

/// Reports how angular velocities and accelerations are paired.
fn layout(imu: &Candidate, layout: &ImuLayout) -> Option<String> {
    let ImuLayout::Separate { acceleration_topic, max_separation } = layout else { return None };
    let max_ms = 1e3 * max_separation.seconds();
    Some(match acceleration_topic {
        Some(forces) => format!(
            "{} has angular velocities only: each is paired with the nearest acceleration of {forces}, within {max_ms:.1} ms.",
            imu.topic
        ),
        None => format!(
            "{} has angular velocities and accelerations in separate messages: they are paired by stamp, within \
             {max_ms:.1} ms.",
            imu.topic
        ),
    })
}

/// Reports which of several echoes is used.
fn echoes(lidar: &Candidate) -> String {
    format!(
        "{} has several echoes per beam: the strongest is used, or the first if there are no intensities.",
        lidar.topic
    )
}

/// Reports an offset between the clocks.
fn shift(imu: &Candidate, lidar: &Candidate, shift: Span) -> String {
    format!(
        "By log times, the stamps of {} and {} differ by {:.3} s: {0} is shifted by {:+.3} s; the estimator determines the remainder.",
        imu.topic,
        lidar.topic,
        shift.seconds().abs(),
        shift.seconds()
    )
}

/// Reports accelerations in g.
fn force(imu: &str) -> String {
    format!("{imu} has accelerations in g, not in m/s^2: they are multiplied by 9.80665.")
}

/// Reports an unusual unit of point times.
fn unit(lidar: &Candidate, unit: TimeUnit) -> String {
    let (topic, unit) = (&lidar.topic, unit.name());
    format!("{topic} has point times in {unit}: in the usual unit its clouds would last implausibly long or short.")
}

/// Reports how the times of beams are known, if each message does not state them.
fn times(lidar: &Candidate, clouds: &CloudPreview) -> Option<String> {
    let topic = &lidar.topic;
    if lidar.kind == Some(LidarKind::Points) {
        return cloud_times(topic, clouds);
    }
    match lidar.times {
        BeamTimes::Implied => Some(format!(
            "{topic} states no time between beams; uniform rotation is assumed, one revolution per scan_time."
        )),
        BeamTimes::Unknown => Some(format!(
            "{topic} states no beam times; all beams of a scan are assumed to be fired at its stamp, so motion distorts it."
        )),
        BeamTimes::Stated | BeamTimes::OtherClock => None,
    }
}

fn cloud_times(topic: &str, clouds: &CloudPreview) -> Option<String> {
    let problem = match clouds.times {
        Some(times) if times.is_other_clock() => {
            return Some(format!(
                "{topic} has point times of another clock than its clouds' stamps: they are counted from each cloud's first \
                 point, which is assumed to be fired at the stamp."
            ));
        }
        Some(PointTimes::AtStamp) if clouds.has_time_field => "has the same time in all points of a cloud",
        Some(PointTimes::AtStamp) => "has no field of point times",
        _ => return None,
    };
    Some(format!(
        "{topic} {problem}: all points of a cloud are assumed to be fired at its stamp, so motion distorts it. Its fields are \
         {}; recognised names of a time field are {}.",
        clouds.fields,
        TIME_NAMES.join(", ")
    ))
}

/// Reports a length of rows that contradicts the data.
fn row_step(lidar: &Candidate, row_step: usize) -> String {
    format!(
        "{} states a row_step of {row_step} bytes, which contradicts its width, height and data: rows are read without gaps.",
        lidar.topic
    )
}
