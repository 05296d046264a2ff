//! Writes the measurements and the truth of a simulation to files.

use super::{Manifest, ProgressMonitor, RunError, Stage, StageData};
use std::cell::RefCell;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use zsim_base::measurement::{ImuSample, LidarScan, Sink, SinkError};
use zsim_base::parallel::check;
use zsim_base::time::Stamp;
use zsim_recording::{BaseImuDescription, RunDescription, TumWriter, Writer};
use zsim_simulation::{Outputs, Simulation, SimulationSummary};
use zsim_truth::{ClockTruth, TruthSample, TruthSink};

/// Runs `simulation` and writes its measurements and truth to the MCAP file `recording`.
///
/// The true trajectory of the head, in lidar time, is written to the TUM file `truth`. With `truth_tf`, the recording
/// includes the true pose of the head on `/tf`.
///
/// # Errors
/// When a file cannot be written, the simulation fails or it is stopped; the files can then be read up to that time.
pub fn record(
    simulation: &Simulation,
    recording: &Path,
    truth: &Path,
    truth_tf: bool,
    watch: &mut ProgressMonitor,
) -> Result<SimulationSummary, RunError> {
    let recording = Writer::create(recording, description(simulation, truth_tf)?)?;
    run(simulation, Outputs::All, recording, Some(truth), true, watch)
}

/// Writes the measurements of the IMUs only to the MCAP file `recording`, without truth.
///
/// # Errors
/// As [`record`].
pub fn record_imus(
    simulation: &Simulation,
    recording: &Path,
    watch: &mut ProgressMonitor,
) -> Result<SimulationSummary, RunError> {
    let recording = Writer::create(recording, description(simulation, false)?)?;
    run(simulation, Outputs::Imus, recording, None, false, watch)
}

/// As [`record`], with the truth in the TUM file only.
///
/// # Errors
/// As [`record`].
pub fn record_with_truth_apart(
    simulation: &Simulation,
    recording: &Path,
    truth: &Path,
    watch: &mut ProgressMonitor,
) -> Result<(), RunError> {
    let recording = Writer::create(recording, description(simulation, false)?)?;
    run(simulation, Outputs::All, recording, Some(truth), false, watch).map(drop)
}

/// Runs `simulation` and writes its `outputs`, and the true trajectory of the head to the TUM file `truth`.
fn run(
    simulation: &Simulation,
    outputs: Outputs,
    recording: Writer,
    truth: Option<&Path>,
    has_truth_inside: bool,
    watch: &mut ProgressMonitor,
) -> Result<SimulationSummary, RunError> {
    let truth = truth.map(TumWriter::create).transpose()?;
    let duration_s = simulation.inputs().duration_s;
    watch.data(StageData::Start { stage: Stage::Simulating, calibration: &simulation.calibration() });
    let watch = RefCell::new(watch);
    let mut progress =
        |fraction: f64| watch.borrow_mut().progress(Stage::Simulating, fraction * duration_s, Some(duration_s));
    let stop = watch.borrow().stop;
    let mut files = FileSink { recording, truth, has_truth_inside, stop, observer: Some(&watch) };
    let ran = simulation.run_outputs(outputs, &mut files, &mut progress);
    files.finish()?;
    check(stop)?;
    let summary = ran?;
    if let Some(contact) = &summary.coil_contact {
        watch.borrow_mut().note(&contact.warning());
    }
    Ok(summary)
}

/// Runs simulations that share physics and ray casting, and writes each to a recording.
pub(super) fn record_together(
    simulations: &[Simulation],
    recordings: Vec<Writer>,
    watch: &ProgressMonitor,
) -> Result<(), RunError> {
    let files =
        |recording| FileSink { recording, truth: None, has_truth_inside: true, stop: watch.stop, observer: None };
    let mut all: Vec<FileSink> = recordings.into_iter().map(files).collect();
    let ran = Simulation::run_together(simulations, &mut all.iter_mut().collect::<Vec<_>>(), &mut |_| ());
    all.into_iter().try_for_each(FileSink::finish)?;
    watch.check_stop()?;
    Ok(ran.map(drop)?)
}

/// Description of a simulation in its recording: calibration, rates and manifest.
pub(super) fn description(simulation: &Simulation, truth_tf: bool) -> Result<RunDescription, RunError> {
    Ok(RunDescription {
        calibration: simulation.calibration(),
        imu_rate_hz: 1.0 / simulation.imu().period_s(),
        base_imu: simulation.base_imu().map(|imu| BaseImuDescription {
            noise: imu.noise(),
            rate_hz: 1.0 / imu.period_s(),
            head_from_base: simulation.head().base_from_head_at_rest().inverse(),
        }),
        manifest: Manifest::of(simulation).to_ron()?,
        truth_tf,
    })
}

/// Writes measurements and truth of a run to the recording and to the TUM file, and reports them for a live view.
struct FileSink<'a, 'w> {
    recording: Writer,
    truth: Option<TumWriter<BufWriter<File>>>,
    /// Whether the truth is also in the recording.
    has_truth_inside: bool,
    stop: &'a AtomicBool,
    /// Shared with the progress callback of the simulation; neither holds it during a call of the other.
    observer: Option<&'a RefCell<&'a mut ProgressMonitor<'w>>>,
}

impl FileSink<'_, '_> {
    fn observe(&self, data: StageData) {
        if let Some(watch) = self.observer {
            watch.borrow_mut().data(data);
        }
    }

    fn finish(self) -> Result<(), RunError> {
        self.recording.finish()?;
        self.truth.map_or(Ok(()), TumWriter::finish)?;
        Ok(())
    }
}

impl Sink for FileSink<'_, '_> {
    fn imu(&mut self, arrival: Stamp, sample: &ImuSample) -> Result<(), SinkError> {
        check(self.stop)?;
        self.recording.imu(arrival, sample)
    }

    fn base_imu(&mut self, arrival: Stamp, sample: &ImuSample) -> Result<(), SinkError> {
        self.recording.base_imu(arrival, sample)
    }

    fn lidar(&mut self, arrival: Stamp, scan: &LidarScan) -> Result<(), SinkError> {
        self.observe(StageData::Scan(scan));
        self.recording.lidar(arrival, scan)
    }
}

impl TruthSink for FileSink<'_, '_> {
    fn truth(&mut self, now: Stamp, sample: &TruthSample) -> Result<(), SinkError> {
        self.observe(StageData::Truth(sample));
        if let Some(truth) = &mut self.truth {
            truth.pose(sample.lidar_stamp, &sample.head.world_from_body)?;
        }
        if self.has_truth_inside { self.recording.truth(now, sample) } else { Ok(()) }
    }

    fn clock(&mut self, now: Stamp, clock: &ClockTruth) -> Result<(), SinkError> {
        if self.has_truth_inside { self.recording.clock(now, clock) } else { Ok(()) }
    }
}
