//! Estimation from a recording, with evaluation and output files.

use super::beams::{Reading, read_beams};
use super::bound::{BoundAccumulator, RecordingBound};
use super::calibration::calibration;
use super::cloud::{Origin, Surroundings, cloud_metrics};
use super::cloud_files::CloudOptions;
use super::comparison::Comparison;
use super::integrity::write_windows;
use super::loops::Loops;
use super::manifest::RecordedSensors;
use super::map::write_map;
use super::map_options::MapOptions;
use super::open_loop::LoopInputs;
use super::page::RunResults;
use super::recorded_manifest::RecordedManifest;
use super::register::{CloudRegistration, RegisteredCloud};
use super::result_files::{estimate_files, remove};
use super::{CalibrationSpec, ProgressMonitor, RunError, Stage, artefacts, comparison, resources};
use std::path::Path;
use zsim_estimation::{EstimatorSpec, Timing};
use zsim_evaluation::MapKnowledge;
use zsim_recording::{FoundCalibration, Reader, Selection};
use zsim_report::Metrics;
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
) -> Result<EstimateResult, RunError> {
    remove(folder, &estimate_files())?;
    let recorded = RecordedManifest::read(reader);
    recorded.note.iter().for_each(|note| watch.note(note));
    let world = recorded.manifest.world().transpose();
    let world = world.inspect_err(|error| watch.note(&format!("no evaluation of the cloud: {error}"))).ok().flatten();
    let carrier = recorded.manifest.run.as_ref().map(|run| carrier_of(&run.head.spec)).unwrap_or_default();
    let surroundings = world.as_ref().map(|world| Surroundings { world, carrier: &carrier });
    let manifest = &recorded.manifest.clone().with_estimator(&options.estimator);
    let origin = Origin { manifest, sensors: recorded.sensors, surroundings, simulation: None };
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
) -> Result<EstimateResult, RunError> {
    origin.manifest.write(&folder.join("manifest.ron"))?;
    let unknown = RecordedSensors::default();
    let recorded = if options.ignore_manifest { &unknown } else { &origin.sensors };
    let (found, models) =
        calibration(reader, selection, &options.calibration, recorded, options.body_frame.as_deref())?;
    report_notes(selection, &found, options, watch);
    if origin.simulation.is_none() {
        watch.note(&models.note());
    }

    let estimated = Estimated { reader, selection, found: &found, options, origin };
    let mut bound = estimated.bound()?;
    let loops = estimated.loops(bound.as_mut(), folder, watch)?;
    let (registered, bound) = estimated.register(&loops, bound, folder, watch)?;
    let (run, truth, best) = (&loops.open, loops.truth.as_ref(), loops.best());

    watch.progress(Stage::Reporting, 0.0, None);
    let imu_only_drift_m_per_min = truth.and_then(|truth| comparison::imu_only_drift_m_per_min(run, truth, watch));
    let bound = bound.as_ref().map(|recording| &recording.bound);
    let (integrity, pairs) = (loops.integrity(), loops.pairs());
    let mut metrics = Metrics {
        sensors: models.metrics(),
        lidar: comparison::lidar_metrics(best.lidar.range_m, &run.estimate.calibrated_lidar, &options.estimator),
        ..described(origin, registered.as_ref(), best.comparison, loops.metrics(&integrity, pairs.as_ref()))
    };
    metrics.open_loop.fixed_views = Some(options.estimator.fixed_views as u64);
    metrics.open_loop.imu_only_drift_m_per_min = imu_only_drift_m_per_min;
    metrics.closed_loop.bound_rmse_m = bound.map(|bound| bound.aligned_position_rmse_m);
    integrity.write(folder)?;
    write_windows(folder, &run.estimate.windows)?;
    watch.check_stop()?;
    let Some(registered) = registered else {
        artefacts::write_metrics(folder, &metrics)?;
        return Ok(EstimateResult { metrics, timing: loops.open.timing });
    };
    let results = RunResults {
        origin,
        loops: &loops,
        best: &best,
        bound,
        integrity: &integrity,
        pairs: pairs.as_ref(),
        points: &registered.page_points,
    };
    let plots = artefacts::plots(&results, &registered.sample, options.estimator.surfels.min_range_m);
    artefacts::write(folder, &plots, &results.page(&metrics, &origin.manifest.to_ron()?))?;
    Ok(EstimateResult { metrics, timing: loops.open.timing })
}

