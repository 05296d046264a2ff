//! Estimation from a recording, with evaluation and output files.

use super::background::with_background;
use super::best_estimate::BestEstimate;
use super::bound::{BoundAccumulator, RecordingBound};
use super::calibration::calibration;
use super::closed_loop::{ClosedLoopRun, run_closed_loop};
use super::cloud::{Surroundings, cloud_metrics};
use super::cloud_files::CloudOptions;
use super::comparison::Comparison;
use super::integrity::{Integrity, write_windows};
use super::map::write_map;
use super::map_options::MapOptions;
use super::open_loop::{OpenLoopOptions, OpenLoopRun, run_open_loop};
use super::origin::Origin;
use super::page::RunResults;
use super::progress::check;
use super::recorded_manifest::RecordedManifest;
use super::register::{RegisteredCloud, Registration};
use super::result_files::{estimate_files, remove};
use super::sampled_truth::SampledTruth;
use super::sensor_models::RecordedSensors;
use super::{CalibrationSpec, ProgressMonitor, Stage, StudyError, artefacts, comparison, memory};
use std::path::Path;
use zsim_estimation::{EstimatorSpec, Timing};
use zsim_evaluation::{Errors, MapKnowledge, Pairs};
use zsim_recording::{FoundCalibration, Reader, Selection, write_tum};
use zsim_report::{ClosedLoopMetrics, Metrics, OpenLoopMetrics};
use zsim_simulation::carrier_of;

/// The frame of the true poses in recordings of zsim.
const TRUE_FRAME: &str = "head";

/// Options of an estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct EstimateOptions {
    /// Settings of the estimator.
    pub estimator: EstimatorSpec,
    /// Calibration given by the user; it takes precedence over the recording.
    pub calibration: CalibrationSpec,
    /// Whether to ignore the sensor models in the recording's manifest, as for a recording of unknown sensors.
    pub ignore_manifest: bool,
    /// The frame whose pose is estimated; `None` for `head` if the recording has it, else the IMU frame.
    pub body_frame: Option<String>,
    /// Whether to run the global registration with loop closure after the open loop.
    pub closed_loop: bool,
    /// Options of the cloud; `None` to write trajectories, map and metrics alone, without cloud, result, plots and page.
    pub cloud: Option<CloudOptions>,
    /// The map in which to localise the head; `None` to start a new map.
    pub map: Option<MapOptions>,
}

impl EstimateOptions {
    /// Options with these estimator settings, loop closure, and defaults.
    pub fn with(estimator: EstimatorSpec) -> Self {
        let (calibration, cloud) = (CalibrationSpec::default(), Some(CloudOptions::default()));
        let (ignore_manifest, body_frame, closed_loop, map) = (false, None, true, None);
        Self { estimator, calibration, ignore_manifest, body_frame, closed_loop, cloud, map }
    }
}

/// Result of an estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct EstimateResult {
    /// The metrics, as in `metrics.json`.
    pub metrics: Metrics,
    /// Run time of each part of the open-loop estimator.
    pub timing: Timing,
}

/// Estimates the trajectory from the sensors `selection` of the recording of `reader` and writes the results to `folder`.
///
/// The files are `manifest.ron`, `open_loop.tum`, `closed_loop.tum`, `map.ply`, `result.mcap` with its layout for Foxglove,
/// `cloud.ply` or `cloud.las`, `integrity.csv`, `windows.csv`, `metrics.json`, `plots/` and `report.html`. Map, cloud and
/// result are those of the closed loop if it was computed. Without [`EstimateOptions::cloud`] result, cloud, `plots/` and
/// `report.html` are left out. If the recording has the truth, the trajectory is evaluated
/// against it; if it also has the scene, the cloud is evaluated against the surfaces.
///
/// Files of these names from an earlier run are removed first. `metrics.json` is written last: a folder without it is
/// incomplete.
///
/// # Errors
/// When the recording cannot be read, the estimation fails, a file cannot be written, or the run is stopped.
pub fn estimate_recording(
    reader: &Reader,
    selection: &Selection,
    folder: &Path,
    options: &EstimateOptions,
    watch: &mut ProgressMonitor,
) -> Result<EstimateResult, StudyError> {
    remove(folder, &estimate_files())?;
    let recorded = RecordedManifest::read(reader);
    recorded.note.iter().for_each(|note| watch.note(note));
    let world = recorded.manifest.world().transpose();
    let world = world.inspect_err(|error| watch.note(&format!("no evaluation of the cloud: {error}"))).ok().flatten();
    let carrier = recorded.manifest.run.as_ref().map(|run| carrier_of(&run.head.spec)).unwrap_or_default();
    let surroundings = world.as_ref().map(|world| Surroundings { world, carrier: &carrier });
    let manifest = &recorded.manifest.clone().with_estimator(&options.estimator);
    let origin = Origin { manifest, sensors: recorded.sensors(), surroundings, simulation: None };
    estimate_in(reader, selection, folder, options, &origin, watch)
}

