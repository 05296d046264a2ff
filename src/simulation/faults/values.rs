//! Faults of measured values.

use super::FaultKind;
use super::stage::{Message, Stage};
use rand::RngExt;
use std::collections::VecDeque;
use zsim_base::geometry::Vector;
use zsim_base::measurement::{ImuSample, Measurement};
use zsim_base::random::Stream;
use zsim_base::time::Span;

/// The stage of a fault of this group, active from `from_s` to `to_s`, s after the start; `None` for other groups.
pub(super) fn stage(kind: &FaultKind, stream: Stream, (from_s, to_s): (f64, f64)) -> Option<Box<dyn Stage>> {
    Some(match kind {
        FaultKind::Freeze => Box::new(Freeze { last: None }),
        FaultKind::Clip { gyro_rad_per_s, gyro_deg_per_s, accel_m_per_s2 } => {
            Box::new(Clip { gyro: gyro_rad_per_s.or(gyro_deg_per_s.map(f64::to_radians)), accel: *accel_m_per_s2 })
        }
        FaultKind::Spike { gyro_rad_per_s, gyro_deg_per_s, accel_m_per_s2, times_s, count } => {
            let mut times_s = times_s.clone().unwrap_or_default();
            times_s.extend(draws(stream, count.unwrap_or(0)).map(|u| from_s + u * (to_s - from_s)));
            times_s.sort_by(f64::total_cmp);
            Box::new(Spike {
                gyro: rate(*gyro_rad_per_s, *gyro_deg_per_s),
                accel: accel_m_per_s2.map(Vector::from),
                times: times_s.into_iter().map(Span::from_seconds).collect(),
            })
        }
        FaultKind::BiasStep { gyro_rad_per_s, gyro_deg_per_s, accel_m_per_s2 } => Box::new(BiasStep {
            gyro: rate(*gyro_rad_per_s, *gyro_deg_per_s).unwrap_or_default(),
            accel: accel_m_per_s2.map(Vector::from).unwrap_or_default(),
        }),
        FaultKind::Axes { negate_gyro, negate_accel, remove_gravity, gyro_scale, accel_scale } => {
            let signed = |scale: Option<f64>, negated: bool| scale.unwrap_or(1.0) * if negated { -1.0 } else { 1.0 };
            Box::new(Axes {
                gyro: signed(*gyro_scale, *negate_gyro),
                accel: signed(*accel_scale, *negate_accel),
                remove_gravity: *remove_gravity,
            })
        }
        _ => return None,
    })
}

/// A rate in rad/s, from either unit.
fn rate(rad_per_s: Option<[f64; 3]>, deg_per_s: Option<[f64; 3]>) -> Option<Vector> {
    rad_per_s.or(deg_per_s.map(|rate| rate.map(f64::to_radians))).map(Vector::from)
}

/// `count` random numbers from 0 to 1.
fn draws(mut stream: Stream, count: u32) -> impl Iterator<Item = f64> {
    (0..count).map(move |_| stream.random::<f64>())
}

/// The sample of an IMU message; `None` for the lidar.
fn sample(message: &mut Message) -> Option<&mut ImuSample> {
    match &mut message.measurement {
        Measurement::Imu(sample) => Some(sample),
        Measurement::Lidar(_) => None,
    }
}

/// Repeats the last measurement.
struct Freeze {
    last: Option<Measurement>,
}

impl Stage for Freeze {
    fn take(&mut self, mut message: Message, out: &mut Vec<Message>) {
        let stamp = message.stamp();
        message.measurement = self.last.get_or_insert(message.measurement).clone();
        message.set_stamp(stamp);
        out.push(message);
    }

    fn pass(&mut self, message: Message, out: &mut Vec<Message>) {
        self.last = Some(message.measurement.clone());
        out.push(message);
    }
}

/// Saturates values, rad/s and m/s^2.
struct Clip {
    gyro: Option<f64>,
    accel: Option<f64>,
}

impl Stage for Clip {
    fn take(&mut self, mut message: Message, out: &mut Vec<Message>) {
        if let Some(sample) = sample(&mut message) {
            let clip = |value: &mut Vector, limit: Option<f64>| {
                if let Some(limit) = limit {
                    *value = value.map(|x| x.clamp(-limit, limit));
                }
            };
            clip(&mut sample.angular_velocity_rad_per_s, self.gyro);
            clip(&mut sample.specific_force_m_per_s2, self.accel);
        }
        out.push(message);
    }
}

/// Replaces single samples.
struct Spike {
    gyro: Option<Vector>,
    accel: Option<Vector>,
    /// Times of the bad samples, in order; each affects one sample.
    times: VecDeque<Span>,
}

impl Stage for Spike {
    fn take(&mut self, mut message: Message, out: &mut Vec<Message>) {
        let is_due = self.times.front().is_some_and(|due| *due <= message.since_start());
        if is_due && let Some(sample) = sample(&mut message) {
            self.times.pop_front();
            sample.angular_velocity_rad_per_s = self.gyro.unwrap_or(sample.angular_velocity_rad_per_s);
            sample.specific_force_m_per_s2 = self.accel.unwrap_or(sample.specific_force_m_per_s2);
        }
        out.push(message);
    }
}

/// Adds a step to the bias, rad/s and m/s^2.
struct BiasStep {
    gyro: Vector,
    accel: Vector,
}

impl Stage for BiasStep {
    fn take(&mut self, mut message: Message, out: &mut Vec<Message>) {
        if let Some(sample) = sample(&mut message) {
            sample.angular_velocity_rad_per_s += self.gyro;
            sample.specific_force_m_per_s2 += self.accel;
        }
        out.push(message);
    }
}

/// Changes signs, units and the treatment of gravity.
struct Axes {
    /// Signed factors on rates and specific forces.
    gyro: f64,
    accel: f64,
    remove_gravity: bool,
}

impl Stage for Axes {
    fn take(&mut self, mut message: Message, out: &mut Vec<Message>) {
        let at_rest = if self.remove_gravity { message.force_at_rest } else { Vector::zeros() };
        if let Some(sample) = sample(&mut message) {
            sample.angular_velocity_rad_per_s *= self.gyro;
            sample.specific_force_m_per_s2 = (sample.specific_force_m_per_s2 - at_rest) * self.accel;
        }
        out.push(message);
    }
}
