//! From a recording to a judged estimate.

use super::bound::information_bound;
use super::calibration::calibration;
use super::closed_loop::{ClosedLoopRun, run_closed_loop};
use super::cloud::{Surroundings, cloud_metrics};
use super::cloud_files::CloudOptions;
use super::integrity::{Integrity, write_windows};
use super::map::{MapOptions, write_map_of};
use super::open_loop::{How, OpenLoopRun, run_open_loop};
use super::register::{Registered, Registration};
use super::result_files::{estimate_files, remove};
use super::{CalibrationSpec, Manifest, Stage, StudyError, Watch, artefacts, judge, memory};
use crate::estimation::{EstimatorSpec, TimeSpent};
use crate::geometry::Trajectory;
use crate::measurement::LidarCorrection;
use crate::recording::{FoundCalibration, Preference, Reader, Selection, write_tum};
use crate::report::{ClosedLoopMetrics, Metrics, OpenLoopMetrics};
use crate::simulation::{SimulationSummary, carrier_of};
use crate::spec::Source;
use crate::world::World;
use std::path::Path;

/// The frame whose truth a recording of ours tells.
const TRUE_FRAME: &str = "head";

/// What is asked of an estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct EstimateOptions {
    /// The estimator's settings.
    pub estimator: EstimatorSpec,
    /// What is comparison of the sensors beside what the recording says.
    pub calibration: CalibrationSpec,
    /// The frame whose pose is told; `None` for `head` where the recording has it, else the IMU's.
    pub body_frame: Option<String>,
    /// Topics to read; those not named are found.
    pub topics: Preference,
    /// Whether to register the whole behind the open loop.
    pub closed_loop: bool,
    /// What is asked of the cloud.
    pub cloud: CloudOptions,
    /// The map in which the recording is to be localised, where there is one.
    pub map: Option<MapOptions>,
}

impl EstimateOptions {
    /// An estimate with these settings, loops closed, and no further wish.
    pub fn with(estimator: EstimatorSpec) -> Self {
        let (calibration, topics) = (CalibrationSpec::default(), Preference::default());
        let cloud = CloudOptions::default();
        Self { estimator, calibration, body_frame: None, topics, closed_loop: true, cloud, map: None }
    }
}

/// What came of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The figures, as in `metrics.json`.
    pub metrics: Metrics,
    /// Of the open loop's time, what the parts of the estimator took.
    pub spent: TimeSpent,
}

/// Estimates from the recording at `path`, whoever made it, and writes to `folder`: `manifest.ron`, `open_loop.tum`,
/// `closed_loop.tum`, `map.ply`, `result.mcap`, `cloud.ply` or `cloud.las`, `metrics.json`, `plots/`, `report.html`;
/// map, cloud and result are the closed loop's unless that is not wanted, or a map holds the trajectory already. Where
/// the recording has the truth the estimate is judged by it, and where it has the scene the cloud is.
///
/// Files of these names from an earlier run are removed first. `metrics.json` is written last: a folder without it is
/// incomplete.
///
/// # Errors
/// When the recording cannot be read, there is no estimate, a file cannot be written, or somebody stops it.
pub fn estimate_recording(
    path: &Path,
    folder: &Path,
    wishes: &EstimateOptions,
    watch: &mut Watch,
) -> Result<Outcome, StudyError> {
    let reader = Reader::open(path)?;
    remove(folder, &estimate_files())?;
    let manifest = Manifest::within(&reader).unwrap_or_else(Manifest::of_recording_by_others);
    let world = world_of(&manifest, watch);
    let carrier = manifest.specs.as_ref().map(|specs| carrier_of(&specs.head)).unwrap_or_default();
    let surroundings = world.as_ref().map(|world| Surroundings { world, carrier: &carrier });
    let origin = Origin { manifest: &manifest.with_estimator(&wishes.estimator), surroundings, simulation: None };
    estimate_in(&reader, folder, wishes, &origin, watch)
}

/// What is comparison of how a recording was made, for the figures alone.
pub(super) struct Origin<'a> {
    /// Its manifest, with the estimator's settings.
    pub manifest: &'a Manifest,
    /// What the beams met.
    pub surroundings: Option<Surroundings<'a>>,
    /// The simulation, where it has just been.
    pub simulation: Option<&'a SimulationSummary>,
}

