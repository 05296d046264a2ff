//! Faults of the sensors and of their delivery, to test a design or an estimator with imperfect data.
//!
//! [`FaultsSpec`] is the list of faults in a file of `specs/faults/`; [`Faults`] is the checked list. An [`Injector`]
//! takes the data of a simulation, applies the faults in the order of the list, and passes the result to the sink. Each
//! sensor has a pipeline with one stage per fault. Each fault has a separate random stream, and all stages run on the
//! delivering thread in order of delivery, so the result does not depend on the number of threads. Memory contains delayed
//! messages only.

mod check;
mod clock;
mod files;
mod injector;
mod interval;
mod loss;
mod pipeline;
mod scan;
mod spec;
mod stage;
mod timing;
mod values;

pub(super) use injector::Injector;
pub use spec::{FaultKind, FaultSpec, FaultsSpec, FaultySensor, MissEncoding};

use clock::ClockFaults;
use interval::Interval;
use zsim_base::geometry::{Pose, Vector, from_roll_pitch_yaw};
use zsim_base::measurement::Calibration;
use zsim_base::spec::{Kind, NamedSpec, Source, SpecError, parse_named};
use zsim_sensors::Lidar;

/// Checked faults.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Faults {
    spec: FaultsSpec,
}

impl Faults {
    /// Checks `spec` from `source`; the files must have been read ([`FaultsSpec::with_files`]).
    ///
    /// # Errors
    /// If times, values or units of a fault are inconsistent.
    pub fn new(spec: &FaultsSpec, source: &Source) -> Result<Self, SpecError> {
        check::check(spec, source)?;
        for (index, fault) in spec.faults.iter().enumerate() {
            match (&fault.fault, fault.sensor) {
                (FaultKind::Thin { arrivals_s: None, .. }, _) => {
                    return Err(check::about(
                        source,
                        index,
                        "file",
                        "its arrival times have not been loaded".to_owned(),
                    ));
                }
                (FaultKind::ClockJump { jump_s }, FaultySensor::Lidar | FaultySensor::Both) if *jump_s < 0.0 => {
                    let message =
                        format!("fault {index} (clock_jump): the lidar's clock would jump back by {} s", -jump_s);
                    let help = "the truth is stamped by the lidar's clock and must increase: let the lidar's clock jump \
                                forward, or the IMU's back";
                    return Err(check::about(source, index, "jump_s", message).with_help(help));
                }
                _ => {}
            }
        }
        Ok(Self { spec: spec.clone() })
    }

    /// Checks that the faults are possible with `lidar`.
    ///
    /// # Errors
    /// If misses are to be encoded for a lidar that is not planar: the messages do not contain misses.
    pub(super) fn check_with(&self, lidar: &Lidar, source: &Source) -> Result<(), SpecError> {
        let is_misses = |fault: &FaultSpec| matches!(fault.fault, FaultKind::Misses { .. });
        match self.spec.faults.iter().position(is_misses).filter(|_| !lidar.is_planar()) {
            Some(index) => {
                let message = format!("fault {index} (misses): this lidar is not planar and has no LaserScan");
                Err(check::about(source, index, "misses", message).with_help("use a planar lidar, such as utm30lx"))
            }
            None => Ok(()),
        }
    }

    /// The published calibration, given the true one.
    pub(super) fn published_calibration(&self, mut calibration: Calibration) -> Calibration {
        for fault in &self.spec.faults {
            let FaultKind::Extrinsics { position_m, roll_pitch_yaw_deg } = &fault.fault else { continue };
            let head_from_sensor = match fault.sensor {
                FaultySensor::Imu => &mut calibration.head_from_imu,
                FaultySensor::Lidar | FaultySensor::Both => &mut calibration.head_from_laser,
            };
            let [roll, pitch, yaw] = roll_pitch_yaw_deg.unwrap_or_default().map(f64::to_radians);
            *head_from_sensor = Pose::from_parts(
                (head_from_sensor.translation.vector + Vector::from(position_m.unwrap_or_default())).into(),
                head_from_sensor.rotation * from_roll_pitch_yaw(roll, pitch, yaw),
            );
        }
        calibration
    }

    fn clock(&self) -> ClockFaults {
        ClockFaults::from_spec(&self.spec)
    }

    /// The faults of the IMU (or of the lidar) with their index in the list and their interval.
    fn for_sensor(&self, is_imu: bool) -> impl Iterator<Item = (usize, &FaultKind, Interval)> {
        let other = if is_imu { FaultySensor::Lidar } else { FaultySensor::Imu };
        let faults = self.spec.faults.iter().enumerate().filter(move |(_, fault)| fault.sensor != other);
        faults.map(|(index, fault)| (index, &fault.fault, Interval::from_spec(fault)))
    }
}

impl NamedSpec for FaultsSpec {
    const KIND: Kind = Kind::Faults;
    type Error = SpecError;

    fn parse(source: &Source) -> Result<Self, SpecError> {
        parse_named(source)
    }

    fn check_model(&self, source: &Source) -> Result<Vec<String>, SpecError> {
        Faults::new(&self.clone().with_files(source)?, source).map(|_| Vec::new())
    }

    fn resolved(self, source: &Source) -> Result<Self, SpecError> {
        self.with_files(source)
    }
}