/// As [`estimate_recording`], for a recording of known origin.
pub(super) fn estimate_in(
    reader: &Reader,
    selection: &Selection,
    folder: &Path,
    options: &EstimateOptions,
    origin: &Origin,
    watch: &mut ProgressMonitor,
) -> Result<EstimateResult, StudyError> {
    origin.manifest.write(&folder.join("manifest.ron"))?;
    let recorded = if options.ignore_manifest { RecordedSensors::default() } else { origin.sensors };
    let (found, models) =
        calibration(reader, selection, &options.calibration, recorded, options.body_frame.as_deref())?;
    report_notes(selection, &found, options, watch);
    if origin.simulation.is_none() {
        watch.note(&models.note());
    }

    let inputs = LoopInputs { reader, selection, found: &found, options, origin };
    let mut bound = inputs.bound()?;
    let loops = inputs.run(bound.as_mut(), folder, watch)?;
    let (registered, bound) = inputs.register(&loops, bound, folder, watch)?;
    let (run, truth, best) = (&loops.open, loops.truth.as_ref(), loops.best());

    watch.progress(Stage::Reporting, 0.0, None);
    let imu_only_drift = truth.and_then(|truth| comparison::imu_only(run, truth, watch));
    let bound = bound.as_ref().map(|recording| &recording.bound);
    let bound_rmse_m = bound.map(|bound| bound.aligned_position_rmse_m);
    let fixed_views = Some(options.estimator.fixed_views as u64);
    let integrity = Integrity::of(run, loops.closed.as_ref(), best.map_from_head);
    let pairs = truth.map(|truth| Pairs::of(best.map_from_head, &truth.heads));
    let metrics = Metrics {
        status: Some(integrity.status().name().to_owned()),
        integrity: integrity.metrics(run, best.map_from_head, pairs.as_ref()),
        sensors: models.metrics(),
        losses: run.events.losses.clone(),
        notes: run.events.notes.clone(),
        open_loop: OpenLoopMetrics {
            fixed_views,
            ..comparison::open_loop_metrics(run, loops.comparison.as_ref(), imu_only_drift)
        },
        closed_loop: ClosedLoopMetrics { bound_rmse_m, ..loops.closed_metrics() },
        clock: comparison::clock_metrics(run, truth),
        lidar: comparison::lidar_metrics(best.lidar.range_m, &run.calibrated_lidar, &options.estimator),
        ..metrics(origin, run, registered.as_ref(), best.comparison)
    };
    integrity.write(folder)?;
    write_windows(folder, &run.windows)?;
    watch.check_stop()?;
    let Some(registered) = registered else {
        artefacts::write_metrics(folder, &metrics)?;
        return Ok(EstimateResult { metrics, timing: loops.open.timing });
    };
    let results = RunResults {
        origin,
        open: run,
        truth,
        best: &best,
        open_errors: loops.open_errors(),
        bound,
        integrity: &integrity,
        pairs: pairs.as_ref(),
        points: &registered.page_points,
    };
    let plots = artefacts::plots(&results, &registered.sample, options.estimator.surfels.min_range_m);
    artefacts::write(folder, &plots, &results.page(&metrics, &origin.manifest.to_ron()?))?;
    Ok(EstimateResult { metrics, timing: loops.open.timing })
}