/// The same with the recording open, and what is comparison of its origin.
pub(super) fn estimate_in(
    reader: &Reader,
    folder: &Path,
    wishes: &EstimateOptions,
    origin: &Origin,
    watch: &mut Watch,
) -> Result<Outcome, StudyError> {
    origin.manifest.write(&folder.join("manifest.ron"))?;
    let selection = reader.select(&wishes.topics)?;
    let found = calibration(reader, &selection, &wishes.calibration, wishes.body_frame.as_deref())?;
    notes_on(&selection, &found, (wishes, origin), watch);

    let expected_s = origin.simulation.map(|summary| summary.duration_s);
    let loops = Loops::run((reader, &selection, &found), folder, wishes, expected_s, watch)?;
    let (run, comparison, best) = (&loops.open, loops.comparison.as_ref(), loops.best());
    let registration = Registration {
        reader,
        selection: &selection,
        calibration: &found.calibration,
        body_frame: &found.body_frame,
        map_from_head: best.map_from_head,
        covariances: &run.covariances,
        lidar: best.lidar,
        returns: run.returns,
        with_truth: comparison.is_some(),
        wishes: wishes.cloud,
    };
    let registered = registration.run(folder, watch)?;

    watch.progress(Stage::Reporting, 0.0, None);
    let drifting = match comparison {
        Some(_) => judge::imu_only(reader, registered.dead_reckoning.as_ref(), watch)?,
        None => None,
    };
    let bound = match (comparison, origin.surroundings) {
        (Some(_), Some(Surroundings { world, .. })) => Some(information_bound(reader, world, watch)?.bound),
        _ => None,
    };
    let bound_rmse_m = bound.as_ref().map(|bound| bound.aligned_position_rmse_m);
    let fixed_views = Some(wishes.estimator.fixed_views as u64);
    let integrity = Integrity::of(run, loops.closed.as_ref(), best.map_from_head);
    let judged = integrity.metrics(run, comparison.map(|_| judge::pairs_of(reader, best.map_from_head)).transpose()?);
    let metrics = Metrics {
        status: Some(integrity.status().name().to_owned()),
        integrity: judged,
        losses: run.events.losses.clone(),
        notes: run.events.notes.clone(),
        open_loop: OpenLoopMetrics { fixed_views, ..judge::open_loop_metrics(run, comparison, drifting) },
        closed_loop: ClosedLoopMetrics { bound_rmse_m, ..loops.closed_metrics() },
        clock: judge::clock_metrics(run, comparison),
        lidar: judge::lidar_metrics(best.lidar.range_m, &run.calibrated_lidar, &wishes.estimator),
        ..metrics(origin, run, &registered, best.comparison)
    };
    integrity.write(folder)?;
    write_windows(folder, &run.windows)?;
    let open_known = comparison.filter(|_| loops.closed.is_some());
    let open_errors = open_known.and_then(|comparison| Some(&comparison.errors.as_ref()?.decimated));
    let plots = artefacts::plots(run, &best, (open_errors, bound.as_ref()), &registered.sample);
    artefacts::write(folder, &metrics, plots, origin.manifest)?;
    Ok(Outcome { metrics, spent: loops.open.spent })
}

/// Both loops, and what the truth says of each.
struct Loops {
    open: OpenLoopRun,
    comparison: Option<judge::Comparison>,
    closed: Option<ClosedLoopRun>,
    closed_comparison: Option<judge::Comparison>,
}

/// The estimate that goes into cloud, result and plots: the closed loop's where loops were closed.
pub(super) struct BestEstimate<'a> {
    pub map_from_head: &'a Trajectory,
    /// From where what was seen was seen, by the open loop.
    pub seen_from: &'a Trajectory,
    /// What was learnt of the lidar beyond its calibration.
    pub lidar: &'a LidarCorrection,
    /// What the truth says of it.
    pub comparison: Option<&'a judge::Comparison>,
}

impl Loops {
    /// Runs them, and writes their trajectories to `folder`.
    fn run(
        (reader, selection, found): (&Reader, &Selection, &FoundCalibration),
        folder: &Path,
        wishes: &EstimateOptions,
        expected_s: Option<f64>,
        watch: &mut Watch,
    ) -> Result<Self, StudyError> {
        let (estimator, calibration) = (&wishes.estimator, &found.calibration);
        let within = wishes.map.as_ref();
        let closes = wishes.closed_loop && within.is_none();
        if wishes.closed_loop && !closes {
            watch.note("the map holds the trajectory; the global registration, which knows nothing of it, is left out");
        }
        let makes_map = within.map_or(wishes.closed_loop, |within| within.extend);
        let how = How { estimator, calibration, surveying: closes || makes_map, map: within };
        let open = run_open_loop(reader, selection, how, Some(&folder.join("open_loop.tum")), expected_s, watch)?;
        open.events.notes.iter().for_each(|note| watch.note(&note.line()));
        let closed = match closes {
            true => Some(close_loops(&open, folder, how, watch)?),
            false => None,
        };
        let mut compare = |map_from_head, covariances| match found.body_frame == TRUE_FRAME {
            true => judge::compare_with_truth(reader, (map_from_head, covariances), watch),
            false => Ok(None),
        };
        let comparison = compare(&open.map_from_head, &open.covariances[..])?;
        let closed_comparison =
            closed.as_ref().map(|closed| compare(&closed.map_from_head, &[])).transpose()?.flatten();
        let loops = Self { open, comparison, closed, closed_comparison };
        if makes_map && !loops.open.survey.is_empty() {
            write_map_of(&loops.open, &loops.best(), (estimator, within), folder)?;
        }
        Ok(loops)
    }

