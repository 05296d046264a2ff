use super::{FaultKind, FaultsSpec, FaultySensor};
use zsim_base::time::Span;
use zsim_truth::ClockTruth;

/// Offsets that faults add to the sensor clocks. Ground truth reports the clocks with these offsets.
#[derive(Debug, Clone)]
pub(super) struct ClockFaults {
    /// Start time since the start of the run, and offset from then on.
    imu: Vec<(Span, Span)>,
    lidar: Vec<(Span, Span)>,
}

impl ClockFaults {
    pub fn from_spec(spec: &FaultsSpec) -> Self {
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

    /// Offset of the lidar clock at `since_start`.
    pub fn lidar_offset(&self, since_start: Span) -> Span {
        offset_after(&self.lidar, since_start)
    }

    /// Clock offsets with the faults, given the offsets without.
    pub fn apply(&self, since_start: Span, clock: &ClockTruth) -> ClockTruth {
        ClockTruth {
            lidar_offset: clock.lidar_offset + offset_after(&self.lidar, since_start),
            imu_offset: clock.imu_offset + offset_after(&self.imu, since_start),
        }
    }
}

fn offset_after(changes: &[(Span, Span)], since_start: Span) -> Span {
    let until_now = changes.iter().filter(|(from, _)| *from <= since_start);
    until_now.fold(Span::ZERO, |sum, (_, by)| sum + *by)
}