/// Inputs of the open loop, the closed loop and the registration of the cloud.
struct LoopInputs<'a> {
    reader: &'a Reader,
    selection: &'a Selection,
    found: &'a FoundCalibration,
    options: &'a EstimateOptions,
    origin: &'a Origin<'a>,
}

impl<'a> LoopInputs<'a> {
    /// The information bound, without truth and measurements; `None` if the scene is not known.
    fn bound(&self) -> Result<Option<BoundAccumulator<'a>>, StudyError> {
        let Some(Surroundings { world, .. }) = self.origin.surroundings else { return Ok(None) };
        BoundAccumulator::new(
            self.reader,
            self.selection,
            (world, MapKnowledge::Known),
            self.origin.manifest.run.as_ref(),
        )
        .map(Some)
    }

    /// Registers the cloud along the best estimate if it is wanted, and meanwhile completes `bound` if the truth is known.
    fn register(
        &self,
        loops: &Loops,
        bound: Option<BoundAccumulator>,
        folder: &Path,
        watch: &mut ProgressMonitor,
    ) -> Result<(Option<RegisteredCloud>, Option<RecordingBound>), StudyError> {
        let (best, with_truth) = (loops.best(), loops.truth.is_some());
        let registration = self.options.cloud.map(|options| Registration {
            reader: self.reader,
            selection: self.selection,
            calibration: &self.found.calibration,
            body_frame: &self.found.body_frame,
            map_from_head: best.map_from_head,
            covariances: best.covariances,
            lidar: best.lidar,
            returns: loops.open.returns,
            with_truth,
            options,
        });
        let stop = watch.stop;
        let complete = || {
            let bound = bound.filter(|_| with_truth)?;
            Some(bound.of_measurements(self.reader, self.selection, &mut |_| check(stop)))
        };
        let register = || registration.map(|registration| registration.run(folder, watch)).transpose();
        let (bound, registered) = with_background(complete, register);
        Ok((registered?, bound.transpose()?))
    }

    /// Runs both loops and writes the trajectories and the map to `folder`.
    ///
    /// The truth is also added to `bound`.
    fn run(
        &self,
        bound: Option<&mut BoundAccumulator>,
        folder: &Path,
        watch: &mut ProgressMonitor,
    ) -> Result<Loops, StudyError> {
        let Self { reader, selection, found, options, origin } = *self;
        let (estimator, calibration) = (&options.estimator, &found.calibration);
        let prior_map = options.map.as_ref();
        let closes_loops = options.closed_loop && prior_map.is_none();
        if options.closed_loop && !closes_loops {
            watch.note("the global registration is skipped: it does not use the given map");
        }
        let writes_map = prior_map.map_or(options.closed_loop, |map| map.extend);
        let open_loop =
            OpenLoopOptions { estimator, calibration, recording_surfels: closes_loops || writes_map, map: prior_map };
        let expected_s = origin.simulation.map(|summary| summary.duration_s);
        let open = run_open_loop(reader, selection, open_loop, Some(&folder.join("open_loop.tum")), expected_s, watch)?;
        open.events.notes.iter().for_each(|note| watch.note(&note.line()));
        let closed = match closes_loops {
            true => Some(close_loops(&open, folder, open_loop, watch)?),
            false => None,
        };
        watch.progress(Stage::Evaluating, 0.0, None);
        let truth = match found.body_frame == TRUE_FRAME {
            true => SampledTruth::read(reader, &open, bound)?,
            false => None,
        };
        let mut compare = |map_from_head, covariances: &[_]| {
            truth.as_ref().map(|truth| Comparison::new(map_from_head, covariances, truth, watch))
        };
        let comparison = compare(&open.map_from_head, &open.covariances);
        let closed_comparison = closed.as_ref().and_then(|closed| compare(&closed.map_from_head, &closed.covariances));
        let loops = Loops { open, truth, comparison, closed, closed_comparison };
        if writes_map && !loops.open.observed.is_empty() {
            write_map(&loops.open, &loops.best(), estimator, prior_map, folder)?;
        }
        Ok(loops)
    }
}