    fn best(&self) -> BestEstimate<'_> {
        let open = &self.open.map_from_head;
        match &self.closed {
            Some(ClosedLoopRun { map_from_head, lidar, open_loop_recalibrated, .. }) => BestEstimate {
                map_from_head,
                seen_from: open_loop_recalibrated.as_ref().unwrap_or(open),
                lidar,
                comparison: self.closed_comparison.as_ref(),
            },
            None => BestEstimate {
                map_from_head: open,
                seen_from: open,
                lidar: &self.open.lidar,
                comparison: self.comparison.as_ref(),
            },
        }
    }

    fn closed_metrics(&self) -> ClosedLoopMetrics {
        let (comparison, acquisition_s) = (self.closed_comparison.as_ref(), self.open.acquisition_s);
        let told = self.closed.as_ref().map(|closed| judge::closed_loop_metrics(closed, comparison, acquisition_s));
        told.unwrap_or_default()
    }
}

/// Closes loops, and writes the trajectory.
fn close_loops(run: &OpenLoopRun, folder: &Path, how: How, watch: &mut Watch) -> Result<ClosedLoopRun, StudyError> {
    watch.progress(Stage::ClosingLoops, 0.0, None);
    let closed = run_closed_loop(run, how.calibration, how.estimator);
    closed.notes.iter().for_each(|note| watch.note(note));
    write_tum(&folder.join("closed_loop.tum"), &closed.map_from_head)?;
    if watch.is_stopped() { Err(StudyError::Stopped) } else { Ok(closed) }
}

/// All figures but those of the two loops and the clock.
fn metrics(
    origin: &Origin,
    run: &OpenLoopRun,
    registered: &Registered,
    comparison: Option<&judge::Comparison>,
) -> Metrics {
    let Manifest { scenario, specs, .. } = origin.manifest;
    let world_from_map = comparison.and_then(|comparison| comparison.world_from_map);
    Metrics {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        scene: specs.as_ref().map(|specs| specs.scene.name.clone()),
        seed: scenario.as_ref().map(|scenario| scenario.seed.0),
        duration_s: origin.simulation.map_or(run.acquisition_s, |summary| summary.duration_s),
        simulation: origin.simulation.map(judge::simulation_metrics).unwrap_or_default(),
        cloud: cloud_metrics(registered, world_from_map.as_ref(), origin.surroundings),
        peak_rss_mib: memory::peak_rss_mib(),
        ..Metrics::default()
    }
}

/// The world in a recording's manifest; `None` where there is none, or its meshes are not at hand.
fn world_of(manifest: &Manifest, watch: &mut Watch) -> Option<World> {
    let scene = &manifest.specs.as_ref()?.scene;
    let built = World::build(scene, &Source::in_memory("the recording's scene", ""));
    built.inspect_err(|error| watch.note(&format!("the cloud is not judged: {error}"))).ok()
}

fn notes_on(
    selection: &Selection,
    found: &FoundCalibration,
    (wishes, origin): (&EstimateOptions, &Origin),
    watch: &mut Watch,
) {
    selection.notes.iter().for_each(|note| watch.note(note));
    let given = wishes.calibration.head_from_laser.is_some() && wishes.calibration.head_from_imu.is_some();
    if !found.from_recording && !given {
        watch.note(
            "the recording has no /tf_static: lidar and IMU are taken to sit in one place with the same axes; if they do \
             not, say so with --calibration",
        );
    }
    if origin.manifest.specs.is_none() && wishes.calibration.imu.is_none() {
        watch.note(
            "nothing tells how noisy the IMU is; an ordinary one is assumed (specs/imus/unknown.ron): where its data sheet is at \
             hand, say so with --calibration",
        );
    }
}
