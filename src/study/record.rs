//! A simulation, recorded.

use super::{Manifest, Stage, StudyError, Watch};
use crate::measurement::{ImuSample, LidarScan, Sink, SinkError};
use crate::recording::{BaseImuDescription, RunDescription, TumWriter, Writer};
use crate::simulation::{Simulation, SimulationSummary};
use crate::time::Stamp;
use crate::truth::{ClockTruth, TruthSample, TruthSink};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// Runs `simulation`; its measurements and truth go to the MCAP file `recording` as they come, and the head's true
/// trajectory, in lidar time, to the TUM file `truth`. With `truth_tf` the recording shows the true head in `/tf` too.
///
/// # Errors
/// When a file cannot be written, the simulation fails, or somebody stops it; what came so far can be read then.
pub fn record(
    simulation: &Simulation,
    recording: &Path,
    truth: &Path,
    truth_tf: bool,
    watch: &mut Watch,
) -> Result<SimulationSummary, StudyError> {
    let recording = Writer::create(recording, description(simulation, truth_tf)?)?;
    let mut files = Files { recording, truth: Some(TumWriter::create(truth)?), stop: watch.stop };
    let duration_s = simulation.scenario().duration_s;
    let mut progress = |fraction: f64| watch.progress(Stage::Simulating, fraction * duration_s, Some(duration_s));
    let ran = simulation.run(&mut files, &mut progress);
    files.finish()?;
    if watch.is_stopped() {
        return Err(StudyError::Stopped);
    }
    Ok(ran?)
}

/// Runs simulations that share physics and rays, each to its recording.
pub(super) fn record_together(
    simulations: &[Simulation],
    recordings: Vec<Writer>,
    watch: &Watch,
) -> Result<(), StudyError> {
    let files = |recording| Files { recording, truth: None, stop: watch.stop };
    let mut all: Vec<Files> = recordings.into_iter().map(files).collect();
    let ran = Simulation::run_together(simulations, &mut all.iter_mut().collect::<Vec<_>>(), &mut |_| ());
    all.into_iter().try_for_each(Files::finish)?;
    if watch.is_stopped() {
        return Err(StudyError::Stopped);
    }
    ran?;
    Ok(())
}

/// What the recording of a simulation says of it.
pub(super) fn description(simulation: &Simulation, truth_tf: bool) -> Result<RunDescription, StudyError> {
    Ok(RunDescription {
        calibration: simulation.calibration(),
        imu_rate_hz: 1.0 / simulation.imu().period_s(),
        base_imu: simulation.base_imu().map(|imu| BaseImuDescription {
            noise: imu.noise(),
            rate_hz: 1.0 / imu.period_s(),
            head_from_base: simulation.head().rest_pose_base_from_head().inverse(),
        }),
        manifest: Manifest::of(simulation).text()?,
        truth_tf,
    })
}

/// Takes all of a run to its files.
struct Files<'a> {
    recording: Writer,
    truth: Option<TumWriter<BufWriter<File>>>,
    stop: &'a AtomicBool,
}

impl Files<'_> {
    fn finish(self) -> Result<(), StudyError> {
        self.recording.finish()?;
        self.truth.map_or(Ok(()), TumWriter::finish)?;
        Ok(())
    }
}

impl Sink for Files<'_> {
    fn imu(&mut self, arrival: Stamp, sample: &ImuSample) -> Result<(), SinkError> {
        if self.stop.load(Ordering::Relaxed) {
            return Err(Box::new(StudyError::Stopped));
        }
        self.recording.imu(arrival, sample)
    }

    fn base_imu(&mut self, arrival: Stamp, sample: &ImuSample) -> Result<(), SinkError> {
        self.recording.base_imu(arrival, sample)
    }

    fn lidar(&mut self, arrival: Stamp, scan: &LidarScan) -> Result<(), SinkError> {
        self.recording.lidar(arrival, scan)
    }
}

impl TruthSink for Files<'_> {
    fn truth(&mut self, now: Stamp, sample: &TruthSample) -> Result<(), SinkError> {
        if let Some(truth) = &mut self.truth {
            truth.pose(sample.lidar_stamp, &sample.head.world_from_body)?;
        }
        self.recording.truth(now, sample)
    }

    fn clock(&mut self, now: Stamp, clock: &ClockTruth) -> Result<(), SinkError> {
        self.recording.clock(now, clock)
    }
}