/// Open loop and closed loop, each with its comparison with the truth.
struct Loops {
    open: OpenLoopRun,
    truth: Option<SampledTruth>,
    comparison: Option<Comparison>,
    closed: Option<ClosedLoopRun>,
    closed_comparison: Option<Comparison>,
}

impl Loops {
    fn best(&self) -> BestEstimate<'_> {
        let open = &self.open.map_from_head;
        match &self.closed {
            Some(ClosedLoopRun { map_from_head, covariances, lidar, open_loop_recalibrated, .. }) => BestEstimate {
                map_from_head,
                covariances,
                observed_trajectory: open_loop_recalibrated.as_ref().unwrap_or(open),
                lidar,
                comparison: self.closed_comparison.as_ref(),
            },
            None => BestEstimate {
                map_from_head: open,
                covariances: &self.open.covariances,
                observed_trajectory: open,
                lidar: &self.open.lidar,
                comparison: self.comparison.as_ref(),
            },
        }
    }

    /// Errors of the open loop if a closed loop was computed.
    fn open_errors(&self) -> Option<&Errors> {
        self.closed.as_ref()?;
        Some(&self.comparison.as_ref()?.errors.as_ref()?.decimated)
    }

    fn closed_metrics(&self) -> ClosedLoopMetrics {
        let (comparison, acquisition_s) = (self.closed_comparison.as_ref(), self.open.acquisition_s);
        let metrics =
            self.closed.as_ref().map(|closed| comparison::closed_loop_metrics(closed, comparison, acquisition_s));
        metrics.unwrap_or_default()
    }
}

/// Runs the closed loop and writes the trajectory.
fn close_loops(
    run: &OpenLoopRun,
    folder: &Path,
    options: OpenLoopOptions,
    watch: &mut ProgressMonitor,
) -> Result<ClosedLoopRun, StudyError> {
    watch.progress(Stage::ClosingLoops, 0.0, None);
    let closed = run_closed_loop(run, options.calibration, options.estimator)?;
    closed.notes.iter().for_each(|note| watch.note(note));
    write_tum(&folder.join("closed_loop.tum"), &closed.map_from_head)?;
    watch.check_stop()?;
    Ok(closed)
}

/// All metrics except those of the two loops, the clock and the integrity.
fn metrics(
    origin: &Origin,
    run: &OpenLoopRun,
    registered: Option<&RegisteredCloud>,
    comparison: Option<&Comparison>,
) -> Metrics {
    let inputs = origin.manifest.run.as_ref();
    let world_from_map = comparison.and_then(|comparison| comparison.world_from_map);
    Metrics {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        scene: inputs.map(|inputs| inputs.scene.spec.name.clone()),
        seed: inputs.map(|inputs| inputs.seed.0),
        duration_s: origin.simulation.map_or(run.acquisition_s, |summary| summary.duration_s),
        simulation: origin.simulation.map(comparison::simulation_metrics).unwrap_or_default(),
        cloud: registered
            .map(|registered| cloud_metrics(registered, world_from_map.as_ref(), origin.surroundings))
            .unwrap_or_default(),
        peak_rss_mib: memory::peak_rss_mib(),
        ..Metrics::default()
    }
}

/// Reports notes on the selection and on missing extrinsics.
fn report_notes(
    selection: &Selection,
    found: &FoundCalibration,
    options: &EstimateOptions,
    watch: &mut ProgressMonitor,
) {
    let unusable: Vec<String> = selection.unusable_topics().collect();
    selection.notes.iter().chain(&unusable).chain(&found.notes).for_each(|note| watch.note(note));
    let given = options.calibration.head_from_laser.is_some() && options.calibration.head_from_imu.is_some();
    if !found.from_recording && !given {
        watch.note(
            "no transforms of the recording join lidar and IMU: assuming that they coincide and have the same axes; if not, \
             pass the extrinsics with --calibration",
        );
    }
}
