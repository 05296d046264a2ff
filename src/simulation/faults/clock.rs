use super::{FaultKind, FaultsSpec, FaultySensor};
use crate::time::Span;
use crate::truth::ClockTruth;

/// By how much the faults set the sensors' clocks ahead; the truth follows the clocks.
#[derive(Debug, Clone)]
pub(super) struct ClockFaults {
    /// From when, since the start, and by how much.
    imu: Vec<(Span, Span)>,
    lidar: Vec<(Span, Span)>,
}

impl ClockFaults {
    pub fn of(spec: &FaultsSpec) -> Self {
        let mut faults = Self { imu: Vec::new(), lidar: Vec::new() };
        for fault in &spec.faults {
            let change = match &fault.fault {
                FaultKind::ClockJump { jump_s } => (fault.from_s.unwrap_or(0.0), *jump_s),
                FaultKind::ClockOffset { offset_s } => (f64::NEG_INFINITY, *offset_s),
                _ => continue,
            };
            let change = (Span::from_seconds(change.0), Span::from_seconds(change.1));
            if fault.sensor != FaultySensor::Lidar {
                faults.imu.push(change);
            }
            if fault.sensor != FaultySensor::Imu {
                faults.lidar.push(change);
            }
        }
        faults
    }

    /// By how much the lidar's clock is set ahead `since_start` after the start.
    pub fn lidar_ahead(&self, since_start: Span) -> Span {
        ahead(&self.lidar, since_start)
    }

    /// What the clocks say with the faults, given what they say without.
    pub fn applied(&self, since_start: Span, clock: &ClockTruth) -> ClockTruth {
        ClockTruth {
            lidar_ahead: clock.lidar_ahead + ahead(&self.lidar, since_start),
            imu_ahead: clock.imu_ahead + ahead(&self.imu, since_start),
        }
    }
}

fn ahead(changes: &[(Span, Span)], since_start: Span) -> Span {
    let until_now = changes.iter().filter(|(from, _)| *from <= since_start);
    until_now.fold(Span::ZERO, |sum, (_, by)| sum + *by)
}