/// A recording that is estimated with these options.
struct Estimated<'a> {
    reader: &'a Reader,
    selection: &'a Selection,
    found: &'a FoundCalibration,
    options: &'a EstimateOptions,
    origin: &'a Origin<'a>,
}

impl<'a> Estimated<'a> {
    /// The information bound, without truth and measurements; `None` if the scene is not known.
    fn bound(&self) -> Result<Option<BoundAccumulator<'a>>, RunError> {
        let Some(Surroundings { world, .. }) = self.origin.surroundings else { return Ok(None) };
        BoundAccumulator::new(
            self.reader,
            self.selection,
            (world, MapKnowledge::Known),
            self.origin.manifest.run.as_ref(),
        )
        .map(Some)
    }

    /// Registers the cloud along the best estimate if it is wanted, and completes `bound` if the truth is known, in one pass.
    fn register(
        &self,
        loops: &Loops,
        bound: Option<BoundAccumulator>,
        folder: &Path,
        watch: &mut ProgressMonitor,
    ) -> Result<(Option<RegisteredCloud>, Option<RecordingBound>), RunError> {
        let with_truth = loops.truth.is_some();
        let start = |options| CloudRegistration::start(self.found, loops, options, folder);
        let mut cloud = self.options.cloud.map(start).transpose()?;
        let mut bound = bound.filter(|_| with_truth);
        let of_cloud = cloud.iter_mut().map(|cloud| cloud as Reading);
        let of_bound = bound.iter_mut().map(|bound| bound as Reading);
        let readers: Vec<Reading> = of_cloud.chain(of_bound).collect();
        let (first, last) = loops.best().map_from_head.span().unwrap_or_default();
        if !readers.is_empty() {
            read_beams((self.reader, self.selection), with_truth, readers, &mut |stamp| {
                watch.progress(Stage::Registering, stamp.seconds_since(first), Some(last.seconds_since(first)));
                watch.check_stop()
            })?;
        }
        let bound = bound.map(BoundAccumulator::finish).transpose()?;
        Ok((cloud.map(CloudRegistration::finish).transpose()?, bound))
    }

    /// Runs both loops and writes the trajectories and the map to `folder`.
    ///
    /// The truth is also added to `bound`.
    fn loops(
        &self,
        bound: Option<&mut BoundAccumulator>,
        folder: &Path,
        watch: &mut ProgressMonitor,
    ) -> Result<Loops, RunError> {
        let Self { reader, selection, found, options, origin } = *self;
        let map = options.map.as_ref();
        let closes_loops = options.closed_loop && map.is_none();
        if options.closed_loop && !closes_loops {
            watch.note("the global registration is skipped: it does not use the given map");
        }
        let writes_map = map.map_or(options.closed_loop, |map| map.extend);
        let inputs = LoopInputs {
            reader,
            selection,
            calibration: &found.calibration,
            estimator: &options.estimator,
            map,
            closes_loops,
            keeps_surfels: writes_map,
            has_truth: found.body_frame == TRUE_FRAME,
            folder: Some(folder),
            expected_s: origin.simulation.map(|summary| summary.duration_s),
        };
        let loops = inputs.run(bound, watch)?;
        if writes_map && !loops.open.estimate.observed.is_empty() {
            write_map(&loops.open, &loops.best(), &options.estimator, map, folder)?;
        }
        Ok(loops)
    }
}

/// Adds the origin of the recording and the cloud to the metrics of the estimate.
fn described(
    origin: &Origin,
    registered: Option<&RegisteredCloud>,
    comparison: Option<&Comparison>,
    estimate: Metrics,
) -> Metrics {
    let inputs = origin.manifest.run.as_ref();
    let world_from_map = comparison.and_then(|comparison| comparison.world_from_map);
    Metrics {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        scene: inputs.map(|inputs| inputs.scene.spec.name.clone()),
        seed: inputs.map(|inputs| inputs.seed.0),
        duration_s: origin.simulation.map_or(estimate.duration_s, |summary| summary.duration_s),
        simulation: origin.simulation.map(comparison::simulation_metrics).unwrap_or_default(),
        cloud: registered
            .map(|registered| cloud_metrics(registered, world_from_map.as_ref(), origin.surroundings))
            .unwrap_or_default(),
        peak_rss_mib: resources::peak_rss_mib(),
        ..estimate
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
